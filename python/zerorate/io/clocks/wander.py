"""Wander: clocks whose rate changes, so that no even clock is right, told from late stamps.

A host stamps a steady sensor late now and then; its stamps come back to the line. A clock that ran
at another rate does not. So what is judged is the level of the stamps over many rows, where
lateness evens out: the levels of a steady clock differ by chance, those of one that wanders differ
little from one to the next and much over the log.
"""

from __future__ import annotations

from typing import Final, NamedTuple, TypeVar

import numpy as np
import numpy.typing as npt

from zerorate.io.clocks.gaps import WINDOW, medians
from zerorate.types import Floats, Integers

_Number = TypeVar("_Number", np.float64, np.int64)

_BLOCKS: Final = (40, 160, 640, 2560, 10_240)
"""Levels in a log, from slow wander to quick one."""
_FEWEST: Final = 32
"""Rows of a level."""
_MANY: Final = 300
"""Rows of a level that a gap of one row, if it is none, hardly moves."""
_SHORTEST: Final = 0.5
"""Seconds of a level: what is quicker is called jitter."""
_LUMPS: Final = 8
"""Lumps of rows that share a stamp, or arrived together, in a level."""
_RATIO: Final = 4.0
"""Variance of the levels over that which their steps let expect (von Neumann's ratio): 1 by chance,
with a deviation of 0.3 for forty of them."""
_MATTERS: Final = 5e-3
"""Half the range, s, that four fifths of the levels take at least: 15 cm on a road."""
_OWN: Final = 0.4
"""Periods by which a stamp may leave those around it and still be kept as it is."""


class Wander(NamedTuple):
    """Level of the stamps against an even clock, s, at each row, and the least and largest rate.

    ``slow`` is the level over many rows, which a gap that is none hardly moves.
    """

    level: Floats
    slow: Floats
    slowest: float
    fastest: float

    def kept(self, even: Floats, deviation: Floats, period: float) -> Floats:
        """Return the times of rows: their stamps, or those around them where they came late.

        Parameters
        ----------
        even, deviation
            Times of the rows on the even clock, and how far the stamps are from it.
        period
            Of that clock, s.
        """
        near = deviation.copy()
        off = np.flatnonzero(np.abs(deviation - self.level) > _OWN * period)
        # Across a gap the rows of the other side may stand elsewhere.
        sides = medians(deviation, off - WINDOW, WINDOW), medians(deviation, off + 1, WINDOW)
        apart = [np.abs(deviation[off] - side) for side in sides]
        by = np.fmin(*apart)
        # At the ends of a log there is one side alone.
        around = np.where(apart[0] == by, sides[0], sides[1])
        late = by > _OWN * period
        near[off[late]] = around[late]
        return np.asarray(np.maximum.accumulate(even + near))


def wander_of(
    deviation: Floats, period: float, lump: float = 1.0, rows: Integers | None = None, n: int = 0
) -> Wander | None:
    """Return the wander of a clock, None unless it is certain and matters.

    Parameters
    ----------
    deviation
        How far stamps are from an even clock, s.
    period
        Of that clock, s.
    lump
        Rows that share a stamp or came together.
    rows, n
        The rows to which the deviations belong, and how many there are; by default all.
    """
    least = max(_FEWEST, _SHORTEST / period, _LUMPS * lump)
    if rows is not None:
        least = max(15.0, _SHORTEST / period * len(rows) / n)
    matters = max(0.5 * period, _MATTERS)
    scales = [k for k in _BLOCKS if len(deviation) >= k * least]
    if not scales or not np.ptp(deviation) > 2.0 * matters:
        return None
    seen = next((k for k in scales if _wanders(_levels(deviation, k), matters)), None)
    if seen is None:
        return None
    own = np.arange(len(deviation)) if rows is None else rows
    everywhere = np.arange(len(deviation) if rows is None else n)

    def through(count: int) -> Floats:
        centres = _blocks(own, count).mean(axis=1)
        return _through(everywhere, centres, _levels(deviation, count))

    levels, centres = _levels(deviation, scales[-1]), _blocks(own, scales[-1]).mean(axis=1)
    over = max(1, len(levels) // _BLOCKS[0])
    slopes = (levels[over:] - levels[:-over]) / (centres[over:] - centres[:-over])
    low, high = 1.0 / (period + slopes.max()), 1.0 / (period + slopes.min())
    long = [k for k in scales if len(deviation) >= k * _MANY]
    slow = through(max([seen, *long]))
    return Wander(through(scales[-1]), slow, float(low), float(high))


def _levels(deviation: Floats, blocks: int) -> Floats:
    levels: Floats = np.median(_blocks(deviation, blocks), axis=1)
    return levels


def _blocks(values: npt.NDArray[_Number], count: int) -> npt.NDArray[_Number]:
    """Return values in so many rows or some more, but for less than a row at the end."""
    width = len(values) // count
    return values[: len(values) // width * width].reshape(-1, width)


def _wanders(levels: Floats, matters: float) -> bool:
    low, few, many, high = np.percentile(levels, (5, 10, 90, 95))
    # Some late blocks make no clock wander.
    levels = np.clip(levels, low, high)
    by_steps = 0.5 * float(np.mean(np.diff(levels) ** 2))
    return bool(0.5 * (many - few) > matters and levels.var() > _RATIO * by_steps)


def _through(rows: Integers, centres: Floats, levels: Floats) -> Floats:
    """Return the line through levels at all rows, which goes on at both ends."""
    slopes = np.diff(levels)[[0, -1]] / np.diff(centres)[[0, -1]]
    first, last = rows[0] - 1.0, rows[-1] + 1.0
    ends = levels[[0, -1]] + slopes * (np.array([first, last]) - centres[[0, -1]])
    x = np.concatenate(([first], centres, [last]))
    y = np.concatenate((ends[:1], levels, ends[1:]))
    return np.asarray(np.interp(rows, x, y))
