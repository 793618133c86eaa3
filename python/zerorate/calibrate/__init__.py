"""Calibration: what is deterministic in an inertial sensor, with its errors, and its removal."""

from zerorate.calibrate.calibration import Calibration, Rest, SensorCalibration, Turn

__all__ = ["Calibration", "Rest", "SensorCalibration", "Turn"]
