"""Measures of a drift filter, each of which hides something another one shows.

A deviation at rest is won by any strong low-pass filter, so `reduction` never stands alone:
`coasting_error` asks what a wrong bias costs, `delay` and `equal_delay_lowpass` what the filter
costs in motion, `regret` how far it is from the best possible, `nis` whether it knows how good it
is. All take one channel (n,) or several (n, k) and answer with a float or with k of them. A NaN
or infinite sample is a missing one and is left out, never filled in.
"""

from zerorate.metrics.coasting import coasting_error
from zerorate.metrics.delays import delay
from zerorate.metrics.lowpass import equal_delay_lowpass
from zerorate.metrics.statistics import mean_shift, nis, reduction, regret, rmse

__all__ = [
    "coasting_error",
    "delay",
    "equal_delay_lowpass",
    "mean_shift",
    "nis",
    "reduction",
    "regret",
    "rmse",
]
