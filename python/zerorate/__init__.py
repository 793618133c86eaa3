"""Turns the raw output of MEMS inertial sensors into numbers to navigate by, live or from a log.

A record of one axis has shape (n,), a record of k axes has shape (n, k); both are float64. Every
function that takes samples also accepts a `Log`, a data frame, a series or an Arrow table. Arrays
are returned: `Log.with_data` turns them into a log again.

The rate of a log must equal the rate of the filter. Classes that need a certain unit, such as
`Attitude`, convert the log's unit. Other filters return the unit of their input. Noise models and
simulations use SI units (rad/s). NaN, infinity and ``None`` mark missing samples. R is the variance
of the measurement noise, G the process noise covariance of the state.
"""

from collections.abc import Callable
from importlib import import_module
from typing import TYPE_CHECKING, Any, Final

from zerorate._native import __version__ as __version__
from zerorate._native import register
from zerorate.lazy import lazy_exports, modules_by_name
from zerorate.views import add_registrar

if TYPE_CHECKING:
    from zerorate import array as array
    from zerorate import attitude as attitude
    from zerorate import calibration as calibration
    from zerorate import checks as checks
    from zerorate import datasets as datasets
    from zerorate import denoising as denoising
    from zerorate import findings as findings
    from zerorate import foot as foot
    from zerorate import geometry as geometry
    from zerorate import identification as identification
    from zerorate import io as io
    from zerorate import linear as linear
    from zerorate import metrics as metrics
    from zerorate import navigation as navigation
    from zerorate import noise as noise
    from zerorate import record as record
    from zerorate import schemas as schemas
    from zerorate import simulation as simulation
    from zerorate import tasks as tasks
    from zerorate import units as units
    from zerorate._native import Attitude as Attitude
    from zerorate._native import DriftFilter as DriftFilter
    from zerorate._native import FootFilter as FootFilter
    from zerorate._native import GyroArray as GyroArray
    from zerorate._native import ImuCorrector as ImuCorrector
    from zerorate._native import LinearKalman as LinearKalman
    from zerorate._native import NavigationFilter as NavigationFilter
    from zerorate._native import PositionFilter as PositionFilter
    from zerorate._native import RestDetector as RestDetector
    from zerorate._native import StreamingAllan as StreamingAllan
    from zerorate._native import TemperatureFilter as TemperatureFilter
    from zerorate._native import Tilt as Tilt
    from zerorate._native import WaveletDenoiser as WaveletDenoiser
    from zerorate.calibration.calibration import Calibration as Calibration
    from zerorate.calibration.comparison import compare_calibrations as compare_calibrations
    from zerorate.calibration.rate.angle import integrate as integrate
    from zerorate.calibration.rate.rate_table import calibrate_rate_table as calibrate_rate_table
    from zerorate.calibration.temperature import TemperatureModel as TemperatureModel
    from zerorate.checks.clipped import restore_clipped as restore_clipped
    from zerorate.denoising.wavelet import denoise as denoise
    from zerorate.foot.feet import join_feet as join_feet
    from zerorate.foot.foot import FootNavigation as FootNavigation
    from zerorate.io.counts import raw_counts as raw_counts
    from zerorate.io.fixes import read_fixes as read_fixes
    from zerorate.io.reading import read_log as read_log
    from zerorate.io.recording import read_recording as read_recording
    from zerorate.io.writing import write_log as write_log
    from zerorate.navigation.alignment import align as align
    from zerorate.noise.allan import allan as allan
    from zerorate.noise.model import NoiseModel as NoiseModel
    from zerorate.record.fixes import Fixes as Fixes
    from zerorate.record.log import Log as Log
    from zerorate.record.log import LogError as LogError
    from zerorate.record.recording import Recording as Recording
    from zerorate.simulation.drive import simulate_drive as simulate_drive
    from zerorate.simulation.gyro import simulate as simulate
    from zerorate.simulation.motion import simulate_motion as simulate_motion
    from zerorate.simulation.walk import simulate_feet as simulate_feet
    from zerorate.simulation.walk import simulate_walk as simulate_walk
    from zerorate.tasks.array import replay_array as replay_array
    from zerorate.tasks.attitude import estimate_attitude as estimate_attitude
    from zerorate.tasks.batch.run import batch as batch
    from zerorate.tasks.calibrate import calibrate as calibrate
    from zerorate.tasks.calibrate import calibrate_magnetometer as calibrate_magnetometer
    from zerorate.tasks.calibrate import correct as correct
    from zerorate.tasks.characterise import characterise as characterise
    from zerorate.tasks.check import check as check
    from zerorate.tasks.compare.task import compare as compare
    from zerorate.tasks.identify import identify as identify
    from zerorate.tasks.navigate import navigate as navigate
    from zerorate.tasks.replay.task import replay as replay
    from zerorate.tasks.report import report as report
    from zerorate.tasks.walk import walk as walk

_LAZY_EXPORTS: Final = {
    "": (
        "array attitude calibration checks datasets denoising findings foot geometry "
        "identification io linear metrics navigation noise record schemas simulation tasks units"
    ),
    "_native": (
        "Attitude DriftFilter FootFilter GyroArray ImuCorrector LinearKalman "
        "NavigationFilter PositionFilter RestDetector StreamingAllan TemperatureFilter Tilt "
        "WaveletDenoiser"
    ),
    "calibration.calibration": "Calibration",
    "calibration.comparison": "compare_calibrations",
    "calibration.rate.angle": "integrate",
    "calibration.rate.rate_table": "calibrate_rate_table",
    "calibration.temperature": "TemperatureModel",
    "checks.clipped": "restore_clipped",
    "denoising.wavelet": "denoise",
    "foot.feet": "join_feet",
    "foot.foot": "FootNavigation",
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
    "simulation.walk": "simulate_feet simulate_walk",
    "tasks.array": "replay_array",
    "tasks.attitude": "estimate_attitude",
    "tasks.batch.run": "batch",
    "tasks.calibrate": "calibrate calibrate_magnetometer correct",
    "tasks.characterise": "characterise",
    "tasks.compare.task": "compare",
    "tasks.identify": "identify",
    "tasks.check": "check",
    "tasks.navigate": "navigate",
    "tasks.replay.task": "replay",
    "tasks.report": "report",
    "tasks.walk": "walk",
}
"""Public names by module, imported at first access; the packages themselves are under ""."""

__all__ = sorted(["__version__", *modules_by_name(_LAZY_EXPORTS)])

add_registrar("zerorate.show.registry")

if not TYPE_CHECKING:
    __getattr__, __dir__ = lazy_exports(__name__, _LAZY_EXPORTS)


def _rule(module: str, name: str) -> Callable[..., Any]:
    """Return a function that imports its target when it is first called."""
    return lambda *given, **named: getattr(import_module(module), name)(*given, **named)


# The compiled module cannot import Python modules: functions that it needs are registered here.
register(
    convert=_rule("zerorate.units", "convert"),
    without_masks=_rule("zerorate.record.missing", "without_masks"),
    samples=_rule("zerorate.record.named", "for_stream"),
    linear_run=_rule("zerorate.linear.run", "LinearRun"),
    trace=_rule("zerorate.tasks.trace", "Trace"),
    navigate=_rule("zerorate.navigation.processing", "processed"),
)
