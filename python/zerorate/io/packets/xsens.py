"""MTData2 messages of Xsens MTi devices, as their low-level documentation describes them.

A message is ``FA FF 36 length data checksum``; the data are items of a type of two bytes, a length
and numbers, high bytes first. All bytes after the first sum to 0 with the checksum, modulo 256.
"""

from __future__ import annotations

import struct
from collections.abc import Iterator, Mapping
from typing import Final

from zerorate.io.packets.form import NO_TRIAD, Buffer, Damaged, PacketForm, Row, named

_START: Final = b"\xfa\xff"
_DATA: Final = 0x36
_EXTENDED: Final = 0xFF
"""A length that is told by the next two bytes."""
_LONGEST: Final = 2048 + 7

_COUNTER: Final = 0x1020
_FINE: Final = 0x1060
_TRIADS: Final = {0x8020: "gyro", 0x4020: "accel", 0xC020: "mag"}
_HIGH_RATE: Final = {0x8040: "gyro", 0x4040: "accel"}
"""The same of the sensors alone, before what corrects them at the rate of the filter."""
_TICK_US: Final = 100
"""Microseconds of a tick of the fine time."""
_SYSTEM: Final = 0xFFF0
"""Without the bits for the number's format and the axes of the earth."""

_NUMBER: Final = {0: (">f", 1.0), 1: (">i", 2.0**-20), 3: (">d", 1.0)}
"""By the two low bits: single, fixed point of 12.20 bits, double."""
_FIXED: Final = 2
"""Fixed point of 16.32 bits: the fraction comes first."""


class _Decoder:
    def __init__(self) -> None:
        self._buffer = Buffer(_LONGEST)

    def feed(self, raw: bytes) -> Iterator[Row | Damaged]:
        buffer = self._buffer
        buffer.raw += raw
        while (message := self._message()) is not None:
            yield from buffer.damage("no message with a right checksum")
            if message[0] == _DATA:
                yield from _rows(message[1])
        yield from buffer.hopeless("xsens")

    def _message(self) -> tuple[int, bytes] | None:
        """Return the next whole message, its kind and data; None if it has not come."""
        raw = self._buffer.raw
        while True:
            start = raw.find(_START)
            self._buffer.skip(start if start >= 0 else max(0, len(raw) - 1))
            if start < 0 or len(raw) < 4:
                return None
            head, length = 4, raw[3]
            if length == _EXTENDED:
                if len(raw) < 6:
                    return None
                head, length = 6, int.from_bytes(raw[4:6], "big")
            end = head + length + 1
            if length <= _LONGEST and len(raw) < end:
                return None
            if length <= _LONGEST and sum(raw[1:end]) % 256 == 0:
                packet = self._buffer.take(end)
                return packet[2], packet[head:-1]
            self._buffer.skip(1)


def _rows(data: bytes) -> Iterator[Row | Damaged]:
    counter: object = ""
    stamp: object = ""
    triads: dict[str, Row] = {}
    try:
        for kind, item in _items(data):
            system = kind & _SYSTEM
            if system == _COUNTER:
                counter = int.from_bytes(item, "big")
            elif system == _FINE:
                stamp = int.from_bytes(item, "big") * _TICK_US
            elif system in _TRIADS:
                triads[_TRIADS[system]] = _numbers(kind, item)
            elif system in _HIGH_RATE:
                triads.setdefault(_HIGH_RATE[system], _numbers(kind, item))
    except (ValueError, struct.error):
        yield Damaged("a message's items are not as long as they say")
        return
    if triads:
        yield (counter, stamp, *_cells(triads))


def _cells(triads: Mapping[str, Row]) -> Iterator[object]:
    for sensor in ("gyro", "accel", "mag"):
        yield from triads.get(sensor, NO_TRIAD)


def _items(data: bytes) -> Iterator[tuple[int, bytes]]:
    place = 0
    while place < len(data):
        if place + 3 > len(data) or place + 3 + data[place + 2] > len(data):
            raise ValueError("an item is cut short")
        begin = place + 3
        place = begin + data[place + 2]
        yield int.from_bytes(data[begin - 3 : begin - 1], "big"), data[begin:place]


def _numbers(kind: int, item: bytes) -> list[float]:
    form = kind & 3
    if form == _FIXED:
        parts = struct.unpack(">" + "Ih" * 3, item)
        return [high + low * 2.0**-32 for low, high in zip(parts[::2], parts[1::2], strict=True)]
    code, scale = _NUMBER[form]
    return [number * scale for number in struct.unpack(f">3{code[1]}", item)]


FORM: Final = PacketForm(
    "xsens",
    "Xsens MTi: MTData2 with rate of turn, acceleration, magnetic field",
    ("packet_counter", "time_us", *named("gyro_{}_radps", "accel_{}_mps2", "mag_{}")),
    _Decoder,
    counter="packet_counter",
    counter_bits=16,
)
