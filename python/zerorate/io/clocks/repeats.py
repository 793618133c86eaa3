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

from zerorate.io.clocks.clock import fit_rate
from zerorate.io.clocks.gaps import WINDOW_ROWS
from zerorate.io.clocks.grid import Grid
from zerorate.types import Booleans, Floats, Integers

HEAD_ROWS: Final = 1 << 15
"""Rows at the beginning of a log for the test for a slower sensor."""
MIN_ROWS_PER_SAMPLE: Final = 1 + 2 / WINDOW_ROWS
"""Rows a sample: repeats so often that they show a gap of the sensor."""
_SPAN_CHANGES: Final = 256
"""Changes over which sensor and log keep their phase."""
MIN_CHANGES: Final = 4 * _SPAN_CHANGES
"""Fewest changes for a decision on a sensor."""
_MIN_POWER_SIGMAS: Final = 10.0
"""Standard deviations by which chance does not come near the power of a clock."""
_RUN_TOLERANCE_ROWS: Final = 1.25
"""Rows by which a run may differ from that, one for it is whole and some for what is read late."""
_MIN_EVEN_PART: Final = 0.9
"""Part of the runs that are so."""
_MIN_POWER_PART: Final = 0.25
"""Part of the power of a clock without fault that is left where its ticks are seen late."""
_MIN_REPEAT_RATIO: Final = 10.0
"""Rows that repeat for each one that chance would let repeat."""


_MANY: Final = 0.125
"""Share of repeating rows from which on they are reported."""
_FEW_ROWS: Final = 16
_EQUAL: Final = 0.02
"""Part of the numbers that a fine sensor has twice in a row, at most."""
_SHORT_RUN: Final = 3
"""Rows that repeat one after the other where they were sent again."""


def find_repeats(values: Floats, before: Floats | None = None) -> Booleans:
    """Return the mask of rows (n, k) that repeat the row before; `before` precedes the first."""
    repeats = np.zeros(len(values), np.bool_)
    repeats[1:] = _are_equal(values[1:], values[:-1])
    if before is not None:
        repeats[:1] = _are_equal(values[:1], before[None])
    return repeats


def _are_equal(rows: Floats, previous: Floats) -> Booleans:
    missing = np.isnan(rows)
    equal = (rows == previous) | (missing & np.isnan(previous))
    return np.asarray(equal.all(axis=1) & ~missing.all(axis=1))


def find_rows_per_sample(values: Floats, indices: Integers) -> float | None:
    """Return the number of rows per sample, None unless the sensor is certainly slower.

    ``indices`` is where the rows (n, k) stand on their own grid, shape (n,).
    """
    repeats = find_repeats(values)
    first = indices[~repeats]
    if len(indices) < MIN_ROWS_PER_SAMPLE * len(first) or len(first) < MIN_CHANGES:
        return None
    rows_per_sample = _find_period(first) if _is_abrupt(values, repeats) else None
    return (
        rows_per_sample
        if rows_per_sample is not None and _is_even(first, rows_per_sample)
        else None
    )


def _is_even(first: Integers, rows_per_sample: float) -> bool:
    """Return True if runs are as long as samples are held; a pattern has other lengths."""
    off = np.abs(np.diff(first) - rows_per_sample)
    return bool((off <= max(_RUN_TOLERANCE_ROWS, rows_per_sample / 4)).mean() >= _MIN_EVEN_PART)


def _find_period(first: Integers) -> float | None:
    """Return the rows from one change to the next, None if their moments are random.

    The power of the moments at any frequency is 1 on average if they are, and many times that at
    the frequency of a clock, whose ticks may also be late or leave out some.
    """
    spans = first[: len(first) // _SPAN_CHANGES * _SPAN_CHANGES].reshape(-1, _SPAN_CHANGES)
    span = float(np.median(spans[:, -1] - spans[:, 0]))
    guess = (_SPAN_CHANGES - 1) / span
    # Ticks that are left out make the clock look slower.
    low, high = 0.9 * guess, min(1.3 * guess, 1 / MIN_ROWS_PER_SAMPLE)
    # Whole rows have the same power at f and 1 - f: more runs of one row than of three decide for
    # f.
    runs = np.diff(first)
    if np.count_nonzero(runs == 1) > np.count_nonzero(runs == 3):
        low = max(low, 0.5 - 1 / span)
    else:
        high = min(high, 0.5 + 1 / span)
    frequencies = np.arange(low, high, 0.25 / span)
    if not frequencies.size:
        return None
    phasors = 2j * np.pi * (spans - spans[:, :1])
    power = [float(np.mean(np.abs(np.exp(f * phasors).sum(axis=1)) ** 2)) for f in frequencies]
    best = int(np.argmax(power))
    frequency = float(frequencies[best])
    # Each change is seen in the row after it: up to a whole row late.
    whole = (_SPAN_CHANGES * np.sinc(frequency)) ** 2
    chance = _SPAN_CHANGES * (1 + _MIN_POWER_SIGMAS / math.sqrt(len(spans)))
    return 1 / frequency if power[best] >= max(chance, _MIN_POWER_PART * whole) else None


def _is_abrupt(values: Floats, repeats: Booleans) -> bool:
    """Return True if far more rows stay the same than change by the least step of each column.

    By chance no change is about as probable as one step up or one down in any of the columns.
    """
    with np.errstate(over="ignore", invalid="ignore"):
        steps = np.abs(np.diff(values, axis=0))
    least = np.where(steps > 0, steps, np.inf).min(axis=0)
    moving = np.isfinite(least)
    small = (steps[:, moving] <= 1.5 * least[moving]).all(axis=1) & ~repeats[1:]
    by_chance = float(small.sum()) / (3.0 ** int(moving.sum()) - 1)
    return bool(moving.any() and repeats.sum() >= _MIN_REPEAT_RATIO * by_chance)


def stamped_again(again: Booleans, seconds: Floats) -> bool:
    """Return True if the rows that repeat the one before are those that have its stamp."""
    if len(again) < _FEW_ROWS or again.mean() < _MANY:
        return False
    same = np.append(False, np.diff(seconds) == 0.0)
    return bool((same & again).sum() >= _MIN_EVEN_PART * max(same.sum(), again.sum()))


def sent_again(values: Floats, again: Booleans, seconds: Floats) -> bool:
    """Return True if rows that repeat the one before, at no clock's moments, are no samples.

    They have the stamp of the one before, and no others have; or they are far more than chance
    would have, and none of them stays for long, as a stuck sensor does.
    """
    if stamped_again(again, seconds):
        return True
    if len(again) < _SPAN_CHANGES or again.mean() < _MANY:
        return False
    edges = np.flatnonzero(np.diff(np.concatenate(([0], again.view(np.int8), [0]))))
    longest = float(np.percentile(edges[1::2] - edges[::2], 100.0 * _MIN_EVEN_PART))
    # A fine sensor hardly ever has one of its numbers again.
    equal = (np.diff(values, axis=0) == 0.0)[~again[1:]]
    fine = equal.size > 0 and bool(equal.mean() <= _EQUAL)
    return fine and longest <= _SHORT_RUN and _is_abrupt(values, again)


def make_sensor_grid(grid: Grid, repeats: Booleans, rows_per_sample: float) -> Grid:
    """Return the grid of a sensor whose samples are held for about so many rows of a log's grid.

    A sample that happens to equal the one before is taken from the row in which it stands.
    """
    indices = grid.indices
    first = np.flatnonzero(~repeats)
    ticks = _number_ticks(indices[first], 1 / rows_per_sample)
    rate, deviation = fit_rate(indices[first] / grid.rate, ticks)
    used_rows, sensor_indices = _add_equal_samples(first, ticks, indices, grid.rate / rate)
    gaps = np.diff(sensor_indices) > 1
    steps = np.diff(indices[used_rows])[gaps] / grid.rate
    late = np.abs(deviation) if grid.report.stamped else np.zeros(1)
    length = int(sensor_indices[-1]) + 1
    report = replace(
        grid.report,
        rate=rate,
        jitter_rms=float(np.sqrt(np.mean(late**2))),
        jitter_max=float(late.max()),
        gap_count=int(gaps.sum()),
        missing_count=length - len(used_rows),
        longest_gap=float(steps.max()) if steps.size else 0.0,
        repeat_count=len(repeats) - len(used_rows),
    )
    stamp_times = None if grid.stamp_times is None else grid.stamp_times[used_rows]
    return Grid(rate, length, report, sensor_indices, used_rows, grid.offset, stamp_times)


def _number_ticks(first: Integers, frequency: float) -> Integers:
    """Return the number of the tick, from 0, that each change belongs to, all different."""
    starts = np.arange(0, max(len(first) - _SPAN_CHANGES // 2, 1), _SPAN_CHANGES)
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


def _add_equal_samples(
    first: Integers, ticks: Integers, indices: Integers, rows_per_sample: float
) -> tuple[Integers, Integers]:
    """Return rows and their places on the sensor's grid, with rows where it did not change.

    ``first`` and ``ticks`` are those of the changes, ``indices`` that of all rows on their own.
    """
    missing = np.diff(ticks) - 1
    change = np.repeat(np.arange(len(missing)), missing)
    which = 1 + np.arange(len(change)) - np.repeat(np.cumsum(missing) - missing, missing)
    wanted_indices = np.rint(indices[first[change]] + which * rows_per_sample).astype(np.int64)
    rows = np.searchsorted(indices, wanted_indices)
    # A row that the log lost, or that belongs to the next change, is not used.
    is_present = (rows < first[change + 1]) & (
        indices[np.minimum(rows, len(indices) - 1)] == wanted_indices
    )
    used_rows = np.concatenate((first, rows[is_present]))
    ticks = np.concatenate((ticks, (ticks[change] + which)[is_present]))
    order = np.argsort(ticks, kind="stable")
    return used_rows[order], ticks[order]
