"""Gaps in a log: missing samples found from timestamps that may be late, early or coarse.

A long step alone is no gap: a stamp may come late, or a logger may write an old one, and the
next stamps make up for it. A gap is a shift of the stamps' level against a uniform clock that
stays. So each long step is judged by the deviations from the uniform clock in a few rows before
and after it.
"""

from __future__ import annotations

import warnings
from itertools import pairwise

import numpy as np

from zerorate.record.log import LogError
from zerorate.types import Floats, Integers

LONG_STEP = 1.5  # periods
WINDOW = 15  # rows on each side of a step that judge it
LONG_WINDOW = 100  # rows on each side that show whether a gap lasts
ROUNDS = 10
RARE = 0.05  # part of the rows: stamps late more often than this move no rows
MAX_GROWTH = 10  # missing samples for each one present
MAX_ROWS = 1_000_000_000


def missing_samples(stamps: Floats, period: float) -> Floats:
    """Return how many samples are missing in each step of the stamps, shape (n - 1,).

    Raises
    ------
    LogError
        If the gaps are too long to fill.
    """
    missing = _settled(stamps, _missing(stamps, period), period)
    return _runs_moved(stamps, missing, period)


def _missing(stamps: Floats, period: float) -> Floats:
    """Return how many samples are missing in each step, shape (n - 1,)."""
    missing = np.zeros(len(stamps) - 1)
    long = np.flatnonzero(np.diff(stamps) > LONG_STEP * period)
    if long.size:
        deviation = stamps - period * np.arange(len(stamps))
        missing[long] = np.maximum(np.rint(_shift(deviation, long) / period), 0)
    return missing


def _shift(deviation: Floats, long: Integers) -> Floats:
    """Return the lasting shift of the deviation at each long step.

    Lowest, middle and highest deviation of both sides are compared, and the smallest change
    counts: a late stamp moves only the highest, an old one only the lowest. A side ends at the
    next long step.
    """
    first = np.concatenate(([0], long[:-1] + 1))
    last = np.concatenate((long[1:], [len(deviation) - 1]))
    reach = np.arange(WINDOW)
    before = _levels(deviation, long[:, None] - reach, first[:, None], long[:, None])
    after = _levels(deviation, long[:, None] + 1 + reach, long[:, None] + 1, last[:, None])
    change = after - before
    return np.asarray(change[np.abs(change).argmin(axis=0), np.arange(long.size)])


def _levels(deviation: Floats, rows: Integers, first: Integers, last: Integers) -> Floats:
    inside = (rows >= first) & (rows <= last)
    values = np.where(inside, deviation[np.clip(rows, first, last)], np.nan)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RuntimeWarning)
        return np.stack(
            (np.nanmin(values, axis=1), np.nanmedian(values, axis=1), np.nanmax(values, axis=1))
        )


def _settled(stamps: Floats, missing: Floats, period: float) -> Floats:
    """Return the missing samples corrected by how the stamps go on.

    Around a rightly filled gap the stamps keep their level on the grid, other gaps being filled
    too; after a stall the clock makes up for, they fall back.
    """
    for width in (WINDOW, LONG_WINDOW):
        for _ in range(ROUNDS):
            gaps = np.flatnonzero(missing)
            deviation = stamps - period * places(missing, stamps)
            if not gaps.size or np.ptp(deviation) < 0.5 * period:
                return missing
            before = medians(deviation, gaps - width + 1, width)
            after = medians(deviation, gaps + 1, width)
            wrong = _apart(np.rint((after - before) / period), gaps, width)
            if not wrong.any():
                break
            missing[gaps] = np.maximum(missing[gaps] + wrong, 0)
    return missing


def _runs_moved(stamps: Floats, missing: Floats, period: float) -> Floats:
    """Return the missing samples with runs of rows moved to where their stamps say.

    A run between two gaps may lie a place off where jitter made one of the gaps look shorter.
    It is moved if there is room: late and old stamps among regular rows have none.
    """
    place = places(missing, stamps)
    deviation = stamps - period * place
    if not missing.any() or np.ptp(deviation) < 0.5 * period:
        return missing
    off = np.rint((deviation - _block_level(deviation)) / period).astype(np.int64)
    if np.mean(off != 0) > RARE:
        return missing
    bounds = np.concatenate(([0], np.flatnonzero(np.diff(off)) + 1, [len(off)]))
    for first, stop in pairwise(bounds):
        moved = off[first]
        fits_before = first == 0 or place[first] + moved > place[first - 1]
        fits_after = stop == len(off) or place[stop - 1] + moved < place[stop]
        if moved and fits_before and fits_after:
            place[first:stop] += moved
    return np.diff(place) - 1.0


def _block_level(deviation: Floats) -> Floats:
    """Return the median of the rows around each block of rows, for each row."""
    starts = np.arange(0, len(deviation), LONG_WINDOW // 2)
    blocks = medians(deviation, starts - LONG_WINDOW, 5 * LONG_WINDOW // 2)
    return np.repeat(blocks, LONG_WINDOW // 2)[: len(deviation)]


def _apart(wrong: Floats, gaps: Integers, width: int) -> Floats:
    """Return the corrections without those that a larger one close by explains."""
    kept = np.zeros(len(wrong))
    some = np.flatnonzero(wrong)
    for i in some[np.argsort(-np.abs(wrong[some]), kind="stable")]:
        first, stop = np.searchsorted(gaps, (gaps[i] - width, gaps[i] + width + 1))
        if not kept[first:stop].any():
            kept[i] = wrong[i]
    return kept


def medians(values: Floats, first: Integers, width: int) -> Floats:
    """Return the median of the rows from each first one on, within the log."""
    found = np.full(len(first), np.nan)
    for block in range(0, len(first), 10_000):
        rows = first[block : block + 10_000, None] + np.arange(width)
        inside = (rows >= 0) & (rows < len(values))
        known = np.where(inside, values[np.clip(rows, 0, len(values) - 1)], np.nan)
        some = inside.any(axis=1)
        found[block : block + 10_000][some] = np.nanmedian(known[some], axis=1)
    return found


def places(missing: Floats, stamps: Floats) -> Integers:
    """Return each row's place on the grid, shape (n,); LogError if it grows too long."""
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
