"""From coefficients of continuous time to deviations per sample."""

import math
from typing import NamedTuple

from zerorate.noise.coefficient import Coefficient

__all__ = ["DiscreteSigmas", "discrete_sigmas", "positive_rate"]


class DiscreteSigmas(NamedTuple):
    """Deviations per sample.

    Parameters
    ----------
    white : float
        N sqrt(rate) in rad/s: the deviation of the white noise of one sample. Its square is the
        measurement noise R of a filter that takes the rate as measured.
    walk_step : float
        K / sqrt(rate) in rad/s: the deviation of the random walk's step from one sample to the
        next. Its square is the process noise Q of the bias state.
    """

    white: float
    walk_step: float


def discrete_sigmas(white: Coefficient, walk: Coefficient, rate: float) -> DiscreteSigmas:
    """Return both deviations at a sampling rate in Hz, by upper bounds where all is unknown."""
    root = math.sqrt(positive_rate(rate))
    return DiscreteSigmas(white.conservative * root, walk.conservative / root)


def positive_rate(rate: float) -> float:
    """Return the rate as a float; ValueError if it is not positive and finite."""
    if not (math.isfinite(rate) and rate > 0.0):
        raise ValueError(f"rate must be positive and finite, got {rate}")
    return float(rate)
