"""ArduPilot's DataFlash logs: IMUs, magnetometers, fixes, attitudes, batches of fast samples."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import cache, partial
from pathlib import Path
from typing import Final, NamedTuple

import numpy as np

from zerorate.faults import keyword_argument, make_sentence
from zerorate.geometry.rotations import from_euler_angles
from zerorate.io.readers.dataflash import DataFlash, Message, parse_binary, parse_text
from zerorate.io.readers.topics import choose_topic, has_gyro
from zerorate.io.table import Column, Content, Metadata, Table
from zerorate.record.log import FORWARD_RIGHT_DOWN
from zerorate.types import Floats, Integers

_Columns = dict[str, Callable[[], Column]]

_AXES: Final = "xyz"
_TIME_FIELDS: Final = {"SampleUS": "us", "TimeUS": "us", "TimeMS": "ms"}
"""Fields with the time and their units; times of samples come before times of writing."""
_INSTANCE_FIELDS: Final = ("I", "C")
"""Fields with the number of a sensor or of an estimator's core."""
_ANGLE_FIELDS: Final = ("Roll", "Pitch", "Yaw")
_MAX_INSTANCES: Final = 16
_NUMBERED_KIND: Final = re.compile(r"(IMU|IMT|MAG|GPS|ACC|GYR)\d")
_CALIBRATION: Final = re.compile(
    r"INS_(GYR|ACC)\d?(OFFS|SCAL|_CALTEMP|_ID)|INS_(GYRO|ACC)\d?OFFS|INS\d?_(GYR|ACC)"
    r"|INS_TCAL|INS_POS|COMPASS_(OFS|DIA|ODI|MOT|SCALE|DEV_ID|ORIENT)|AHRS_(TRIM|ORIENT)|GPS\d?_POS"
)
"""Parameters with the autopilot's calibration of its sensors, and their mounting."""


def read_binary(path: Path) -> Content:
    """Return the messages of a binary log."""
    return _make_content(parse_binary(path))


def read_text(path: Path) -> Content:
    """Return the messages of a log as text."""
    return _make_content(parse_text(path))


def _make_content(log: DataFlash) -> Content:
    """Return a table of each kind of message and each sensor; those of a recording come first."""
    if not any(message.rows for name, message in log.messages.items() if name != "FMT"):
        raise ValueError("no message is left")
    meta = Metadata(calibration=_find_calibration(log), notes=_describe_faults(log))
    parts = {
        name: part for message in log.messages.values() for name, part in _split_instances(message)
    }
    ranked = sorted(parts, key=lambda name: (_rank(parts[name].name), name))
    tables = {name: _make_table(name, parts[name], meta) for name in ranked if parts[name].rows}
    batches = _make_batches(log, meta)
    sensors = _choose_sensors(parts, tables)
    tables = _note_fast_topics(tables | batches, sensors)
    own = tuple(name for name in tables if tables[name].meta.axes)
    expected = "no message holds a gyro, expected IMU"
    return Content(tables, partial(choose_topic, tables, own, expected), sensors)


def _split_instances(message: Message) -> Iterator[tuple[str, Message]]:
    """Yield the messages of each instance: IMU, IMU_1 and so on."""
    instance_field = next((name for name in _INSTANCE_FIELDS if name in message), None)
    if instance_field is None or _kind(message.name) not in _SENSORS or not message.rows:
        yield message.name, message
        return
    numbers = message[instance_field]
    instances = np.unique(numbers)
    if len(instances) > _MAX_INSTANCES:
        yield message.name, message
        return
    for number in instances.tolist():
        name = f"{message.name}_{number:.0f}" if number else message.name
        yield name, message.select_rows(np.flatnonzero(numbers == number))


def _imu(message: Message) -> _Columns:
    return {
        **_vector(message, "Gyr", "gyro_{}_radps"),
        **_vector(message, "Acc", "accel_{}_mps2"),
        **_rename(message, {"T": "temperature_degc"}),
    }


def _increments(message: Message) -> _Columns:
    """Return means over the integration time, s."""
    columns: _Columns = {}
    for field, time, name in (
        ("DelA", "DelaT", "gyro_{}_radps"),
        ("DelV", "DelvT", "accel_{}_mps2"),
    ):
        for axis in _AXES:
            columns[name.format(axis)] = partial(_mean, message, f"{field}{axis.upper()}", time)
    return columns


def _mean(message: Message, field: str, time: str) -> Column:
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        return message[field].astype(np.float64) / message[time]


def _magnetometer(message: Message) -> _Columns:
    return _vector(message, "Mag", "mag_{}_gauss", 1e-3)


def _barometer(message: Message) -> _Columns:
    named = {"Press": "pressure_pa", "Alt": "baro_altitude_m", "Temp": "barotemp_degc"}
    return _rename(message, named)


def _fixes(message: Message) -> _Columns:
    columns = {
        "latitude_deg": partial(_mask_without_fix, message, "Lat"),
        "longitude_deg": partial(_mask_without_fix, message, "Lng"),
        "altitude_msl_m": partial(_mask_without_fix, message, "Alt"),
        "velocity_north_mps": partial(_speed, message, np.cos),
        "velocity_east_mps": partial(_speed, message, np.sin),
    }
    if "VZ" in message:
        columns["velocity_down_mps"] = partial(_mask_without_fix, message, "VZ")
    return columns | _rename(message, {"NSats": "satellites", "Status": "fix_type"})


def _mask_without_fix(message: Message, name: str) -> Column:
    return np.where(message["Status"] >= 2, message[name].astype(np.float64), np.nan)


def _speed(message: Message, part: Callable[[Floats], Floats]) -> Column:
    with np.errstate(invalid="ignore", over="ignore"):
        return _mask_without_fix(message, "Spd") * part(
            np.radians(message["GCrs"].astype(np.float64))
        )


def _attitude(message: Message) -> _Columns:
    """Return the orientation from body (forward, right, down) to earth (north, east, down)."""
    if "Q1" in message:
        return _rename(message, {f"Q{i}": f"ref_quat_{axis}" for i, axis in enumerate("wxyz", 1)})
    quaternions = cache(partial(_quaternions, message))
    return {
        f"ref_quat_{axis}": partial(_component, quaternions, i) for i, axis in enumerate("wxyz")
    }


def _component(quaternions: Callable[[], Floats], component: int) -> Column:
    return np.asarray(quaternions()[:, component])


def _quaternions(message: Message) -> Floats:
    with np.errstate(invalid="ignore", over="ignore"):
        angles = [np.radians(message[name].astype(np.float64)) for name in _ANGLE_FIELDS]
    return from_euler_angles(*angles)


class _Sensor(NamedTuple):
    """Fields of a sensor's messages, and functions that convert them to columns."""

    needs: tuple[str, ...]
    columns: Callable[[Message], _Columns]


_SENSORS: Final[dict[str, _Sensor]] = {
    "IMU": _Sensor(("GyrX", "GyrY", "GyrZ", "AccX", "AccY", "AccZ"), _imu),
    "GYR": _Sensor(("GyrX", "GyrY", "GyrZ"), _imu),
    "ACC": _Sensor(("AccX", "AccY", "AccZ"), _imu),
    "IMT": _Sensor(
        ("DelaT", "DelvT", "DelAX", "DelAY", "DelAZ", "DelVX", "DelVY", "DelVZ"), _increments
    ),
    "MAG": _Sensor(("MagX", "MagY", "MagZ"), _magnetometer),
    "GPS": _Sensor(("Status", "Lat", "Lng", "Alt", "Spd", "GCrs"), _fixes),
    "BARO": _Sensor((), _barometer),
    "BAR2": _Sensor((), _barometer),
    "BAR3": _Sensor((), _barometer),
    "SIM": _Sensor(_ANGLE_FIELDS, _attitude),
    "ATT": _Sensor(_ANGLE_FIELDS, _attitude),
    "XKF1": _Sensor(_ANGLE_FIELDS, _attitude),
    "NKF1": _Sensor(_ANGLE_FIELDS, _attitude),
    "AHR2": _Sensor(_ANGLE_FIELDS, _attitude),
    "XKQ": _Sensor(("Q1", "Q2", "Q3", "Q4"), _attitude),
    "NKQ": _Sensor(("Q1", "Q2", "Q3", "Q4"), _attitude),
}
"""Messages of sensors and attitudes; of each kind, the best comes first."""
_RANKS: Final = {name: rank for rank, name in enumerate(_SENSORS)}
_ESTIMATES: Final = ("ATT", "XKF1", "NKF1")
"""Attitudes used as references of a recording: the autopilot's own estimates."""


def _kind(name: str) -> str:
    """Return the kind of sensor of messages; IMU2 and IMU3 count as IMU."""
    return name[:3] if _NUMBERED_KIND.fullmatch(name) or name in ("XKQ1", "NKQ1") else name


def _rank(name: str) -> int:
    return _RANKS.get(_kind(name), len(_RANKS))


def _vector(message: Message, field: str, name: str, default: float = 1.0) -> _Columns:
    """Return three axes of messages, scaled by the stated factor or the firmware's factor."""
    columns: _Columns = {}
    for axis in _AXES:
        key = f"{field}{axis.upper()}"
        if key in message:
            factor = message.multipliers.get(key, default)
            columns[name.format(axis)] = partial(_multiply, message, key, factor)
    return columns


def _multiply(message: Message, name: str, factor: float) -> Column:
    return message[name] if factor == 1.0 else message[name] * factor


def _rename(message: Message, names: Mapping[str, str]) -> _Columns:
    return {to: partial(message.__getitem__, key) for key, to in names.items() if key in message}


def _make_table(name: str, message: Message, meta: Metadata) -> Table:
    """Return a table; sensors have SI units and zerorate's names, other messages are unchanged."""
    sensor = _SENSORS.get(_kind(message.name))
    is_known = sensor is not None and all(key in message for key in sensor.needs)
    time = _find_time(message)
    make = sensor.columns if is_known and sensor is not None else _all_columns

    def columns(message: Message) -> _Columns:
        stamps: _Columns = {}
        if time is not None:
            stamps[f"timestamp_{_TIME_FIELDS[time]}"] = partial(_stamps, message, time)
        return stamps | make(message)

    names = tuple(columns(message))

    def load(wanted: Sequence[int]) -> list[Column]:
        getters = columns(message.load_numbers() if len(wanted) > 1 else message)
        return [getters[names[i]]() for i in wanted]

    notes = meta.notes
    if _kind(message.name) in _ESTIMATES:
        notes = (
            *notes,
            f"the attitude {name} is the autopilot's own estimate, not a reference",
        )
    axes = FORWARD_RIGHT_DOWN if is_known else None
    own_meta = Metadata(
        sensor=name, axes=axes, calibration=meta.calibration if is_known else None, notes=notes
    )
    return Table(len(names), load, names=names, meta=own_meta, time=0 if time is not None else None)


def _all_columns(message: Message) -> _Columns:
    return _rename(message, {key: key for key in message.numbers() if key not in _TIME_FIELDS})


def _find_time(message: Message) -> str | None:
    """Return the field with the times: times of samples if the driver provides them."""
    present = [name for name in _TIME_FIELDS if name in message]
    if present[:1] == ["SampleUS"] and not message["SampleUS"].all():
        present = present[1:]
    return present[0] if present else None


def _stamps(message: Message, name: str) -> Column:
    return message[name].astype(np.int64)


_BATCH_HEAD_FIELDS: Final = ("N", "type", "instance", "mul", "smp_cnt", "SampleUS", "smp_rate")
_BATCH_DATA_FIELDS: Final = ("N", "seqno", "x", "y", "z")
_BATCH_KINDS: Final = {0: ("accel", "accel_{}_mps2"), 1: ("gyro", "gyro_{}_radps")}
"""Sensors of batches by number, and the names of their columns."""
_SAMPLES_PER_MESSAGE: Final = 32
"""Samples in a message of a batch."""


def _make_batches(log: DataFlash, meta: Metadata) -> dict[str, Table]:
    """Return the batches of fast samples of each sensor; they are short and far apart."""
    head, data = log.messages.get("ISBH"), log.messages.get("ISBD")
    if head is None or data is None or not head.rows or not data.rows:
        return {}
    if not all(map(head.__contains__, _BATCH_HEAD_FIELDS)) or not all(
        map(data.__contains__, _BATCH_DATA_FIELDS)
    ):
        return {}
    pairs = zip(head["type"].tolist(), head["instance"].tolist(), strict=True)
    tables = {}
    for kind, instance in sorted(set(pairs)):
        if kind in _BATCH_KINDS and instance < _MAX_INSTANCES:
            name = f"ISB_{_BATCH_KINDS[kind][0]}_{instance}"
            own = replace(meta, sensor=name, axes=FORWARD_RIGHT_DOWN)
            batches = _Batches(head, data, kind, instance)
            names = ("timestamp_us", *(_BATCH_KINDS[kind][1].format(axis) for axis in _AXES))
            tables[name] = Table(len(names), batches.load, names=names, meta=own, time=0)
    return tables


class _Batches(NamedTuple):
    """Batches of one sensor: headers, and messages with several samples each."""

    head: Message
    data: Message
    kind: int
    instance: int

    def load(self, wanted: Sequence[int]) -> list[Column]:
        """Return the times of the samples, us, and their axes."""
        parts, batch = self._match_messages()
        at = self.data["seqno"].astype(np.int64)[parts, None] * _SAMPLES_PER_MESSAGE + np.arange(
            _SAMPLES_PER_MESSAGE
        )
        is_used = at < self.head["smp_cnt"][batch, None]
        if not is_used.any():
            raise ValueError("no batch has a sample")
        return [
            (
                self._sample_times(batch, at)
                if i == 0
                else self._axis_values(_AXES[i - 1], parts, batch)
            )[is_used]
            for i in wanted
        ]

    def _match_messages(self) -> tuple[Integers, Integers]:
        """Return the messages with samples in order of time, (k,), and the header of each.

        The numbers of batches wrap; a message belongs to the header of the same round.
        """
        numbers, own = self.data["N"].astype(np.int64), self.head["N"].astype(np.int64)
        seqno = self.data["seqno"].astype(np.int64)
        order = np.argsort(numbers, kind="stable")
        new = np.diff(numbers[order], prepend=-1) != 0
        ordinal = np.cumsum(new | (np.diff(seqno[order], prepend=0) <= 0))
        repeat = ordinal - np.maximum.accumulate(np.where(new, ordinal, 0))
        heads = np.argsort(own, kind="stable")
        position = np.searchsorted(own[heads], numbers[order]) + repeat
        fits = position < np.searchsorted(own[heads], numbers[order], "right")
        parts, batch = order[fits], heads[position[fits]]
        is_own = (self.head["type"] == self.kind) & (self.head["instance"] == self.instance)
        parts, batch = parts[is_own[batch]], batch[is_own[batch]]
        by_time = np.lexsort((seqno[parts], self.head["SampleUS"][batch]))
        return parts[by_time], batch[by_time]

    def _sample_times(self, batch: Integers, at: Integers) -> Integers:
        rate = self.head["smp_rate"].astype(np.float64)
        if not (rate[batch] > 1.0).all():
            raise ValueError("a batch does not say its rate")
        first = self.head["SampleUS"].astype(np.int64)
        return first[batch, None] + np.rint(1e6 * at / rate[batch, None]).astype(np.int64)

    def _axis_values(self, axis: str, parts: Integers, batch: Integers) -> Floats:
        with np.errstate(divide="ignore", invalid="ignore"):
            return self.data[axis][parts] / self.head["mul"].astype(np.float64)[batch, None]


def _choose_sensors(parts: Mapping[str, Message], tables: Mapping[str, Table]) -> tuple[str, ...]:
    """Return the tables for a recording, with each sensor once."""

    def of(*kinds: str) -> list[str]:
        return [n for n in tables if _kind(parts[n].name) in kinds and tables[n].meta.axes]

    imus = of("IMU") or of("GYR", "ACC") or of("IMT")
    references = of("SIM") or [n for n in _ESTIMATES if n in of(n)]
    return (*imus, *of("MAG"), *of("BARO", "BAR2", "BAR3"), *of("GPS"), *references)


def _note_fast_topics(tables: dict[str, Table], sensors: Sequence[str]) -> dict[str, Table]:
    """Return the tables; the first gyro's table gets a note on faster samples."""
    first_gyro = next((name for name in sensors if has_gyro(tables[name])), None)
    fast_topics = [
        n
        for n in tables
        if n not in sensors and n.startswith(("GYR", "ISB")) and has_gyro(tables[n])
    ]
    if first_gyro is None or not fast_topics:
        return tables
    note = make_sentence(
        "faster samples are read by ", keyword_argument("topic"), f": {', '.join(fast_topics)}"
    )
    table = tables[first_gyro]
    return tables | {
        first_gyro: replace(table, meta=replace(table.meta, notes=(*table.meta.notes, note)))
    }


def _find_calibration(log: DataFlash) -> dict[str, float] | None:
    """Return the last value of each parameter of the autopilot's calibration."""
    message = log.messages.get("PARM")
    if message is None or "Name" not in message or "Value" not in message:
        return None
    names = (_decode_text(name) for name in message["Name"].tolist())
    pairs = zip(names, message["Value"].tolist(), strict=True)
    return {name: float(value) for name, value in pairs if _CALIBRATION.match(name)} or None


def _decode_text(raw: bytes) -> str:
    return raw.partition(b"\0")[0].decode("ascii", "replace")


def _describe_faults(log: DataFlash) -> tuple[str, ...]:
    notes = []
    if log.cut_count:
        notes.append("the log ends within a message: it was cut off, and the rest is read")
    if log.lost_count:
        notes.append(
            f"{log.lost_count} of its {log.size} {log.counted_unit} are damaged or "
            "unknown: they are left out"
        )
    return tuple(notes)
