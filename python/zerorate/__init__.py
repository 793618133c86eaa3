"""Model, measure and remove the random drift of MEMS gyroscopes, live or in replay.

Conventions: a record of one axis has shape (n,), of k axes (n, k), both float64. Filters need no
unit and answer in the unit that they are given; noise models and simulation are in SI (rad/s).
NaN, infinities and ``None`` are missing samples. R is the measurement noise variance, G the
process noise covariance of the state.
"""

from zerorate import metrics
from zerorate._native import (
    AllanNoise,
    DriftFilter,
    RecursiveLeastSquares,
    StreamingAllan,
    Trace,
    __version__,
    overlapping_allan_deviation,
)
from zerorate.devices import DEVICES, Device, device
from zerorate.io import Log, LogError, read_log, write_log
from zerorate.noise_model import NoiseModel
from zerorate.simulate import simulate

__all__ = [
    "DEVICES",
    "AllanNoise",
    "Device",
    "DriftFilter",
    "Log",
    "LogError",
    "NoiseModel",
    "RecursiveLeastSquares",
    "StreamingAllan",
    "Trace",
    "__version__",
    "device",
    "metrics",
    "overlapping_allan_deviation",
    "read_log",
    "simulate",
    "write_log",
]
