"""Temperature between the steps of a coarse thermometer, and on the clock of another sensor."""

from __future__ import annotations

from typing import Final

import numpy as np

from zerorate.types import Floats, Integers

_MIN_COARSE_STAY_S: Final = 5.0
"""Seconds: a thermometer is coarse that stands still for longer most of the time."""

_MAX_STEP_K: Final = 2.0
"""Kelvins: a larger step is one of the temperature, not of a thermometer."""

_MAX_TEMPERATURE_DEGC: Final = 1e4

_MIN_LEAP_K: Final = 10.0
"""Kelvins by which no temperature changes at once, and per second in which it may change more."""
_MAX_RATE_K_S: Final = 1.0

_MAX_LEAP_S: Final = 15.0
"""Seconds: what a temperature leaps to for less, and leaps back from, is none."""

_ROUNDING: Final = 1e-9
"""Part of the largest value: below it a change is none."""


def mask_impossible(temperature: Floats) -> Floats:
    """Return temperatures, NaN for impossible ones: 1e4 degC and more."""
    return np.where(np.abs(temperature) <= _MAX_TEMPERATURE_DEGC, temperature, np.nan)


def hold_last(temperature: Floats) -> Floats:
    """Return temperatures in which a missing one is the last before it, or the first of all.

    What no thermometer shows, 1e4 degC and more, is missing; NaN throughout if none is there.
    """
    present = np.abs(temperature) <= _MAX_TEMPERATURE_DEGC
    if present.all() or not present.any():
        return np.where(present, temperature, np.nan)
    last = np.maximum.accumulate(np.where(present, np.arange(temperature.size), -1))
    return np.asarray(temperature[np.where(last < 0, np.argmax(present), last)])


def remove_leaps(time: Floats, temperature: Floats) -> tuple[Floats, int]:
    """Return temperatures in which those that a thermometer cannot have had are missing, NaN.

    No gyro is ten kelvins warmer at once, and colder again within seconds: a stretch of less than
    15 s between two such leaps, or between one and an end of the record, is none. Returns how many
    they are as well.
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
    # What is short and no leap away from the others, between two spikes, is of the thermometer.
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
        Seconds, increasing.
    temperature : ndarray of float64, shape (n,)
        What the thermometer shows, finite.

    Returns
    -------
    temperature : ndarray of float64, shape (n,)
        As given, and the step zero, if the thermometer is fine.
    step : float
        Smallest difference of two values, in the unit of the temperature.

    Notes
    -----
    A thermometer of whole degrees is exact only when it changes: then the temperature is halfway
    between the two values. Straight lines join these moments. Where it goes back to the value
    before after a long stay, the middle of that stay has the value itself; a short stay is noise
    at a boundary, where the temperature stays, too. At the ends the lines go on, ever slower: after
    as long as the last step took they are at the value itself.
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
    """Return the samples after which the value is another."""
    least = _ROUNDING * np.abs(temperature).max()
    return np.flatnonzero(np.abs(np.diff(temperature)) > least)


def _median_stay(stays: Floats) -> float:
    """Return the length of the stay in the middle of the record's time, stays by length."""
    lengths = np.sort(stays)
    total = np.cumsum(lengths)
    return float(lengths[np.searchsorted(total, 0.5 * total[-1])])


def _find_reversals(moments: Floats, jumps: Floats) -> Integers:
    """Return the changes after which the value stays long, and then goes back."""
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
