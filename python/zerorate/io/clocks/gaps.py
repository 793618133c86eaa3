"""Gaps in a log: missing samples found from stamps that can be late, early or coarse.

A long step alone is no gap: a stamp can be late, or a logger can write an old stamp, and the next
stamps compensate. A gap is a lasting shift of the stamps against a uniform clock. So each long step
is tested by the deviations from this clock in a few rows before and after it.
"""

from __future__ import annotations

import warnings
from itertools import pairwise

import numpy as np

from zerorate.record.log import LogError
from zerorate.types import Floats, Integers

LONG_STEP_PERIODS = 1.5  # periods
WINDOW_ROWS = 15  # rows on each side of a step to test it
LONG_WINDOW_ROWS = 100  # rows on each side of a step that show if a shift lasts
MAX_ROUNDS = 10
MAX_MOVED_PART = 0.05  # share of rows: if more are late, no rows are moved
MAX_GROWTH = 10  # missing samples per present sample
MAX_ROWS = 1_000_000_000


def count_missing(stamps: Floats, period: float) -> Floats:
    """Return the number of missing samples in each step of the stamps, shape (n - 1,).

    Raises
    ------
    LogError
        If the gaps are too long to fill.
    """
    missing = _correct_missing(stamps, _count_at_long_steps(stamps, period), period)
    return _move_runs(stamps, missing, period)


def _count_at_long_steps(stamps: Floats, period: float) -> Floats:
    """Return the number of missing samples in each step, shape (n - 1,)."""
    missing = np.zeros(len(stamps) - 1)
    long = np.flatnonzero(np.diff(stamps) > LONG_STEP_PERIODS * period)
    if long.size:
        deviation = stamps - period * np.arange(len(stamps))
        missing[long] = np.maximum(np.rint(_find_shifts(deviation, long) / period), 0)
    return missing


def _find_shifts(deviation: Floats, long: Integers) -> Floats:
    """Return the lasting shift of the deviation at each long step.

    The lowest, middle and highest deviations on both sides are compared, and the smallest change is
    used: a late stamp changes only the highest, an old stamp only the lowest. A side ends at the
    next long step.
    """
    first = np.concatenate(([0], long[:-1] + 1))
    last = np.concatenate((long[1:], [len(deviation) - 1]))
    offsets = np.arange(WINDOW_ROWS)
    before = _side_levels(deviation, long[:, None] - offsets, first[:, None], long[:, None])
    after = _side_levels(deviation, long[:, None] + 1 + offsets, long[:, None] + 1, last[:, None])
    change = after - before
    return np.asarray(change[np.abs(change).argmin(axis=0), np.arange(long.size)])


def _side_levels(deviation: Floats, rows: Integers, first: Integers, last: Integers) -> Floats:
    inside = (rows >= first) & (rows <= last)
    values = np.where(inside, deviation[np.clip(rows, first, last)], np.nan)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RuntimeWarning)
        return np.stack(
            (np.nanmin(values, axis=1), np.nanmedian(values, axis=1), np.nanmax(values, axis=1))
        )


def _correct_missing(stamps: Floats, missing: Floats, period: float) -> Floats:
    """Return the number of missing samples, corrected by the later stamps.

    If a gap is filled correctly, the deviations around it have the same level. After a stall that
    the clock compensates, the level falls.
    """
    for width in (WINDOW_ROWS, LONG_WINDOW_ROWS):
        for _ in range(MAX_ROUNDS):
            gaps = np.flatnonzero(missing)
            deviation = stamps - period * grid_indices(missing, stamps)
            if not gaps.size or np.ptp(deviation) < 0.5 * period:
                return missing
            before = window_medians(deviation, gaps - width + 1, width)
            after = window_medians(deviation, gaps + 1, width)
            corrections = _thin_corrections(np.rint((after - before) / period), gaps, width)
            if not corrections.any():
                break
            missing[gaps] = np.maximum(missing[gaps] + corrections, 0)
    return missing


def _move_runs(stamps: Floats, missing: Floats, period: float) -> Floats:
    """Return the number of missing samples after moving runs of rows to fit their stamps.

    A run between two gaps may be one place off, if jitter made one gap look shorter. It is moved
    only if there is room; late and old stamps among regular rows have none.
    """
    indices = grid_indices(missing, stamps)
    deviation = stamps - period * indices
    if not missing.any() or np.ptp(deviation) < 0.5 * period:
        return missing
    off = np.rint((deviation - _block_medians(deviation)) / period).astype(np.int64)
    if np.mean(off != 0) > MAX_MOVED_PART:
        return missing
    bounds = np.concatenate(([0], np.flatnonzero(np.diff(off)) + 1, [len(off)]))
    for first, stop in pairwise(bounds):
        moved = off[first]
        fits_before = first == 0 or indices[first] + moved > indices[first - 1]
        fits_after = stop == len(off) or indices[stop - 1] + moved < indices[stop]
        if moved and fits_before and fits_after:
            indices[first:stop] += moved
    return np.diff(indices) - 1.0


def _block_medians(deviation: Floats) -> Floats:
    """Return, for each row, the median of the rows around its block of rows."""
    starts = np.arange(0, len(deviation), LONG_WINDOW_ROWS // 2)
    blocks = window_medians(deviation, starts - LONG_WINDOW_ROWS, 5 * LONG_WINDOW_ROWS // 2)
    return np.repeat(blocks, LONG_WINDOW_ROWS // 2)[: len(deviation)]


def _thin_corrections(wrong: Floats, gaps: Integers, width: int) -> Floats:
    """Return the corrections, without those that a larger correction nearby explains."""
    thinned = np.zeros(len(wrong))
    nonzero = np.flatnonzero(wrong)
    for i in nonzero[np.argsort(-np.abs(wrong[nonzero]), kind="stable")]:
        first, stop = np.searchsorted(gaps, (gaps[i] - width, gaps[i] + width + 1))
        if not thinned[first:stop].any():
            thinned[i] = wrong[i]
    return thinned


def window_medians(values: Floats, first: Integers, width: int) -> Floats:
    """Return the median of `width` rows from each first row on, within the log."""
    result = np.full(len(first), np.nan)
    for block in range(0, len(first), 10_000):
        rows = first[block : block + 10_000, None] + np.arange(width)
        inside = (rows >= 0) & (rows < len(values))
        window_values = np.where(inside, values[np.clip(rows, 0, len(values) - 1)], np.nan)
        has_rows = inside.any(axis=1)
        result[block : block + 10_000][has_rows] = np.nanmedian(window_values[has_rows], axis=1)
    return result


def grid_indices(missing: Floats, stamps: Floats) -> Integers:
    """Return the grid index of each row, shape (n,); LogError if the grid gets too long."""
    _check_growth(missing, np.diff(stamps))
    return np.concatenate(([0], np.cumsum(1 + missing))).astype(np.int64)


def _check_growth(missing: Floats, steps: Floats) -> None:
    n = len(steps) + 1
    total = float(missing.sum())
    if total > MAX_GROWTH * n or n + total > MAX_ROWS:
        row = int(np.argmax(missing)) + 1
        raise LogError(
            f"the gap of {steps[row - 1]:g} s before row {row} (counting from 0) and others "
            f"would add {total:.3g} missing samples to {n}; cut the log there"
        )
