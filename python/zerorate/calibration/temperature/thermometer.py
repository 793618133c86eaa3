"""Temperature between the steps of a coarse thermometer, and on the clock of another sensor."""

from __future__ import annotations

from typing import Final

import numpy as np

from zerorate.types import Floats, Integers

_COARSE: Final = 5.0
"""Seconds: a thermometer is coarse that stands still for longer most of the time."""

_LARGEST: Final = 2.0
"""Kelvins: a larger step is one of the temperature, not of a thermometer."""

_KELVINS: Final = 1e4

_LEAP: Final = 10.0
"""Kelvins by which no temperature changes at once, and per second in which it may change more."""
_LEAP_RATE: Final = 1.0

_SHORT: Final = 15.0
"""Seconds: what a temperature leaps to for less, and leaps back from, is none."""

_ROUNDING: Final = 1e-9
"""Part of the largest value: below it a change is none."""


def thermometric(temperature: Floats) -> Floats:
    """Return temperatures, NaN for what no thermometer shows: 1e4 degC and more."""
    return np.where(np.abs(temperature) <= _KELVINS, temperature, np.nan)


def held(temperature: Floats) -> Floats:
    """Return temperatures in which a missing one is the last before it, or the first of all.

    What no thermometer shows, 1e4 degC and more, is missing; NaN throughout if none is there.
    """
    there = np.abs(temperature) <= _KELVINS
    if there.all() or not there.any():
        return np.where(there, temperature, np.nan)
    last = np.maximum.accumulate(np.where(there, np.arange(temperature.size), -1))
    return np.asarray(temperature[np.where(last < 0, np.argmax(there), last)])


def without_leaps(time: Floats, temperature: Floats) -> tuple[Floats, int]:
    """Return temperatures in which those that a thermometer cannot have had are missing, NaN.

    No gyro is ten kelvins warmer at once, and colder again within seconds: a stretch of less than
    15 s between two such leaps, or between one and an end of the record, is none. Returns how many
    they are as well.
    """
    there = np.flatnonzero(np.isfinite(temperature))
    if there.size < 2:
        return temperature, 0
    stamps, shown = time[there], temperature[there]
    leaps = np.abs(np.diff(shown)) > _LEAP + _LEAP_RATE * np.diff(stamps)
    begins = np.concatenate(([0], np.flatnonzero(leaps) + 1))
    ends = np.append(begins[1:], shown.size)
    lasts = stamps[ends - 1] - stamps[begins]
    short = (lasts < _SHORT) & (ends - begins < shown.size // 2)
    if not short.any() or short.all():
        return temperature, 0
    kept = ~np.repeat(short, ends - begins)
    # What is short and no leap away from the others, between two spikes, is of the thermometer.
    wild = np.abs(shown - np.interp(stamps, stamps[kept], shown[kept])) > _LEAP
    wild &= ~kept
    cleaned = temperature.copy()
    cleaned[there[wild]] = np.nan
    return cleaned, int(wild.sum())


def between_steps(time: Floats, temperature: Floats) -> tuple[Floats, float]:
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
    changes = _changes(temperature)
    if changes.size == 0:
        return temperature, 0.0
    moments = 0.5 * (time[changes] + time[changes + 1])
    if _usual_stay(np.diff([time[0], *moments, time[-1]])) < _COARSE:
        return temperature, 0.0
    jumps = temperature[changes + 1] - temperature[changes]
    step = float(np.abs(jumps).min())
    if step > _LARGEST:
        return temperature, 0.0
    half = 0.5 * step * np.sign(jumps)
    edges = temperature[changes] + half, temperature[changes + 1] - half
    turns = _turns(moments, jumps)
    times = [time[changes], time[changes + 1], 0.5 * (moments[turns] + moments[turns + 1])]
    values = [*edges, temperature[changes[turns] + 1]]
    backwards = (time[-1] - moments[::-1], edges[0][::-1], -half[::-1], time[-1] - time[0])
    times += [time[:1], time[-1:]]
    values += [_end(*backwards), _end(moments - time[0], edges[1], half, time[-1] - time[0])]
    known, shown = np.concatenate(times), np.concatenate(values)
    order = np.argsort(known, kind="stable")
    return np.interp(time, known[order], shown[order]), step


def _changes(temperature: Floats) -> Integers:
    """Return the samples after which the value is another."""
    least = _ROUNDING * np.abs(temperature).max()
    return np.flatnonzero(np.abs(np.diff(temperature)) > least)


def _usual_stay(stays: Floats) -> float:
    """Return the length of the stay in the middle of the record's time, stays by length."""
    lengths = np.sort(stays)
    total = np.cumsum(lengths)
    return float(lengths[np.searchsorted(total, 0.5 * total[-1])])


def _turns(moments: Floats, jumps: Floats) -> Integers:
    """Return the changes after which the value stays long, and then goes back."""
    stays = np.diff(moments)
    beside = np.concatenate(([np.inf], stays, [np.inf]))
    long = stays > np.minimum(beside[:-2], beside[2:])
    return np.flatnonzero(long & (jumps[:-1] * jumps[1:] < 0.0))


def _end(moments: Floats, edges: Floats, half: Floats, end: float) -> Floats:
    """Return the temperature at the end of a record, after its last change."""
    elsewhere = np.flatnonzero(np.abs(edges - edges[-1]) > abs(half[-1]))
    share = 0.5
    if elsewhere.size and (edges[-1] - edges[elsewhere[-1]]) * half[-1] > 0.0:
        took, since = moments[-1] - moments[elsewhere[-1]], end - moments[-1]
        share = since / (since + took)
    return np.array([edges[-1] + 2.0 * half[-1] * share])
