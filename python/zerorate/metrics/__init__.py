"""Measures of a filter; each hides something that another one shows.

Any strong low-pass filter has a small standard deviation at rest, so `reduction` alone is not
enough. `coasting_error` measures the cost of a wrong bias, `orientation_error_growth` its cost in
attitude, and `motion_error` the cost of the filter in motion. `orientation_errors` measures the
error of an attitude, `ate` and `rpe` the error of a track. `regret` and `best_ema` compare a filter
with the best possible one; `nis` and `coverage` check its stated uncertainty. Measures of
orientation take quaternions, measures of tracks take poses; all others take one channel (n,) or
several (n, k) and return a float or k of them. NaN or infinite samples count as missing: they are
left out, never filled in.
"""

from zerorate.metrics.averages import BestEma, best_ema, running_mean
from zerorate.metrics.motion import MotionError, delay, equal_delay_lowpass, motion_error
from zerorate.metrics.orientation import (
    OrientationErrors,
    heading_offset,
    orientation_error_growth,
    orientation_errors,
)
from zerorate.metrics.rest import AllanRatio, allan_ratio, coasting_error, mean_shift, reduction
from zerorate.metrics.tracks import Statistics, TrackErrors, ate, rpe
from zerorate.metrics.truth import coverage, nis, regret, rmse, settling_time

__all__ = [
    "AllanRatio",
    "BestEma",
    "MotionError",
    "OrientationErrors",
    "Statistics",
    "TrackErrors",
    "allan_ratio",
    "ate",
    "best_ema",
    "coasting_error",
    "coverage",
    "delay",
    "equal_delay_lowpass",
    "heading_offset",
    "mean_shift",
    "motion_error",
    "nis",
    "orientation_error_growth",
    "orientation_errors",
    "reduction",
    "regret",
    "rmse",
    "rpe",
    "running_mean",
    "settling_time",
]


def __dir__() -> list[str]:
    """Return the public names."""
    return __all__
