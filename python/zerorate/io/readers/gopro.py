"""Videos of GoPro cameras: gyro, accelerometer, magnetometer and receiver, each on its own clock.

The core reads the packets of telemetry; see https://github.com/gopro/gpmf-parser.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final, NamedTuple

import numpy as np

from zerorate._native import read_gopro
from zerorate.io.readers.rows import make_content
from zerorate.io.table import Column, Content, Metadata, Table
from zerorate.record.log import LogError
from zerorate.texts import escape_line
from zerorate.types import Floats

AXES: Final = "right or left, forward or back, up"
UNITS: Final = {
    "rad/s": "radps",
    "deg/s": "dps",
    "°/s": "dps",
    "m/s²": "mps2",
    "m/s^2": "mps2",
    "g": "g",
    "µT": "ut",
    "μT": "ut",
}
"""Suffixes of column names, by the units that cameras state."""
MAX_LISTED: Final = 12
"""Maximum number of names in a sentence."""

_SENSORS: Final = {b"GYRO": "gyro", b"ACCL": "accel", b"MAGN": "mag"}
_RECEIVERS: Final = {b"GPS5": "gps", b"GPS9": "gps9"}
_FIX_WIDTH: Final = 3
_CHANNEL_AXES: Final = {"up/down": "z", "right/left": "x", "forward/back": "y"}
_CHANNEL_NAMES: Final = re.compile(r"\(([\w/]+), ?([\w/]+), ?([\w/]+)\)")


@dataclass(frozen=True)
class _Packets:
    """One value for each packet of a stream: columns of the array that the core returns."""

    begin: Floats
    start: Floats
    duration: Floats
    total: Floats
    clock_us: Floats
    clock_ms: Floats
    temperature: Floats
    fix: Floats

    def counts(self, rows: int) -> Floats:
        """Return the number of samples of each packet."""
        return np.diff([*self.begin, rows])

    def ticks(self) -> Floats:
        """Return the times of the first samples, us: by the best clock that all packets have."""
        clocks = (self.clock_us, 1e3 * self.clock_ms, 1e6 * self.start)
        return next(clock for clock in clocks if np.isfinite(clock).all())

    def positions(self, rows: int) -> Floats:
        """Return the index of the first sample of each packet, lost samples counted."""
        first = self.total - self.counts(rows)
        positions = first - first[0]
        is_valid = np.isfinite(positions).all() and (np.diff(positions - self.begin) >= 0).all()
        return positions if is_valid else self.begin


def read(path: Path) -> Content | None:
    """Return a table of each sensor of a GoPro, None for the video of another camera.

    Raises
    ------
    LogError
        If the telemetry has no gyro.
    ValueError
        If the telemetry is damaged.
    """
    raw = np.asarray(np.memmap(path, np.uint8, "r"))
    telemetry = read_gopro(raw, [*_SENSORS, *_RECEIVERS])
    if telemetry is None:
        return None
    model, streams, others, (packet_count, damaged_count) = telemetry
    camera = escape_line(f"GoPro {model.decode('latin-1')}".strip())
    notes = []
    if damaged_count:
        notes.append(f"{damaged_count} of {packet_count} packets are damaged: they are left out")
    tables: dict[str, Table] = {}
    for key, label, unit, axes, values, packets in streams:
        name = (_SENSORS | _RECEIVERS)[key]
        table = _make_table(name, camera, _Stream(label, unit, axes, values, packets), notes)
        if table is not None:
            tables.setdefault(name, table)
    if "gyro" not in tables:
        names = [*tables, *(escape_line(name.decode("latin-1")) for name in others)]
        listed = ", ".join(names[:MAX_LISTED]) or "nothing that is known"
        raise LogError(f"no gyro is found in this file of {camera}; there is: {listed}")
    if "gps9" in tables:
        tables["gps"] = tables.pop("gps9")
    return make_content(tables)


class _Stream(NamedTuple):
    """A stream as the core returns it: texts in Latin-1, values, and its packets."""

    label: bytes
    unit: bytes
    axes: bytes
    values: Floats
    packets: Floats


def _make_table(name: str, camera: str, stream: _Stream, notes: Sequence[str]) -> Table | None:
    """Return the table of a stream, None if it has no three channels."""
    label, unit, letters = (text.decode("latin-1") for text in stream[:3])
    values, packets = stream.values, stream.packets
    clock = _Packets(*packets.T)
    if values.shape[1] < _FIX_WIDTH or len(values) < 2:
        return None
    columns: dict[str, Column] = {"timestamp_us": _sample_times(clock, len(values))}
    if name in _RECEIVERS.values():
        columns |= _fix_columns(values, clock)
        return _to_table(columns, Metadata(sensor=f"{camera} receiver", notes=tuple(notes)))
    order, note = find_orientation(letters, label)
    suffix = f"_{UNITS[unit]}" if unit in UNITS else ""
    for axis, (channel, sign) in zip("xyz", order, strict=True):
        columns[f"{name}_{axis}{suffix}"] = sign * values[:, channel]
    if np.isfinite(clock.temperature).all():
        columns["temperature_degc"] = np.full(len(values), np.nan)
        has_samples = clock.counts(len(values)) > 0
        begins = clock.begin[has_samples].astype(np.int64)
        columns["temperature_degc"][begins] = clock.temperature[has_samples]
    axes = AXES if note else "those of the channels"
    more = note or "the axes' directions are unknown"
    meta = Metadata(sensor=f"{camera} {name}", axes=axes, notes=(*notes, more))
    return _to_table(columns, meta)


def _to_table(columns: dict[str, Column], meta: Metadata) -> Table:
    arrays = list(columns.values())
    return Table(
        len(arrays),
        lambda wanted: [arrays[i] for i in wanted],
        names=tuple(columns),
        meta=meta,
        time=0,
    )


def _fix_columns(values: Floats, clock: _Packets) -> Iterator[tuple[str, Column]]:
    """Yield the columns of fixes, NaN without a fix."""
    kind = np.repeat(clock.fix, clock.counts(len(values)).astype(np.int64))
    if values.shape[1] == 9:
        kind = values[:, 8]
    fixes = np.where((kind >= 2)[:, None], values[:, :_FIX_WIDTH], np.nan)
    names = ("latitude_deg", "longitude_deg", "altitude_m")
    yield from zip(names, fixes.T.copy(), strict=True)


def _sample_times(clock: _Packets, rows: int) -> Column:
    """Return the times of samples, us: packets have one, samples between are equally spaced."""
    ticks, positions = clock.ticks(), clock.positions(rows)
    counts = clock.counts(rows)
    span, samples = ticks[-1] - ticks[0], positions[-1] - positions[0]
    if len(ticks) == 1:
        period = 1e6 * clock.duration[0] / rows
    else:
        period = span / samples if samples > 0 else 0.0
    if not (period > 0.0 and (np.diff(ticks) > 0.0).all()):
        raise ValueError("the clock of the packets does not advance")
    own = np.concatenate([p + np.arange(n) for p, n in zip(positions, counts, strict=True)])
    end = positions[-1] + counts[-1]
    times = np.interp(own, [*positions, end], [*ticks, ticks[-1] + period * counts[-1]])
    return np.asarray(np.rint(times), dtype=np.int64)


def find_orientation(letters: str, label: str) -> tuple[list[tuple[int, int]], str]:
    """Return the channel and the sign of each axis, and a note, empty if they are unknown.

    Parameters
    ----------
    letters
        Axis of each channel, a lower-case letter for a negative axis, such as ``"YxZ"``.
    label
        Description of the channels, such as ``"Gyroscope (z,x,y)"``, used without letters.
    """
    if sorted(letters.lower()) == ["x", "y", "z"]:
        order = [letters.lower().index(axis) for axis in "xyz"]
        signed = [(channel, 1 if letters[channel].isupper() else -1) for channel in order]
        return signed, f"axes are turned by the orientation {letters}"
    match = _CHANNEL_NAMES.search(label)
    words = [part.lower() for part in match.groups()] if match else []
    channels = [_CHANNEL_AXES.get(word, word) for word in words]
    if match is not None and sorted(channels) == ["x", "y", "z"]:
        note = f"the channels are {match[0][1:-1]}: they are reordered to x, y, z"
        return [(channels.index(axis), 1) for axis in "xyz"], note
    return [(0, 1), (1, 1), (2, 1)], ""
