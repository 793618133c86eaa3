"""Packets of WitMotion devices: eleven bytes per sensor, or twenty by Bluetooth.

A packet is ``55 kind data checksum`` with four 16-bit numbers, low byte first. Kind 51 is the
acceleration (range 16 g), 52 the rate (range 2000 deg/s), 54 the magnetic field in counts. The
checksum is the sum of all bytes before it, modulo 256. A Bluetooth packet ``55 61`` has nine
numbers (acceleration, rate, angles) and no checksum. Source: the protocols of the manufacturer.
"""

from __future__ import annotations

import struct
from collections.abc import Iterator
from typing import Final

from zerorate.io.packets.protocol import NO_TRIAD, Buffer, Damage, PacketProtocol, Row, name_axes

_START: Final = 0x55
_TIME, _ACCEL, _GYRO, _MAG = 0x50, 0x51, 0x52, 0x54
_COMBINED: Final = 0x61
_KINDS: Final = range(0x50, 0x60)
_ALL_KINDS: Final = {*_KINDS, _COMBINED}
_PACKET_BYTES: Final = 11
_BLUETOOTH_BYTES: Final = 20
_G_PER_COUNT: Final = 16.0 / 32768.0
_DPS_PER_COUNT: Final = 2000.0 / 32768.0


class _Decoder:
    """Decoder; the rate completes a row. Acceleration precedes it, the field follows."""

    def __init__(self) -> None:
        self._buffer = Buffer(_BLUETOOTH_BYTES, "witmotion", "no packet with a right checksum")
        self._accel: Row = NO_TRIAD
        self._mag: Row = NO_TRIAD

    def feed(self, raw: bytes) -> Iterator[Row | Damage]:
        self._buffer.raw += raw
        while (packet := self._next_packet()) is not None:
            yield from self._buffer.report()
            yield from self._decode(packet)
        yield from self._buffer.report()

    def finish(self) -> Iterator[Row | Damage]:
        raw = self._buffer.raw
        begun = bytes(raw[_BLUETOOTH_BYTES:]) in (b"", bytes([_START]))
        if len(raw) >= _BLUETOOTH_BYTES and raw[:2] == bytes([_START, _COMBINED]) and begun:
            yield from self._decode(self._buffer.take(_BLUETOOTH_BYTES))
        yield from self._buffer.finish()

    def _next_packet(self) -> bytes | None:
        raw = self._buffer.raw
        while raw:
            if raw[0] != _START:
                start = raw.find(_START)
                self._buffer.skip(start if start >= 0 else len(raw))
                continue
            if len(raw) < _PACKET_BYTES:
                return None
            if raw[1] == _COMBINED:
                # Without a checksum, the beginning of the next packet confirms this one. Waiting
                # for it makes the samples independent of the pieces.
                if len(raw) < _BLUETOOTH_BYTES + 2:
                    return None
                if raw[_BLUETOOTH_BYTES] == _START and raw[_BLUETOOTH_BYTES + 1] in _ALL_KINDS:
                    return self._buffer.take(_BLUETOOTH_BYTES)
            elif raw[1] in _KINDS and sum(raw[: _PACKET_BYTES - 1]) % 256 == raw[_PACKET_BYTES - 1]:
                return self._buffer.take(_PACKET_BYTES)
            self._buffer.skip(1)
        return None

    def _decode(self, packet: bytes) -> Iterator[Row]:
        kind, numbers = packet[1], struct.unpack_from("<3h", packet, 2)
        if kind == _ACCEL:
            self._accel = [number * _G_PER_COUNT for number in numbers]
        elif kind == _MAG:
            self._mag = numbers
        elif kind == _COMBINED:
            self._accel = [number * _G_PER_COUNT for number in numbers]
            numbers = struct.unpack_from("<3h", packet, 8)
        if kind in (_GYRO, _COMBINED):
            yield (*(number * _DPS_PER_COUNT for number in numbers), *self._accel, *self._mag)
            self._accel = self._mag = NO_TRIAD


PROTOCOL: Final = PacketProtocol(
    "witmotion",
    "WitMotion: packets 51, 52, 54 of serial lines, 61 of Bluetooth",
    name_axes("gyro_{}_dps", "accel_{}_g", "mag_{}"),
    _Decoder,
    notify="0000ffe4-0000-1000-8000-00805f9a34fb",
)
