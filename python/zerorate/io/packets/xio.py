"""Data messages of x-io Technologies' x-IMU3, as text or bytes, by serial line or UDP.

Text: lines ``I,time,gyro,accelerometer`` and ``M,time,field``, in microseconds, deg/s, g and
arbitrary units. Bytes: the letter plus 80 hex, time as 64 bits, single floats, low bytes first,
then 0A. Within a message, 0A is escaped as DB DC, and DB as DB DD. Source: the user manual.
"""

from __future__ import annotations

import math
import struct
from collections.abc import Iterator
from typing import Final

from zerorate.io.packets.protocol import (
    NO_TRIAD,
    Buffer,
    Damage,
    PacketProtocol,
    Row,
    name_axes,
    read_lines,
)

_BINARY_BIT: Final = 0x80
_INERTIAL, _MAG = ord("I"), ord("M")
_NUMBER_COUNTS: Final = {_INERTIAL: 6, _MAG: 3}
_IGNORED_KINDS: Final = b"ABEFHLNQRSTVW{"
"""Messages that are ignored: orientations, temperatures, notes, answers to commands."""
_MAX_MESSAGE_BYTES: Final = 4096


class _Decoder:
    def __init__(self) -> None:
        self._buffer = Buffer(_MAX_MESSAGE_BYTES, "xio", "no message as long as its letter says")
        self._mag: Row = NO_TRIAD

    def feed(self, raw: bytes) -> Iterator[Row | Damage]:
        self._buffer.raw += raw
        yield from read_lines(self._buffer, self._decode)

    def finish(self) -> Iterator[Row | Damage]:
        yield from self._buffer.finish()

    def _decode(self, message: bytes) -> list[Row]:
        if not message.strip():
            return []
        kind = message[0] & ~_BINARY_BIT
        if kind not in _NUMBER_COUNTS:
            if kind in _IGNORED_KINDS:
                return []
            raise ValueError("no letter of a message")
        stamp, numbers = (_parse_binary if message[0] & _BINARY_BIT else _parse_text)(kind, message)
        if kind == _MAG:
            self._mag = numbers
            return []
        mag, self._mag = self._mag, NO_TRIAD
        return [(stamp, *numbers, *mag)]


def _parse_binary(kind: int, message: bytes) -> tuple[int, list[float]]:
    unescaped = message.replace(b"\xdb\xdc", b"\n").replace(b"\xdb\xdd", b"\xdb")
    layout = f"<xQ{_NUMBER_COUNTS[kind]}f"
    if len(unescaped) != struct.calcsize(layout):
        raise ValueError("too long or too short")
    stamp, *numbers = struct.unpack(layout, unescaped)
    return stamp, _check_finite(numbers)


def _parse_text(kind: int, message: bytes) -> tuple[int, list[float]]:
    cells = message.split(b",")
    if len(cells) != 2 + _NUMBER_COUNTS[kind]:
        raise ValueError("too long or too short")
    return int(cells[1]), _check_finite([float(cell) for cell in cells[2:]])


def _check_finite(numbers: list[float]) -> list[float]:
    if not all(map(math.isfinite, numbers)):
        raise ValueError("no numbers")
    return numbers


PROTOCOL: Final = PacketProtocol(
    "xio",
    "x-io x-IMU3: inertial and magnetometer messages, as text or bytes",
    ("time_us", *name_axes("gyro_{}_dps", "accel_{}_g", "mag_{}")),
    _Decoder,
    lines=True,
)
