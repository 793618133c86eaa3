"""Samples of gyro, accelerometer and magnetometer on the clock of the gyro, in SI."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from zerorate.faults import keyword_argument, make_sentence
from zerorate.record import Log, LogError, Recording
from zerorate.record.log import notes_of
from zerorate.types import Floats
from zerorate.units import UNITS, convert

_LATE_TOLERANCE = 0.01
"""Largest delay of a sample that is still assigned to the gyro sample before it, periods."""


@dataclass(frozen=True, eq=False)
class Samples:
    """Samples of the sensors of one body at the times of its gyro.

    Attributes
    ----------
    gyro, accel : ndarray, shape (n, 3)
        Angular rates, rad/s, and specific forces, m/s^2; NaN where missing.
    mag : ndarray, shape (n, 3), or None
        Magnetic field in its own unit; NaN where missing.
    log : Log
        Log of the gyro, with the clock of all samples.
    dt : ndarray, shape (n,), or None
        Time since the previous sample, s; None if it is always one period.
    notes : tuple of str
        Sentences on clocks and on omitted samples.
    """

    gyro: Floats
    accel: Floats
    mag: Floats | None
    log: Log
    dt: Floats | None
    notes: tuple[str, ...]

    @classmethod
    def of(
        cls,
        recording: Recording,
        gyro: str = "gyro",
        accel: str | None = None,
        mag: bool = True,
        what: str = "an attitude",
    ) -> Samples:
        """Return the samples of a recording.

        Samples are not interpolated, and no sample appears before its time. A sample on another
        clock is assigned to the first gyro sample at or after it. If several are assigned to the
        same gyro sample, the last is used.

        Parameters
        ----------
        recording : Recording
            Recording with logs of three axes each.
        gyro, accel : str
            Names of the sensors. Default for the accelerometer: from the gyro's device, or the only
            one.
        mag : bool
            Use a magnetometer if there is one.
        what : str
            Task that needs the sensors, for messages.

        Raises
        ------
        LogError
            If gyro or accelerometer is missing, does not have three axes, has no sample, or has no
            known unit.
        """
        rates = _select_sensor(recording, gyro, "rate", "rad/s", what)
        forces = _select_sensor(
            recording,
            accel or partner_name(recording, gyro, "accel"),
            "acceleration",
            "m/s^2",
            what,
        )
        field = _select_magnetometer(recording, gyro) if mag else None
        logs = [forces] if field is None else [forces, field]
        aligned = [_align_to_clock(log, rates) for log in logs]
        notes = [*recording.notes, *(note for log in (rates, *logs) for note in notes_of(log))]
        for log, (_, lost) in zip(logs, aligned, strict=True):
            notes.extend(_describe_clock(log, rates, lost))
        return cls(
            rates.data,
            aligned[0][0],
            None if field is None else aligned[1][0],
            rates,
            rates.steps,
            tuple(dict.fromkeys(notes)),
        )

    @property
    def time(self) -> Floats:
        """Time of each sample, s, shape (n,)."""
        return self.log.sampled

    def align(self, log: Log) -> Floats:
        """Return another log's samples at the times of the gyro, in the log's own unit."""
        return _align_to_clock(log, self.log)[0]


def _select_sensor(recording: Recording, name: str, kind: str, unit: str, what: str) -> Log:
    """Return a log of three axes in SI."""
    sensor = "a gyro" if kind == "rate" else "an accelerometer"
    if name not in recording:
        listed = ", ".join(recording) or "nothing"
        raise LogError(f"{what} needs {sensor}; there is no {name}, the recording has: {listed}")
    log = recording[name]
    _check_axes(log, sensor, what)
    if log.unit not in UNITS or UNITS[log.unit].kind != kind:
        raise LogError(
            make_sentence(
                f"{', '.join(log.names)}: {what} needs {sensor} of a known unit, got "
                f"'{log.unit}'; give ",
                keyword_argument("unit"),
            )
        )
    data = convert(log.data, log.unit, unit)
    return replace(log, data=data, unit=unit)


def partner_name(recording: Recording, gyro: str, kind: str) -> str:
    """Return the sensor of a kind with the gyro's number, or else the first of the kind."""
    own_name = gyro.replace("gyro", kind, 1)
    return own_name if own_name in recording else kind


def _check_axes(log: Log, sensor: str, what: str = "an attitude") -> None:
    if log.channels != 3:
        raise LogError(
            f"{', '.join(log.names)}: {what} needs {sensor} of three axes, got {log.channels}"
        )
    if not np.isfinite(log.data).all(axis=1).any():
        raise LogError(f"{', '.join(log.names)}: no sample has all three axes")


def _select_magnetometer(recording: Recording, gyro: str) -> Log | None:
    """Return the magnetometer of the gyro's device, or else the first; None if there is none."""
    log = recording.get(partner_name(recording, gyro, "mag"))
    if log is not None:
        _check_axes(log, "a magnetometer")
    return log


def _is_same_clock(log: Log, other: Log) -> bool:
    return log.n == other.n and bool(np.array_equal(log.sampled, other.sampled))


def _align_to_clock(log: Log, clock: Log) -> tuple[Floats, int]:
    """Return a log's samples at the times of a clock, and the number of samples without a match."""
    if _is_same_clock(log, clock):
        return log.data, 0
    rows = np.searchsorted(clock.sampled, log.sampled - _LATE_TOLERANCE / clock.rate)
    late = log.sampled - clock.sampled[0] < -1.0 / clock.rate
    valid = (rows < clock.n) & ~late & np.isfinite(log.data).all(axis=1)
    values = np.full((clock.n, log.channels), np.nan)
    # NumPy keeps the last of several samples with the same index.
    values[rows[valid]] = log.data[valid]
    return values, int(valid.sum() - np.unique(rows[valid]).size)


def _describe_clock(log: Log, clock: Log, lost: int) -> Iterator[str]:
    if _is_same_clock(log, clock):
        return
    yield (
        f"{', '.join(log.names)}: {log.rate:.4g} Hz on a clock of their own, each sample taken at "
        f"the next one of the gyro ({clock.rate:.4g} Hz)"
        + (f"; {lost} that a later one came with left out" if lost else "")
    )
