"""Calibration: what is deterministic in an inertial sensor, with its errors, and its removal."""

from importlib import import_module
from typing import TYPE_CHECKING, Any

from zerorate.calibration.calibrate import CalibrationError, calibrate

if TYPE_CHECKING:
    from zerorate.calibration.calibration import (
        Calibration,
        Origin,
        Rest,
        SensorCalibration,
        Turn,
    )
    from zerorate.calibration.fit.rests import find_rests

__all__ = [
    "Calibration",
    "CalibrationError",
    "Origin",
    "Rest",
    "SensorCalibration",
    "Turn",
    "calibrate",
    "find_rests",
]

_LATER = {
    "Calibration": "calibration",
    "Origin": "calibration",
    "Rest": "calibration",
    "SensorCalibration": "calibration",
    "Turn": "calibration",
    "find_rests": "fit.rests",
}
"""Modules that are imported when a name in them is first asked for."""


def __getattr__(name: str) -> Any:  # noqa: ANN401
    """Import what takes time when it is first asked for."""
    if name not in _LATER:
        raise AttributeError(f"module 'zerorate.calibration' has no attribute {name!r}")
    return getattr(import_module(f"zerorate.calibration.{_LATER[name]}"), name)


def __dir__() -> list[str]:
    """Show what is public."""
    return __all__
