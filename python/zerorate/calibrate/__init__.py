"""Calibration: what is deterministic in an inertial sensor, with its errors, and its removal."""

from zerorate.calibrate.calibrate import CalibrationError, calibrate
from zerorate.calibrate.calibration import Calibration, Rest, SensorCalibration, Turn
from zerorate.calibrate.rests import find_rests

__all__ = [
    "Calibration",
    "CalibrationError",
    "Rest",
    "SensorCalibration",
    "Turn",
    "calibrate",
    "find_rests",
]
