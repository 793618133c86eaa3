"""Interface of packet protocols: bytes in, rows of numbers and reports of damage out."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from typing import Final, Protocol, TypeAlias

AXES: Final = "xyz"

Row: TypeAlias = Sequence[object]
"""Cells of a sample: numbers, or empty texts for missing values."""

NO_TRIAD: Final[Row] = ("", "", "")
"""Cells of a sensor without new values since the last row."""


_MAX_UNKNOWN_BYTES: Final = 1 << 12
"""Number of bytes without a packet after which they are reported."""


@dataclass(frozen=True)
class Damage:
    """Report on bytes that are no packet, or on a packet without a usable sample.

    Examples
    --------
    >>> from zerorate.tasks.live import Damage
    >>> Damage("its checksum is wrong").reason
    'its checksum is wrong'
    """

    reason: str


class Decoder(Protocol):
    """Decoder of a byte stream in pieces of any size; the size does not change the rows."""

    def feed(self, raw: bytes) -> Iterator[Row | Damage]:
        """Yield a row for each sample completed by these bytes, and `Damage` for faults."""

    def finish(self) -> Iterator[Row | Damage]:
        """Yield the rows completed by the end of the stream, and `Damage` for the rest."""


@dataclass(frozen=True)
class PacketProtocol:
    """Protocol of a manufacturer's packets.

    Attributes
    ----------
    name : str
        Name for ``--form``.
    meaning : str
        Devices with this protocol.
    columns : tuple of str
        Names of the columns of a row; they state sensor and unit.
    decoder : callable
        Function that returns a new decoder.
    counter : str, optional
        Column with the packet counter.
    counter_bits : int, optional
        Width of the counter, bits.
    notify : str, optional
        Bluetooth characteristic that sends the packets.
    lines : bool
        True if each message is one line of text.

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
    """Return the names of three axes for each sensor pattern, such as ``gyro_{}_dps``."""
    return tuple(sensor.format(axis) for sensor in sensors for axis in AXES)


@dataclass
class Buffer:
    """Bytes of incomplete packets, and a count of bytes that belong to none.

    Bytes before the first packet are not reported, because reading often begins within a packet.
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
        """Return a packet and remove its bytes."""
        packet = bytes(self.raw[:count])
        del self.raw[:count]
        if self._has_packet:
            self._lost += self._skipped
        self._has_packet, self._skipped = True, 0
        return packet

    def skip(self, count: int) -> None:
        """Remove bytes that belong to no packet."""
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
        """Yield a remark if the end cuts a packet, and packets have come before."""
        yield from self.report()
        count = self._skipped + len(self.raw)
        if count and self._has_packet:
            are = "the last byte is" if count == 1 else f"the last {count} bytes are"
            yield Damage(f"{are} no whole packet")

    def take_line(self) -> bytes | None:
        """Return the bytes up to the next line end; None if it has not come.

        Bytes longer than the largest message are removed.
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
    """Yield the rows of one-line messages; `parse` raises ValueError for a bad message."""
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
