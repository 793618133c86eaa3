"""Peaks of a vibration that the sampling folds: they move against the peak they belong to."""

from __future__ import annotations

import math
from typing import Final, NamedTuple

import numpy as np

from zerorate.types import Booleans, Floats, Integers

_PEAK: Final = 4.0
"""Amplitude of a peak over what is around it: 12 dB."""
_LOWEST: Final = 5.0
"""Hz below which motion is, and no vibration."""
_LEAST: Final = 12
"""Windows of a second without which nothing is told."""
_MOVES: Final = 1.5
"""Hz by which a peak must move; of one that stands, nothing tells where it comes from."""
_SECTION: Final = 16
"""Bins, at least, whose median is what is around a peak."""
_NEAR: Final = 3.0
"""Bins within which a folded peak and a harmonic that is not cannot be told apart."""
_CHANCE: Final = 1e-6


class Folded(NamedTuple):
    """A harmonic k f₁ that is seen at |k f₁ − m f_s|: frequencies, Hz, its amplitude and error."""

    order: int
    fold: int
    peak: tuple[float, float]
    """The middle 80 % of where the peak f₁ is."""
    seen: tuple[float, float]
    amplitude: float
    sigma: float


def folded_of(parts: Floats, rate: float) -> Folded | None:
    """Return the largest folded harmonic of the strongest peak, None if none is seen.

    The strongest peak of each window says where its harmonics would be folded to. A harmonic is
    seen where peaks are there in most windows, and are not where other windows say.

    Parameters
    ----------
    parts : array of float64, shape (m, n, 3)
        Windows of a second of an accelerometer, with n samples each.
    rate : float
        Hz.
    """
    if len(parts) < _LEAST:
        return None
    taper = np.hanning(parts.shape[1])[:, np.newaxis]
    spectra = np.fft.rfft((parts - parts.mean(axis=1, keepdims=True)) * taper, axis=1)
    power = np.square(np.abs(spectra)).sum(axis=2)
    power *= 4.0 / (parts.shape[1] * float(np.square(taper).sum()))
    bins = rate / parts.shape[1]
    amplitude = np.sqrt(power)
    stands = amplitude > _PEAK * _around(amplitude)
    stands[:, : math.ceil(_LOWEST / bins)] = False
    first, there = _strongest(amplitude, stands)
    if np.count_nonzero(there) < _LEAST:
        return None
    first, power, stands = first[there], power[there], stands[there]
    low, high = np.quantile(first, (0.1, 0.9))
    if (high - low) * bins < _MOVES:
        return None
    places = [(k, m) for k in (2, 3, 4) for m in (1, 2)]
    found = [_harmonic(k, m, first, power, stands, bins, rate) for k, m in places]
    return max((one for one in found if one is not None), key=lambda o: o.amplitude, default=None)


def _around(amplitude: Floats) -> Floats:
    """Return the median amplitude of each section of the band, at each bin."""
    count = amplitude.shape[1]
    sections = np.array_split(np.arange(count), max(1, min(12, count // _SECTION)))
    medians = [np.median(amplitude[:, s], axis=1, keepdims=True) for s in sections]
    columns = [np.repeat(one, len(s), axis=1) for one, s in zip(medians, sections, strict=True)]
    return np.maximum(np.concatenate(columns, axis=1), np.finfo(float).tiny)


def _strongest(amplitude: Floats, stands: Booleans) -> tuple[Floats, Booleans]:
    """Return the bin of each window's strongest peak, by a parabola, and where there is one."""
    rows = np.arange(len(amplitude))
    at = np.argmax(np.where(stands, amplitude, 0.0), axis=1)
    there = stands[rows, at] & (at > 0) & (at < amplitude.shape[1] - 1)
    at = np.clip(at, 1, amplitude.shape[1] - 2)
    left, middle, right = np.log(
        np.maximum([amplitude[rows, at + k] for k in (-1, 0, 1)], np.finfo(float).tiny)
    )
    bend = np.minimum(left - 2.0 * middle + right, -1e-9)
    return at + np.clip(0.5 * (left - right) / bend, -0.5, 0.5), there


def _harmonic(
    order: int, fold: int, first: Floats, power: Floats, stands: Booleans, bins: float, rate: float
) -> Folded | None:
    half = 0.5 * rate / bins
    place = np.abs(order * first - 2.0 * fold * half)
    width = math.ceil(0.75 * order)
    usable = (place < half - width) & (place > _LOWEST / bins + width)
    usable &= np.abs(place - first) > _NEAR + width
    for times in (0.5, 1.5, 2.0, 3.0, 4.0):
        other = times * first
        seen = _stands_at(stands, other, 1)[other < half]
        if seen.size and np.mean(seen) > 0.5:  # else there is none to be taken for it
            usable &= np.abs(place - other) > _NEAR + width
    if np.count_nonzero(usable) < _LEAST:
        return None
    first, place, power, stands = first[usable], place[usable], power[usable], stands[usable]
    hits = _stands_at(stands, place, width)
    # Where the other windows have it tells how often something is there by chance.
    shifts = range(1, len(place), max(1, len(place) // 64))
    elsewhere = np.stack([np.roll(place, s) for s in shifts])
    far = np.abs(elsewhere - place) > 2 * width + 1
    far &= np.abs(elsewhere - first) > _NEAR + width
    others = np.stack([_stands_at(stands, one, width) for one in elsewhere])
    usual = float(others[far].mean()) if np.count_nonzero(far) >= _LEAST else 1.0
    if not _is_told(hits, max(usual, 0.02)):
        return None
    # Next to the peak itself its own amplitude counts in it.
    clear = hits & (np.abs(place - first) > _NEAR + width + 2)
    if np.count_nonzero(clear) < _LEAST // 2:
        return None
    sizes = _amplitudes(power, place, width + 2)[clear]
    low, high = np.quantile(first[hits], (0.1, 0.9)) * bins
    under, over = np.quantile(place[hits], (0.1, 0.9)) * bins
    return Folded(
        order, fold, (float(low), float(high)), (float(under), float(over)),
        float(np.median(sizes)), float(1.25 * sizes.std() / math.sqrt(len(sizes))),
    )  # fmt: skip


def _is_told(hits: Booleans, usual: float) -> bool:
    """Whether hits are most of the windows, and far more than usual; half of those overlap."""
    share, count = float(np.mean(hits)), 0.5 * len(hits)
    if share < 0.5 or share <= usual:
        return False
    odds = share * math.log(share / usual)
    odds += (1.0 - share) * math.log((1.0 - share) / (1.0 - usual)) if share < 1.0 else 0.0
    return math.exp(-count * odds) < _CHANCE


def _stands_at(stands: Booleans, place: Floats, width: int) -> Booleans:
    """Return whether a peak stands within some bins of a place of each window."""
    return np.asarray(np.take_along_axis(stands, _bins(place, width, stands), axis=1).any(axis=1))


def _amplitudes(power: Floats, place: Floats, width: int) -> Floats:
    """Return the amplitude of a sine at a place of each window, by the bins about it."""
    near = np.take_along_axis(power, _bins(place, width, power), axis=1)
    return np.asarray(np.sqrt(near.sum(axis=1)))


def _bins(place: Floats, width: int, table: Floats | Booleans) -> Integers:
    around = np.arange(-width, width + 1)
    near = np.round(place).astype(np.int64)[:, np.newaxis] + around
    return np.asarray(np.clip(near, 0, table.shape[1] - 1))
