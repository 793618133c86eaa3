"""PX4's ULog files: topics of gyros, accelerometers and other sensors."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Final

import numpy as np

from zerorate.faults import keyword_argument, make_sentence
from zerorate.io.readers.topics import choose_topic, has_gyro
from zerorate.io.readers.ulog import Topic, ULog, parse_log
from zerorate.io.table import Column, Content, Metadata, Table
from zerorate.numerals import shorten
from zerorate.record.log import FORWARD_RIGHT_DOWN

_Fields = Mapping[str, Column]
_Columns = dict[str, Column]

_AXES: Final = "xyz"
_INVALID_RELATIVE_TIME: Final = 0x7FFFFFFF
"""Relative time that marks a missing accelerometer sample."""


def read(path: Path) -> Content:
    """Return a table for each topic and instance; sensors come first, in SI units.

    Further instances are called ``sensor_gyro_1`` and so on.
    """
    raw = path.read_bytes()
    log = parse_log(raw)
    if not log.topics and (log.cut_bytes or log.lost_bytes):
        raise ValueError("no message is left")
    notes = _describe_faults(log, len(raw))
    topics = {_topic_name(topic): topic for topic in log.topics}
    ranked = sorted(topics, key=lambda name: _rank(topics[name]))
    meta = Metadata(calibration=_find_calibration(log), notes=notes)
    tables = {name: _make_table(name, topics[name], meta) for name in ranked}
    sensors = tuple(name for name in tables if topics[name].name in _TOPICS)
    measured = tuple(name for name in sensors if topics[name].name not in _DERIVED_TOPICS)
    if not any(topics[name].name == _TRUTH_TOPIC for name in ranked):
        measured += tuple(name for name in ranked if name == _ESTIMATE_TOPIC)
    tables = _note_topics(tables, topics, measured)
    expected = "no topic holds a gyro, expected sensor_combined"
    return Content(tables, partial(choose_topic, tables, sensors, expected), measured)


def _find_calibration(log: ULog) -> dict[str, float] | None:
    return {n: v for n, v in log.parameters.items() if _CALIBRATION.match(n)} or None


def _note_topics(
    tables: dict[str, Table], topics: Mapping[str, Topic], measured: Sequence[str]
) -> dict[str, Table]:
    """Return the tables with notes on equal devices and faster samples."""
    devices: dict[int, str] = {}
    noted = dict(tables)
    for name in measured:
        notes = [_ESTIMATE_NOTE] if name == _ESTIMATE_TOPIC else []
        ids = topics[name].fields.get(_DEVICE_FIELDS.get(topics[name].name, ""))
        if ids is not None and ids.any():
            other = devices.setdefault(int(ids[0]), name)
            if other != name:
                notes.append(f"{name} and {other} are of one device")
        noted[name] = _add_notes(tables[name], *notes)
    first = next((name for name in measured if has_gyro(tables[name])), None)
    fast = [n for n in tables if topics[n].name == "sensor_gyro_fifo"]
    if first is not None and fast:
        noted[first] = _add_notes(
            noted[first],
            make_sentence(
                "faster samples are read by ", keyword_argument("topic"), f": {', '.join(fast)}"
            ),
        )
    return noted


def _add_notes(table: Table, *notes: str) -> Table:
    meta = replace(table.meta, notes=(*table.meta.notes, *notes))
    return replace(table, meta=meta) if notes else table


def _combined_columns(fields: _Fields) -> _Columns:
    """Return ``sensor_combined``: the gyro and accelerometer that the autopilot uses."""
    accel = _vector(fields, "accelerometer_m_s2[{}]", "accel_{}_mps2")
    relative = fields.get("accelerometer_timestamp_relative")
    if relative is not None:
        for name, values in accel.items():
            accel[name] = np.where(relative == _INVALID_RELATIVE_TIME, np.nan, values)
    return _vector(fields, "gyro_rad[{}]", "gyro_{}_radps") | accel | _old_magnetometer(fields)


def _old_magnetometer(fields: _Fields) -> _Columns:
    """Return the magnetometer of old logs in ``sensor_combined``, at the rows with new values."""
    relative = fields.get("magnetometer_timestamp_relative")
    if relative is None:
        return {}
    mag = _vector(fields, "magnetometer_ga[{}]", "mag_{}_gauss")
    stamps = fields["timestamp"].astype(np.int64) + relative
    is_new = (relative != _INVALID_RELATIVE_TIME) & (np.diff(stamps, prepend=-1) != 0)
    return {name: np.where(is_new, values, np.nan) for name, values in mag.items()}


def _integrated_columns(fields: _Fields) -> _Columns:
    """Return ``vehicle_imu``: means over the integration time, us."""
    gyro = _vector(fields, "delta_angle[{}]", "gyro_{}_radps")
    accel = _vector(fields, "delta_velocity[{}]", "accel_{}_mps2")
    with np.errstate(divide="ignore", invalid="ignore"):
        gyro = {n: v / (1e-6 * fields["delta_angle_dt"]) for n, v in gyro.items()}
        accel = {n: v / (1e-6 * fields["delta_velocity_dt"]) for n, v in accel.items()}
    return gyro | accel


def _fixes(fields: _Fields) -> _Columns:
    """Return GNSS fixes; old logs have integers in 1e-7 deg and mm, new logs degrees and metres."""
    if "lat" in fields:
        fix_columns = {
            "latitude_deg": fields["lat"] * 1e-7,
            "longitude_deg": fields["lon"] * 1e-7,
            "altitude_msl_m": fields["alt"] * 1e-3,
        }
    else:
        fix_columns = {
            "latitude_deg": fields["latitude_deg"],
            "longitude_deg": fields["longitude_deg"],
            "altitude_msl_m": fields["altitude_msl_m"],
        }
    has_fix = fields["fix_type"] >= 2
    fix_columns = {name: np.where(has_fix, values, np.nan) for name, values in fix_columns.items()}
    directions = {"n": "north", "e": "east", "d": "down"}
    return fix_columns | {
        f"velocity_{way}_mps": np.where(has_fix, fields[f"vel_{letter}_m_s"], np.nan)
        for letter, way in directions.items()
        if f"vel_{letter}_m_s" in fields
    }


def _make_vector_reader(field: str, name: str) -> Callable[[_Fields], _Columns]:
    """Return a reader of three axes, and of the sensor's temperature if logged."""

    def columns(fields: _Fields) -> _Columns:
        values = _vector(fields, field, name)
        if "temperature" in fields:
            values["temperature_degc"] = fields["temperature"]
        return values

    return columns


def _read_fifo(fields: _Fields, name: str) -> tuple[Column, _Columns]:
    """Return times, us, and values of rows with several samples; the last has the row's stamp."""
    count = np.clip(fields["samples"].astype(np.int64), 0, _FIFO_SAMPLES)[:, None]
    position = np.arange(_FIFO_SAMPLES)
    is_used = position < count
    with np.errstate(invalid="ignore", over="ignore"):
        before = (count - 1 - position) * np.nan_to_num(fields["dt"].astype(np.float64))[:, None]
        before = np.rint(np.clip(before, 0.0, 1e6)).astype(np.int64)
        scale = fields["scale"].astype(np.float64)[:, None]
        columns = {
            name.format(axis): (
                np.stack([fields[f"{axis}[{i}]"] for i in range(_FIFO_SAMPLES)], axis=1) * scale
            )[is_used]
            for axis in _AXES
        }
    return (_stamps(fields)[:, None] - before)[is_used], columns


def _barometer(fields: _Fields) -> _Columns:
    return {"pressure_pa": fields["baro_pressure_pa"], "baro_altitude_m": fields["baro_alt_meter"]}


def _attitude(fields: _Fields) -> _Columns:
    return {f"ref_quat_{letter}": fields[f"q[{i}]"] for i, letter in enumerate("wxyz")}


_TOPICS: Final[dict[str, Callable[[_Fields], _Columns]]] = {
    "sensor_combined": _combined_columns,
    "vehicle_imu": _integrated_columns,
    "sensor_gyro": _make_vector_reader("{}", "gyro_{}_radps"),
    "vehicle_angular_velocity": _make_vector_reader("xyz[{}]", "gyro_{}_radps"),
    "sensor_accel": _make_vector_reader("{}", "accel_{}_mps2"),
    "vehicle_acceleration": _make_vector_reader("xyz[{}]", "accel_{}_mps2"),
    "vehicle_magnetometer": _make_vector_reader("magnetometer_ga[{}]", "mag_{}_gauss"),
    "sensor_mag": _make_vector_reader("{}", "mag_{}_gauss"),
    "vehicle_air_data": _barometer,
    "vehicle_gps_position": _fixes,
    "sensor_gps": _fixes,
    "vehicle_attitude_groundtruth": _attitude,
    "vehicle_attitude": _attitude,
    "sensor_gyro_fifo": _make_vector_reader("{}", "gyro_{}_radps"),
    "sensor_accel_fifo": _make_vector_reader("{}", "accel_{}_mps2"),
}
"""Topics of sensors, the best of each kind first, with functions that make their columns."""

_FIFO_COLUMNS: Final = {"sensor_gyro_fifo": "gyro_{}_radps", "sensor_accel_fifo": "accel_{}_mps2"}
"""Topics with many samples per row, and the names of their columns."""
_FIFO_SAMPLES: Final = 32
_TRUTH_TOPIC: Final = "vehicle_attitude_groundtruth"
_ESTIMATE_TOPIC: Final = "vehicle_attitude"
_ESTIMATE_NOTE: Final = (
    "the attitude vehicle_attitude is the autopilot's own estimate, not a reference"
)
_DERIVED_TOPICS: Final = (
    "vehicle_angular_velocity",
    "vehicle_acceleration",
    _ESTIMATE_TOPIC,
    *_FIFO_COLUMNS,
)
"""Topics with filtered, estimated or faster samples of a sensor; they are no further sensors."""
_DEVICE_FIELDS: Final = {"vehicle_imu": "gyro_device_id", "sensor_gyro": "device_id"}
"""Fields with a gyro's identifier, which shows the topics of one device."""
_CALIBRATION: Final = re.compile(
    r"CAL_(GYRO|ACC|MAG)|TC_[GAM]|SENS_BOARD_|SENS_IMU_|SENS_MAG_|EKF2_(IMU|GPS)_POS"
)
"""Parameters with the autopilot's calibration of its sensors, and their mounting."""

_RANKS: Final = {name: rank for rank, name in enumerate(_TOPICS)}


def _vector(fields: _Fields, field: str, name: str) -> _Columns:
    keys = _AXES if field == "{}" else range(3)
    return {
        name.format(axis): fields[field.format(key)] for axis, key in zip(_AXES, keys, strict=True)
    }


def _stamps(fields: _Fields) -> Column:
    # `timestamp` is slightly later than the sample; `timestamp_sample` is 0 if not provided.
    stamps = fields.get("timestamp_sample")
    if stamps is None or not stamps.all():
        stamps = fields["timestamp"]
    return stamps.astype(np.int64)


def _make_table(name: str, topic: Topic, meta: Metadata) -> Table:
    fields = topic.fields
    stamps = _stamps(fields)
    try:
        if topic.name in _FIFO_COLUMNS:
            stamps, columns = _read_fifo(fields, _FIFO_COLUMNS[topic.name])
        else:
            columns = _TOPICS[topic.name](fields)
    except KeyError:  # another topic, or fields of an unknown version
        columns = {key: v for key, v in fields.items() if not key.startswith("timestamp")}
    names, arrays = ("timestamp_us", *columns), [stamps, *columns.values()]

    def load(wanted: Sequence[int]) -> list[Column]:
        return [arrays[i] for i in wanted]

    is_known = topic.name in _TOPICS
    own_meta = replace(
        meta,
        sensor=name,
        axes=FORWARD_RIGHT_DOWN if is_known else None,
        calibration=meta.calibration if is_known else None,
    )
    return Table(len(names), load, names=names, meta=own_meta, time=0)


def _topic_name(topic: Topic) -> str:
    return f"{topic.name}_{topic.instance}" if topic.instance else topic.name


def _rank(topic: Topic) -> tuple[int, str, int]:
    return _RANKS.get(topic.name, len(_RANKS)), topic.name, topic.instance


def _describe_faults(log: ULog, size: int) -> tuple[str, ...]:
    notes = []
    if log.cut_bytes:
        notes.append("the file ends within a message: it was cut off, and the rest is read")
    if log.lost_bytes:
        notes.append(
            f"{log.lost_bytes} of its {size} bytes are damaged or unknown: they are left out"
        )
    if log.dropouts:
        plural = "" if log.dropouts == 1 else "s"
        notes.append(
            f"{log.dropouts} dropout{plural} of the logger, {shorten(1e-3 * log.dropped_ms, 3)} s "
            "in all"
        )
    return tuple(notes)
