"""Whether a model knows the slow part of its record."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final

import numpy as np

from zerorate.identify.models.model import ArmaModel

if TYPE_CHECKING:
    from zerorate.identify.study.result import Identification

__all__ = ["slow_ratio", "variance_of_mean"]

_LEAST_MEANS: Final = 30
"""Fewer tell their variance no better than to a quarter."""


def slow_ratio(found: Identification) -> float:
    """Return the variance of the segments' means over what the model says of it.

    Orders are chosen by the next sample, to which a slow drift adds next to nothing: a model can
    leave white residuals and know nothing of the drift, which then shows here.

    Parameters
    ----------
    found : Identification
        Record and model.

    Returns
    -------
    float
        About 1 where the model knows all there is; NaN where fewer than 30 segments have samples
        or the model is not stationary.
    """
    means = found.tests.segment_means[np.isfinite(found.tests.segment_means)]
    if means.size < _LEAST_MEANS or not found.model.stationary:
        return math.nan
    n = max(round(found.tests.segment * found.rate), 1)
    return float(np.var(means, ddof=1)) / variance_of_mean(found.model, n)


def variance_of_mean(model: ArmaModel, n: int) -> float:
    """Return the variance of the mean of n samples of a stationary process."""
    gamma = model.autocovariance(n - 1)
    weights = 1.0 - np.arange(n) / n
    return float(2.0 * (weights @ gamma) - gamma[0]) / n
