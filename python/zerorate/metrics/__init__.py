"""Measures of the quality of a filter; use several, because each measure hides some errors.

A strong low-pass filter has a small standard deviation at rest, so `reduction` alone is not enough.

- `coasting_error`: angle error from a wrong bias.
- `orientation_error_growth`: attitude error from a wrong bias.
- `motion_error`: error of the filter in motion.
- `orientation_errors`: error of an attitude.
- `ate` and `rpe`: error of a track.
- `regret` and `best_ema`: comparison with the best possible filter.
- `nis` and `coverage`: check of the stated uncertainty.

Measures of orientation take quaternions, and measures of tracks take poses. All other measures take
one channel (n,) or k channels (n, k). They return a float, or an array with k floats. NaN and
infinite samples count as missing and are left out.
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
