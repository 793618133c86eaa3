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
    """Takes bytes as they come, in pieces of any size."""

    def feed(self, raw: bytes) -> Iterator[Row | Damage]:
        """Yield the samples that are complete with these bytes, and damage."""


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
    raw: bytearray = field(default_factory=bytearray)
    _has_packet: bool = False
    _skipped: int = 0
    _lost: int = 0

    def take(self, count: int) -> bytes:
        """Return a packet and forget its bytes."""
        packet = bytes(self.raw[:count])
        del self.raw[:count]
        if self._has_packet or self._skipped >= self.max_bytes:
            self._lost += self._skipped
        self._has_packet, self._skipped = True, 0
        return packet

    def skip(self, count: int) -> None:
        """Forget bytes that belong to no packet."""
        del self.raw[:count]
        self._skipped += count

    def report_damage(self, reason: str) -> Iterator[Damage]:
        """Yield the damage in the bytes between the last two packets."""
        count, self._lost = self._lost, 0
        if count:
            are = "a byte is" if count == 1 else f"{count} bytes are"
            yield Damage(f"{are} no packet: {reason}")

    def report_unknown(self, protocol: str) -> Iterator[Damage]:
        """Yield that the bytes look like another form, where none of many was a packet."""
        if not self._has_packet and self._skipped >= _MAX_UNKNOWN_BYTES:
            count, self._skipped = self._skipped, 0
            yield Damage(
                f"the first {count} bytes hold no packet of {protocol}; is the form "
                "another, or the "
                "speed of the line?"
            )


def read_lines(
    buffer: Buffer, parse: Callable[[bytes], Sequence[Row]], reason: str, protocol: str
) -> Iterator[Row | Damage]:
    """Yield the rows of messages that a line's end ends; `parse` raises ValueError for others."""
    while (end := buffer.raw.find(b"\n")) >= 0:
        try:
            rows = parse(bytes(buffer.raw[:end]))
        except ValueError:
            buffer.skip(end + 1)
            continue
        buffer.take(end + 1)
        yield from buffer.report_damage(reason)
        yield from rows
    if len(buffer.raw) > buffer.max_bytes:
        buffer.skip(len(buffer.raw))
    yield from buffer.report_unknown(protocol)
