"""The two sensors that are calibrated: their samples, units and clocks, as the fit takes them."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Final, Literal

import numpy as np
import numpy.typing as npt

from zerorate import units
from zerorate.calibration.fit.wild import wild_samples
from zerorate.faults import given, said
from zerorate.record.log import Log, LogError, present_axes
from zerorate.record.missing import floats
from zerorate.record.named import rate_of, unit_of
from zerorate.record.names import UNKNOWN
from zerorate.record.recording import Recording
from zerorate.types import Booleans, Floats, Integers

Kind = Literal["gyro", "accel"]
Source = str | Log | npt.ArrayLike | None

STANDARD_GRAVITY: Final = 9.80665
"""What is meant by g, m/s^2."""

UNNAMED: Final = "unnamed"
"""Says in the meta of a log that its names are not those of a file."""
_MEASURES: Final = {"gyro": "rate", "accel": "acceleration"}
_CORRECTED: Final = {"gyro": "rad/s", "accel": "m/s^2"}
_EXAMPLE: Final = {"gyro": "'deg/s'", "accel": "'g'"}


@dataclass(frozen=True, eq=False)
class Sensor:
    """Samples of three axes on a uniform clock, in the unit of the fit.

    That is rad/s of a gyro and the local gravity of an accelerometer, or the raw unit where that
    is unknown.

    Parameters
    ----------
    kind
        ``"gyro"`` or ``"accel"``.
    data
        Shape (n, 3), NaN where missing.
    rate, start
        Samples a second, Hz, and time of the first one, s.
    unit
        Of the raw samples.
    factor
        What raw samples were multiplied by; 1 if the unit is unknown.
    known
        Whether the unit is.
    wild
        Samples that are missing because they stood alone in a rest, and what they were, raw unit.
    """

    kind: Kind
    data: Floats
    rate: float
    start: float
    unit: str
    factor: float
    known: bool
    wild: tuple[Integers, Floats]

    @property
    def n(self) -> int:
        """Number of samples."""
        return len(self.data)

    @property
    def units(self) -> tuple[str, str]:
        """Unit of the raw and of the corrected samples."""
        return self.unit, self.unit if self.known else _CORRECTED[self.kind]

    @cached_property
    def missing(self) -> Booleans | None:
        """Which samples lack an axis, shape (n,); None if none does."""
        # A sum is finite only if all its terms are, and costs a tenth of asking each.
        if np.isfinite(self.data.sum()):
            return None
        return np.asarray(~np.isfinite(self.data).all(axis=1))

    def place(self, time: float) -> int:
        """Return the first sample at or after a time, at most n."""
        # Times of a grid are whole periods but for rounding.
        return int(np.clip(np.ceil((time - self.start) * self.rate - 1e-6), 0, self.n))

    def mean(self, first: int, last: int) -> Floats:
        """Return the mean of what is there, shape (3,); NaN if nothing is."""
        part = self.data[first:last]
        if self.missing is not None:
            part = part[~self.missing[first:last]]
        return part.mean(axis=0) if len(part) else np.full(3, np.nan)

    def on(self, other: Sensor, first: int, last: int) -> Floats:
        """Return the samples at the times of another's, missing ones interpolated, shape (k, 3)."""
        same = (self.rate, self.start, self.n) == (other.rate, other.start, other.n)
        if same and (self.missing is None or not self.missing[first:last].any()):
            return self.data[first:last]
        times = other.start + np.arange(first, last) / other.rate
        there = slice(None) if self.missing is None else np.flatnonzero(~self.missing)
        clock = self.start + np.arange(self.n)[there] / self.rate
        return np.stack([np.interp(times, clock, axis[there]) for axis in self.data.T], axis=1)


def sensor(kind: Kind, log: Log, gravity: float) -> Sensor:
    """Return a log as the fit takes it.

    Raises
    ------
    LogError
        If it has not three axes, or its unit is that of something else.
    """
    log = present_axes(log)
    if log.channels != 3:
        raise LogError(
            f"the {kind} must have three axes that hold samples, got {log.channels}: "
            f"{', '.join(log.names)}"
        )
    log = _evened(log)
    factor = _factor(kind, log.unit, gravity)
    data = np.array(log.data) if factor is None else log.data * factor
    if not np.isfinite(data.sum()):
        there = np.isfinite(data).all(axis=1)
        if not there.any():
            raise LogError(f"the {kind} has no sample of all three axes")
        data[~there] = np.nan
    # One of them would make two rests of one, and a turn between them.
    wild = wild_samples(data, resolution(data))
    data[wild] = np.nan
    return Sensor(
        kind=kind,
        data=data,
        rate=log.rate,
        start=float(log.time[0]),
        unit=log.unit,
        factor=1.0 if factor is None else factor,
        known=factor is not None,
        wild=(wild, log.data[wild]),
    )


def _evened(log: Log) -> Log:
    """Return a log on its even clock: one whose clock wanders interpolated between its samples."""
    if log.stamps is None:
        return log
    rate = (log.n - 1) / float(log.stamps[-1] - log.stamps[0])
    even = log.stamps[0] + np.arange(log.n) / rate
    data = np.stack([np.interp(even, log.stamps, axis) for axis in log.data.T], axis=1)
    return Log(even, rate, data, log.names, log.unit, log.meta)


def resolution(data: Floats) -> Floats:
    """Return the step between neighbouring values of each axis, small where it cannot be seen."""
    sizes = np.abs(np.diff(data[: 1 << 16], axis=0))
    steps = np.zeros(3)
    for axis, size in enumerate(sizes.T):
        seen = size[size > 1e-6 * np.nanmax(size, initial=0.0)]
        if seen.size:
            steps[axis] = np.partition(seen, seen.size // 100)[seen.size // 100]
    return steps


def _factor(kind: Kind, unit: str, gravity: float) -> float | None:
    """Return what makes of raw samples those of the fit, None if the unit is not known."""
    try:
        found = units.kind(unit)
    except ValueError:
        return None
    if found != _MEASURES[kind]:
        raise LogError(
            f"the {kind} has the unit {unit}, which is of {found}; expected one of "
            f"{_MEASURES[kind]} such as {_EXAMPLE[kind]}, or 'unit' for one that is not known"
        )
    si = units.convert(1.0, unit, _CORRECTED[kind])
    return si if kind == "gyro" else si / gravity


def chosen(
    recording: Recording | None, gyro: Source, accel: Source, rate: float | None
) -> tuple[Log, Log]:
    """Return the logs of both sensors, as a user has named or given them.

    Raises
    ------
    LogError
        If the recording lacks one, or has several and none was chosen.
    TypeError, ValueError
        If an argument is not as described in `calibrate`.
    """
    if recording is not None and not isinstance(recording, Recording):
        raise TypeError(
            "recording must be a Recording as read_recording gives it, got "
            f"{type(recording).__name__}; zr.read_recording reads files and data frames, and "
            "arrays and logs are given as gyro= and accel="
        )
    if isinstance(gyro, str) and accel is None:
        accel = _partner(gyro, "gyro", "accel", recording)
    elif isinstance(accel, str) and gyro is None:
        gyro = _partner(accel, "accel", "gyro", recording)
    logs = _log("gyro", gyro, recording, rate), _log("accel", accel, recording, rate)
    if all(log.meta.get(UNNAMED) for log in logs) and logs[0].n != logs[1].n:
        raise ValueError(
            f"gyro and accel must have as many samples, got {logs[0].n} and {logs[1].n}: arrays "
            "have one rate= and begin together; sensors of two rates are given as Logs"
        )
    return logs


def _partner(name: str, own: str, other: str, recording: Recording | None) -> str | None:
    """Return the name of the other sensor of the same device, None if there is none."""
    partner = other + name.removeprefix(own)
    return partner if recording is not None and partner in recording else None


def _log(kind: Kind, source: Source, recording: Recording | None, rate: float | None) -> Log:
    if isinstance(source, Log):
        return source
    if source is None or isinstance(source, str):
        if recording is None:
            raise LogError(f"there is no {kind}: give a recording, or {kind}= as a Log or an array")
        return _named(kind, source, recording)
    if rate is None:
        raise ValueError(f"{kind}= is an array, which needs rate= in Hz")
    return _from_array(kind, source, rate_of(rate))


def _named(kind: Kind, name: str | None, recording: Recording) -> Log:
    if name is not None:
        if name not in recording:
            raise LogError(f"there is no '{name}'; the recording has: {', '.join(recording)}")
        return recording[name]
    known = [one for one in recording if one == kind or one.rpartition("_")[0] == kind]
    known = [one for one in known if one == kind or one.rpartition("_")[2].isdigit()]
    if len(known) == 1:
        return recording[known[0]]
    listed = ", ".join(recording)
    if not known:
        told = f"a calibration needs a gyro and an accel; the recording has: {listed}"
        if len(recording) == 1 and recording[listed].channels > 3:
            told += (
                f" of {recording[listed].channels} columns; a first line of names such as "
                "time_s,gx,gy,gz,ax,ay,az tells sensors apart"
            )
        raise LogError(told)
    raise LogError(
        said(
            f"the recording has {len(known)} logs of {kind}: {', '.join(known)}; choose one, such "
            "as ",
            given(kind, known[0], f"{kind}='{known[0]}'"),
        )
    )


def _from_array(kind: Kind, samples: npt.ArrayLike, rate: float) -> Log:
    data = floats(samples, kind)
    if data.ndim != 2 or data.shape[1] != 3 or len(data) == 0:
        raise ValueError(f"{kind} must have shape (n, 3), got {data.shape}")
    names, unit = tuple(f"{kind}_{axis}" for axis in "xyz"), unit_of(None, samples) or UNKNOWN
    return Log(np.arange(len(data)) / rate, rate, data, names, unit, {UNNAMED: True})
