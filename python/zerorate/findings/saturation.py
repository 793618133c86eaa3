"""Detection of saturation at an unknown limit, hard or soft, from the signal's shape."""

from __future__ import annotations

import math
from typing import Final, NamedTuple

import numpy as np

from zerorate.record.runs import runs, runs_of_rows
from zerorate.types import Booleans, Floats, Integers

_MIN_SAMPLES: Final = 100
"""Smallest number of samples for a finding."""
_MIN_SPAN_STEPS: Final = 20.0
"""Smallest half range of an axis, in steps of its values."""
_MIN_RUN: Final = 3
"""Smallest length of a run at the limit that may be sufficient alone; many shorter runs are needed.
"""
_CORNER_STEEPNESS: Final = 2.0
"""Slope of a plateau's edges over the slope of a smooth peak, for a corner."""
_PEAK_BIN_RATIO: Final = 4.6
"""Ratio of samples in the highest bin of equal smooth peaks to samples in a lower bin. The highest
bin of width w has a number ∝ √w. Each of the eight bins below it has (√9 − √1) √w / 8 on average.
"""
_MAX_CHANCE: Final = 1e-7
"""Largest chance probability of a finding: a log has a dozen axes and signs."""
_TOP_SAMPLES: Final = 1000
"""Number of the largest samples that are searched for the step if the whole record shows none."""
_SOFT_BAND_FRACTION: Final = 0.03
"""Width of the band of a soft limit, as a share of the largest value."""
_MIN_EXCURSIONS: Final = 5
"""Smallest number of excursions into this band for a soft limit."""
_MIN_FLATNESS: Final = 10.0
"""Smallest value of (slope at the edge × time in the band / band height) for a soft limit: it is 4
for a parabola, and up to 7 for three samples.
"""
_MAX_EXCURSION_S: Final = 0.5
"""Longest excursion into the band, s; a longer one is a steady rotation."""


class Saturation(NamedTuple):
    """Rows at a limit, their longest run, the value, and True if all values there are equal."""

    rows: Integers
    longest: int
    value: float
    hard: bool


class _Plateaus(NamedTuple):
    """First and last rows of runs, and depth of the samples before and after them."""

    first: Integers
    last: Integers
    before: Floats
    after: Floats

    @property
    def length(self) -> Integers:
        return self.last - self.first + 1


def find_saturation(
    column: Floats, other_axes: Floats, rate: float, step: float
) -> Saturation | None:
    """Return the saturation of an axis at its largest value, None if there is none.

    Only the shape is used. A hard limit has a plateau with corners, which no smooth peak has, or
    more samples at the largest value than chance explains. A soft limit bends all excursions just
    below the largest value.

    Parameters
    ----------
    column : array of float64, shape (n,)
        Samples of an axis, or their negatives; NaN where missing.
    others : array of float64, shape (n, 2)
        Samples of the other axes. If these are also constant, the value is not a limit.
    rate : float
        Sampling rate, Hz.
    step : float
        Step of the values, 0 if they are not on a grid.
    """
    finite = np.isfinite(column)
    if np.count_nonzero(finite) < _MIN_SAMPLES:
        return None
    largest, smallest = float(np.fmax.reduce(column)), float(np.fmin.reduce(column))
    half_range = 0.5 * (largest - smallest)
    # A limit is not zero: a sensor that falls to zero is not saturated.
    if not (largest > 0.0 and 0.0 < half_range < math.inf):
        return None
    return _find_hard_limit(column, other_axes, largest, half_range, step) or _find_soft_limit(
        column, largest, half_range, rate
    )


def _find_hard_limit(
    column: Floats, other_axes: Floats, largest: float, half_range: float, step: float
) -> Saturation | None:
    quantum = max(step or _smallest_step(column, largest, half_range), 1e-9 * half_range)
    if half_range < _MIN_SPAN_STEPS * quantum:
        return None
    rows = np.flatnonzero(column >= largest - 0.5 * quantum)
    if rows.size < _MIN_RUN:
        return None
    plateaus = _find_plateaus(column, rows, largest)
    is_limit = (
        _has_corners(plateaus, quantum)
        or _has_long_run(column, plateaus, quantum)
        or _has_many_equal(column, plateaus, half_range, quantum)
    )
    if (
        not is_limit
        or _is_standstill(other_axes, rows)
        or _has_exact_repeats(plateaus, half_range, quantum)
    ):
        return None
    return Saturation(rows, int(plateaus.length.max()), largest, True)


def _smallest_step(column: Floats, largest: float, half_range: float) -> float:
    """Return the smallest difference of the highest values: their step, if they are on a grid."""
    values = column[:0]
    for part in (0.02, 0.2, 2.1):  # the whole column is a copy
        if values.size < _TOP_SAMPLES:
            values = column[column >= largest - part * half_range]
    steps = np.diff(
        np.unique(np.partition(values, max(0, values.size - _TOP_SAMPLES))[-_TOP_SAMPLES:])
    )
    return float(steps.min()) if steps.size else 0.0


def _find_plateaus(column: Floats, rows: Integers, largest: float) -> _Plateaus:
    first, stop = runs_of_rows(rows).T
    around = np.concatenate([[np.nan], column, [np.nan]])
    return _Plateaus(first, stop - 1, largest - around[first], largest - around[stop + 1])


def _has_corners(plateaus: _Plateaus, quantum: float) -> bool:
    """Return True if a plateau has sharper corners than an equally flat parabola.

    A parabola that stays within a step for L samples is at most ((L + 1) / (L − 1))² steps lower
    after one more sample.
    """
    long = plateaus.length >= _MIN_RUN
    length = plateaus.length[long].astype(np.float64)
    bound = _CORNER_STEEPNESS * quantum * np.square((length + 1.0) / (length - 1.0))
    lower = np.minimum(plateaus.before[long], plateaus.after[long])
    return bool((lower > bound).any())


def _has_long_run(column: Floats, plateaus: _Plateaus, quantum: float) -> bool:
    """Return True if a run is longer than the usual share of equal neighbours explains."""
    length = int(plateaus.length.max())
    smallest = np.nanmin(column)
    same = np.abs(np.diff(column)) < 0.5 * quantum
    inside = (column[1:] < np.nanmax(column) - 0.5 * quantum) & (
        column[1:] > smallest + 0.5 * quantum
    )
    equal_elsewhere = same[inside]
    blocks = equal_elsewhere[: equal_elsewhere.size // _MIN_SAMPLES * _MIN_SAMPLES].reshape(
        -1, _MIN_SAMPLES
    )
    equal_share = float(np.quantile(blocks.mean(axis=1), 0.95)) if len(blocks) else 1.0
    return length >= _MIN_RUN and bool(column.size * equal_share ** (length - 1) < _MAX_CHANCE)


def _has_many_equal(column: Floats, plateaus: _Plateaus, half_range: float, quantum: float) -> bool:
    """Return True if more samples have the largest value than the lower bins predict."""
    count, drops = int(plateaus.length.sum()), np.fmax(plateaus.before, plateaus.after)
    # With noise below one step, samples at rest alternate between two values.
    if not np.median(drops[np.isfinite(drops)]) >= 3.0 * quantum:
        return False
    largest = float(np.nanmax(column))
    beneath = np.count_nonzero(column >= largest - 8.5 * quantum) - count
    is_near = column[1:-1] >= largest - 0.25 * half_range
    is_near &= column[1:-1] < largest - 0.5 * quantum
    bends = np.abs(np.diff(column, 2))[is_near]
    noise = float(np.nanmedian(bends)) / (0.6745 * math.sqrt(6.0)) if bends.size else 0.0
    expected = (beneath + 1.0) / 8.0 * (1.0 if noise > 4.0 * quantum else _PEAK_BIN_RATIO)
    return _chernoff_bound(count, expected) < _MAX_CHANCE


def _chernoff_bound(count: int, expected: float) -> float:
    """Return Chernoff's bound of the probability of at least a count, given its expectation."""
    if count <= expected:
        return 1.0
    return math.exp(count - expected - count * math.log(count / expected))


def _is_standstill(other_axes: Floats, rows: Integers) -> bool:
    """Return True if the other axes repeat their values together with this axis: no motion."""
    next_to = rows[1:][np.diff(rows) == 1]
    if next_to.size < _MIN_RUN - 1:
        return False
    changes = (other_axes[next_to] != other_axes[next_to - 1]).any(axis=1)
    return bool(np.mean(changes) < 0.3)


def _has_exact_repeats(plateaus: _Plateaus, half_range: float, quantum: float) -> bool:
    """Return True if most plateaus have the same neighbours: a motion that repeats exactly."""
    sides = np.stack([plateaus.before, plateaus.after], axis=1)
    sides = np.sort(sides[np.isfinite(sides).all(axis=1)], axis=1)
    if len(sides) < _MIN_RUN:
        return False
    deviations = np.abs(sides - np.median(sides, axis=0)).max(axis=1)
    return bool(np.mean(deviations < max(0.5 * quantum, 1e-6 * half_range)) > 0.8)


def _find_soft_limit(
    column: Floats, largest: float, half_range: float, rate: float
) -> Saturation | None:
    """Return excursions that bend in a band below the largest value, unlike any peak."""
    height = _SOFT_BAND_FRACTION * half_range
    inside = column >= largest - height
    if np.count_nonzero(inside) < _MIN_RUN * _MIN_EXCURSIONS:
        return None
    first, stop = runs(inside).T
    last = stop - 1
    is_excursion = (
        (first >= 2) & (last < len(column) - 2) & (last - first + 1 <= _MAX_EXCURSION_S * rate)
    )
    first, last = first[is_excursion], last[is_excursion]
    if first.size < _MIN_EXCURSIONS:
        return None
    slope = np.fmin(column[first - 1] - column[first - 2], column[last + 1] - column[last + 2])
    length = last - first + 1
    is_flat = (length >= _MIN_RUN) & (slope * length > _MIN_FLATNESS * height)
    if np.count_nonzero(is_flat) < _MIN_EXCURSIONS or np.count_nonzero(is_flat) < 0.5 * first.size:
        return None
    rows = np.flatnonzero(_mask_ranges(first[is_flat], last[is_flat], len(column)))
    return Saturation(rows, int(length[is_flat].max()), largest, False)


def _mask_ranges(first: Integers, last: Integers, n: int) -> Booleans:
    marks = np.zeros(n + 1, dtype=np.int64)
    marks[first] += 1
    marks[last + 1] -= 1
    return np.asarray(np.cumsum(marks[:-1]) > 0)
