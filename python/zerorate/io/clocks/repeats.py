"""Rows that repeat the one before, as a sensor slower than its log leaves them, and its own clock.

Such a log holds each sample until the next: the rows at which something changes are as regular as
the sensor, and what changes jumps by any amount. A coarse or quiet sensor repeats values as well,
but at random moments, and changes by its least step.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Final

import numpy as np

from zerorate.io.clocks.clock import clock_through
from zerorate.io.clocks.gaps import WINDOW
from zerorate.io.clocks.grid import Grid
from zerorate.types import Booleans, Floats, Integers

HEAD: Final = 1 << 15
"""Rows at the beginning of a log that tell whether its sensor is slower."""
LEAST: Final = 1 + 2 / WINDOW
"""Rows a sample: repeats so often that a gap of the sensor is told from them."""
_CHANGES: Final = 256
"""Changes over which sensor and log keep their phase."""
FEWEST_CHANGES: Final = 4 * _CHANGES
"""Changes that a sensor is judged by at least."""
_CERTAIN: Final = 10.0
"""Standard deviations by which chance does not come near the power of a clock."""
_OFF: Final = 1.25
"""Rows by which a run may differ from that, one for it is whole and some for what is read late."""
_MOST: Final = 0.9
"""Part of the runs that are so."""
_LATE: Final = 0.25
"""Part of the power of a clock without fault that is left where its ticks are seen late."""
_EXCESS: Final = 10.0
"""Rows that repeat for each one that chance would let repeat."""


def repeated(values: Floats, before: Floats | None = None) -> Booleans:
    """Return which rows (n, k) repeat the one before; the first is compared with one given."""
    again = np.zeros(len(values), np.bool_)
    again[1:] = _same(values[1:], values[:-1])
    if before is not None:
        again[:1] = _same(values[:1], before[None])
    return again


def _same(rows: Floats, others: Floats) -> Booleans:
    missing = np.isnan(rows)
    equal = (rows == others) | (missing & np.isnan(others))
    return np.asarray(equal.all(axis=1) & ~missing.all(axis=1))


def rows_held(values: Floats, place: Integers) -> float | None:
    """Return how many rows hold each sample, None unless the sensor is slower for certain.

    ``place`` is where the rows (n, k) stand on their own grid, shape (n,).
    """
    again = repeated(values)
    first = place[~again]
    if len(place) < LEAST * len(first) or len(first) < FEWEST_CHANGES:
        return None
    held = _period(first) if _abrupt(values, again) else None
    return held if held is not None and _even(first, held) else None


def _even(first: Integers, held: float) -> bool:
    """Whether runs are as long as samples are held: a pattern has its period too, but others."""
    off = np.abs(np.diff(first) - held)
    return bool((off <= max(_OFF, held / 4)).mean() >= _MOST)


def _period(first: Integers) -> float | None:
    """Return the rows from one change to the next, None if their moments are random.

    The power of the moments at any frequency is 1 on average if they are, and many times that at
    the frequency of a clock, whose ticks may also be late or leave out some.
    """
    spans = first[: len(first) // _CHANGES * _CHANGES].reshape(-1, _CHANGES)
    span = float(np.median(spans[:, -1] - spans[:, 0]))
    guess = (_CHANGES - 1) / span
    # Ticks that are left out make the clock look slower.
    low, high = 0.9 * guess, min(1.3 * guess, 1 / LEAST)
    # Whole rows have the same power at f and 1 - f: more runs of one row than of three tell f.
    runs = np.diff(first)
    if np.count_nonzero(runs == 1) > np.count_nonzero(runs == 3):
        low = max(low, 0.5 - 1 / span)
    else:
        high = min(high, 0.5 + 1 / span)
    frequencies = np.arange(low, high, 0.25 / span)
    if not frequencies.size:
        return None
    turns = 2j * np.pi * (spans - spans[:, :1])
    power = [float(np.mean(np.abs(np.exp(f * turns).sum(axis=1)) ** 2)) for f in frequencies]
    best = int(np.argmax(power))
    frequency = float(frequencies[best])
    # Each change is seen in the row after it: up to a whole row late.
    whole = (_CHANGES * np.sinc(frequency)) ** 2
    chance = _CHANGES * (1 + _CERTAIN / math.sqrt(len(spans)))
    return 1 / frequency if power[best] >= max(chance, _LATE * whole) else None


def _abrupt(values: Floats, again: Booleans) -> bool:
    """Whether far more rows change by nothing at all than by the least step of each column.

    By chance no change is about as probable as one step up or one down in any of the columns.
    """
    with np.errstate(over="ignore", invalid="ignore"):
        steps = np.abs(np.diff(values, axis=0))
    least = np.where(steps > 0, steps, np.inf).min(axis=0)
    moving = np.isfinite(least)
    small = (steps[:, moving] <= 1.5 * least[moving]).all(axis=1) & ~again[1:]
    by_chance = float(small.sum()) / (3.0 ** int(moving.sum()) - 1)
    return bool(moving.any() and again.sum() >= _EXCESS * by_chance)


def slower(grid: Grid, again: Booleans, held: float) -> Grid:
    """Return the grid of a sensor whose samples are held for about so many rows of a log's grid.

    A sample that happens to equal the one before is taken from the row in which it stands.
    """
    place = grid.place
    first = np.flatnonzero(~again)
    ticks = _ticks(place[first], 1 / held)
    rate, deviation = clock_through(place[first] / grid.rate, ticks)
    used, spread = _with_equal(first, ticks, place, grid.rate / rate)
    gaps = np.diff(spread) > 1
    steps = np.diff(place[used])[gaps] / grid.rate
    late = np.abs(deviation) if grid.report.stamped else np.zeros(1)
    length = int(spread[-1]) + 1
    report = replace(
        grid.report,
        rate=rate,
        jitter_rms=float(np.sqrt(np.mean(late**2))),
        jitter_max=float(late.max()),
        gap_count=int(gaps.sum()),
        missing_count=length - len(used),
        longest_gap=float(steps.max()) if steps.size else 0.0,
        repeat_count=len(again) - len(used),
    )
    kept = None if grid.kept is None else grid.kept[used]
    return Grid(rate, length, report, spread, used, grid.offset, kept)


def _ticks(first: Integers, frequency: float) -> Integers:
    """Return the number of the tick, from 0, that each change belongs to, all different."""
    starts = np.arange(0, max(len(first) - _CHANGES // 2, 1), _CHANGES)
    phases = np.add.reduceat(np.exp(2j * np.pi * frequency * (first - first[0])), starts)
    centres = np.add.reduceat(first, starts) / np.diff(np.append(starts, len(first)))
    ahead = np.interp(first, centres, np.unwrap(np.angle(phases)) / (2 * np.pi))
    ticks = np.rint(frequency * (first - first[0]) - ahead).astype(np.int64)
    # Of two changes near one tick, one was seen late or the other early.
    count = np.arange(len(ticks))
    after = np.maximum.accumulate(ticks - count)
    before = np.minimum.accumulate((ticks - count)[::-1])[::-1]
    ticks = (after + before) // 2 + count
    return np.asarray(ticks - ticks[0])


def _with_equal(
    first: Integers, spread: Integers, place: Integers, held: float
) -> tuple[Integers, Integers]:
    """Return rows and their places on the sensor's grid, with rows where it did not change.

    ``first`` and ``spread`` are those of the changes, ``place`` that of all rows on their own.
    """
    missing = np.diff(spread) - 1
    change = np.repeat(np.arange(len(missing)), missing)
    which = 1 + np.arange(len(change)) - np.repeat(np.cumsum(missing) - missing, missing)
    sought = np.rint(place[first[change]] + which * held).astype(np.int64)
    rows = np.searchsorted(place, sought)
    # A row that the log lost, or that is of the next change, tells nothing.
    there = (rows < first[change + 1]) & (place[np.minimum(rows, len(place) - 1)] == sought)
    used = np.concatenate((first, rows[there]))
    spread = np.concatenate((spread, (spread[change] + which)[there]))
    order = np.argsort(spread, kind="stable")
    return used[order], spread[order]
