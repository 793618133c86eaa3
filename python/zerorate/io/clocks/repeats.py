"""Repeated rows in the log of a slower sensor, and the sensor's own clock.

Such a log repeats each sample until the next one. The rows with changes are as regular as the
sensor, and changes have any size. A coarse or quiet sensor repeats values too, but at random times,
and its changes are its smallest step.
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
"""Number of rows at the beginning of a log that are tested for a slower sensor."""
MIN_ROWS_PER_SAMPLE: Final = 1 + 2 / WINDOW_ROWS
"""Smallest number of rows per sample: repeats are then frequent enough to show gaps."""
_SPAN_CHANGES: Final = 256
"""Number of changes over which sensor and log keep their phase."""
MIN_CHANGES: Final = 4 * _SPAN_CHANGES
"""Smallest number of changes to recognise a slower sensor."""
_MIN_POWER_SIGMAS: Final = 10.0
"""Smallest power of a clock, in standard deviations; chance does not reach it."""
_RUN_TOLERANCE_ROWS: Final = 1.25
"""Largest difference of a run's length from the mean, in rows, by rounding and late reading."""
_MIN_EVEN_PART: Final = 0.9
"""Smallest share of runs within this tolerance."""
_MIN_POWER_PART: Final = 0.25
"""Smallest share of an ideal clock's power, because its ticks are seen late."""
_MIN_REPEAT_RATIO: Final = 10.0
"""Smallest ratio of repeated rows to the number expected by chance."""


_MANY: Final = 0.125
"""Share of repeated rows from which on they are reported."""
_FEW_ROWS: Final = 16
_EQUAL: Final = 0.02
"""Largest share of values that a fine sensor repeats by chance."""
_SHORT_RUN: Final = 3
"""Largest number of consecutive repeats of rows that were sent twice."""


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
    """Return the number of rows per sample; None if the sensor is not certainly slower.

    ``indices`` are the positions of the rows (n, k) on their grid, shape (n,).
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
    """Return True if runs have the expected length of held samples; patterns differ."""
    off = np.abs(np.diff(first) - rows_per_sample)
    return bool((off <= max(_RUN_TOLERANCE_ROWS, rows_per_sample / 4)).mean() >= _MIN_EVEN_PART)


def _find_period(first: Integers) -> float | None:
    """Return the number of rows between changes; None if changes occur at random.

    For random changes, the power at any frequency is 1 on average. A clock has many times that
    power at its frequency, even if ticks are late or missing.
    """
    spans = first[: len(first) // _SPAN_CHANGES * _SPAN_CHANGES].reshape(-1, _SPAN_CHANGES)
    span = float(np.median(spans[:, -1] - spans[:, 0]))
    guess = (_SPAN_CHANGES - 1) / span
    # Missing ticks make the clock look slower.
    low, high = 0.9 * guess, min(1.3 * guess, 1 / MIN_ROWS_PER_SAMPLE)
    # Whole rows have the same power at f and 1 - f. If runs of one row outnumber runs of three, the
    # frequency is f.
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
    # A change is seen in the row after it, up to one row late.
    whole = (_SPAN_CHANGES * np.sinc(frequency)) ** 2
    chance = _SPAN_CHANGES * (1 + _MIN_POWER_SIGMAS / math.sqrt(len(spans)))
    return 1 / frequency if power[best] >= max(chance, _MIN_POWER_PART * whole) else None


def _is_abrupt(values: Floats, repeats: Booleans) -> bool:
    """Return True if far more rows repeat than change by the smallest step of each column.

    By chance, no change is about as probable as one step up or down in any column.
    """
    with np.errstate(over="ignore", invalid="ignore"):
        steps = np.abs(np.diff(values, axis=0))
    least = np.where(steps > 0, steps, np.inf).min(axis=0)
    moving = np.isfinite(least)
    small = (steps[:, moving] <= 1.5 * least[moving]).all(axis=1) & ~repeats[1:]
    by_chance = float(small.sum()) / (3.0 ** int(moving.sum()) - 1)
    return bool(moving.any() and repeats.sum() >= _MIN_REPEAT_RATIO * by_chance)


def stamped_again(again: Booleans, seconds: Floats) -> bool:
    """Return True if exactly the rows that repeat values also repeat the stamp."""
    if len(again) < _FEW_ROWS or again.mean() < _MANY:
        return False
    same = np.append(False, np.diff(seconds) == 0.0)
    return bool((same & again).sum() >= _MIN_EVEN_PART * max(same.sum(), again.sum()))


def sent_again(values: Floats, again: Booleans, seconds: Floats) -> bool:
    """Return True if rows that repeat at irregular times are no samples.

    Either exactly these rows repeat the stamp too. Or they are far more than by chance, with only
    short runs; a stuck sensor has long runs.
    """
    if stamped_again(again, seconds):
        return True
    if len(again) < _SPAN_CHANGES or again.mean() < _MANY:
        return False
    edges = np.flatnonzero(np.diff(np.concatenate(([0], again.view(np.int8), [0]))))
    longest = float(np.percentile(edges[1::2] - edges[::2], 100.0 * _MIN_EVEN_PART))
    # A fine sensor hardly ever repeats a value.
    equal = (np.diff(values, axis=0) == 0.0)[~again[1:]]
    fine = equal.size > 0 and bool(equal.mean() <= _EQUAL)
    return fine and longest <= _SHORT_RUN and _is_abrupt(values, again)


def make_sensor_grid(grid: Grid, repeats: Booleans, rows_per_sample: float) -> Grid:
    """Return the grid of a sensor that holds each sample for about `rows_per_sample` rows.

    If a sample equals the sample before, it is taken from the row at its expected position.
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
    """Return the index of each change's tick, from 0, all different."""
    starts = np.arange(0, max(len(first) - _SPAN_CHANGES // 2, 1), _SPAN_CHANGES)
    phases = np.add.reduceat(np.exp(2j * np.pi * frequency * (first - first[0])), starts)
    centres = np.add.reduceat(first, starts) / np.diff(np.append(starts, len(first)))
    ahead = np.interp(first, centres, np.unwrap(np.angle(phases)) / (2 * np.pi))
    ticks = np.rint(frequency * (first - first[0]) - ahead).astype(np.int64)
    # If two changes are close to one tick, one is early or late by a tick.
    count = np.arange(len(ticks))
    after = np.maximum.accumulate(ticks - count)
    before = np.minimum.accumulate((ticks - count)[::-1])[::-1]
    ticks = (after + before) // 2 + count
    return np.asarray(ticks - ticks[0])


def _add_equal_samples(
    first: Integers, ticks: Integers, indices: Integers, rows_per_sample: float
) -> tuple[Integers, Integers]:
    """Return rows and their indices on the sensor's grid, with rows for unchanged samples.

    ``first`` and ``ticks`` belong to the changes, ``indices`` to all rows of the log.
    """
    missing = np.diff(ticks) - 1
    change = np.repeat(np.arange(len(missing)), missing)
    which = 1 + np.arange(len(change)) - np.repeat(np.cumsum(missing) - missing, missing)
    wanted_indices = np.rint(indices[first[change]] + which * rows_per_sample).astype(np.int64)
    rows = np.searchsorted(indices, wanted_indices)
    # Rows that the log lost, or that belong to the next change, are not used.
    is_present = (rows < first[change + 1]) & (
        indices[np.minimum(rows, len(indices) - 1)] == wanted_indices
    )
    used_rows = np.concatenate((first, rows[is_present]))
    ticks = np.concatenate((ticks, (ticks[change] + which)[is_present]))
    order = np.argsort(ticks, kind="stable")
    return used_rows[order], ticks[order]
