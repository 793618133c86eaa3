"""Stamps of arrival: samples that their host stamped as they came, in bursts, and their own clock.

A sample arrives after it was made, never before. So the clock that made the samples is the line
under their stamps, and what a pause holds back comes in the burst after it: the stamps fall back
to the line. Where they stay above it for good, samples were lost.

Only the last sample of a burst comes near the line, so it stands for its burst here.
"""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np

from zerorate.io.clocks.gaps import LONG_STEP, LONG_WINDOW, ROUNDS, WINDOW
from zerorate.record.clock import ALIKE
from zerorate.types import Booleans, Floats, Integers

_LAG: Final = 512  # rows over which bursts even out
_FEWEST_STATED: Final = 3  # bursts of which there is one that is neither the first nor the last
_SHORT: Final = 0.8  # of the period by count, at most: steps within a burst
_WIDTHS: Final = (WINDOW, WINDOW // 3)  # bursts: the more see past delays, the fewer past gaps
_CERTAIN: Final = 10.0  # standard deviations of the line, which no burst leaves for good
_TO_DEVIATION: Final = 0.7413  # standard deviation of normal noise over its interquartile range


class Bursts(NamedTuple):
    """Bursts in which n samples arrived, and the clock that made them.

    Parameters
    ----------
    period
        Period of that clock, s.
    missing
        Samples lost in each step, shape (n - 1,).
    last
        The last row of each burst.
    """

    period: float
    missing: Floats
    last: Integers


def bursts(stamps: Floats, rate: float | None = None) -> Bursts | None:
    """Return the bursts in which samples arrived, None unless the stamps are those of arrival.

    They are if most steps are clearly shorter than the period that the count of rows tells, and if
    pauses of different length are made up for by what comes after them. A sensor that was
    switched on and off does neither. A ``rate``, Hz, that somebody has stated needs no such
    evidence.
    """
    steps = np.diff(stamps)
    lag = min(_LAG, len(stamps) // 8)
    if lag == 0:
        return None
    period = float(np.median(stamps[lag:] - stamps[:-lag])) / lag
    if not 0.0 <= (middle := float(np.median(steps))) <= _SHORT * period:
        return None
    last = np.append(np.flatnonzero(steps > period), len(steps))
    stated = rate is not None and _explains(rate, period, stamps, steps)
    if len(last) < (_FEWEST_STATED if stated else LONG_WINDOW):
        return None
    seen = _Pauses(stamps, last)
    if not stated and not seen.made_up_for(middle):
        return None
    missing = np.zeros(len(steps))
    period, missing[last[:-1]] = seen.lost()
    return Bursts(period, missing, last)


def _explains(rate: float, period: float, stamps: Floats, steps: Floats) -> bool:
    """Whether a rate is that of the count of rows, which a short log tells to its longest pause."""
    whole = abs(float(stamps[-1]) - len(steps) / rate) <= float(steps.max())
    return whole or abs(rate * period - 1) <= ALIKE


def floor(late: Floats) -> float:
    """Return the level that the latest samples of bursts, so late on a clock, come down to."""
    return float(np.median(_lowest(late, WINDOW, 2 * WINDOW + 1)))


class _Pauses:
    """The b - 1 pauses between b bursts."""

    def __init__(self, stamps: Floats, last: Integers) -> None:
        self._last = last
        self._first = np.append(0, last[:-1] + 1)
        self._end, self._begin = stamps[last], stamps[self._first]
        self._length = self._begin[1:] - self._end[:-1]

    def made_up_for(self, step: float) -> bool:
        """Whether pauses differ, by more than a step, and leave the bursts on a line."""
        spread = _spread(self._length)
        return spread > step and any(self._lifts(width) < 0.5 * spread for width in _WIDTHS)

    def _lifts(self, width: int) -> float:
        """Return how much the line under so many bursts rises and falls."""
        level = self._end - _slope(self._end, self._last, width) * self._last
        return _spread(_lift(level, width))

    def lost(self) -> tuple[float, Floats]:
        """Return the period of the samples, and how many were lost in each pause."""
        lost = np.zeros(len(self._length))
        for width in (WINDOW, LONG_WINDOW):
            for _ in range(ROUNDS):
                before = np.append(0.0, np.cumsum(lost))
                lag = len(before) // 2 if lost.any() else WINDOW // 3
                period = _slope(self._end, self._last + before, lag)
                wrong = self._wrong(before, lost > 0, period, width)
                if not wrong.any():
                    break
                lost = np.maximum(lost + wrong, 0.0)
        return period, lost

    def _wrong(self, before: Floats, known: Booleans, period: float, width: int) -> Floats:
        """Return how many samples too few each pause holds, those before each burst being lost."""
        low = self._end - period * (self._last + before)
        high = self._begin - period * (self._first + before)
        lift = _lift(low, width)
        lift -= np.median(lift)
        lifted = lift > max(LONG_STEP * period, _CERTAIN * _TO_DEVIATION * _spread(lift))
        # A pause in which samples were lost is about as long as they would have taken.
        new = lifted & (self._length > 0.5 * lift)
        new &= ~_hasty(lift, new) | (lift > _latest(low, high, lifted))
        wrong = np.where(new | known, np.rint(lift / period), 0.0)
        return _first_of_each(wrong, width)


def _lift(level: Floats, width: int) -> Floats:
    """Return how far the lowest level after each pause is above the lowest before it."""
    lowest = _lowest(level, width - 1, width)
    return lowest[width:] - lowest[: len(level) - 1]


def _lowest(level: Floats, beyond: int, width: int) -> Floats:
    """Return the lowest level in every window, from one that begins so many places before it."""
    around = np.pad(level, beyond, constant_values=np.inf)
    return np.asarray(np.lib.stride_tricks.sliding_window_view(around, width).min(axis=1))


def _hasty(lift: Floats, new: Booleans) -> Booleans:
    """Return which lifts too few bursts show, before the log ends or is lifted by more."""
    hasty = np.ones(len(lift), np.bool_)
    for i in np.flatnonzero(new[: len(lift) + 1 - WINDOW]):
        ahead = slice(i + 1, i + WINDOW)
        hasty[i] = i + 1 < WINDOW or bool((new[ahead] & (lift[ahead] > lift[i])).any())
    return hasty


def _latest(low: Floats, high: Floats, lifted: Booleans) -> float:
    """Return the latest that a sample has ever come, away from lifts."""
    width = 2 * WINDOW + 1
    away = _lowest(np.where(np.append(lifted, False), -1.0, 0.0), WINDOW, width) == 0.0
    late = (high - _lowest(low, WINDOW, width))[away]
    return float(late.max()) if late.size else np.inf


def _first_of_each(wrong: Floats, width: int) -> Floats:
    """Return the corrections without those that an earlier one close by may explain."""
    kept, free = np.zeros(len(wrong)), 0
    for i in np.flatnonzero(wrong).tolist():
        if i >= free:
            kept[i], free = wrong[i], i + width
    return kept


def _spread(values: Floats) -> float:
    low, high = np.percentile(values, (25, 75))
    return float(high - low)


def _slope(stamps: Floats, place: Floats | Integers, lag: int) -> float:
    lag = max(1, min(lag, len(stamps) // 2))
    return float(np.median((stamps[lag:] - stamps[:-lag]) / (place[lag:] - place[:-lag])))
