"""Rows of a comparison, and the measures that several kinds of recording share."""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from zerorate import metrics
from zerorate.compare.methods import AxisResult
from zerorate.types import Booleans

__all__ = ["Row", "consistency", "if_possible"]


@dataclass(frozen=True)
class Row:
    """Measures of one method on one axis.

    Attributes
    ----------
    source : str
        Of the recording.
    axis : str
        The channel's name, or ``"all"`` where the axes are measured together.
    method : str
        Its name.
    angle : str
        Unit of angles in the values: ``"rad"``, or the recording's own unit times s where that is
        not known to be a rate.
    values : mapping of str to float
        Measures by name, in SI otherwise; NaN where one means nothing.
    """

    source: str
    axis: str
    method: str
    angle: str
    values: Mapping[str, float]


def if_possible(measure: Callable[[], object]) -> float:
    """Return a measure, or NaN where the record is too short, too gappy or constant for it."""
    try:
        return np.asarray(measure(), dtype=np.float64).item()
    except ValueError:
        return math.nan


def consistency(found: AxisResult, where: Booleans) -> float:
    """Return the mean normalised innovation squared of some samples, NaN without innovations.

    A sample in what the method takes for motion is not used, and has none.
    """
    innovation, variance = found.innovation, found.innovation_variance
    if innovation is None or variance is None:
        return math.nan
    known = where & (variance > 0.0)
    if found.at_rest is not None:
        known &= found.at_rest
    positive = np.where(known, variance, 1.0)
    return if_possible(lambda: metrics.nis(innovation, positive, where=known))
