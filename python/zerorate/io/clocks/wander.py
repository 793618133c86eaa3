"""Wander: clocks that change their rate, as opposed to late stamps of a steady clock.

If a host stamps a steady sensor late, later stamps return to the line. The stamps of a wandering
clock do not. The test uses the level of the stamps over many rows, because lateness averages out in
a level. Levels of a steady clock differ by chance. Levels of a wandering clock differ little from
one to the next, but much over the log.
"""

from __future__ import annotations

from typing import Final, NamedTuple, TypeVar

import numpy as np
import numpy.typing as npt

from zerorate.io.clocks.gaps import WINDOW_ROWS, window_medians
from zerorate.types import Floats, Integers

_Number = TypeVar("_Number", np.float64, np.int64)

_LEVEL_COUNTS: Final = (40, 160, 640, 2560, 10_240)
"""Numbers of levels per log, from slow to fast wander."""
_MIN_LEVEL_ROWS: Final = 32
"""Smallest number of rows per level."""
_STEADY_LEVEL_ROWS: Final = 300
"""Smallest number of rows per level so that a wrong gap of one row hardly changes it."""
_MIN_LEVEL_S: Final = 0.5
"""Shortest duration of a level, s; faster changes are jitter."""
_MIN_LEVEL_BLOCKS: Final = 8
"""Smallest number of blocks per level; a block has equal stamps, or arrived together."""
_MIN_VARIANCE_RATIO: Final = 4.0
"""Smallest ratio of the variance of levels to its expectation from their steps (von Neumann)."""
_MIN_WANDER_S: Final = 5e-3
"""Smallest half range of the middle four fifths of the levels, s: 15 cm at 30 m/s."""
_MAX_OFFSET_PERIODS: Final = 0.4
"""Largest distance of a stamp that is kept from the stamps around it, periods."""


class Wander(NamedTuple):
    """Level of the stamps against a uniform clock at each row, s, and range of the rate.

    ``slow`` is the level over many rows; a wrong gap hardly changes it.
    """

    level: Floats
    slow: Floats
    slowest: float
    fastest: float

    def stamp_times(self, even: Floats, deviation: Floats, period: float) -> Floats:
        """Return the times of rows: their stamps, or the level around them if a stamp is late.

        Parameters
        ----------
        even, deviation
            Times of the rows on the uniform clock, and deviations of the stamps from it, s.
        period
            Period of the uniform clock, s.
        """
        offsets = deviation.copy()
        off = np.flatnonzero(np.abs(deviation - self.level) > _MAX_OFFSET_PERIODS * period)
        # Rows across a gap may have another level.
        sides = (
            window_medians(deviation, off - WINDOW_ROWS, WINDOW_ROWS),
            window_medians(deviation, off + 1, WINDOW_ROWS),
        )
        distances = [np.abs(deviation[off] - side) for side in sides]
        distance = np.fmin(*distances)
        # At the ends of a log there is only one side.
        around = np.where(distances[0] == distance, sides[0], sides[1])
        late = distance > _MAX_OFFSET_PERIODS * period
        offsets[off[late]] = around[late]
        return np.asarray(np.maximum.accumulate(even + offsets))


def find_wander(
    deviation: Floats,
    period: float,
    block_rows: float = 1.0,
    rows: Integers | None = None,
    n: int = 0,
) -> Wander | None:
    """Return the wander of a clock; None if it is uncertain or too small to matter.

    Parameters
    ----------
    deviation
        Deviations of the stamps from a uniform clock, s.
    period
        Period of the uniform clock, s.
    block_rows
        Rows that share a stamp or arrived together.
    rows, n
        Rows of the deviations, and number of all rows; default: all rows.
    """
    min_rows = max(_MIN_LEVEL_ROWS, _MIN_LEVEL_S / period, _MIN_LEVEL_BLOCKS * block_rows)
    if rows is not None:
        min_rows = max(15.0, _MIN_LEVEL_S / period * len(rows) / n)
    min_wander = max(0.5 * period, _MIN_WANDER_S)
    scales = [k for k in _LEVEL_COUNTS if len(deviation) >= k * min_rows]
    if not scales or not np.ptp(deviation) > 2.0 * min_wander:
        return None
    level_count = next(
        (k for k in scales if _has_wander(_block_levels(deviation, k), min_wander)), None
    )
    if level_count is None:
        return None
    own_rows = np.arange(len(deviation)) if rows is None else rows
    all_rows = np.arange(len(deviation) if rows is None else n)

    def through(count: int) -> Floats:
        centres = _split_blocks(own_rows, count).mean(axis=1)
        return _interpolate_levels(all_rows, centres, _block_levels(deviation, count))

    levels, centres = (
        _block_levels(deviation, scales[-1]),
        _split_blocks(own_rows, scales[-1]).mean(axis=1),
    )
    lag = max(1, len(levels) // _LEVEL_COUNTS[0])
    slopes = (levels[lag:] - levels[:-lag]) / (centres[lag:] - centres[:-lag])
    low, high = 1.0 / (period + slopes.max()), 1.0 / (period + slopes.min())
    long = [k for k in scales if len(deviation) >= k * _STEADY_LEVEL_ROWS]
    slow = through(max([level_count, *long]))
    return Wander(through(scales[-1]), slow, float(low), float(high))


def _block_levels(deviation: Floats, blocks: int) -> Floats:
    levels: Floats = np.median(_split_blocks(deviation, blocks), axis=1)
    return levels


def _split_blocks(values: npt.NDArray[_Number], count: int) -> npt.NDArray[_Number]:
    """Return values in about `count` blocks of equal length; a shorter rest is dropped."""
    width = len(values) // count
    return values[: len(values) // width * width].reshape(-1, width)


def _has_wander(levels: Floats, min_wander: float) -> bool:
    low, few, many, high = np.percentile(levels, (5, 10, 90, 95))
    # A few late blocks are no wander.
    levels = np.clip(levels, low, high)
    by_steps = 0.5 * float(np.mean(np.diff(levels) ** 2))
    return bool(0.5 * (many - few) > min_wander and levels.var() > _MIN_VARIANCE_RATIO * by_steps)


def _interpolate_levels(rows: Integers, centres: Floats, levels: Floats) -> Floats:
    """Return the levels interpolated at all rows, extrapolated at both ends."""
    slopes = np.diff(levels)[[0, -1]] / np.diff(centres)[[0, -1]]
    first, last = rows[0] - 1.0, rows[-1] + 1.0
    ends = levels[[0, -1]] + slopes * (np.array([first, last]) - centres[[0, -1]])
    x = np.concatenate(([first], centres, [last]))
    y = np.concatenate((ends[:1], levels, ends[1:]))
    return np.asarray(np.interp(rows, x, y))
