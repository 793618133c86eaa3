"""Corrections of a recording's sensors: calibrations or calibration files."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TypeAlias, overload

from zerorate.calibration.calibration import Calibration
from zerorate.calibration.magnetometer import MagnetometerCalibration
from zerorate.record.log import LogError
from zerorate.record.recording import Recording

_Path: TypeAlias = str | os.PathLike[str]


def correction_of(
    calibration: Calibration | _Path | None,
    magnetometer: MagnetometerCalibration | _Path | None = None,
    **names: str | None,
) -> Callable[[Recording], Recording] | None:
    """Return the function that corrects a recording; None without calibrations.

    Parameters
    ----------
    calibration : Calibration or path, optional
        Calibration of gyro and accelerometer.
    magnetometer : MagnetometerCalibration or path, optional
        Calibration of the magnetometer's hard and soft iron.
    **names
        Names of the logs ``gyro`` and ``accel``; None for the default logs.

    Raises
    ------
    LogError
        If a file contains no calibration.
    OSError
        If a file cannot be read.
    """
    imu = calibration_of(calibration)
    field = _magnetometer_of(magnetometer)
    if imu is None and field is None:
        return None
    logs = {kind: name for kind, name in names.items() if name is not None}

    def correct(recording: Recording) -> Recording:
        corrected = recording if imu is None else imu.apply(recording, **logs)
        result = corrected if field is None else field.apply(corrected)
        assert isinstance(result, Recording)
        return result

    return correct


@overload
def calibration_of(calibration: Calibration | _Path) -> Calibration: ...
@overload
def calibration_of(calibration: Calibration | _Path | None) -> Calibration | None: ...
def calibration_of(calibration: Calibration | _Path | None) -> Calibration | None:
    """Return a calibration; read it if the argument is a path."""
    if calibration is None or isinstance(calibration, Calibration):
        return calibration
    with _as_log_errors():
        return Calibration.from_json(calibration)


def _magnetometer_of(
    calibration: MagnetometerCalibration | _Path | None,
) -> MagnetometerCalibration | None:
    if calibration is None or isinstance(calibration, MagnetometerCalibration):
        return calibration
    with _as_log_errors():
        return MagnetometerCalibration.from_json(calibration)


@contextmanager
def _as_log_errors() -> Iterator[None]:
    """Turn errors of a calibration's file into LogError."""
    try:
        yield
    except ValueError as error:
        raise LogError(str(error)) from None
