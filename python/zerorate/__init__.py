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
    DriftFilter,
    ImuCorrector,
    RecursiveLeastSquares,
    RestDetector,
    StreamingAllan,
    Trace,
    WaveletDenoiser,
    __version__,
)
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

__all__ = [
    "DEVICES",
    "AllanNoise",
    "AllanResult",
    "Coefficient",
    "Contamination",
    "Denoised",
    "Device",
    "DriftFilter",
    "DynamicAllan",
    "FittedModel",
    "ImuCorrector",
    "Log",
    "LogError",
    "Markov",
    "NoiseModel",
    "Recording",
    "RecursiveLeastSquares",
    "RestDetector",
    "Sinusoid",
    "StreamingAllan",
    "Trace",
    "WaveletDenoiser",
    "__version__",
    "allan",
    "compare",
    "denoise",
    "device",
    "dynamic_allan",
    "identify",
    "live",
    "metrics",
    "raw_counts",
    "read_log",
    "read_recording",
    "simulate",
    "split_log",
    "units",
    "whittle",
    "worst_axis",
    "write_log",
]


def __getattr__(name: str) -> Any:  # noqa: ANN401
    """Import the large parts when they are first asked for."""
    if name in ("compare", "identify", "live", "metrics"):
        return import_module(f"zerorate.{name}")
    raise AttributeError(f"module 'zerorate' has no attribute {name!r}")


def __dir__() -> list[str]:
    """Show what is public, the large parts among it."""
    return __all__
