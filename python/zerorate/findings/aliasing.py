"""Detection of aliased harmonics of a vibration, by the change of their frequency with its peak."""

from __future__ import annotations

import math
from typing import Final, NamedTuple

import numpy as np

from zerorate.types import Booleans, Floats, Integers

_MIN_PEAK_RATIO: Final = 4.0
"""Smallest ratio of a peak to the spectrum around it: 12 dB."""
_MIN_FREQUENCY_HZ: Final = 5.0
"""Frequency below which motion, not vibration, is expected, Hz."""
_MIN_WINDOWS: Final = 12
"""Smallest number of windows of a second for a finding."""
_MIN_PEAK_MOTION_HZ: Final = 1.5
"""Smallest change of a peak's frequency, Hz; the source of a constant peak is unknown."""
_MIN_SECTION_BINS: Final = 16
"""Smallest number of bins for the median around a peak."""
_RESOLUTION_BINS: Final = 3.0
"""Distance in bins below which an aliased peak and a harmonic are indistinguishable."""
_MAX_CHANCE: Final = 1e-6


class AliasedHarmonic(NamedTuple):
    """Harmonic k f₁ visible at |k f₁ − m f_s|: frequencies, Hz, amplitude and its error."""

    order: int
    fold: int
    peak: tuple[float, float]
    """Middle 80 % of the frequencies of the peak f₁."""
    alias: tuple[float, float]
    amplitude: float
    sigma: float


def find_aliased_harmonic(parts: Floats, rate: float) -> AliasedHarmonic | None:
    """Return the largest aliased harmonic of the strongest peak, None if there is none.

    The strongest peak of each window gives the aliased frequencies of its harmonics. A harmonic is
    found if most windows have a peak at their own aliased frequency, but not at the aliased
    frequencies of other windows.

    Parameters
    ----------
    parts : array of float64, shape (m, n, 3)
        One-second windows of an accelerometer, with n samples each.
    rate : float
        Sampling rate, Hz.
    """
    if len(parts) < _MIN_WINDOWS:
        return None
    taper = np.hanning(parts.shape[1])[:, np.newaxis]
    spectra = np.fft.rfft((parts - parts.mean(axis=1, keepdims=True)) * taper, axis=1)
    power = np.square(np.abs(spectra)).sum(axis=2)
    power *= 4.0 / (parts.shape[1] * float(np.square(taper).sum()))
    bins = rate / parts.shape[1]
    amplitude = np.sqrt(power)
    stands = amplitude > _MIN_PEAK_RATIO * _median_amplitude(amplitude)
    stands[:, : math.ceil(_MIN_FREQUENCY_HZ / bins)] = False
    first, has_peak = _find_strongest(amplitude, stands)
    if np.count_nonzero(has_peak) < _MIN_WINDOWS:
        return None
    first, power, stands = first[has_peak], power[has_peak], stands[has_peak]
    low, high = np.quantile(first, (0.1, 0.9))
    if (high - low) * bins < _MIN_PEAK_MOTION_HZ:
        return None
    orders = [(k, m) for k in (2, 3, 4) for m in (1, 2)]
    harmonics = [_find_harmonic(k, m, first, power, stands, bins, rate) for k, m in orders]
    return max(
        (harmonic for harmonic in harmonics if harmonic is not None),
        key=lambda o: o.amplitude,
        default=None,
    )


def _median_amplitude(amplitude: Floats) -> Floats:
    """Return the median amplitude of each section of the band, at each bin."""
    count = amplitude.shape[1]
    sections = np.array_split(np.arange(count), max(1, min(12, count // _MIN_SECTION_BINS)))
    medians = [np.median(amplitude[:, s], axis=1, keepdims=True) for s in sections]
    columns = [np.repeat(one, len(s), axis=1) for one, s in zip(medians, sections, strict=True)]
    return np.maximum(np.concatenate(columns, axis=1), np.finfo(float).tiny)


def _find_strongest(amplitude: Floats, stands: Booleans) -> tuple[Floats, Booleans]:
    """Return the bin of each window's strongest peak, by a parabola, and a mask of peaks."""
    rows = np.arange(len(amplitude))
    at = np.argmax(np.where(stands, amplitude, 0.0), axis=1)
    has_peak = stands[rows, at] & (at > 0) & (at < amplitude.shape[1] - 1)
    at = np.clip(at, 1, amplitude.shape[1] - 2)
    left, middle, right = np.log(
        np.maximum([amplitude[rows, at + k] for k in (-1, 0, 1)], np.finfo(float).tiny)
    )
    bend = np.minimum(left - 2.0 * middle + right, -1e-9)
    return at + np.clip(0.5 * (left - right) / bend, -0.5, 0.5), has_peak


def _find_harmonic(
    order: int, fold: int, first: Floats, power: Floats, stands: Booleans, bins: float, rate: float
) -> AliasedHarmonic | None:
    half = 0.5 * rate / bins
    alias_bins = np.abs(order * first - 2.0 * fold * half)
    width = math.ceil(0.75 * order)
    usable = (alias_bins < half - width) & (alias_bins > _MIN_FREQUENCY_HZ / bins + width)
    usable &= np.abs(alias_bins - first) > _RESOLUTION_BINS + width
    for times in (0.5, 1.5, 2.0, 3.0, 4.0):
        other_bin = times * first
        has_other = _has_peak_at(stands, other_bin, 1)[other_bin < half]
        if has_other.size and np.mean(has_other) > 0.5:  # no other peaks to confuse
            usable &= np.abs(alias_bins - other_bin) > _RESOLUTION_BINS + width
    if np.count_nonzero(usable) < _MIN_WINDOWS:
        return None
    first, alias_bins, power, stands = (
        first[usable],
        alias_bins[usable],
        power[usable],
        stands[usable],
    )
    hits = _has_peak_at(stands, alias_bins, width)
    # Peaks at this frequency in other windows show how often one occurs by chance.
    shifts = range(1, len(alias_bins), max(1, len(alias_bins) // 64))
    other_bins = np.stack([np.roll(alias_bins, s) for s in shifts])
    is_separate = np.abs(other_bins - alias_bins) > 2 * width + 1
    is_separate &= np.abs(other_bins - first) > _RESOLUTION_BINS + width
    chance_hits = np.stack(
        [_has_peak_at(stands, shifted_bins, width) for shifted_bins in other_bins]
    )
    chance_share = (
        float(chance_hits[is_separate].mean())
        if np.count_nonzero(is_separate) >= _MIN_WINDOWS
        else 1.0
    )
    if not _is_significant(hits, max(chance_share, 0.02)):
        return None
    # Near the peak itself, the amplitude would include the amplitude of the peak.
    clear = hits & (np.abs(alias_bins - first) > _RESOLUTION_BINS + width + 2)
    if np.count_nonzero(clear) < _MIN_WINDOWS // 2:
        return None
    sizes = _amplitudes(power, alias_bins, width + 2)[clear]
    low, high = np.quantile(first[hits], (0.1, 0.9)) * bins
    under, over = np.quantile(alias_bins[hits], (0.1, 0.9)) * bins
    return AliasedHarmonic(
        order, fold, (float(low), float(high)), (float(under), float(over)),
        float(np.median(sizes)), float(1.25 * sizes.std() / math.sqrt(len(sizes))),
    )  # fmt: skip


def _is_significant(hits: Booleans, chance_share: float) -> bool:
    """Return True if hits are most of the windows, and far more than by chance."""
    share, count = float(np.mean(hits)), 0.5 * len(hits)
    if share < 0.5 or share <= chance_share:
        return False
    odds = share * math.log(share / chance_share)
    odds += (1.0 - share) * math.log((1.0 - share) / (1.0 - chance_share)) if share < 1.0 else 0.0
    return math.exp(-count * odds) < _MAX_CHANCE


def _has_peak_at(stands: Booleans, positions: Floats, width: int) -> Booleans:
    """Return the mask of windows with a peak within some bins of a position."""
    return np.asarray(
        np.take_along_axis(stands, _bins_around(positions, width, stands), axis=1).any(axis=1)
    )


def _amplitudes(power: Floats, positions: Floats, width: int) -> Floats:
    """Return the amplitude of a sine at a bin position of each window, from the bins around it."""
    near = np.take_along_axis(power, _bins_around(positions, width, power), axis=1)
    return np.asarray(np.sqrt(near.sum(axis=1)))


def _bins_around(positions: Floats, width: int, table: Floats | Booleans) -> Integers:
    around = np.arange(-width, width + 1)
    near = np.round(positions).astype(np.int64)[:, np.newaxis] + around
    return np.asarray(np.clip(near, 0, table.shape[1] - 1))
