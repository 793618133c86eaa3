"""MTData2 messages of Xsens MTi devices, from their low-level documentation.

A message is ``FA FF 36 length data checksum``. The data are items with a type of two bytes, a
length, and numbers, high bytes first. All bytes after the first, with the checksum, sum to 0 modulo
256.
"""

from __future__ import annotations

import struct
from collections.abc import Iterator, Mapping
from typing import Final

from zerorate.io.packets.protocol import NO_TRIAD, Buffer, Damage, PacketProtocol, Row, name_axes

_START: Final = b"\xfa\xff"
_MTDATA2: Final = 0x36
_EXTENDED_LENGTH: Final = 0xFF
"""Length that is stated in the next two bytes."""
_MAX_DATA_BYTES: Final = 2048 + 7

_PACKET_COUNTER: Final = 0x1020
_SAMPLE_TIME_FINE: Final = 0x1060
_TRIADS: Final = {0x8020: "gyro", 0x4020: "accel", 0xC020: "mag"}
_HIGH_RATE_TRIADS: Final = {0x8040: "gyro", 0x4040: "accel"}
"""Sensors alone, before the corrections at the rate of the filter."""
_TICK_US: Final = 100
"""Tick of the fine time, microseconds."""
_ID_MASK: Final = 0xFFF0
"""Mask without the bits of the number's format and the earth axes."""

_NUMBER_FORMATS: Final = {0: (">f", 1.0), 1: (">i", 2.0**-20), 3: (">d", 1.0)}
"""Formats by the two low bits: single, fixed point 12.20, double."""
_FIXED_16_32: Final = 2
"""Fixed point 16.32: the fraction comes first."""


class _Decoder:
    def __init__(self) -> None:
        self._buffer = Buffer(_MAX_DATA_BYTES, "xsens", "no message with a right checksum")

    def feed(self, raw: bytes) -> Iterator[Row | Damage]:
        buffer = self._buffer
        buffer.raw += raw
        while (message := self._next_message()) is not None:
            yield from buffer.report()
            if message[0] == _MTDATA2:
                yield from _decode(message[1])
        yield from buffer.report()

    def finish(self) -> Iterator[Row | Damage]:
        yield from self._buffer.finish()

    def _next_message(self) -> tuple[int, bytes] | None:
        """Return the kind and data of the next complete message; None if it has not come."""
        raw = self._buffer.raw
        while True:
            start = raw.find(_START)
            self._buffer.skip(start if start >= 0 else max(0, len(raw) - 1))
            if start < 0 or len(raw) < 4:
                return None
            head, length = 4, raw[3]
            if length == _EXTENDED_LENGTH:
                if len(raw) < 6:
                    return None
                head, length = 6, int.from_bytes(raw[4:6], "big")
            end = head + length + 1
            if length <= _MAX_DATA_BYTES and len(raw) < end:
                return None
            if length <= _MAX_DATA_BYTES and sum(raw[1:end]) % 256 == 0:
                packet = self._buffer.take(end)
                return packet[2], packet[head:-1]
            self._buffer.skip(1)


def _decode(data: bytes) -> Iterator[Row | Damage]:
    counter: object = ""
    stamp: object = ""
    triads: dict[str, Row] = {}
    try:
        for kind, item in _split_items(data):
            data_id = kind & _ID_MASK
            if data_id == _PACKET_COUNTER:
                counter = int.from_bytes(item, "big")
            elif data_id == _SAMPLE_TIME_FINE:
                stamp = int.from_bytes(item, "big") * _TICK_US
            elif data_id in _TRIADS:
                triads[_TRIADS[data_id]] = _parse_numbers(kind, item)
            elif data_id in _HIGH_RATE_TRIADS:
                triads.setdefault(_HIGH_RATE_TRIADS[data_id], _parse_numbers(kind, item))
    except (ValueError, struct.error):
        yield Damage("a message's items are not as long as they say")
        return
    if triads:
        yield (counter, stamp, *_cells(triads))


def _cells(triads: Mapping[str, Row]) -> Iterator[object]:
    for sensor in ("gyro", "accel", "mag"):
        yield from triads.get(sensor, NO_TRIAD)


def _split_items(data: bytes) -> Iterator[tuple[int, bytes]]:
    position = 0
    while position < len(data):
        if position + 3 > len(data) or position + 3 + data[position + 2] > len(data):
            raise ValueError("an item is cut short")
        begin = position + 3
        position = begin + data[position + 2]
        yield int.from_bytes(data[begin - 3 : begin - 1], "big"), data[begin:position]


def _parse_numbers(kind: int, item: bytes) -> list[float]:
    number_format = kind & 3
    if number_format == _FIXED_16_32:
        parts = struct.unpack(">" + "Ih" * 3, item)
        return [high + low * 2.0**-32 for low, high in zip(parts[::2], parts[1::2], strict=True)]
    code, scale = _NUMBER_FORMATS[number_format]
    return [number * scale for number in struct.unpack(f">3{code[1]}", item)]


PROTOCOL: Final = PacketProtocol(
    "xsens",
    "Xsens MTi: MTData2 with rate of turn, acceleration, magnetic field",
    ("packet_counter", "time_us", *name_axes("gyro_{}_radps", "accel_{}_mps2", "mag_{}")),
    _Decoder,
    counter="packet_counter",
    counter_bits=16,
)
