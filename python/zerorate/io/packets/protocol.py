"""Protocol of packets: bytes in, rows of numbers out, and reports of damage."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from typing import Final, Protocol, TypeAlias

AXES: Final = "xyz"

Row: TypeAlias = Sequence[object]
"""The cells of a sample: numbers, or an empty text where there is none."""

NO_TRIAD: Final[Row] = ("", "", "")
"""The cells of a sensor that has not spoken since the last row."""


_MAX_UNKNOWN_BYTES: Final = 1 << 12
"""Bytes after which a packet should have come."""


@dataclass(frozen=True)
class Damage:
    """Bytes that are no packet where one should be, or a packet that holds no sample of use.

    Examples
    --------
    >>> from zerorate.tasks.live import Damage
    >>> Damage("its checksum is wrong").reason
    'its checksum is wrong'
    """

    reason: str


class Decoder(Protocol):
    """Takes bytes as they come, in pieces of any size: however they are cut, the rows are equal."""

    def feed(self, raw: bytes) -> Iterator[Row | Damage]:
        """Yield the samples that are complete with these bytes, and damage."""

    def finish(self) -> Iterator[Row | Damage]:
        """Yield the packets and remarks that the end of the bytes completes or cuts."""


@dataclass(frozen=True)
class PacketProtocol:
    """A protocol of packets, as a maker's devices send them.

    Attributes
    ----------
    name : str
        Its name for ``--form``.
    meaning : str
        Devices that send it.
    columns : tuple of str
        Names of the cells of a row, which show the sensors and their units.
    decoder : callable
        Returns a new decoder.
    counter : str, optional
        The column that numbers the packets.
    counter_bits : int, optional
        Its width.
    notify : str, optional
        The characteristic by which Bluetooth devices send it.
    lines : bool
        True if a line's end ends a message.

    Examples
    --------
    >>> from zerorate.tasks.live import PACKETS
    >>> sorted(PACKETS)
    ['phone', 'witmotion', 'xio', 'xsens']
    >>> PACKETS["xsens"].columns[:3], PACKETS["xsens"].counter_bits
    (('packet_counter', 'time_us', 'gyro_x_radps'), 16)
    """

    name: str
    meaning: str
    columns: tuple[str, ...]
    decoder: Callable[[], Decoder]
    counter: str | None = None
    counter_bits: int | None = None
    notify: str | None = None
    lines: bool = False


def name_axes(*sensors: str) -> tuple[str, ...]:
    """Return the names of three axes for each sensor, such as ``gyro_{}_dps``."""
    return tuple(sensor.format(axis) for sensor in sensors for axis in AXES)


@dataclass
class Buffer:
    """Bytes that wait for the rest of their packet, and a count of those that belong to none.

    Bytes before the first packet are not reported: a device is often joined in the middle of one.
    """

    max_bytes: int
    protocol: str
    reason: str
    raw: bytearray = field(default_factory=bytearray)
    _has_packet: bool = False
    _skipped: int = 0
    _lost: int = 0
    _unknown: int = 0
    _searched: int = 0
    _overlong: bool = False

    def take(self, count: int) -> bytes:
        """Return a packet and forget its bytes."""
        packet = bytes(self.raw[:count])
        del self.raw[:count]
        if self._has_packet:
            self._lost += self._skipped
        self._has_packet, self._skipped = True, 0
        return packet

    def skip(self, count: int) -> None:
        """Forget bytes that belong to no packet."""
        del self.raw[:count]
        self._skipped += count
        while not self._has_packet and self._skipped >= _MAX_UNKNOWN_BYTES:
            self._skipped -= _MAX_UNKNOWN_BYTES
            self._unknown += 1

    def report(self) -> Iterator[Damage]:
        """Yield a remark on bytes that belong to no packet."""
        unknown, self._unknown = self._unknown, 0
        for _ in range(unknown):
            yield Damage(
                f"{_MAX_UNKNOWN_BYTES} bytes hold no packet of {self.protocol}; is the form "
                "another, or the speed of the line?"
            )
        count, self._lost = self._lost, 0
        if count:
            are = "a byte is" if count == 1 else f"{count} bytes are"
            yield Damage(f"{are} no packet: {self.reason}")

    def finish(self) -> Iterator[Damage]:
        """Yield that the end cuts a packet, where one has come before."""
        yield from self.report()
        count = self._skipped + len(self.raw)
        if count and self._has_packet:
            are = "the last byte is" if count == 1 else f"the last {count} bytes are"
            yield Damage(f"{are} no whole packet")

    def take_line(self) -> bytes | None:
        """Return the next bytes that a line's end ends, None where it has not come.

        What is longer than a message may be is forgotten.
        """
        while (end := self.raw.find(b"\n", self._searched)) >= 0:
            self._searched = 0
            if not self._overlong and end <= self.max_bytes:
                return bytes(self.raw[:end])
            self._overlong = False
            self.skip(end + 1)
        if self._overlong or len(self.raw) > self.max_bytes:
            self._overlong = True
            self.skip(len(self.raw))
        self._searched = len(self.raw)
        return None


def read_lines(buffer: Buffer, parse: Callable[[bytes], Sequence[Row]]) -> Iterator[Row | Damage]:
    """Yield the rows of messages that a line's end ends; `parse` raises ValueError for others."""
    while (line := buffer.take_line()) is not None:
        try:
            rows = parse(line)
        except (ValueError, ArithmeticError, RecursionError):
            buffer.skip(len(line) + 1)
            continue
        buffer.take(len(line) + 1)
        yield from buffer.report()
        yield from rows
    yield from buffer.report()
