"""Logs of arrays: several gyros of one body with a common clock and unit."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, Final, Literal, NamedTuple

import numpy as np

from zerorate.faults import ArgumentError
from zerorate.record.log import Log, LogError, check_rate
from zerorate.record.names import looks_like_gyro, meaning_of, split_unit, to_snake_case
from zerorate.record.recording import Recording
from zerorate.types import Floats
from zerorate.units import UNITS

_AXES: Final = ("x", "y", "z")
_MAX_OFFSET_PERIODS: Final = 0.5
"""Largest difference of sample times between equal clocks, in sample periods."""
_KIND_WORDS: Final = re.compile(
    r"gyroscope|gyrometer|gyro|gyr|accelerometer|acceleration|accel|acc"
    r"|(?<![a-z])(?:g|a|w|f|rate)(?![a-z])"
)
"""Words in a channel's name for the kind of sensor, which do not name the device."""


@dataclass(frozen=True, eq=False)
class ArrayLog:
    """Samples of N gyros on one body, with a common clock.

    Parameters
    ----------
    time : ndarray, shape (n,)
        Times of the samples, s, uniform.
    rate : float
        Sampling rate, Hz.
    data : ndarray, shape (n, N, 3) or (n, N)
        Rates in `unit`, with three axes or one axis per sensor, in the sensor's own axes. NaN marks
        a missing sample.
    labels : tuple of str
        One unique label per sensor.
    unit : str
        Unit of all gyros.
    axes : tuple of str
        ``("x", "y", "z")``, or one letter for gyros of one axis. Empty if this axis is unknown.
    meta : mapping
        Metadata, as in `zerorate.Log`.
    accel : ndarray, shape (n, N, 3), or None
        Specific forces of the same devices in `accel_unit`, in the sensors' own axes. NaN marks a
        missing sample, or a device without an accelerometer.
    accel_unit : str
        Unit of all accelerometers.

    Examples
    --------
    >>> import numpy as np
    >>> import zerorate as zr
    >>> one = {f"imu1_gyro_{axis}_dps": np.zeros(8) for axis in "xyz"}
    >>> other = {f"imu2_gyro_{axis}_dps": np.ones(8) for axis in "xyz"}
    >>> log = zr.array.array_log(zr.read_recording({"t": np.arange(8) / 100, **one, **other}))
    >>> log
    ArrayLog(2 gyros of 3 axes, 8 samples at 100 Hz, deg/s: imu1, imu2)
    >>> log.data.shape
    (8, 2, 3)
    """

    time: Floats
    rate: float
    data: Floats
    labels: tuple[str, ...]
    unit: str = "unit"
    axes: tuple[str, ...] = _AXES
    meta: Mapping[str, Any] = field(default_factory=dict)
    accel: Floats | None = None
    accel_unit: str = "unit"

    def __post_init__(self) -> None:
        """Check that the parts match."""
        object.__setattr__(self, "rate", check_rate(self.rate))
        n, sensors, axes = len(self.time), len(self.labels), len(self.axes)
        expected = (n, sensors, 3) if axes == 3 else (n, sensors)
        if self.data.shape != expected:
            raise LogError(f"data must have shape {expected}, got {self.data.shape}")
        if self.accel is not None and self.accel.shape != (n, sensors, 3):
            raise LogError(f"accel must have shape {(n, sensors, 3)}, got {self.accel.shape}")
        if len(set(self.labels)) < sensors:
            raise LogError(f"labels must differ, got {', '.join(self.labels)}")

    def __repr__(self) -> str:
        """Return the numbers of sensors and axes, the size, rate, unit and labels."""
        axes = "3 axes" if self.data.ndim == 3 else "1 axis"
        gyros = "gyro" if self.sensors == 1 else "gyros"
        return (
            f"ArrayLog({self.sensors} {gyros} of {axes}, {self.n} samples at {self.rate:g} Hz, "
            f"{self.unit}: {', '.join(self.labels)})"
        )

    @property
    def n(self) -> int:
        """Number of samples of each sensor, including missing samples."""
        return int(self.data.shape[0])

    @property
    def sensors(self) -> int:
        """Number of gyros."""
        return len(self.labels)

    def fused(self, data: Floats) -> Log:
        """Return a log of one fused gyro, with data of shape (n, 3) or (n,)."""
        names = [f"gyro_{axis}" if axis else "gyro" for axis in self.axes]
        return Log.at(self.time, self.rate, data, names, self.unit, self.meta)


def array_log(source: Recording | Log, *, axes: Literal[1, 3] | None = None) -> ArrayLog:
    """Return the gyros of a recording as one array.

    Parameters
    ----------
    source : Recording or Log
        All gyros of a recording are used: ``gyro``, ``gyro_1``, and so on. The channels of a log
        are split into sensors. If a recording has a single gyro, its channels are split in the same
        way. Columns that a user selects with ``columns=`` can therefore become an array.
    axes : {1, 3}, optional
        Axes of each sensor in a split log. Default: three columns in a row are a sensor if their
        names end in x, y, z. Otherwise each column is a gyro with one axis.

    Returns
    -------
    ArrayLog
        The array. Labels come from the channel names, such as ``imu1`` from ``imu1_gyro_x_dps``, or
        else from the names of the logs. Accelerometers with three axes are matched to gyros by
        name. If one of them is not on the gyros' clock, or if their units differ, all
        accelerometers are left out, with a note.

    Raises
    ------
    LogError
        If there is no gyro, or gyros differ in rate, length, clock, unit or number of axes. The
        message names two gyros that differ.

    Examples
    --------
    >>> import numpy as np, zerorate as zr
    >>> table = {"t": np.arange(8) / 100, "a_gyro_z_dps": np.zeros(8), "b_gyro_z_dps": np.ones(8)}
    >>> zr.array.array_log(zr.read_recording(table))
    ArrayLog(2 gyros of 1 axis, 8 samples at 100 Hz, deg/s: a, b)
    """
    sensors = _find_sensors(source, axes)
    first = sensors[0]
    for other in sensors[1:]:
        _check_compatible(first, other)
    data = np.stack([sensor.log.data for sensor in sensors], axis=1)
    letters = _common_axes(sensors)
    notes: list[str] = []
    accelerometers = (
        _match_accelerometers(source, sensors, notes) if isinstance(source, Recording) else {}
    )
    return ArrayLog(
        first.log.sampled,
        first.log.rate,
        np.ascontiguousarray(data if len(letters) == 3 else data[:, :, 0]),
        _choose_labels([sensor.label for sensor in sensors], [sensor.name for sensor in sensors]),
        first.log.unit,
        letters,
        _merge_meta([sensor.log for sensor in sensors], notes),
        **_stack_accelerometers(accelerometers, len(sensors)),
    )


class _Sensor(NamedTuple):
    """A gyro of an array: its name, its label from the channel names, and its log."""

    name: str
    label: str
    log: Log


def _find_sensors(source: Recording | Log, axes: int | None) -> list[_Sensor]:
    if isinstance(source, Log):
        return _split_sensors(source, axes)
    gyros = source.of_kind("gyro")
    logs = {name: log for name, log in source.items() if any(log is gyro for gyro in gyros)}
    if not logs:
        raise LogError(f"{source.source}: there is no gyro")
    if len(logs) == 1:
        return _split_sensors(next(iter(logs.values())), axes)
    return [_Sensor(name, _sensor_label(log.names[0]), log) for name, log in logs.items()]


def _split_sensors(log: Log, axes: int | None) -> list[_Sensor]:
    """Return the sensors that share a log."""
    size = axes or (3 if _has_triads(log.names) else 1)
    if size not in (1, 3):
        raise ArgumentError("axes", f"must be 1 or 3, got {size}")
    if log.channels % size:
        raise LogError(
            f"{log.channels} columns are no sensors of {size} axes each: {', '.join(log.names)}"
        )
    return [_select_channels(log, slice(i, i + size)) for i in range(0, log.channels, size)]


def _select_channels(log: Log, columns: slice) -> _Sensor:
    names, units = log.names[columns], set(log.units[columns])
    if len(units) > 1:
        raise LogError(f"{', '.join(names)}: the axes differ in unit ({', '.join(sorted(units))})")
    part = replace(log, data=log.data[:, columns], names=names, unit=units.pop())
    return _Sensor(split_unit(names[0])[0], _sensor_label(names[0]), part)


def _has_triads(names: Sequence[str]) -> bool:
    """Return True if the names are sensors with three axes each, in the order x, y, z."""
    letters = [_axis_letter(name) for name in names]
    return len(names) % 3 == 0 and letters == list(_AXES) * (len(names) // 3)


def _axis_letter(name: str) -> str:
    """Return the letter of a name's axis, or an empty text."""
    last = to_snake_case(split_unit(name)[0])[-1:]
    return last if last in _AXES else ""


def _common_axes(sensors: Sequence[_Sensor]) -> tuple[str, ...]:
    """Return the common axes of sensors with the same number of axes."""
    if sensors[0].log.channels == 3:
        return _AXES
    letters = {_axis_letter(sensor.log.names[0]) for sensor in sensors}
    return (letters.pop() if len(letters) == 1 else "",)


def _sensor_label(name: str) -> str:
    """Return the label in the name of a channel, such as ``imu1`` in ``imu1_gyro_x_dps``."""
    meaning = meaning_of(name)
    stem = to_snake_case(split_unit(name)[0]) if meaning is None else meaning.sensor
    words = [word for word in stem.split("_") if word and not _is_kind_word(word)]
    return "_".join(words) or stem


def _is_kind_word(word: str) -> bool:
    """Return True if a word only says that the channel belongs to a gyro."""
    return word in ("w", "g", "rate") or (looks_like_gyro(word) and not word[-1].isdigit())


def _choose_labels(sensor_labels: Sequence[str], names: Sequence[str]) -> tuple[str, ...]:
    """Return unique labels: from the channels, else from the names, else numbers."""
    for labels in (sensor_labels, names):
        if len(set(labels)) == len(labels) and all(labels):
            return tuple(labels)
    return tuple(str(i) for i in range(1, len(names) + 1))


def _check_compatible(first: _Sensor, other: _Sensor) -> None:
    """Raise LogError if two sensors cannot be in one array."""
    for what, first_value, other_value in _compare_logs(first.log, other.log):
        if first_value != other_value:
            raise LogError(
                f"the gyros of an array must agree in {what}: {_describe_sensor(first)} "
                f"has {first_value}, "
                f"{_describe_sensor(other)} has {other_value}"
            )
    offset = float(np.abs(first.log.sampled - other.log.sampled).max()) * first.log.rate
    if offset > _MAX_OFFSET_PERIODS:
        raise LogError(
            f"the gyros of an array must be on one clock: {_describe_sensor(other)} is up "
            f"to {offset:.3g} "
            f"samples away from {_describe_sensor(first)}"
        )


def _compare_logs(first: Log, second: Log) -> Iterator[tuple[str, object, object]]:
    """Yield each property in which two logs of an array differ, with both values."""
    yield "unit", first.unit, second.unit
    yield "axes", first.channels, second.channels
    # Two clocks are equal if they differ by less than half a sample over the record.
    drift_samples = abs(first.rate - second.rate) * max(first.n, second.n) / first.rate
    if drift_samples > _MAX_OFFSET_PERIODS:
        yield "rate", f"{first.rate:.9g} Hz", f"{second.rate:.9g} Hz"
    yield "length", f"{first.n} samples", f"{second.n} samples"


def _describe_sensor(sensor: _Sensor) -> str:
    return f"'{sensor.name}' ({', '.join(sensor.log.names)})"


def _match_accelerometers(
    source: Recording, sensors: Sequence[_Sensor], notes: list[str]
) -> dict[int, Log]:
    """Return the accelerometer of each gyro; if they do not match, return none, with the reason."""
    first = sensors[0].log
    logs = {name: log for name, log in source.items() if _is_of_kind(source, log, "accel")}
    if first.channels != 3 or not logs:
        return {}
    gyros = _device_names([(sensor.name, sensor.log) for sensor in sensors])
    owners = dict(zip(gyros, range(len(sensors)), strict=True))
    named = zip(_device_names([*logs.items()]), logs.values(), strict=True)
    accelerometers = {owners[device]: log for device, log in named if device in owners}
    faults = [
        fault
        for log in accelerometers.values()
        if (fault := _explain_mismatch(first, log)) is not None
    ]
    if len({log.unit for log in accelerometers.values()}) > 1:
        faults.append("they differ in unit")
    if faults:
        notes.append(f"the accelerometers are left out: {faults[0]}")
        return {}
    return accelerometers


def _is_of_kind(source: Recording, log: Log, kind: str) -> bool:
    return any(log is other for other in source.of_kind(kind))


def _device_names(logs: Sequence[tuple[str, Log]]) -> list[str]:
    """Return the devices of the logs, from the channel names or else from the logs' names."""
    by_channel = [_device_name(to_snake_case(split_unit(log.names[0])[0])[:-1]) for _, log in logs]
    if len(set(by_channel)) == len(logs):
        return by_channel
    return [_device_name(name) for name, _ in logs]


def _device_name(name: str) -> str:
    return re.sub(r"[^a-z0-9]+", "_", _KIND_WORDS.sub("_", name.lower())).strip("_")


def _explain_mismatch(gyro: Log, log: Log) -> str | None:
    """Return the reason why an accelerometer does not match the gyros; None if it matches."""
    channels = ", ".join(log.names)
    if log.channels != 3:
        return f"{channels} has not three axes"
    if log.unit not in UNITS or UNITS[log.unit].kind != "acceleration":
        return f"the unit of {channels} is not known"
    if (
        log.n != gyro.n
        or np.abs(log.sampled - gyro.sampled).max() * gyro.rate > _MAX_OFFSET_PERIODS
    ):
        return f"{channels} is not on the clock of the gyros"
    return None


def _stack_accelerometers(accelerometers: Mapping[int, Log], sensors: int) -> dict[str, Any]:
    """Return the accelerometer arguments of `ArrayLog`, NaN for devices without accelerometer."""
    if not accelerometers:
        return {}
    first = next(iter(accelerometers.values()))
    accel = np.full((first.n, sensors, 3), np.nan)
    for index, log in accelerometers.items():
        accel[:, index] = log.data
    return {"accel": accel, "accel_unit": first.unit}


def _merge_meta(logs: Sequence[Log], extra_notes: Sequence[str]) -> dict[str, Any]:
    """Return the metadata of the first log, with the notes of all logs."""
    each = (note for log in logs for note in log.meta.get("notes", ()))
    notes = dict.fromkeys((*each, *extra_notes))
    return {**logs[0].meta, "notes": tuple(notes)}
