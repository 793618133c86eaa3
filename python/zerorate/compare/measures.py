"""Measures of a comparison, NaN where one cannot be taken of this record."""

import math
from collections.abc import Callable

import numpy as np
import numpy.typing as npt

from zerorate import metrics
from zerorate.compare.methods import Answer

__all__ = ["allan", "consistency", "if_possible"]

Floats = npt.NDArray[np.float64]
Flags = npt.NDArray[np.bool_]


def if_possible(measure: Callable[[], object]) -> float:
    """Return a measure, or NaN where the record is too short, too gappy or constant for it."""
    try:
        return np.asarray(measure(), dtype=np.float64).item()
    except ValueError:
        return math.nan


def consistency(found: Answer, where: Flags) -> float:
    """Return the mean normalised innovation squared of some samples, NaN without innovations.

    A sample in what the method takes for motion is not used, and has none.
    """
    innovation, variance = found.innovation, found.innovation_variance
    if innovation is None or variance is None:
        return math.nan
    known = where & (variance > 0.0)
    if found.at_rest is not None:
        known &= found.at_rest
    honest = np.where(known, variance, 1.0)
    return if_possible(lambda: metrics.nis(innovation, honest, where=known))


def allan(z: Floats, found: Answer, rate: float) -> float:
    """Return the ratio of Allan deviations at ten times the memory."""
    return if_possible(lambda: metrics.allan_ratio(z, found.estimate, rate, found.memory).ratio[0])
