"""The two calibrated sensors: their samples, units and clocks."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Final, Literal

import numpy as np
import numpy.typing as npt

from zerorate import units
from zerorate.calibration.fit.outliers import find_outliers
from zerorate.faults import keyword_argument, make_sentence
from zerorate.record.log import Log, LogError, drop_empty_channels
from zerorate.record.missing import floats
from zerorate.record.named import rate_of, unit_of
from zerorate.record.names import UNKNOWN_UNIT
from zerorate.record.recording import Recording
from zerorate.types import Booleans, Floats, Integers

Kind = Literal["gyro", "accel"]
Source = str | Log | npt.ArrayLike | None

STANDARD_GRAVITY: Final = 9.80665
"""The unit g in m/s^2."""

UNNAMED: Final = "unnamed"
"""Key in a log's meta: its channel names do not come from a file."""
_QUANTITIES: Final = {"gyro": "rate", "accel": "acceleration"}
_CORRECTED_UNITS: Final = {"gyro": "rad/s", "accel": "m/s^2"}
_EXAMPLE_UNITS: Final = {"gyro": "'deg/s'", "accel": "'g'"}


@dataclass(frozen=True, eq=False)
class Sensor:
    """Samples of three axes on a uniform clock, in the unit of the fit.

    This unit is rad/s for a gyro and local gravity for an accelerometer. If the unit of the samples
    is unknown, it is the raw unit.

    Parameters
    ----------
    kind
        ``"gyro"`` or ``"accel"``.
    data
        Samples, shape (n, 3), NaN where missing.
    rate, start
        Sampling rate, Hz, and time of the first sample, s.
    unit
        Unit of the raw samples.
    factor
        Factor from raw samples to the unit of the fit; 1 if the unit is unknown.
    known
        True if the unit is known.
    outliers
        Indices of samples removed as outliers at rest, and their raw values.
    """

    kind: Kind
    data: Floats
    rate: float
    start: float
    unit: str
    factor: float
    known: bool
    outliers: tuple[Integers, Floats]

    @property
    def n(self) -> int:
        """Number of samples."""
        return len(self.data)

    @property
    def units(self) -> tuple[str, str]:
        """Unit of the raw and of the corrected samples."""
        return self.unit, self.unit if self.known else _CORRECTED_UNITS[self.kind]

    @cached_property
    def missing(self) -> Booleans | None:
        """Mask of samples with a missing axis, shape (n,); None if there are none."""
        # A sum is finite only if all its terms are; testing the sum takes a tenth of the time.
        if np.isfinite(self.data.sum()):
            return None
        return np.asarray(~np.isfinite(self.data).all(axis=1))

    def index_at(self, time: float) -> int:
        """Return the index of the first sample at or after a time, at most n."""
        # Grid times are whole periods apart from rounding errors.
        return int(np.clip(np.ceil((time - self.start) * self.rate - 1e-6), 0, self.n))

    def mean(self, first: int, last: int) -> Floats:
        """Return the mean of the present samples, shape (3,); NaN if there are none."""
        part = self.data[first:last]
        if self.missing is not None:
            part = part[~self.missing[first:last]]
        return part.mean(axis=0) if len(part) else np.full(3, np.nan)

    def resample_at(self, other: Sensor, first: int, last: int) -> Floats:
        """Return the samples interpolated at the times of another sensor, shape (k, 3)."""
        same = (self.rate, self.start, self.n) == (other.rate, other.start, other.n)
        if same and (self.missing is None or not self.missing[first:last].any()):
            return self.data[first:last]
        times = other.start + np.arange(first, last) / other.rate
        present = slice(None) if self.missing is None else np.flatnonzero(~self.missing)
        clock = self.start + np.arange(self.n)[present] / self.rate
        return np.stack([np.interp(times, clock, axis[present]) for axis in self.data.T], axis=1)


def prepare_sensor(kind: Kind, log: Log, gravity: float) -> Sensor:
    """Return a log as a `Sensor` for the fit.

    Raises
    ------
    LogError
        If the log does not have three axes, or its unit is not one of this sensor.
    """
    log = drop_empty_channels(log)
    if log.channels != 3:
        raise LogError(
            f"the {kind} must have three axes that hold samples, got {log.channels}: "
            f"{', '.join(log.names)}"
        )
    log = _resample_evenly(log)
    factor = _unit_factor(kind, log.unit, gravity)
    data = np.array(log.data) if factor is None else log.data * factor
    if not np.isfinite(data.sum()):
        complete = np.isfinite(data).all(axis=1)
        if not complete.any():
            raise LogError(f"the {kind} has no sample of all three axes")
        data[~complete] = np.nan
    # An outlier would split a rest in two, with a rotation between them.
    outliers = find_outliers(data, resolution(data))
    data[outliers] = np.nan
    return Sensor(
        kind=kind,
        data=data,
        rate=log.rate,
        start=float(log.time[0]),
        unit=log.unit,
        factor=1.0 if factor is None else factor,
        known=factor is not None,
        outliers=(outliers, log.data[outliers]),
    )


def _resample_evenly(log: Log) -> Log:
    """Return a log on an even clock, interpolated if its clock wanders."""
    if log.stamps is None:
        return log
    rate = (log.n - 1) / float(log.stamps[-1] - log.stamps[0])
    even = log.stamps[0] + np.arange(log.n) / rate
    data = np.stack([np.interp(even, log.stamps, axis) for axis in log.data.T], axis=1)
    return Log(even, rate, data, log.names, log.unit, log.meta)


def resolution(data: Floats) -> Floats:
    """Return the step between neighbouring values of each axis, small if it is not visible."""
    sizes = np.abs(np.diff(data[: 1 << 16], axis=0))
    steps = np.zeros(3)
    for axis, size in enumerate(sizes.T):
        nonzero = size[size > 1e-6 * np.nanmax(size, initial=0.0)]
        if nonzero.size:
            steps[axis] = np.partition(nonzero, nonzero.size // 100)[nonzero.size // 100]
    return steps


def _unit_factor(kind: Kind, unit: str, gravity: float) -> float | None:
    """Return the factor from raw samples to the unit of the fit, None if the unit is unknown."""
    try:
        quantity = units.kind(unit)
    except ValueError:
        return None
    if quantity != _QUANTITIES[kind]:
        raise LogError(
            f"the {kind} has the unit {unit}, which is of {quantity}; expected one of "
            f"{_QUANTITIES[kind]} such as {_EXAMPLE_UNITS[kind]}, or 'unit' for one that "
            "is not known"
        )
    si = units.convert(1.0, unit, _CORRECTED_UNITS[kind])
    return si if kind == "gyro" else si / gravity


def choose_logs(
    recording: Recording | None, gyro: Source, accel: Source, rate: float | None
) -> tuple[Log, Log]:
    """Return the logs of both sensors from a user's names or data.

    Raises
    ------
    LogError
        If the recording lacks a sensor, or has several and none was chosen.
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
        accel = _find_partner(gyro, "gyro", "accel", recording)
    elif isinstance(accel, str) and gyro is None:
        gyro = _find_partner(accel, "accel", "gyro", recording)
    logs = _select_log("gyro", gyro, recording, rate), _select_log("accel", accel, recording, rate)
    if all(log.meta.get(UNNAMED) for log in logs) and logs[0].n != logs[1].n:
        raise ValueError(
            f"gyro and accel must have as many samples, got {logs[0].n} and {logs[1].n}: arrays "
            "have one rate= and begin together; sensors of two rates are given as Logs"
        )
    return logs


def _find_partner(name: str, own: str, other: str, recording: Recording | None) -> str | None:
    """Return the name of the other sensor of the same device, None if there is none."""
    partner = other + name.removeprefix(own)
    return partner if recording is not None and partner in recording else None


def _select_log(kind: Kind, source: Source, recording: Recording | None, rate: float | None) -> Log:
    if isinstance(source, Log):
        return source
    if source is None or isinstance(source, str):
        if recording is None:
            raise LogError(f"there is no {kind}: give a recording, or {kind}= as a Log or an array")
        return _find_log(kind, source, recording)
    if rate is None:
        raise ValueError(f"{kind}= is an array, which needs rate= in Hz")
    return _log_from_array(kind, source, rate_of(rate))


def _find_log(kind: Kind, name: str | None, recording: Recording) -> Log:
    if name is not None:
        if name not in recording:
            raise LogError(f"there is no '{name}'; the recording has: {', '.join(recording)}")
        return recording[name]
    candidates = [
        candidate
        for candidate in recording
        if candidate == kind or candidate.rpartition("_")[0] == kind
    ]
    candidates = [
        candidate
        for candidate in candidates
        if candidate == kind or candidate.rpartition("_")[2].isdigit()
    ]
    if len(candidates) == 1:
        return recording[candidates[0]]
    listed = ", ".join(recording)
    if not candidates:
        message = f"a calibration needs a gyro and an accel; the recording has: {listed}"
        if len(recording) == 1 and recording[listed].channels > 3:
            message += (
                f" of {recording[listed].channels} columns; a first line of names such as "
                "time_s,gx,gy,gz,ax,ay,az distinguishes the sensors"
            )
        raise LogError(message)
    raise LogError(
        make_sentence(
            f"the recording has {len(candidates)} logs of {kind}: {', '.join(candidates)}; "
            "choose one, such "
            "as ",
            keyword_argument(kind, candidates[0], f"{kind}='{candidates[0]}'"),
        )
    )


def _log_from_array(kind: Kind, samples: npt.ArrayLike, rate: float) -> Log:
    data = floats(samples, kind)
    if data.ndim != 2 or data.shape[1] != 3 or len(data) == 0:
        raise ValueError(f"{kind} must have shape (n, 3), got {data.shape}")
    names, unit = tuple(f"{kind}_{axis}" for axis in "xyz"), unit_of(None, samples) or UNKNOWN_UNIT
    return Log(np.arange(len(data)) / rate, rate, data, names, unit, {UNNAMED: True})
