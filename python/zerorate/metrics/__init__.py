"""Measures of a drift filter, each of which hides something another one shows.

A deviation at rest is won by any strong low-pass filter, so `reduction` never stands alone:
`coasting_error` asks what a wrong bias costs, `orientation_error_growth` what it costs in attitude,
`motion_error` what the filter costs in motion, `regret` and `best_ema` how far it is from the best
possible, `nis` and `coverage` whether it knows how good it is. All take one channel (n,) or several
(n, k) and answer with a float or with k of them. A NaN or infinite sample is a missing one and is
left out, never filled in.
"""

from zerorate.metrics.averages import BestEma, best_ema, running_mean
from zerorate.metrics.coasting import coasting_error
from zerorate.metrics.consistency import coverage, nis
from zerorate.metrics.delays import delay
from zerorate.metrics.long_times import AllanRatio, allan_ratio
from zerorate.metrics.lowpass import equal_delay_lowpass
from zerorate.metrics.motion import MotionError, motion_error
from zerorate.metrics.orientation import orientation_error_growth
from zerorate.metrics.settling import settling_time
from zerorate.metrics.statistics import mean_shift, reduction, regret, rmse

__all__ = [
    "AllanRatio",
    "BestEma",
    "MotionError",
    "allan_ratio",
    "best_ema",
    "coasting_error",
    "coverage",
    "delay",
    "equal_delay_lowpass",
    "mean_shift",
    "motion_error",
    "nis",
    "orientation_error_growth",
    "reduction",
    "regret",
    "rmse",
    "running_mean",
    "settling_time",
]
