"""Outliers among the logs of a batch."""

import math
from collections import defaultdict
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from statistics import NormalDist
from typing import Final, NamedTuple

import numpy as np

from zerorate.tasks.batch.command import Quantity, Row
from zerorate.types import Floats

MIN_LOGS: Final = 8
"""Smallest number of sensors to estimate the spread of their kind."""

EXPECTED_FALSE_ALARMS: Final = 0.1
"""Expected number of outliers in a whole batch of equal sensors with normal differences."""

_SIGMA_PER_MAD: Final = 1.4826022185056018
"""Ratio of standard deviation to median absolute deviation of a normal distribution."""

_MAD_FREEDOM_PER_VALUE: Final = 0.4
"""Degrees of freedom per value of a spread from the median absolute deviation.

Simulated with 8 to 300 normal values. Their distances from the median, in such spreads, have the
tails of Student's t. The degrees of freedom are 0.40 to 0.48 per value, for tails from 1 in 100 to
1 in 100 000.
"""

_MIN_RELATIVE_SPREAD: Final = 0.01
"""Smallest relative spread, because copies of a log have no spread."""


@dataclass(frozen=True)
class Outlier:
    """Log with a value far from the other logs' values.

    Parameters
    ----------
    log : str
        Name of the log.
    axis : str
        Axis of the log.
    quantity : str
        Column of the summary.
    unit : str
        Unit of the value.
    value, median : float
        Value of the log, and median of all logs with this axis and unit.
    deviations : float
        Distance of the value from the median, in standard deviations of all logs. The standard
        deviation is estimated from the median absolute deviation, so outliers do not increase it.
    times : float or None
        Ratio of value to median; None for quantities that can be negative.
    """

    log: str
    axis: str
    quantity: str
    unit: str
    value: float
    median: float
    deviations: float
    times: float | None


@dataclass(frozen=True)
class Fleet:
    """Result of the comparison of logs.

    Parameters
    ----------
    outliers : tuple of Outlier
        Outliers, the largest first.
    untested_axes : frozenset of (str, str)
        Pairs of log and axis that were not compared, because fewer than eight logs have this axis
        with this unit.
    """

    outliers: tuple[Outlier, ...]
    untested_axes: frozenset[tuple[str, str]]

    def of(self, log: str, axis: object) -> list[str] | None:
        """Return the quantities in which an axis is an outlier; None if it was not tested."""
        key = (log, str(axis))
        if axis is None or key in self.untested_axes:
            return None
        return self._quantities.get(key, [])

    @cached_property
    def _quantities(self) -> dict[tuple[str, str], list[str]]:
        quantities: dict[tuple[str, str], list[str]] = {}
        for outlier in self.outliers:
            quantities.setdefault((outlier.log, outlier.axis), []).append(outlier.quantity)
        return quantities


class _Sample(NamedTuple):
    """One quantity of one axis, over the logs that have it."""

    quantity: Quantity
    axis: str
    unit: str
    logs: list[str]
    values: Floats
    sigmas: Floats


def fleet_of(logs: Mapping[str, Sequence[Row]], quantities: Sequence[Quantity]) -> Fleet:
    """Compare the logs of a batch, axis by axis and unit by unit.

    The median absolute deviation estimates the spread of the fleet; for positive quantities,
    logarithms are used. A value is an outlier if its distance from the median is larger than by
    chance. The limit depends on the number of all values: a batch of equal sensors has
    `EXPECTED_FALSE_ALARMS` false alarms on average. Two kinds of values are never outliers: values
    within their own standard error of the median, and values of an axis in motion.

    Parameters
    ----------
    logs : mapping of str to sequence of mapping
        Rows of each log, by its name.
    quantities : sequence of Quantity
        Quantities to compare.

    Returns
    -------
    Fleet
        Outliers, and axes that could not be tested.

    Notes
    -----
    The score with the median is from B. Iglewicz, D. C. Hoaglin, "How to Detect and Handle
    Outliers", ASQC, 1993. Its limit of 3.5 is for one sample of moderate size.
    """
    groups: dict[tuple[str, str], list[tuple[str, Row]]] = defaultdict(list)
    for log, rows in logs.items():
        for row in rows:
            groups[str(row["axis"]), str(row["unit"])].append((log, row))
    large = {key: group for key, group in groups.items() if len(group) >= MIN_LOGS}
    small = {(log, key[0]) for key in groups.keys() - large.keys() for log, _ in groups[key]}
    samples = [
        sample
        for (axis, unit), group in large.items()
        for quantity in quantities
        if len((sample := _collect_sample(quantity, axis, unit, group)).logs) >= MIN_LOGS
    ]
    comparisons = sum(len(sample.logs) for sample in samples)
    outliers = [one for sample in samples for one in _find_outliers(sample, comparisons)]
    outliers.sort(key=lambda one: -one.deviations)
    return Fleet(tuple(outliers), frozenset(small))


def _collect_sample(
    quantity: Quantity, axis: str, unit: str, group: Iterable[tuple[str, Row]]
) -> _Sample:
    """Return the comparable values."""
    logs, values, sigmas = [], [], []
    for log, row in group:
        value, sigma = (row.get(name or "") for name in (quantity.column, quantity.sigma))
        usable = isinstance(value, float) and (quantity.signed or value > 0.0)
        if usable and not row.get("moved"):
            logs.append(log)
            values.append(value)
            sigmas.append(sigma or 0.0)
    unit = quantity.unit.format(unit)
    return _Sample(quantity, axis, unit, logs, np.array(values, float), np.array(sigmas, float))


def _find_outliers(sample: _Sample, comparisons: int) -> Iterator[Outlier]:
    quantity, values, sigmas = sample.quantity, sample.values, sample.sigmas
    median = float(np.median(values))
    offsets = values - median if quantity.signed else np.log(values / median)
    errors = sigmas if quantity.signed else sigmas / values
    floor = _MIN_RELATIVE_SPREAD * (abs(median) if quantity.signed else 1.0)
    spread = _SIGMA_PER_MAD * float(np.median(np.abs(offsets)))
    width = np.maximum(errors, max(spread, floor, np.finfo(float).tiny))
    deviations = offsets / width
    scores = np.abs(deviations) if quantity.two_sided or quantity.signed else deviations
    for i in np.flatnonzero(scores > _score_limit(len(values), comparisons)):
        value = float(values[i])
        times = None if quantity.signed else value / median
        yield Outlier(
            sample.logs[i], sample.axis, quantity.column, sample.unit,
            value, median, float(scores[i]), times,
        )  # fmt: skip


def _score_limit(count: int, comparisons: int) -> float:
    """Return the largest distance from the median by chance in `count` values, in spreads.

    Quantile of Student's t by D. L. Wallace, Annals of Mathematical Statistics 30 (1959).
    """
    normal = NormalDist().inv_cdf(1.0 - EXPECTED_FALSE_ALARMS / (2.0 * comparisons))
    freedom = _MAD_FREEDOM_PER_VALUE * count
    scaled = normal * (8.0 * freedom + 3.0) / (8.0 * freedom + 1.0)
    return math.sqrt(freedom * math.expm1(scaled**2 / freedom))
