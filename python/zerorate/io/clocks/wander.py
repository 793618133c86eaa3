"""Wander: clocks whose rate changes, so that no even clock is right, as opposed to late stamps.

A host stamps a steady sensor late now and then; its stamps come back to the line. A clock that ran
at another rate does not. So the test uses the level of the stamps over many rows, where lateness
evens out: the levels of a steady clock differ by chance, those of one that wanders differ little
from one to the next and much over the log.
"""

from __future__ import annotations

from typing import Final, NamedTuple, TypeVar

import numpy as np
import numpy.typing as npt

from zerorate.io.clocks.gaps import WINDOW_ROWS, window_medians
from zerorate.types import Floats, Integers

_Number = TypeVar("_Number", np.float64, np.int64)

_LEVEL_COUNTS: Final = (40, 160, 640, 2560, 10_240)
"""Levels in a log, from slow wander to quick one."""
_MIN_LEVEL_ROWS: Final = 32
"""Rows of a level."""
_STEADY_LEVEL_ROWS: Final = 300
"""Rows of a level that a gap of one row, if it is none, hardly moves."""
_MIN_LEVEL_S: Final = 0.5
"""Seconds of a level: what is quicker is called jitter."""
_MIN_LEVEL_BLOCKS: Final = 8
"""Lumps of rows that share a stamp, or arrived together, in a level."""
_MIN_VARIANCE_RATIO: Final = 4.0
"""Variance of the levels over that which their steps let expect (von Neumann's ratio): 1 by chance,
with a deviation of 0.3 for forty of them."""
_MIN_WANDER_S: Final = 5e-3
"""Half the range, s, that four fifths of the levels take at least: 15 cm on a road."""
_MAX_OFFSET_PERIODS: Final = 0.4
"""Periods by which a stamp may leave those around it and still be kept as it is."""


class Wander(NamedTuple):
    """Level of the stamps against an even clock, s, at each row, and the least and largest rate.

    ``slow`` is the level over many rows, which a gap that is none hardly moves.
    """

    level: Floats
    slow: Floats
    slowest: float
    fastest: float

    def stamp_times(self, even: Floats, deviation: Floats, period: float) -> Floats:
        """Return the times of rows: their stamps, or those around them where they came late.

        Parameters
        ----------
        even, deviation
            Times of the rows on the even clock, and how far the stamps are from it.
        period
            Of that clock, s.
        """
        offsets = deviation.copy()
        off = np.flatnonzero(np.abs(deviation - self.level) > _MAX_OFFSET_PERIODS * period)
        # Across a gap the rows of the other side may stand elsewhere.
        sides = (
            window_medians(deviation, off - WINDOW_ROWS, WINDOW_ROWS),
            window_medians(deviation, off + 1, WINDOW_ROWS),
        )
        distances = [np.abs(deviation[off] - side) for side in sides]
        distance = np.fmin(*distances)
        # At the ends of a log there is one side alone.
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
    """Return the wander of a clock, None unless it is certain and matters.

    Parameters
    ----------
    deviation
        How far stamps are from an even clock, s.
    period
        Of that clock, s.
    block_rows
        Rows that share a stamp or came together.
    rows, n
        The rows to which the deviations belong, and how many there are; by default all.
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
    """Return values in so many rows or some more, but for less than a row at the end."""
    width = len(values) // count
    return values[: len(values) // width * width].reshape(-1, width)


def _has_wander(levels: Floats, min_wander: float) -> bool:
    low, few, many, high = np.percentile(levels, (5, 10, 90, 95))
    # Some late blocks make no clock wander.
    levels = np.clip(levels, low, high)
    by_steps = 0.5 * float(np.mean(np.diff(levels) ** 2))
    return bool(0.5 * (many - few) > min_wander and levels.var() > _MIN_VARIANCE_RATIO * by_steps)


def _interpolate_levels(rows: Integers, centres: Floats, levels: Floats) -> Floats:
    """Return the line through levels at all rows, which goes on at both ends."""
    slopes = np.diff(levels)[[0, -1]] / np.diff(centres)[[0, -1]]
    first, last = rows[0] - 1.0, rows[-1] + 1.0
    ends = levels[[0, -1]] + slopes * (np.array([first, last]) - centres[[0, -1]])
    x = np.concatenate(([first], centres, [last]))
    y = np.concatenate((ends[:1], levels, ends[1:]))
    return np.asarray(np.interp(rows, x, y))
