"""Measures of a filter, each of which hides something another one shows.

A deviation at rest is won by any strong low-pass filter, so `reduction` never stands alone:
`coasting_error` asks what a wrong bias costs, `orientation_error_growth` what it costs in
attitude, `orientation_errors` how far an attitude is from the true one, `ate` and `rpe` how far a
track is, `motion_error` what the filter costs in motion, `regret` and `best_ema` how far it is from
the best possible, `nis` and `coverage` whether it knows how good it is. Those of orientation take
quaternions, those of tracks poses; all others take one channel (n,) or several (n, k) and return a
float or k of them. A NaN or infinite sample is a missing one and is left out, never filled in.
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
