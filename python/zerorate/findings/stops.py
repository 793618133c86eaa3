"""Where an axis is at a limit that nobody told: by the shape of its samples, hard or soft."""

from __future__ import annotations

import math
from typing import Final, NamedTuple

import numpy as np

from zerorate.record.runs import runs, runs_of_rows
from zerorate.types import Booleans, Floats, Integers

_FEWEST: Final = 100
"""Samples without which nothing is told."""
_STEPS: Final = 20.0
"""Steps of the numbers that half the span of an axis must have."""
_RUN: Final = 3
"""Samples at the limit next to each other that may tell it alone; fewer must be many."""
_CORNER: Final = 2.0
"""How many times steeper than a smooth peak the edges of a plateau are."""
_PEAK: Final = 4.6
"""Samples in the highest bin of equal smooth peaks over those of a bin beneath: a bin of width w
holds them as √w, and the eight bins beneath (√9 − √1) √w / 8 on average, or fewer on a grid."""
_CHANCE: Final = 1e-7
"""Chance of so many equal samples that is told: a log has a dozen axes and signs, people many."""
_TOP: Final = 1000
"""Largest samples, which tell the step where the whole tells none."""
_BAND: Final = 0.03
"""Part of the largest value in which a limit is that is not flat."""
_TOUCHES: Final = 5
"""Excursions into that band without which no soft limit is told."""
_FLAT: Final = 10.0
"""Steepness at the edge times time in the band over its height: 4 of a parabola, up to 7 as it is
sampled three times."""
_LONGEST: Final = 0.5
"""Seconds in the band of an excursion; a sensor that stays longer is turned evenly."""


class Stop(NamedTuple):
    """Rows at a limit, the longest run of them, the value, and whether all are equal there."""

    rows: Integers
    longest: int
    value: float
    hard: bool


class _Plateaus(NamedTuple):
    """First and last rows of runs, and how far the samples before and after lie beneath."""

    first: Integers
    last: Integers
    before: Floats
    after: Floats

    @property
    def length(self) -> Integers:
        return self.last - self.first + 1


def stop_of(column: Floats, others: Floats, rate: float, step: float) -> Stop | None:
    """Return where an axis is at its largest value as at a limit, None if it is not.

    A limit shows in the shape alone: a plateau with corners, which no smooth peak has, or more
    samples equal to the largest than chance puts there; of one that is not flat, in excursions that
    all bend just below the largest value.

    Parameters
    ----------
    column : array of float64, shape (n,)
        Of an axis, or its negative; NaN is no sample.
    others : array of float64, shape (n, 2)
        The other axes: where they stand still too, it is no limit.
    rate : float
        Hz.
    step : float
        Of the numbers, 0 where they are on no grid.
    """
    finite = np.isfinite(column)
    if np.count_nonzero(finite) < _FEWEST:
        return None
    most, least = float(np.fmax.reduce(column)), float(np.fmin.reduce(column))
    reach = 0.5 * (most - least)
    # A limit is on its own side of zero: where a sensor falls to zero it has none.
    if not (most > 0.0 and 0.0 < reach < math.inf):
        return None
    return _hard(column, others, most, reach, step) or _soft(column, most, reach, rate)


def _hard(column: Floats, others: Floats, most: float, reach: float, step: float) -> Stop | None:
    quantum = max(step or _gap(column, most, reach), 1e-9 * reach)
    if reach < _STEPS * quantum:
        return None
    rows = np.flatnonzero(column >= most - 0.5 * quantum)
    if rows.size < _RUN:
        return None
    plateaus = _plateaus(column, rows, most)
    found = (
        _has_corners(plateaus, quantum)
        or _is_long(column, plateaus, quantum)
        or _is_many(column, plateaus, reach, quantum)
    )
    if not found or _stands(others, rows) or _repeats(plateaus, reach, quantum):
        return None
    return Stop(rows, int(plateaus.length.max()), most, True)


def _gap(column: Floats, most: float, reach: float) -> float:
    """Return the smallest difference of the highest values: the step, if they are on a grid."""
    values = column[:0]
    for part in (0.02, 0.2, 2.1):  # all of it is a copy of a long log
        if values.size < _TOP:
            values = column[column >= most - part * reach]
    steps = np.diff(np.unique(np.partition(values, max(0, values.size - _TOP))[-_TOP:]))
    return float(steps.min()) if steps.size else 0.0


def _plateaus(column: Floats, rows: Integers, most: float) -> _Plateaus:
    first, stop = runs_of_rows(rows).T
    around = np.concatenate([[np.nan], column, [np.nan]])
    return _Plateaus(first, stop - 1, most - around[first], most - around[stop + 1])


def _has_corners(plateaus: _Plateaus, quantum: float) -> bool:
    """Whether a plateau begins and ends as no parabola does that is so flat in the middle.

    One that stays within a step for L samples is, one sample further, at most
    ((L + 1) / (L − 1))² steps beneath.
    """
    long = plateaus.length >= _RUN
    length = plateaus.length[long].astype(np.float64)
    bound = _CORNER * quantum * np.square((length + 1.0) / (length - 1.0))
    lower = np.minimum(plateaus.before[long], plateaus.after[long])
    return bool((lower > bound).any())


def _is_long(column: Floats, plateaus: _Plateaus, quantum: float) -> bool:
    """Whether a run is longer than chance makes it as often as neighbours are equal elsewhere."""
    length = int(plateaus.length.max())
    least = np.nanmin(column)
    same = np.abs(np.diff(column)) < 0.5 * quantum
    inside = (column[1:] < np.nanmax(column) - 0.5 * quantum) & (column[1:] > least + 0.5 * quantum)
    elsewhere = same[inside]
    blocks = elsewhere[: elsewhere.size // _FEWEST * _FEWEST].reshape(-1, _FEWEST)
    usual = float(np.quantile(blocks.mean(axis=1), 0.95)) if len(blocks) else 1.0
    return length >= _RUN and bool(column.size * usual ** (length - 1) < _CHANCE)


def _is_many(column: Floats, plateaus: _Plateaus, reach: float, quantum: float) -> bool:
    """Whether more samples equal the largest than the bins beneath let expect."""
    count, off = int(plateaus.length.sum()), np.fmax(plateaus.before, plateaus.after)
    # Where noise is less than a step, a rest flickers between neighbours.
    if not np.median(off[np.isfinite(off)]) >= 3.0 * quantum:
        return False
    most = float(np.nanmax(column))
    beneath = np.count_nonzero(column >= most - 8.5 * quantum) - count
    near = column[1:-1] >= most - 0.25 * reach
    near &= column[1:-1] < most - 0.5 * quantum
    bends = np.abs(np.diff(column, 2))[near]
    noise = float(np.nanmedian(bends)) / (0.6745 * math.sqrt(6.0)) if bends.size else 0.0
    expected = (beneath + 1.0) / 8.0 * (1.0 if noise > 4.0 * quantum else _PEAK)
    return _chance(count, expected) < _CHANCE


def _chance(count: int, expected: float) -> float:
    """Return a bound of the chance of a count or more where another is expected (Chernoff)."""
    if count <= expected:
        return 1.0
    return math.exp(count - expected - count * math.log(count / expected))


def _stands(others: Floats, rows: Integers) -> bool:
    """Whether the other axes keep their numbers while this one does: a motion without noise."""
    next_to = rows[1:][np.diff(rows) == 1]
    if next_to.size < _RUN - 1:
        return False
    changes = (others[next_to] != others[next_to - 1]).any(axis=1)
    return bool(np.mean(changes) < 0.3)


def _repeats(plateaus: _Plateaus, reach: float, quantum: float) -> bool:
    """Whether most plateaus have the same samples beside them: a motion that repeats exactly."""
    sides = np.stack([plateaus.before, plateaus.after], axis=1)
    sides = np.sort(sides[np.isfinite(sides).all(axis=1)], axis=1)
    if len(sides) < _RUN:
        return False
    off = np.abs(sides - np.median(sides, axis=0)).max(axis=1)
    return bool(np.mean(off < max(0.5 * quantum, 1e-6 * reach)) > 0.8)


def _soft(column: Floats, most: float, reach: float, rate: float) -> Stop | None:
    """Return excursions that bend within a band beneath the largest value, as no peak does."""
    height = _BAND * reach
    inside = column >= most - height
    if np.count_nonzero(inside) < _RUN * _TOUCHES:
        return None
    first, stop = runs(inside).T
    last = stop - 1
    kept = (first >= 2) & (last < len(column) - 2) & (last - first + 1 <= _LONGEST * rate)
    first, last = first[kept], last[kept]
    if first.size < _TOUCHES:
        return None
    slope = np.fmin(column[first - 1] - column[first - 2], column[last + 1] - column[last + 2])
    length = last - first + 1
    flat = (length >= _RUN) & (slope * length > _FLAT * height)
    if np.count_nonzero(flat) < _TOUCHES or np.count_nonzero(flat) < 0.5 * first.size:
        return None
    rows = np.flatnonzero(_between(first[flat], last[flat], len(column)))
    return Stop(rows, int(length[flat].max()), most, False)


def _between(first: Integers, last: Integers, n: int) -> Booleans:
    marks = np.zeros(n + 1, dtype=np.int64)
    marks[first] += 1
    marks[last + 1] -= 1
    return np.asarray(np.cumsum(marks[:-1]) > 0)
