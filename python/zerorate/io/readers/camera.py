"""Videos of cameras: GoPro by the core, Sony, Insta360, DJI and others by telemetry-parser.

If packets of samples have their own clock, raw values are read with their scale, unit and
temperature, each sensor on its clock. Otherwise times, axes and units are telemetry-parser's.
"""

from __future__ import annotations

import os
import sys
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from importlib.util import find_spec
from pathlib import Path
from typing import Any, Final, NamedTuple

import numpy as np

from zerorate.io.readers import gopro
from zerorate.io.readers.gopro import MAX_LISTED, UNITS
from zerorate.io.readers.isolated import run_isolated
from zerorate.io.readers.rows import make_content
from zerorate.io.table import Column, Content, Metadata, Table
from zerorate.record.log import LogError
from zerorate.texts import describe_missing_extra, escape_line
from zerorate.types import Floats

_Group = Mapping[str, Any]

_KINDS: Final = {"Gyroscope": "gyro", "Accelerometer": "accel", "Magnetometer": "mag"}
_CLOCK_FIELDS: Final = {"TimestampUs": 1, "0x5449434b": 1000}
"""Clocks of a packet: of GoPro's STMP and TICK, and their microseconds."""
_COMMON_COLUMNS: Final = {"gyro": "gyro_{}_dps", "accl": "accel_{}_mps2", "magn": "mag_{}_ut"}
"""Columns that telemetry-parser makes for all cameras, and their units."""

_MIN_UNSUPPORTED_PYTHON: Final = (3, 13)
"""The first Python for which telemetry-parser has no wheel, and it has no sources on the index."""


def read(path: Path) -> Content:
    """Return a table of each sensor of a camera."""
    content = None if path.suffix.lower() == ".gcsv" else gopro.read(path)
    if content is not None:
        return content
    if find_spec("telemetry_parser") is None:
        needed = describe_missing_extra("telemetry_parser", "camera", "the video of this camera")
        is_unsupported = tuple(sys.version_info) >= _MIN_UNSUPPORTED_PYTHON
        raise ImportError(f"{needed}, with Python 3.12 or older" if is_unsupported else needed)
    result, arrays = run_isolated("camera_sensors", path)
    if not result["sensors"]:
        listed = ", ".join(result["others"][:MAX_LISTED]) or "nothing that it knows"
        raise LogError(f"no gyro is found in this file of {result['camera']}; there is: {listed}")
    columns = iter(arrays)
    tables = {}
    for sensor in result["sensors"]:
        own = [next(columns) for _ in sensor["names"]]
        notes = (sensor["note"],) if sensor["note"] else ()
        meta = Metadata(
            sensor=f"{result['camera']} {sensor['sensor']}", axes=sensor["axes"], notes=notes
        )
        tables[sensor["sensor"]] = _make_table(tuple(sensor["names"]), own, meta)
    return make_content(tables)


def _make_table(names: tuple[str, ...], columns: Sequence[Column], meta: Metadata) -> Table:
    return Table(
        len(names), lambda wanted: [columns[i] for i in wanted], names=names, meta=meta, time=0
    )


class Sensor(NamedTuple):
    """Data of one sensor: names of columns, the first of times, and these."""

    sensor: str
    names: tuple[str, ...]
    columns: tuple[Column, ...]
    axes: str | None
    note: str


class CameraContent(NamedTuple):
    """A camera, its sensors, and the rest of its file."""

    camera: str
    sensors: list[Sensor]
    others: list[str]


def find_sensors(path: Path) -> CameraContent:
    """Return the sensors that telemetry-parser finds in a file.

    This runs in a process of its own, because damaged files can end it.

    Raises
    ------
    ValueError
        In the place of whatever the library raises.
    """
    import telemetry_parser

    try:
        with _link_with_text_name(path) as name:
            parser = telemetry_parser.Parser(name)
        packets = parser.telemetry()
    except BaseException as error:  # panics of the library are no Exception
        raise ValueError(str(error)) from None
    camera = escape_line(f"{parser.camera or ''} {parser.model or ''}".strip())
    groups: dict[str, list[_Group]] = {}
    for packet in packets:
        for name, group in packet.items():
            groups.setdefault(name, []).append(group)
    found = [
        sensor
        for name in _KINDS
        if (sensor := _read_clocked(name, groups.get(name, ()))) is not None
    ]
    if not any(sensor.sensor == "gyro" for sensor in found):
        try:
            found = list(_read_common(parser.normalized_imu()))
        except BaseException as error:
            raise ValueError(str(error)) from None
    others = [_group_name(name, of) for name, of in groups.items() if name != "Default"]
    return CameraContent(camera, found, list(dict.fromkeys(others)))


@contextmanager
def _link_with_text_name(path: Path) -> Iterator[str]:
    """Give a name of a file that is text: that of a link to it, where its own is none."""
    name = os.fspath(path)
    try:
        name.encode()
    except UnicodeEncodeError:
        with tempfile.TemporaryDirectory() as folder:
            link = Path(folder) / f"file{path.suffix}"
            link.symlink_to(path.absolute())
            yield str(link)
    else:
        yield name


def _group_name(name: str, groups: Sequence[_Group]) -> str:
    group_label = groups[0].get("Name")
    return escape_line(group_label if isinstance(group_label, str) else name)


def _read_clocked(name: str, packets: Sequence[_Group]) -> Sensor | None:
    """Return a sensor whose packets have raw values and a clock of their own."""
    rows = [packet.get("Data") for packet in packets]
    clock = next((key for key in _CLOCK_FIELDS if all(key in packet for packet in packets)), None)
    unit = {packet.get("Unit") for packet in packets}
    if len(rows) < 2 or clock is None or len(unit) > 1 or not all(map(_are_triads, rows)):
        return None
    suffix = UNITS.get(str(unit.pop()))
    scales = {packet.get("Scale", 1) for packet in packets}
    if suffix is None or len(scales) > 1 or not isinstance(scale := scales.pop(), (int, float)):
        return None
    flat = (float(sample[axis]) for row in rows if row for sample in row for axis in "xyz")
    values = np.fromiter(flat, np.float64).reshape(-1, 3) / (scale or 1)
    counts = [len(row) for row in rows if row is not None]
    begins = np.concatenate(([0], np.cumsum(counts)[:-1]))
    ticks = np.array([float(packet[clock]) for packet in packets]) * _CLOCK_FIELDS[clock]
    order, axes, note = _find_orientation(packets[0])
    values = np.column_stack([sign * values[:, at] for at, sign in order])
    kind = _KINDS[name]
    names = ["timestamp_us", *(f"{kind}_{axis}_{suffix}" for axis in "xyz")]
    columns: list[Column] = [_interpolate_times(begins, ticks, len(values)), *values.T.copy()]
    temperatures = [packet.get("Temperature") for packet in packets]
    if all(isinstance(sample, (int, float)) for sample in temperatures):
        column = np.full(len(values), np.nan)
        column[begins[np.array(counts) > 0]] = [
            t for t, count in zip(temperatures, counts, strict=True) if count
        ]
        names, columns = [*names, "temperature_degc"], [*columns, column]
    return Sensor(kind, tuple(names), tuple(columns), axes, note)


def _are_triads(rows: object) -> bool:
    return isinstance(rows, list) and all(
        isinstance(one, dict) and {"x", "y", "z"} == set(one) for one in rows
    )


def _interpolate_times(begins: Column, ticks: Floats, count: int) -> Column:
    """Return times of samples, us, between the packets with a time, and after the last."""
    rate = (begins[-1] - begins[0]) / (ticks[-1] - ticks[0]) if ticks[-1] > ticks[0] else 0.0
    if not rate > 0.0:
        raise ValueError("the clock of the packets does not go on")
    end = ticks[-1] + (count - begins[-1]) / rate
    times = np.interp(np.arange(count), [*begins, count], [*ticks, end])
    return np.asarray(np.rint(times), dtype=np.int64)


def _find_orientation(packet: _Group) -> tuple[list[tuple[int, int]], str, str]:
    """Return the channel and sign of each axis, their description, and a note."""
    orientation = packet.get("Orientation")
    if isinstance(orientation, str) and sorted(orientation.lower()) == ["x", "y", "z"]:
        order = [
            ("xyz".index(letter.lower()), 1 if letter.isupper() else -1) for letter in orientation
        ]
        note = f"axes are turned by the orientation {orientation}"
        return order, "those of telemetry-parser", note
    order, note = gopro.find_orientation("", str(packet.get("Name", "")))
    if note:
        return order, gopro.AXES, note
    return order, "those of the channels", "the axes' directions are unknown"


def _read_common(rows: Sequence[Mapping[str, Any]]) -> Iterator[Sensor]:
    """Yield the sensors of any camera as telemetry-parser reads them, by its clock."""
    times = np.array([row["timestamp_ms"] for row in rows], np.float64)
    for key, name in _COMMON_COLUMNS.items():
        is_present = [row.get(key) is not None for row in rows]
        if any(is_present):
            flat = [row[key] for row, present in zip(rows, is_present, strict=True) if present]
            values = np.array(flat, np.float64).reshape(-1, 3)
            names = ("timestamp_ms", *(name.format(axis) for axis in "xyz"))
            note = "times, axes and units are as telemetry-parser makes them"
            kind = name.partition("_")[0]
            columns = (times[np.array(is_present)], *values.T.copy())
            yield Sensor(kind, names, columns, "those of telemetry-parser", note)
