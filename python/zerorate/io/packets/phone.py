"""JSON of phones: events of SensorServer by WebSocket, and messages of Sensor Logger.

SensorServer sends one event per message: ``{"type": "android.sensor.gyroscope", "timestamp": …,
"values": [x, y, z]}``. Sensor Logger sends many: ``{"payload": [{"name": "gyroscope", "time": …,
"values": {"x": …}}]}``. Both use rad/s, m/s^2, microtesla and nanoseconds. A row is a sample of the
gyro with the values of the other sensors since the previous row.

Sensor Logger's ``accelerometer`` is without gravity. ``totalacceleration`` is used instead, or else
the sum of ``accelerometer`` and ``gravity``.
"""

from __future__ import annotations

import json
import math
from collections.abc import Iterable, Iterator, Mapping
from typing import Any, Final

from zerorate.io.packets.protocol import (
    AXES,
    NO_TRIAD,
    Buffer,
    Damage,
    PacketProtocol,
    Row,
    name_axes,
    read_lines,
)

_MAX_MESSAGE_BYTES: Final = 1 << 22
"""Largest message, bytes: Sensor Logger collects several seconds of all sensors."""
_MAX_STAMP: Final = 1 << 63
_REASON: Final = "no JSON of events with a time and three numbers"
_SENSORS: Final = {
    "gyroscope": "gyro",
    "android.sensor.gyroscope": "gyro",
    "totalacceleration": "accel",
    "android.sensor.accelerometer": "accel",
    "accelerometer": "linear",
    "android.sensor.linear_acceleration": "linear",
    "gravity": "gravity",
    "android.sensor.gravity": "gravity",
    "magnetometer": "mag",
    "android.sensor.magnetic_field": "mag",
}


class _Decoder:
    def __init__(self) -> None:
        self._buffer = Buffer(_MAX_MESSAGE_BYTES, "phone", _REASON)
        self._last: dict[str, list[float]] = {}

    def feed(self, raw: bytes) -> Iterator[Row | Damage]:
        self._buffer.raw += raw
        yield from read_lines(self._buffer, self._decode)

    def finish(self) -> Iterator[Row | Damage]:
        yield from self._buffer.finish()

    def _decode(self, message: bytes) -> list[Row]:
        if not message.strip():
            return []
        return list(self._decode_events(_check_events(json.loads(message))))

    def _decode_events(self, events: Iterable[Mapping[str, Any]]) -> Iterator[Row]:
        for event in events:
            sensor = _SENSORS.get(str(event.get("type", event.get("name"))).lower())
            if sensor is None:
                continue
            stamp, triad = _find_stamp(event), _check_triad(event.get("values"))
            if sensor != "gyro":
                self._last[sensor] = triad
                continue
            yield (stamp, *triad, *self._specific_force(), *self._last.get("mag", NO_TRIAD))
            self._last = {}

    def _specific_force(self) -> Row:
        last = self._last
        if "accel" in last:
            return last["accel"]
        if "linear" in last and "gravity" in last:
            return [a + g for a, g in zip(last["linear"], last["gravity"], strict=True)]
        return NO_TRIAD


def _check_events(message: Any) -> list[Mapping[str, Any]]:  # noqa: ANN401
    events = message.get("payload", [message]) if isinstance(message, dict) else message
    if not isinstance(events, list) or not all(isinstance(event, dict) for event in events):
        raise ValueError("no events")
    return events


def _find_stamp(event: Mapping[str, Any]) -> int:
    stamp = event.get("timestamp", event.get("time"))
    if not isinstance(stamp, int) or isinstance(stamp, bool) or abs(stamp) >= _MAX_STAMP:
        raise ValueError("no time")
    return stamp


def _check_triad(values: Any) -> list[float]:  # noqa: ANN401
    numbers = [values.get(axis) for axis in AXES] if isinstance(values, dict) else values
    if not isinstance(numbers, list) or len(numbers) < 3:
        raise ValueError("no three numbers")
    triad = [float(value) for value in numbers[:3] if isinstance(value, int | float)]
    if len(triad) < 3 or not all(map(math.isfinite, triad)):
        raise ValueError("no three numbers")
    return triad


PROTOCOL: Final = PacketProtocol(
    "phone",
    "phones: JSON of SensorServer (WebSocket) and of Sensor Logger (pushed)",
    ("time_ns", *name_axes("gyro_{}_radps", "accel_{}_mps2", "mag_{}_ut")),
    _Decoder,
    lines=True,
)
