"""Samples of an IMU on the clock of its gyro, as input of attitude filters."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from zerorate.geometry.rotations import from_matrices
from zerorate.record import Log, LogError
from zerorate.tasks.compare.trial import Trial, align_to_gyros
from zerorate.types import Floats
from zerorate.units import UNITS, convert


@dataclass(frozen=True, eq=False)
class Imu:
    """Samples of three sensors on one clock.

    Attributes
    ----------
    rate : float
        Samples of the gyro per second, Hz.
    gyro, accel : ndarray, shape (n, 3)
        Angular rates, rad/s, and specific forces, m/s^2; NaN where missing.
    mag : ndarray, shape (n, 3), or None
        Magnetic field in any unit; NaN where missing.
    accel_rate, mag_rate : float
        Samples per second of accelerometer and magnetometer, Hz.
    """

    rate: float
    gyro: Floats
    accel: Floats
    mag: Floats | None
    accel_rate: float
    mag_rate: float

    @classmethod
    def of(cls, trial: Trial) -> Imu:
        """Return the samples of a trial.

        Samples are not interpolated: a sample on another clock is moved to the nearest gyro sample.

        Raises
        ------
        LogError
            If there is no accelerometer with a known unit, or not exactly one gyro with three axes.
        """
        gyro, mag = trial.log, trial.mag
        if gyro.channels != 3:
            raise LogError(
                f"{trial.source}: an attitude needs three gyros, got {', '.join(gyro.names)}"
            )
        if trial.accel is None:
            raise LogError(f"{trial.source}: an attitude needs an accelerometer of three axes")
        accel = _to_si(trial.source, trial.accel)
        _check_samples(trial.source, accel)
        if mag is not None:
            _check_samples(trial.source, mag)
        return cls(
            gyro.rate,
            gyro.data,
            align_to_gyros(accel, gyro),
            None if mag is None else align_to_gyros(mag, gyro),
            min(accel.rate, gyro.rate),
            gyro.rate if mag is None else min(mag.rate, gyro.rate),
        )

    def six_axes(self) -> Imu:
        """Return the samples without a magnetometer."""
        return replace(self, mag=None)

    def fill_missing(self) -> Imu:
        """Return samples without gaps, for filters that do not accept missing samples.

        A missing gyro sample repeats the sample before, or is zero at the beginning. A missing
        accelerometer or magnetometer sample becomes a zero vector, which these filters ignore.
        """
        mag = None if self.mag is None else _fill_zeros(self.mag)
        return replace(self, gyro=_hold_last(self.gyro), accel=_fill_zeros(self.accel), mag=mag)

    def first_orientation(self) -> Floats:
        """Return the orientation at the first samples, from sensor to east, north, up.

        Without a magnetometer, the heading is arbitrary.
        """
        up = _first_direction(self.accel)
        north = (
            np.eye(3)[int(np.argmin(np.abs(up)))]
            if self.mag is None
            else _first_direction(self.mag)
        )
        east = np.cross(north, up)
        east /= np.linalg.norm(east)
        start: Floats = from_matrices(np.array([[east, np.cross(up, east), up]]))[0]
        return start


def _to_si(source: str, accel: Log) -> Log:
    if accel.unit not in UNITS or UNITS[accel.unit].kind != "acceleration":
        raise LogError(
            f"{source}: an attitude needs an accelerometer of a known unit, got '{accel.unit}'"
        )
    return replace(accel, data=convert(accel.data, accel.unit, "m/s^2"), unit="m/s^2")


def _check_samples(source: str, log: Log) -> None:
    complete = np.isfinite(log.data).all(axis=1) & log.data.any(axis=1)
    if not complete.any():
        raise LogError(f"{source}: {', '.join(log.names)}: no sample is there in all axes")


def _first_direction(values: Floats) -> Floats:
    """Return the direction of the first nonzero sample."""
    rows = values[np.isfinite(values).all(axis=1)]
    lengths = np.linalg.norm(rows, axis=1)
    index = int(np.argmax(lengths > 0.0))
    first: Floats = rows[index] / lengths[index]
    return first


def _fill_zeros(values: Floats) -> Floats:
    return np.where(np.isfinite(values).all(axis=1, keepdims=True), values, 0.0)


def _hold_last(values: Floats) -> Floats:
    complete = np.isfinite(values).all(axis=1)
    last = np.cumsum(complete)
    filled: Floats = np.concatenate((np.zeros((1, 3)), values[complete]))[last]
    return filled
