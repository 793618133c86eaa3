"""Model, measure and remove the random drift of MEMS gyroscopes, live or in replay.

Conventions: a record of one axis has shape (n,), of k axes (n, k), both float64. Filters need no
unit and return the unit that they are given; noise models and simulation are in SI (rad/s).
NaN, infinities and ``None`` are missing samples. R is the measurement noise variance, G the
process noise covariance of the state.
"""

from collections.abc import Callable
from importlib import import_module
from typing import TYPE_CHECKING, Any, Final

from zerorate._native import (
    AllanNoise,
    Attitude,
    DriftFilter,
    GyroArray,
    ImuCorrector,
    LinearKalman,
    MotionDetector,
    NavigationFilter,
    PositionFilter,
    RecursiveLeastSquares,
    RestDetector,
    StreamingAllan,
    TemperatureFilter,
    Tilt,
    Trace,
    WaveletDenoiser,
    __version__,
    register,
)
from zerorate.views import shown_by

if TYPE_CHECKING:
    from zerorate import compare, identify, live, metrics, units
    from zerorate.array.accelerometers import FusedAccelerometers, fuse_accelerometers
    from zerorate.array.covariance import AllanCovariance, allan_covariance
    from zerorate.array.logs import ArrayLog, array_log
    from zerorate.array.rotations import Rotations, find_rotations, read_rotations
    from zerorate.array.virtual_gyro import VirtualGyro
    from zerorate.attitude.estimate import AttitudeEstimate, estimate_attitude
    from zerorate.calibration.calibrate import CalibrationError, calibrate
    from zerorate.calibration.calibration import Calibration
    from zerorate.calibration.comparison import (
        CalibrationComparison,
        MovedParameter,
        compare_calibrations,
    )
    from zerorate.calibration.fit.rests import find_rests
    from zerorate.calibration.rate.angle import Integrated, integrate
    from zerorate.calibration.rate.rate_table import RateTable, RateTableAxis, calibrate_rate_table
    from zerorate.calibration.rate.reference import FittedRate, fit_rate
    from zerorate.calibration.temperature import TemperatureBias, TemperatureModel
    from zerorate.checks.check import check
    from zerorate.checks.result import Checks, Finding
    from zerorate.denoising.wavelet import Denoised, denoise
    from zerorate.io.counts import raw_counts
    from zerorate.io.log import Log, LogError, Recording
    from zerorate.io.reading import read_log
    from zerorate.io.recording import read_recording
    from zerorate.io.split import split_log
    from zerorate.io.writing import write_log
    from zerorate.linear.run import LinearRun, SmoothedRun
    from zerorate.navigation.alignment import Alignment, align
    from zerorate.navigation.clock import TimeOffset, find_time_offset
    from zerorate.navigation.fixes import Fixes
    from zerorate.navigation.mounting import Mounting, body_axes, read_mounting
    from zerorate.navigation.outages import Outages, outages
    from zerorate.navigation.readers import read_fixes
    from zerorate.navigation.track import Track
    from zerorate.navigation.tracks import write_geojson, write_gpx
    from zerorate.noise.allan import allan
    from zerorate.noise.coefficient import Coefficient
    from zerorate.noise.dynamic import DynamicAllan, dynamic_allan
    from zerorate.noise.fit import FittedModel
    from zerorate.noise.model import NoiseModel, worst_axis
    from zerorate.noise.result import AllanResult
    from zerorate.noise.spectrum import whittle
    from zerorate.noise.terms import Markov, Sinusoid
    from zerorate.simulation.contamination import Contamination
    from zerorate.simulation.devices import DEVICES, Device, device
    from zerorate.simulation.drive import SimulatedDrive, simulate_drive
    from zerorate.simulation.gyro import simulate
    from zerorate.simulation.motion import MotionErrors, SimulatedMotion, simulate_motion
    from zerorate.simulation.session import (
        AccelErrors,
        GyroErrors,
        SimulatedSession,
        simulate_session,
    )

__all__ = [
    "DEVICES",
    "AccelErrors",
    "Alignment",
    "AllanCovariance",
    "AllanNoise",
    "AllanResult",
    "ArrayLog",
    "Attitude",
    "AttitudeEstimate",
    "Calibration",
    "CalibrationComparison",
    "CalibrationError",
    "Checks",
    "Coefficient",
    "Contamination",
    "Denoised",
    "Device",
    "DriftFilter",
    "DynamicAllan",
    "Finding",
    "FittedModel",
    "FittedRate",
    "Fixes",
    "FusedAccelerometers",
    "GyroArray",
    "GyroErrors",
    "ImuCorrector",
    "Integrated",
    "LinearKalman",
    "LinearRun",
    "Log",
    "LogError",
    "Markov",
    "MotionDetector",
    "MotionErrors",
    "Mounting",
    "MovedParameter",
    "NavigationFilter",
    "NoiseModel",
    "Outages",
    "PositionFilter",
    "RateTable",
    "RateTableAxis",
    "Recording",
    "RecursiveLeastSquares",
    "RestDetector",
    "Rotations",
    "SimulatedDrive",
    "SimulatedMotion",
    "SimulatedSession",
    "Sinusoid",
    "SmoothedRun",
    "StreamingAllan",
    "TemperatureBias",
    "TemperatureFilter",
    "TemperatureModel",
    "Tilt",
    "TimeOffset",
    "Trace",
    "Track",
    "VirtualGyro",
    "WaveletDenoiser",
    "__version__",
    "align",
    "allan",
    "allan_covariance",
    "array_log",
    "body_axes",
    "calibrate",
    "calibrate_rate_table",
    "check",
    "compare",
    "compare_calibrations",
    "denoise",
    "device",
    "dynamic_allan",
    "estimate_attitude",
    "find_rests",
    "find_rotations",
    "find_time_offset",
    "fit_rate",
    "fuse_accelerometers",
    "identify",
    "integrate",
    "live",
    "metrics",
    "outages",
    "raw_counts",
    "read_fixes",
    "read_log",
    "read_mounting",
    "read_recording",
    "read_rotations",
    "simulate",
    "simulate_drive",
    "simulate_motion",
    "simulate_session",
    "split_log",
    "units",
    "whittle",
    "worst_axis",
    "write_geojson",
    "write_gpx",
    "write_log",
]

shown_by("zerorate.show.registry")

_PLACES: Final = {
    "array.accelerometers": ("FusedAccelerometers", "fuse_accelerometers"),
    "array.covariance": ("AllanCovariance", "allan_covariance"),
    "array.logs": ("ArrayLog", "array_log"),
    "array.rotations": ("Rotations", "find_rotations", "read_rotations"),
    "array.virtual_gyro": ("VirtualGyro",),
    "attitude.estimate": ("AttitudeEstimate", "estimate_attitude"),
    "calibration.calibrate": ("CalibrationError", "calibrate"),
    "calibration.calibration": ("Calibration",),
    "calibration.comparison": ("CalibrationComparison", "MovedParameter", "compare_calibrations"),
    "calibration.fit.rests": ("find_rests",),
    "calibration.rate.angle": ("Integrated", "integrate"),
    "calibration.rate.rate_table": ("RateTable", "RateTableAxis", "calibrate_rate_table"),
    "calibration.rate.reference": ("FittedRate", "fit_rate"),
    "calibration.temperature": ("TemperatureBias", "TemperatureModel"),
    "checks.check": ("check",),
    "checks.result": ("Checks", "Finding"),
    "denoising.wavelet": ("Denoised", "denoise"),
    "io.counts": ("raw_counts",),
    "io.log": ("Log", "LogError", "Recording"),
    "io.reading": ("read_log",),
    "io.recording": ("read_recording",),
    "io.split": ("split_log",),
    "io.writing": ("write_log",),
    "linear.run": ("LinearRun", "SmoothedRun"),
    "navigation.alignment": ("Alignment", "align"),
    "navigation.clock": ("TimeOffset", "find_time_offset"),
    "navigation.fixes": ("Fixes",),
    "navigation.outages": ("Outages", "outages"),
    "navigation.mounting": ("Mounting", "body_axes", "read_mounting"),
    "navigation.readers": ("read_fixes",),
    "navigation.track": ("Track",),
    "navigation.tracks": ("write_geojson", "write_gpx"),
    "noise.allan": ("allan",),
    "noise.coefficient": ("Coefficient",),
    "noise.dynamic": ("DynamicAllan", "dynamic_allan"),
    "noise.fit": ("FittedModel",),
    "noise.model": ("NoiseModel", "worst_axis"),
    "noise.result": ("AllanResult",),
    "noise.spectrum": ("whittle",),
    "noise.terms": ("Markov", "Sinusoid"),
    "simulation.contamination": ("Contamination",),
    "simulation.devices": ("DEVICES", "Device", "device"),
    "simulation.drive": ("SimulatedDrive", "simulate_drive"),
    "simulation.gyro": ("simulate",),
    "simulation.motion": ("MotionErrors", "SimulatedMotion", "simulate_motion"),
    "simulation.session": ("AccelErrors", "GyroErrors", "SimulatedSession", "simulate_session"),
}
"""Modules that are imported when a name in them is first asked for: nobody needs all of them."""

_MODULES: Final = {name: module for module, names in _PLACES.items() for name in names}


def __getattr__(name: str) -> Any:  # noqa: ANN401
    """Import a name's module, or a module by its name, when it is first asked for."""
    if name in _MODULES:
        found = getattr(import_module(f"zerorate.{_MODULES[name]}"), name)
        globals()[name] = found
        return found
    try:
        return import_module(f"zerorate.{name}")
    except ModuleNotFoundError as error:
        if error.name != f"zerorate.{name}":
            raise
        raise AttributeError(f"module 'zerorate' has no attribute {name!r}") from None


def _rule(module: str, name: str) -> Callable[..., Any]:
    """Return a function that is imported when it is first called."""
    return lambda *given, **named: getattr(import_module(module), name)(*given, **named)


# Compiled classes know no module of the package: they are told what they go by.
register(
    convert=_rule("zerorate.units", "convert"),
    without_masks=_rule("zerorate.io.missing", "without_masks"),
    linear_run=_rule("zerorate.linear.run", "LinearRun"),
    navigate=_rule("zerorate.navigation.processing", "processed"),
)


def __dir__() -> list[str]:
    """Show what is public, whether it was imported or not."""
    return __all__
