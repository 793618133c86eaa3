"""Clocks from arrival stamps: samples that a host stamped when they arrived, in bursts.

A sample arrives after it was made, never before. So the sensor's clock is the lower line below the
stamps. Samples delayed by a pause arrive in the next burst, and the stamps return to the line. If
the stamps stay above it, samples were lost.

Only the last sample of a burst is close to the line. It represents the burst here.
"""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np

from zerorate.io.clocks.gaps import LONG_STEP_PERIODS, LONG_WINDOW_ROWS, MAX_ROUNDS, WINDOW_ROWS
from zerorate.record.clock import RATE_TOLERANCE
from zerorate.types import Booleans, Floats, Integers

_LAG_ROWS: Final = 512  # rows that average over bursts
_MIN_BURSTS_AT_STATED_RATE: Final = 3  # bursts, so that one is neither the first nor the last
_MAX_SHORT_STEP_PERIODS: Final = 0.8  # longest step within a burst, in periods by count
_WINDOW_BURSTS: Final = (
    WINDOW_ROWS,
    WINDOW_ROWS // 3,
)  # bursts: more tolerate longer delays, fewer resolve closer gaps
_MIN_LIFT_SIGMAS: Final = 10.0  # smallest lasting rise of the line, in standard deviations
_SIGMA_PER_IQR: Final = 0.7413  # standard deviation of normal noise by its interquartile range


class Bursts(NamedTuple):
    """Bursts in which n samples arrived, and the clock of the sensor.

    Parameters
    ----------
    period
        Period of the sensor's clock, s.
    missing
        Number of samples lost in each step, shape (n - 1,).
    last
        Last row of each burst.
    """

    period: float
    missing: Floats
    last: Integers


def find_bursts(stamps: Floats, rate: float | None = None) -> Bursts | None:
    """Return the bursts in which samples arrived; None if the stamps are no arrival stamps.

    Arrival stamps have two properties. Most steps are clearly shorter than the period by the number
    of rows. And samples after a pause compensate for the pause, whatever its length. A sensor that
    is switched off and on has neither. With a stated ``rate``, Hz, this evidence is not necessary.
    """
    steps = np.diff(stamps)
    lag = min(_LAG_ROWS, len(stamps) // 8)
    if lag == 0:
        return None
    period = float(np.median(stamps[lag:] - stamps[:-lag])) / lag
    if not 0.0 <= (median_step := float(np.median(steps))) <= _MAX_SHORT_STEP_PERIODS * period:
        return None
    last = np.append(np.flatnonzero(steps > period), len(steps))
    stated = rate is not None and _fits_rate(rate, period, stamps, steps)
    if len(last) < (_MIN_BURSTS_AT_STATED_RATE if stated else LONG_WINDOW_ROWS):
        return None
    pauses = _Pauses(stamps, last)
    if not stated and not pauses.are_caught_up(median_step):
        return None
    missing = np.zeros(len(steps))
    period, missing[last[:-1]] = pauses.find_lost()
    return Bursts(period, missing, last)


def _fits_rate(rate: float, period: float, stamps: Floats, steps: Floats) -> bool:
    """Return True if a rate fits the number of rows, within the log's longest pause."""
    fits_span = abs(float(stamps[-1]) - len(steps) / rate) <= float(steps.max())
    return fits_span or abs(rate * period - 1) <= RATE_TOLERANCE


def find_floor(late: Floats) -> float:
    """Return the lowest lateness of bursts, which defines the line below the stamps."""
    return float(np.median(_window_minima(late, WINDOW_ROWS, 2 * WINDOW_ROWS + 1)))


class _Pauses:
    """The b - 1 pauses between b bursts."""

    def __init__(self, stamps: Floats, last: Integers) -> None:
        self._last = last
        self._first = np.append(0, last[:-1] + 1)
        self._end, self._begin = stamps[last], stamps[self._first]
        self._length = self._begin[1:] - self._end[:-1]

    def are_caught_up(self, step: float) -> bool:
        """Return True if pauses differ by more than a step, but the bursts stay on a line."""
        spread = _interquartile_range(self._length)
        return spread > step and any(
            self._level_spread(width) < 0.5 * spread for width in _WINDOW_BURSTS
        )

    def _level_spread(self, width: int) -> float:
        """Return the variation of the line below the stamps, over windows of `width` bursts."""
        level = self._end - _slope(self._end, self._last, width) * self._last
        return _interquartile_range(_level_rises(level, width))

    def find_lost(self) -> tuple[float, Floats]:
        """Return the period of the samples, and the number of samples lost in each pause."""
        lost = np.zeros(len(self._length))
        for width in (WINDOW_ROWS, LONG_WINDOW_ROWS):
            for _ in range(MAX_ROUNDS):
                before = np.append(0.0, np.cumsum(lost))
                lag = len(before) // 2 if lost.any() else WINDOW_ROWS // 3
                period = _slope(self._end, self._last + before, lag)
                corrections = self._find_corrections(before, lost > 0, period, width)
                if not corrections.any():
                    break
                lost = np.maximum(lost + corrections, 0.0)
        return period, lost

    def _find_corrections(
        self, before: Floats, known: Booleans, period: float, width: int
    ) -> Floats:
        """Return the corrections of the samples lost in each pause, from the rise of the line."""
        low = self._end - period * (self._last + before)
        high = self._begin - period * (self._first + before)
        lift = _level_rises(low, width)
        lift -= np.median(lift)
        lifted = lift > max(
            LONG_STEP_PERIODS * period,
            _MIN_LIFT_SIGMAS * _SIGMA_PER_IQR * _interquartile_range(lift),
        )
        # If samples were lost in a pause, its length is about their number of periods.
        new = lifted & (self._length > 0.5 * lift)
        new &= ~_find_unconfirmed(lift, new) | (lift > _max_lateness(low, high, lifted))
        corrections = np.where(new | known, np.rint(lift / period), 0.0)
        return _thin_corrections(corrections, width)


def _level_rises(level: Floats, width: int) -> Floats:
    """Return the lowest level after each pause minus the lowest level before it."""
    lowest = _window_minima(level, width - 1, width)
    return lowest[width:] - lowest[: len(level) - 1]


def _window_minima(level: Floats, margin: int, width: int) -> Floats:
    """Return the lowest level in each window; the first one begins `margin` places early."""
    padded = np.pad(level, margin, constant_values=np.inf)
    return np.asarray(np.lib.stride_tricks.sliding_window_view(padded, width).min(axis=1))


def _find_unconfirmed(lift: Floats, new: Booleans) -> Booleans:
    """Return the mask of lifts with too few bursts before the log's end or a larger lift."""
    unconfirmed = np.ones(len(lift), np.bool_)
    for i in np.flatnonzero(new[: len(lift) + 1 - WINDOW_ROWS]):
        ahead = slice(i + 1, i + WINDOW_ROWS)
        unconfirmed[i] = i + 1 < WINDOW_ROWS or bool((new[ahead] & (lift[ahead] > lift[i])).any())
    return unconfirmed


def _max_lateness(low: Floats, high: Floats, lifted: Booleans) -> float:
    """Return the largest lateness of any sample away from lifts."""
    width = 2 * WINDOW_ROWS + 1
    is_away = (
        _window_minima(np.where(np.append(lifted, False), -1.0, 0.0), WINDOW_ROWS, width) == 0.0
    )
    lateness = (high - _window_minima(low, WINDOW_ROWS, width))[is_away]
    return float(lateness.max()) if lateness.size else np.inf


def _thin_corrections(wrong: Floats, width: int) -> Floats:
    """Return the corrections, without those that an earlier correction nearby may explain."""
    thinned, next_free = np.zeros(len(wrong)), 0
    for i in np.flatnonzero(wrong).tolist():
        if i >= next_free:
            thinned[i], next_free = wrong[i], i + width
    return thinned


def _interquartile_range(values: Floats) -> float:
    low, high = np.percentile(values, (25, 75))
    return float(high - low)


def _slope(stamps: Floats, indices: Floats | Integers, lag: int) -> float:
    lag = max(1, min(lag, len(stamps) // 2))
    return float(np.median((stamps[lag:] - stamps[:-lag]) / (indices[lag:] - indices[:-lag])))
