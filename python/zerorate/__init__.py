"""Model, measure and remove the random drift of MEMS gyroscopes, live or in replay.

Conventions: a record of one axis has shape (n,), of k axes (n, k), both float64. Filters need no
unit and return the unit that they are given; noise models and simulation are in SI (rad/s).
NaN, infinities and ``None`` are missing samples. R is the measurement noise variance, G the
process noise covariance of the state.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

from zerorate import units
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
)
from zerorate.array import AllanCovariance, VirtualGyro, allan_covariance
from zerorate.calibrate import CalibrationError, calibrate
from zerorate.denoise import Denoised, denoise
from zerorate.io import (
    Log,
    LogError,
    Recording,
    raw_counts,
    read_log,
    read_recording,
    split_log,
    write_log,
)
from zerorate.noise import (
    AllanResult,
    Coefficient,
    DynamicAllan,
    FittedModel,
    Markov,
    NoiseModel,
    Sinusoid,
    allan,
    dynamic_allan,
    whittle,
    worst_axis,
)
from zerorate.simulate import Contamination, simulate
from zerorate.simulate.devices import DEVICES, Device, device

if TYPE_CHECKING:
    from zerorate import compare, identify, live, metrics
    from zerorate.array.accelerometers import FusedAccelerometers, fuse_accelerometers
    from zerorate.array.logs import ArrayLog, array_log
    from zerorate.array.rotations import Rotations, find_rotations, read_rotations
    from zerorate.attitude.estimate import AttitudeEstimate, estimate_attitude
    from zerorate.calibrate import Calibration, find_rests
    from zerorate.calibrate.comparison import (
        CalibrationComparison,
        MovedParameter,
        compare_calibrations,
    )
    from zerorate.calibrate.rate.angle import Integrated, integrate
    from zerorate.calibrate.rate.rate_table import RateTable, RateTableAxis, calibrate_rate_table
    from zerorate.calibrate.rate.reference import FittedRate, fit_rate
    from zerorate.calibrate.temperature import TemperatureBias, TemperatureModel
    from zerorate.linear.run import LinearRun, SmoothedRun
    from zerorate.navigation.alignment import Alignment, align
    from zerorate.navigation.clock import TimeOffset, find_time_offset
    from zerorate.navigation.fixes import Fixes
    from zerorate.navigation.mounting import Mounting, body_axes, read_mounting
    from zerorate.navigation.readers import read_fixes
    from zerorate.navigation.track import Track
    from zerorate.navigation.tracks import write_geojson, write_gpx
    from zerorate.simulate.drive import SimulatedDrive, simulate_drive
    from zerorate.simulate.motion import MotionErrors, SimulatedMotion, simulate_motion
    from zerorate.simulate.session import (
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
    "Coefficient",
    "Contamination",
    "Denoised",
    "Device",
    "DriftFilter",
    "DynamicAllan",
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


_LATER = {
    "compare": "compare",
    "identify": "identify",
    "live": "live",
    "metrics": "metrics",
    "AccelErrors": "simulate.session",
    "Alignment": "navigation.alignment",
    "ArrayLog": "array.logs",
    "AttitudeEstimate": "attitude.estimate",
    "Calibration": "calibrate.calibration",
    "CalibrationComparison": "calibrate.comparison",
    "FittedRate": "calibrate.rate.reference",
    "Fixes": "navigation.fixes",
    "FusedAccelerometers": "array.accelerometers",
    "GyroErrors": "simulate.session",
    "Integrated": "calibrate.rate.angle",
    "LinearRun": "linear.run",
    "MotionErrors": "simulate.motion",
    "Mounting": "navigation.mounting",
    "MovedParameter": "calibrate.comparison",
    "RateTable": "calibrate.rate.rate_table",
    "RateTableAxis": "calibrate.rate.rate_table",
    "Rotations": "array.rotations",
    "SimulatedDrive": "simulate.drive",
    "SimulatedMotion": "simulate.motion",
    "SimulatedSession": "simulate.session",
    "SmoothedRun": "linear.run",
    "TemperatureBias": "calibrate.temperature",
    "TemperatureModel": "calibrate.temperature",
    "TimeOffset": "navigation.clock",
    "Track": "navigation.track",
    "find_time_offset": "navigation.clock",
    "align": "navigation.alignment",
    "array_log": "array.logs",
    "body_axes": "navigation.mounting",
    "calibrate_rate_table": "calibrate.rate.rate_table",
    "find_rests": "calibrate.fit.rests",
    "compare_calibrations": "calibrate.comparison",
    "estimate_attitude": "attitude.estimate",
    "find_rotations": "array.rotations",
    "fit_rate": "calibrate.rate.reference",
    "fuse_accelerometers": "array.accelerometers",
    "integrate": "calibrate.rate.angle",
    "read_mounting": "navigation.mounting",
    "read_fixes": "navigation.readers",
    "read_rotations": "array.rotations",
    "simulate_drive": "simulate.drive",
    "simulate_motion": "simulate.motion",
    "simulate_session": "simulate.session",
    "write_geojson": "navigation.tracks",
    "write_gpx": "navigation.tracks",
}
"""Modules that are imported when they, or a name in them, are first asked for."""


def __getattr__(name: str) -> Any:  # noqa: ANN401
    """Import the large parts when they are first asked for."""
    if name not in _LATER:
        raise AttributeError(f"module 'zerorate' has no attribute {name!r}")
    module = import_module(f"zerorate.{_LATER[name]}")
    return module if _LATER[name] == name else getattr(module, name)


def __dir__() -> list[str]:
    """Show what is public, the large parts among it."""
    return __all__
