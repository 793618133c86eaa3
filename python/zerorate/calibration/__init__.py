"""Calibration of inertial sensors: scale, misalignment and bias, their errors, and correction."""

from typing import TYPE_CHECKING, Final

from zerorate.calibration.calibrate import calibrate
from zerorate.calibration.errors import CalibrationError
from zerorate.lazy import lazy_exports

if TYPE_CHECKING:
    from zerorate.calibration.calibration import Calibration, SensorCalibration
    from zerorate.calibration.comparison import (
        CalibrationComparison,
        MovedParameter,
        compare_calibrations,
    )
    from zerorate.calibration.fit.rests import find_rests
    from zerorate.calibration.magnet.calibrate import calibrate_magnetometer
    from zerorate.calibration.magnetometer import IronGroup, MagnetometerCalibration
    from zerorate.calibration.rate.angle import Integrated, integrate
    from zerorate.calibration.rate.rate_table import RateTable, RateTableAxis, calibrate_rate_table
    from zerorate.calibration.rate.reference import FittedRate, fit_rate
    from zerorate.calibration.record import Origin, Rest, Turn
    from zerorate.calibration.temperature import TemperatureBias, TemperatureModel

__all__ = [
    "Calibration",
    "CalibrationComparison",
    "CalibrationError",
    "FittedRate",
    "Integrated",
    "IronGroup",
    "MagnetometerCalibration",
    "MovedParameter",
    "Origin",
    "RateTable",
    "RateTableAxis",
    "Rest",
    "SensorCalibration",
    "TemperatureBias",
    "TemperatureModel",
    "Turn",
    "calibrate",
    "calibrate_magnetometer",
    "calibrate_rate_table",
    "compare_calibrations",
    "find_rests",
    "fit_rate",
    "integrate",
]

_LAZY_EXPORTS: Final = {
    "calibration": "Calibration SensorCalibration",
    "comparison": "CalibrationComparison MovedParameter compare_calibrations",
    "fit.rests": "find_rests",
    "magnet.calibrate": "calibrate_magnetometer",
    "magnetometer": "IronGroup MagnetometerCalibration",
    "rate.angle": "Integrated integrate",
    "rate.rate_table": "RateTable RateTableAxis calibrate_rate_table",
    "rate.reference": "FittedRate fit_rate",
    "record": "Origin Rest Turn",
    "temperature": "TemperatureBias TemperatureModel",
}
if not TYPE_CHECKING:
    __getattr__, __dir__ = lazy_exports(__name__, _LAZY_EXPORTS)
