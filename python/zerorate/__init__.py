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
    Attitude,
    DriftFilter,
    GyroArray,
    ImuCorrector,
    LinearKalman,
    NavigationFilter,
    PositionFilter,
    RestDetector,
    StreamingAllan,
    TemperatureFilter,
    Tilt,
    WaveletDenoiser,
    __version__,
    register,
)
from zerorate.lazy import by_name
from zerorate.views import shown_by

if TYPE_CHECKING:
    from zerorate import identification, metrics, units
    from zerorate.attitude.estimate import estimate_attitude
    from zerorate.calibration.calibration import Calibration
    from zerorate.calibration.comparison import compare_calibrations
    from zerorate.calibration.rate.angle import integrate
    from zerorate.calibration.rate.rate_table import calibrate_rate_table
    from zerorate.calibration.temperature import TemperatureModel
    from zerorate.checks.check import check
    from zerorate.denoising.wavelet import denoise
    from zerorate.io.counts import raw_counts
    from zerorate.io.fixes import read_fixes
    from zerorate.io.reading import read_log
    from zerorate.io.recording import read_recording
    from zerorate.io.writing import write_log
    from zerorate.navigation.alignment import align
    from zerorate.noise.allan import allan
    from zerorate.noise.model import NoiseModel
    from zerorate.record.fixes import Fixes
    from zerorate.record.log import Log, LogError
    from zerorate.record.recording import Recording
    from zerorate.simulation.drive import simulate_drive
    from zerorate.simulation.gyro import simulate
    from zerorate.simulation.motion import simulate_motion
    from zerorate.tasks.calibrate import calibrate, calibrate_magnetometer, correct
    from zerorate.tasks.navigate import navigate
    from zerorate.tasks.report import report

__all__ = [
    "Attitude",
    "Calibration",
    "DriftFilter",
    "Fixes",
    "GyroArray",
    "ImuCorrector",
    "LinearKalman",
    "Log",
    "LogError",
    "NavigationFilter",
    "NoiseModel",
    "PositionFilter",
    "Recording",
    "RestDetector",
    "StreamingAllan",
    "TemperatureFilter",
    "TemperatureModel",
    "Tilt",
    "WaveletDenoiser",
    "__version__",
    "align",
    "allan",
    "calibrate",
    "calibrate_magnetometer",
    "calibrate_rate_table",
    "check",
    "compare_calibrations",
    "correct",
    "denoise",
    "estimate_attitude",
    "identification",
    "integrate",
    "metrics",
    "navigate",
    "raw_counts",
    "read_fixes",
    "read_log",
    "read_recording",
    "report",
    "simulate",
    "simulate_drive",
    "simulate_motion",
    "units",
    "write_log",
]

shown_by("zerorate.show.registry")

_PLACES: Final = {
    "attitude.estimate": "estimate_attitude",
    "calibration.calibration": "Calibration",
    "calibration.comparison": "compare_calibrations",
    "calibration.rate.angle": "integrate",
    "calibration.rate.rate_table": "calibrate_rate_table",
    "calibration.temperature": "TemperatureModel",
    "checks.check": "check",
    "denoising.wavelet": "denoise",
    "io.counts": "raw_counts",
    "io.fixes": "read_fixes",
    "io.reading": "read_log",
    "io.recording": "read_recording",
    "io.writing": "write_log",
    "navigation.alignment": "align",
    "noise.allan": "allan",
    "noise.model": "NoiseModel",
    "record.fixes": "Fixes",
    "record.log": "Log LogError",
    "record.recording": "Recording",
    "simulation.drive": "simulate_drive",
    "simulation.gyro": "simulate",
    "simulation.motion": "simulate_motion",
    "tasks.calibrate": "calibrate calibrate_magnetometer correct",
    "tasks.navigate": "navigate",
    "tasks.report": "report",
    # What has its home in a package, and was here before.
    "array": (
        "AllanCovariance ArrayLog FusedAccelerometers Rotations VirtualGyro allan_covariance "
        "array_log find_rotations fuse_accelerometers read_rotations"
    ),
    "attitude": "AttitudeEstimate",
    "calibration": (
        "CalibrationComparison CalibrationError FittedRate Integrated MovedParameter "
        "RateTable RateTableAxis IronGroup MagnetometerCalibration TemperatureBias "
        "find_rests fit_rate"
    ),
    "checks": "Checks Finding restore_clipped",
    "denoising": "Denoised",
    "findings": "Report",
    "foot": "Feet FootFilter FootNavigation FootTrack join_feet",
    "identification": "RecursiveLeastSquares",
    "io": "read_mounting split_log",
    "linear": "LinearRun SmoothedRun",
    "navigation": ("Alignment Outages Track find_time_offset outages write_geojson write_gpx"),
    "noise": (
        "AllanNoise AllanResult Coefficient DynamicAllan FittedModel Markov MotionDetector "
        "Sinusoid dynamic_allan whittle worst_axis"
    ),
    "record": "Mounting TimeOffset body_axes",
    "tasks": "Trace",
    "simulation": (
        "DEVICES AccelErrors Contamination Device GyroErrors MotionErrors SimulatedDrive "
        "SimulatedMotion SimulatedSession SimulatedWalk device simulate_session "
        "simulate_feet simulate_walk"
    ),
}
"""Modules that are imported when a name in them is first asked for: nobody needs all of them."""

_MODULES: Final = by_name(_PLACES)


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
    without_masks=_rule("zerorate.record.missing", "without_masks"),
    linear_run=_rule("zerorate.linear.run", "LinearRun"),
    trace=_rule("zerorate.tasks.trace", "Trace"),
    navigate=_rule("zerorate.navigation.processing", "processed"),
)


def __dir__() -> list[str]:
    """Show what is public, whether it was imported or not."""
    return __all__
