"""Rows of a comparison, and measures for several kinds of recordings."""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from zerorate import metrics
from zerorate.tasks.compare.methods import AxisResult
from zerorate.types import Booleans

ERROR_MEASURES: Final = frozenset(
    (
        *("coasting_10", "coasting_60"),
        *("compensated_rmse", "angle_drift", "smooth_rmse"),
        *(f"{name}_{horizon}" for name in ("growth", "smooth_growth") for horizon in (1, 10, 60)),
    )
)
"""Error measures, which are compared with their values on the clean recording."""

DEGRADATION_SUFFIX: Final = "_degradation"
"""Suffix of an error's name for its ratio to the error on the clean recording."""


@dataclass(frozen=True)
class Row:
    """Measures of one method on one axis.

    Attributes
    ----------
    source : str
        Name of the recording.
    axis : str
        Name of the channel, or ``"all"`` if the axes are measured together.
    method : str
        Name of the method.
    angle : str
        Unit of angles in the values: ``"rad"``, or the recording's unit times s if it is no known
        rate.
    values : mapping of str to float
        Measures by name, in SI except for angles; NaN if a measure has no meaning.
    causal : bool
        True if the method used no later samples. This is known for methods of the package, and
        tested for your own methods.

    Examples
    --------
    >>> import zerorate as zr
    >>> recording = zr.simulate_motion("hand", duration=30.0, seed=1).recording()
    >>> row = zr.tasks.compare.compare_methods([recording], ["raw"])[0].rows[0]
    >>> row.method, row.axis, row.angle, row.causal
    ('raw', 'all', 'rad', True)
    """

    source: str
    axis: str
    method: str
    angle: str
    values: Mapping[str, float]
    causal: bool = True


def add_degradation(row: Row, clean: Row) -> Row:
    """Return a contaminated recording's row with the ratios to the clean recording's errors."""
    ratios = {
        f"{name}{DEGRADATION_SUFFIX}": value / clean.values[name]
        if clean.values[name] > 0.0
        else math.nan
        for name, value in row.values.items()
        if name in ERROR_MEASURES
    }
    return replace(row, values={**row.values, **ratios})


def measure_or_nan(measure: Callable[[], object]) -> float:
    """Return a measure; NaN if the record is constant, too short, or has too many gaps."""
    try:
        return np.asarray(measure(), dtype=np.float64).item()
    except ValueError:
        return math.nan


def mean_nis(result: AxisResult, where: Booleans) -> float:
    """Return the mean normalised innovation squared over some samples; NaN without innovations.

    In motion, a method has no innovation.
    """
    innovation, variance = result.innovation, result.innovation_variance
    if innovation is None or variance is None:
        return math.nan
    counted = where & (variance > 0.0)
    if result.at_rest is not None:
        counted &= result.at_rest
    positive = np.where(counted, variance, 1.0)
    return measure_or_nan(lambda: metrics.nis(innovation, positive, where=counted))
