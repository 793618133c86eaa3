"""Temperature interpolated between the steps of a coarse thermometer, on any clock."""

from __future__ import annotations

from typing import Final

import numpy as np

from zerorate.types import Floats, Integers

_MIN_COARSE_STAY_S: Final = 5.0
"""Smallest usual time between changes of a coarse thermometer, s."""

_MAX_STEP_K: Final = 2.0
"""Largest step of a coarse thermometer, K: a larger step is a change of the temperature."""

_MAX_TEMPERATURE_DEGC: Final = 1e4

_MIN_LEAP_K: Final = 10.0
"""Smallest leap, K, that a real temperature cannot make. Between samples it is increased by
`_MAX_RATE_K_S` times the time.
"""
_MAX_RATE_K_S: Final = 1.0

_MAX_LEAP_S: Final = 15.0
"""Longest interval between two leaps that counts as an outlier, s."""

_ROUNDING: Final = 1e-9
"""Share of the largest value below which a change is rounding."""


def mask_impossible(temperature: Floats) -> Floats:
    """Return the temperatures with NaN for impossible values, above 1e4 degC."""
    return np.where(np.abs(temperature) <= _MAX_TEMPERATURE_DEGC, temperature, np.nan)


def hold_last(temperature: Floats) -> Floats:
    """Return the temperatures with each missing value replaced by the last value before it.

    Missing values at the start get the first value. Values above 1e4 degC count as missing. The
    result is NaN throughout if all are missing.
    """
    present = np.abs(temperature) <= _MAX_TEMPERATURE_DEGC
    if present.all() or not present.any():
        return np.where(present, temperature, np.nan)
    last = np.maximum.accumulate(np.where(present, np.arange(temperature.size), -1))
    return np.asarray(temperature[np.where(last < 0, np.argmax(present), last)])


def remove_leaps(time: Floats, temperature: Floats) -> tuple[Floats, int]:
    """Return the temperatures with outliers replaced by NaN, and the number of outliers.

    A gyro cannot become ten kelvins warmer at once and colder again within seconds. An interval of
    less than 15 s between two leaps, or between a leap and an end of the record, is an outlier.
    """
    present = np.flatnonzero(np.isfinite(temperature))
    if present.size < 2:
        return temperature, 0
    stamps, values = time[present], temperature[present]
    leaps = np.abs(np.diff(values)) > _MIN_LEAP_K + _MAX_RATE_K_S * np.diff(stamps)
    begins = np.concatenate(([0], np.flatnonzero(leaps) + 1))
    ends = np.append(begins[1:], values.size)
    durations = stamps[ends - 1] - stamps[begins]
    short = (durations < _MAX_LEAP_S) & (ends - begins < values.size // 2)
    if not short.any() or short.all():
        return temperature, 0
    is_kept = ~np.repeat(short, ends - begins)
    # A short interval between two outliers is kept if it agrees with the remaining temperatures.
    is_leap = np.abs(values - np.interp(stamps, stamps[is_kept], values[is_kept])) > _MIN_LEAP_K
    is_leap &= ~is_kept
    cleaned = temperature.copy()
    cleaned[present[is_leap]] = np.nan
    return cleaned, int(is_leap.sum())


def interpolate_steps(time: Floats, temperature: Floats) -> tuple[Floats, float]:
    """Return the temperature without the steps of its thermometer, and the size of a step.

    Parameters
    ----------
    time : ndarray of float64, shape (n,)
        Times, s, increasing.
    temperature : ndarray of float64, shape (n,)
        Readings of the thermometer, finite.

    Returns
    -------
    temperature : ndarray of float64, shape (n,)
        Interpolated temperature. For a fine thermometer it is unchanged, and the step is zero.
    step : float
        Smallest difference of two values, in the unit of the temperature.

    Notes
    -----
    A coarse thermometer is exact only when it changes: the temperature is then halfway between the
    two values. Straight lines join these moments. If the reading stays long and then returns to the
    value before, the temperature equals the reading in the middle of the stay. A short stay is
    noise at a boundary between values. At the ends of the record the lines continue with decreasing
    slope. They reach the reading after the duration of the last step.
    """
    changes = _find_changes(temperature)
    if changes.size == 0:
        return temperature, 0.0
    moments = 0.5 * (time[changes] + time[changes + 1])
    if _median_stay(np.diff([time[0], *moments, time[-1]])) < _MIN_COARSE_STAY_S:
        return temperature, 0.0
    jumps = temperature[changes + 1] - temperature[changes]
    step = float(np.abs(jumps).min())
    if step > _MAX_STEP_K:
        return temperature, 0.0
    half = 0.5 * step * np.sign(jumps)
    edges = temperature[changes] + half, temperature[changes + 1] - half
    reversals = _find_reversals(moments, jumps)
    times = [time[changes], time[changes + 1], 0.5 * (moments[reversals] + moments[reversals + 1])]
    values = [*edges, temperature[changes[reversals] + 1]]
    backwards = (time[-1] - moments[::-1], edges[0][::-1], -half[::-1], time[-1] - time[0])
    times += [time[:1], time[-1:]]
    values += [
        _extrapolate_end(*backwards),
        _extrapolate_end(moments - time[0], edges[1], half, time[-1] - time[0]),
    ]
    knot_times, knot_values = np.concatenate(times), np.concatenate(values)
    order = np.argsort(knot_times, kind="stable")
    return np.interp(time, knot_times[order], knot_values[order]), step


def _find_changes(temperature: Floats) -> Integers:
    """Return the indices of samples before a change of value."""
    least = _ROUNDING * np.abs(temperature).max()
    return np.flatnonzero(np.abs(np.diff(temperature)) > least)


def _median_stay(stays: Floats) -> float:
    """Return the length of stay at half of the record's time, with stays sorted by length."""
    lengths = np.sort(stays)
    total = np.cumsum(lengths)
    return float(lengths[np.searchsorted(total, 0.5 * total[-1])])


def _find_reversals(moments: Floats, jumps: Floats) -> Integers:
    """Return the changes with a long stay after them and then a return to the value before."""
    stays = np.diff(moments)
    neighbours = np.concatenate(([np.inf], stays, [np.inf]))
    long = stays > np.minimum(neighbours[:-2], neighbours[2:])
    return np.flatnonzero(long & (jumps[:-1] * jumps[1:] < 0.0))


def _extrapolate_end(moments: Floats, edges: Floats, half: Floats, end: float) -> Floats:
    """Return the temperature at the end of a record, after its last change."""
    elsewhere = np.flatnonzero(np.abs(edges - edges[-1]) > abs(half[-1]))
    share = 0.5
    if elsewhere.size and (edges[-1] - edges[elsewhere[-1]]) * half[-1] > 0.0:
        took, since = moments[-1] - moments[elsewhere[-1]], end - moments[-1]
        share = since / (since + took)
    return np.array([edges[-1] + 2.0 * half[-1] * share])
