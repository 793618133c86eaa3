"""Logs of arrays: the gyros of one body side by side, on one clock and in one unit."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, Final, Literal, NamedTuple

import numpy as np

from zerorate.faults import ArgumentError
from zerorate.record.log import Log, LogError, checked_rate
from zerorate.record.names import looks_like_gyro, meaning_of, plain, split_unit
from zerorate.record.recording import Recording
from zerorate.types import Floats
from zerorate.units import UNITS

_AXES: Final = ("x", "y", "z")
_APART: Final = 0.5
"""Periods by which clocks may differ and still be one."""
_KIND_WORDS: Final = re.compile(
    r"gyroscope|gyrometer|gyro|gyr|accelerometer|acceleration|accel|acc"
    r"|(?<![a-z])(?:g|a|w|f|rate)(?![a-z])"
)
"""Words that say gyro or accelerometer, and not of which device."""


@dataclass(frozen=True, eq=False)
class ArrayLog:
    """N gyros of one body, recorded side by side.

    Parameters
    ----------
    time : ndarray, shape (n,)
        Seconds, uniform.
    rate : float
        Samples per second, Hz.
    data : ndarray, shape (n, N, 3) or (n, N)
        In ``unit``, three axes or one of each sensor, in the sensor's own axes; NaN marks a missing
        sample.
    labels : tuple of str
        One a sensor, all different.
    unit : str
        Of all sensors.
    axes : tuple of str
        ``("x", "y", "z")``; of one axis its letter, or nothing where it is not known.
    meta : mapping
        As of `zerorate.Log`.
    accel : ndarray, shape (n, N, 3), or None
        Accelerometers of the same devices in ``accel_unit``, in the sensors' own axes; NaN marks a
        missing sample, or a device without one.
    accel_unit : str
        Of all accelerometers.

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
        """Check that the parts agree."""
        object.__setattr__(self, "rate", checked_rate(self.rate))
        n, sensors, axes = len(self.time), len(self.labels), len(self.axes)
        expected = (n, sensors, 3) if axes == 3 else (n, sensors)
        if self.data.shape != expected:
            raise LogError(f"data must have shape {expected}, got {self.data.shape}")
        if self.accel is not None and self.accel.shape != (n, sensors, 3):
            raise LogError(f"accel must have shape {(n, sensors, 3)}, got {self.accel.shape}")
        if len(set(self.labels)) < sensors:
            raise LogError(f"labels must differ, got {', '.join(self.labels)}")

    def __repr__(self) -> str:
        """Return the number of sensors and axes, the size, rate, unit and labels."""
        axes = "3 axes" if self.data.ndim == 3 else "1 axis"
        gyros = "gyro" if self.sensors == 1 else "gyros"
        return (
            f"ArrayLog({self.sensors} {gyros} of {axes}, {self.n} samples at {self.rate:g} Hz, "
            f"{self.unit}: {', '.join(self.labels)})"
        )

    @property
    def n(self) -> int:
        """Number of samples of each sensor, missing ones included."""
        return int(self.data.shape[0])

    @property
    def sensors(self) -> int:
        """Number of gyros."""
        return len(self.labels)

    def fused(self, data: Floats) -> Log:
        """Return the log of one gyro in the place of all, of shape (n, 3) or (n,)."""
        names = [f"gyro_{axis}" if axis else "gyro" for axis in self.axes]
        return Log.at(self.time, self.rate, data, names, self.unit, self.meta)


def array_log(source: Recording | Log, *, axes: Literal[1, 3] | None = None) -> ArrayLog:
    """Return the gyros of a recording as one array.

    Parameters
    ----------
    source : Recording or Log
        All gyros of a recording count, ``gyro``, ``gyro_1``, and so on. Of a log, or of a recording
        with a single gyro, the channels are taken apart: that is how columns of a user's own
        choice, ``columns=``, become an array.
    axes : {1, 3}, optional
        Axes of each sensor in a log that is taken apart. By default three columns in a row are a
        sensor if their names say x, y, z, and else each is a gyro of one axis.

    Returns
    -------
    ArrayLog
        Labels are what names say of a sensor, ``imu1`` of ``imu1_gyro_x_dps``; else the names of
        the logs. Accelerometers of three axes go with the gyros that their names belong to; they
        are left out, with a note, where they are not on the clock of the gyros, or not of one unit.

    Raises
    ------
    LogError
        If there is no gyro, or they differ in rate, length, clock, unit or number of axes: the
        message names two that do.

    Examples
    --------
    >>> import numpy as np, zerorate as zr
    >>> table = {"t": np.arange(8) / 100, "a_gyro_z_dps": np.zeros(8), "b_gyro_z_dps": np.ones(8)}
    >>> zr.array.array_log(zr.read_recording(table))
    ArrayLog(2 gyros of 1 axis, 8 samples at 100 Hz, deg/s: a, b)
    """
    found = _sensors(source, axes)
    first = found[0]
    for other in found[1:]:
        _check_alike(first, other)
    data = np.stack([sensor.log.data for sensor in found], axis=1)
    letters = _letters(found)
    told: list[str] = []
    beside = _accelerometers(source, found, told) if isinstance(source, Recording) else {}
    return ArrayLog(
        first.log.sampled,
        first.log.rate,
        np.ascontiguousarray(data if len(letters) == 3 else data[:, :, 0]),
        _labels([sensor.label for sensor in found], [sensor.name for sensor in found]),
        first.log.unit,
        letters,
        _meta([sensor.log for sensor in found], told),
        **_stacked(beside, len(found)),
    )


class _Sensor(NamedTuple):
    """A gyro of an array: its name, what the names of its channels say of it, and its log."""

    name: str
    label: str
    log: Log


def _sensors(source: Recording | Log, axes: int | None) -> list[_Sensor]:
    if isinstance(source, Log):
        return _taken_apart(source, axes)
    gyros = source.of_kind("gyro")
    logs = {name: log for name, log in source.items() if any(log is gyro for gyro in gyros)}
    if not logs:
        raise LogError(f"{source.source}: there is no gyro")
    if len(logs) == 1:
        return _taken_apart(next(iter(logs.values())), axes)
    return [_Sensor(name, _label(log.names[0]), log) for name, log in logs.items()]


def _taken_apart(log: Log, axes: int | None) -> list[_Sensor]:
    """Return the sensors that share a log."""
    size = axes or (3 if _in_threes(log.names) else 1)
    if size not in (1, 3):
        raise ArgumentError("axes", f"must be 1 or 3, got {size}")
    if log.channels % size:
        raise LogError(
            f"{log.channels} columns are no sensors of {size} axes each: {', '.join(log.names)}"
        )
    return [_part(log, slice(i, i + size)) for i in range(0, log.channels, size)]


def _part(log: Log, place: slice) -> _Sensor:
    names, units = log.names[place], set(log.units[place])
    if len(units) > 1:
        raise LogError(f"{', '.join(names)}: the axes differ in unit ({', '.join(sorted(units))})")
    part = replace(log, data=log.data[:, place], names=names, unit=units.pop())
    return _Sensor(split_unit(names[0])[0], _label(names[0]), part)


def _in_threes(names: Sequence[str]) -> bool:
    """Whether names tell of sensors with three axes, in the order x, y, z."""
    letters = [_axis(name) for name in names]
    return len(names) % 3 == 0 and letters == list(_AXES) * (len(names) // 3)


def _axis(name: str) -> str:
    """Return the letter of a name's axis, nothing for none."""
    last = plain(split_unit(name)[0])[-1:]
    return last if last in _AXES else ""


def _letters(found: Sequence[_Sensor]) -> tuple[str, ...]:
    """Return the axes of sensors that agree in their number."""
    if found[0].log.channels == 3:
        return _AXES
    letters = {_axis(sensor.log.names[0]) for sensor in found}
    return (letters.pop() if len(letters) == 1 else "",)


def _label(name: str) -> str:
    """Return what the name of a channel says of its sensor: ``imu1`` of ``imu1_gyro_x_dps``."""
    meaning = meaning_of(name)
    stem = plain(split_unit(name)[0]) if meaning is None else meaning.sensor
    words = [word for word in stem.split("_") if word and not _tells_kind(word)]
    return "_".join(words) or stem


def _tells_kind(word: str) -> bool:
    """Whether a word says that it is of a gyro, and nothing else."""
    return word in ("w", "g", "rate") or (looks_like_gyro(word) and not word[-1].isdigit())


def _labels(told: Sequence[str], names: Sequence[str]) -> tuple[str, ...]:
    """Return labels that differ: what names say, else the names, else numbers."""
    for labels in (told, names):
        if len(set(labels)) == len(labels) and all(labels):
            return tuple(labels)
    return tuple(str(i) for i in range(1, len(names) + 1))


def _check_alike(first: _Sensor, other: _Sensor) -> None:
    """Raise LogError unless two sensors can stand side by side."""
    for what, one, two in _compared(first.log, other.log):
        if one != two:
            raise LogError(
                f"the gyros of an array must agree in {what}: {_called(first)} has {one}, "
                f"{_called(other)} has {two}"
            )
    apart = float(np.abs(first.log.sampled - other.log.sampled).max()) * first.log.rate
    if apart > _APART:
        raise LogError(
            f"the gyros of an array must be on one clock: {_called(other)} is up to {apart:.3g} "
            f"samples away from {_called(first)}"
        )


def _compared(one: Log, two: Log) -> Iterator[tuple[str, object, object]]:
    """Yield what two logs of an array must have in common, and what each has."""
    yield "unit", one.unit, two.unit
    yield "axes", one.channels, two.channels
    # Rates that differ by less than half a sample over the record are of one clock.
    drift = abs(one.rate - two.rate) * max(one.n, two.n) / one.rate
    if drift > _APART:
        yield "rate", f"{one.rate:.9g} Hz", f"{two.rate:.9g} Hz"
    yield "length", f"{one.n} samples", f"{two.n} samples"


def _called(sensor: _Sensor) -> str:
    return f"'{sensor.name}' ({', '.join(sensor.log.names)})"


def _accelerometers(source: Recording, found: Sequence[_Sensor], told: list[str]) -> dict[int, Log]:
    """Return the accelerometers by the places of their gyros; none, and why, if they do not fit."""
    first = found[0].log
    logs = {name: log for name, log in source.items() if _is_of(source, log, "accel")}
    if first.channels != 3 or not logs:
        return {}
    gyros = _devices([(sensor.name, sensor.log) for sensor in found])
    owners = dict(zip(gyros, range(len(found)), strict=True))
    named = zip(_devices([*logs.items()]), logs.values(), strict=True)
    beside = {owners[device]: log for device, log in named if device in owners}
    faults = [fault for log in beside.values() if (fault := _why_not(first, log)) is not None]
    if len({log.unit for log in beside.values()}) > 1:
        faults.append("they differ in unit")
    if faults:
        told.append(f"the accelerometers are left out: {faults[0]}")
        return {}
    return beside


def _is_of(source: Recording, log: Log, kind: str) -> bool:
    return any(log is other for other in source.of_kind(kind))


def _devices(logs: Sequence[tuple[str, Log]]) -> list[str]:
    """Return what names of channels say of a log's device, else what the names of logs say."""
    by_channel = [_device(plain(split_unit(log.names[0])[0])[:-1]) for _, log in logs]
    if len(set(by_channel)) == len(logs):
        return by_channel
    return [_device(name) for name, _ in logs]


def _device(name: str) -> str:
    return re.sub(r"[^a-z0-9]+", "_", _KIND_WORDS.sub("_", name.lower())).strip("_")


def _why_not(gyro: Log, log: Log) -> str | None:
    """Return why an accelerometer cannot stand beside the gyros, None if it can."""
    called = ", ".join(log.names)
    if log.channels != 3:
        return f"{called} has not three axes"
    if log.unit not in UNITS or UNITS[log.unit].kind != "acceleration":
        return f"the unit of {called} is not known"
    if log.n != gyro.n or np.abs(log.sampled - gyro.sampled).max() * gyro.rate > _APART:
        return f"{called} is not on the clock of the gyros"
    return None


def _stacked(beside: Mapping[int, Log], sensors: int) -> dict[str, Any]:
    """Return the arguments of an array's log for its accelerometers, NaN where there is none."""
    if not beside:
        return {}
    one = next(iter(beside.values()))
    accel = np.full((one.n, sensors, 3), np.nan)
    for place, log in beside.items():
        accel[:, place] = log.data
    return {"accel": accel, "accel_unit": one.unit}


def _meta(logs: Sequence[Log], told: Sequence[str]) -> dict[str, Any]:
    """Return the metadata of the first log, with the notes of all."""
    each = (note for log in logs for note in log.meta.get("notes", ()))
    notes = dict.fromkeys((*each, *told))
    return {**logs[0].meta, "notes": tuple(notes)}
