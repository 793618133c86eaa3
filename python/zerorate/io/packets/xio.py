"""Data messages of x-io Technologies' x-IMU3, as text and as bytes, on a serial line or by UDP.

Text: ``I,time,gyro,accelerometer`` and ``M,time,field``, a line each; time in microseconds, deg/s,
g, arbitrary units. Bytes: the letter plus 80 hex, time as 64 bits, single floats, low bytes first,
then 0A; within a message 0A stands as DB DC, and DB as DB DD. From the user manual.
"""

from __future__ import annotations

import math
import struct
from collections.abc import Iterator
from typing import Final

from zerorate.io.packets.form import NO_TRIAD, Buffer, Damaged, PacketForm, Row, by_lines, named

_BINARY: Final = 0x80
_INERTIAL, _MAG = ord("I"), ord("M")
_NUMBERS: Final = {_INERTIAL: 6, _MAG: 3}
_OTHERS: Final = b"ABEFHLNQRSTVW{"
"""What is not read: orientations, temperatures, notes, answers to commands."""
_LONGEST: Final = 4096


class _Decoder:
    def __init__(self) -> None:
        self._buffer = Buffer(_LONGEST)
        self._mag: Row = NO_TRIAD

    def feed(self, raw: bytes) -> Iterator[Row | Damaged]:
        self._buffer.raw += raw
        yield from by_lines(
            self._buffer, self._rows, "no message as long as its letter says", "xio"
        )

    def _rows(self, message: bytes) -> list[Row]:
        if not message.strip():
            return []
        kind = message[0] & ~_BINARY
        if kind not in _NUMBERS:
            if kind in _OTHERS:
                return []
            raise ValueError("no letter of a message")
        stamp, numbers = (_of_bytes if message[0] & _BINARY else _of_text)(kind, message)
        if kind == _MAG:
            self._mag = numbers
            return []
        mag, self._mag = self._mag, NO_TRIAD
        return [(stamp, *numbers, *mag)]


def _of_bytes(kind: int, message: bytes) -> tuple[int, list[float]]:
    plain = message.replace(b"\xdb\xdc", b"\n").replace(b"\xdb\xdd", b"\xdb")
    form = f"<xQ{_NUMBERS[kind]}f"
    if len(plain) != struct.calcsize(form):
        raise ValueError("too long or too short")
    stamp, *numbers = struct.unpack(form, plain)
    return stamp, _finite(numbers)


def _of_text(kind: int, message: bytes) -> tuple[int, list[float]]:
    cells = message.split(b",")
    if len(cells) != 2 + _NUMBERS[kind]:
        raise ValueError("too long or too short")
    return int(cells[1]), _finite([float(cell) for cell in cells[2:]])


def _finite(numbers: list[float]) -> list[float]:
    if not all(map(math.isfinite, numbers)):
        raise ValueError("no numbers")
    return numbers


FORM: Final = PacketForm(
    "xio",
    "x-io x-IMU3: inertial and magnetometer messages, as text or bytes",
    ("time_us", *named("gyro_{}_dps", "accel_{}_g", "mag_{}")),
    _Decoder,
    lines=True,
)
