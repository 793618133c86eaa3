"""Means of a gyro's samples at rest, with their temperature, in blocks of a few seconds."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from zerorate.types import Booleans, Floats, Integers

_BLOCK_S: Final = 5.0
"""Length of a block, s; shorter in a short record, longer in a long record."""

_MIN_BLOCKS, _MAX_BLOCKS = 24, 1000
_MIN_REST_SHARE: Final = 0.2
"""Smallest share of a used block that is at rest."""

_WINDOW_S: Final = 0.5
"""Length of a window, s; at least eight samples."""

_MAX_VARIANCE_RATIO: Final = 5.0
"""Largest variance of a window at rest, over the usual variance at rest."""

_CHUNK_SAMPLES: Final = 100_000
"""Number of samples in one computation of variances, to limit the memory."""

_TINY: Final = float(np.finfo(float).tiny)


@dataclass(frozen=True, eq=False)
class Blocks:
    """Means of samples at rest.

    Parameters
    ----------
    time
        Time since the record's start, s, shape (m,).
    temperature
        Temperature, degC, shape (m,); NaN if unknown.
    bias
        Mean output, shape (m, k).
    count
        Number of samples in each mean, shape (m,).
    length
        Length of a block, s.
    still
        Share of the record's samples in the means.
    """

    time: Floats
    temperature: Floats
    bias: Floats
    count: Integers
    length: float
    still: float

    def select(self, mask: Booleans) -> Blocks:
        """Return a part of the means."""
        return replace(
            self,
            time=self.time[mask],
            temperature=self.temperature[mask],
            bias=self.bias[mask],
            count=self.count[mask],
        )

    def scaled(self, factor: float) -> Blocks:
        """Return the means of samples multiplied by a number."""
        return replace(self, bias=self.bias * factor)


def average_blocks(
    rates: Floats, temperature: Floats, rate: float, rests: Booleans | None
) -> Blocks:
    """Return the means of all blocks with enough samples at rest.

    Parameters
    ----------
    rates : ndarray of float64, shape (n, k)
        Samples of the gyro.
    temperature : ndarray of float64, shape (n,)
        Temperature: finite, or NaN throughout.
    rate : float
        Sampling rate, Hz.
    rests : ndarray of bool, shape (n,), optional
        Mask of samples at rest. Default: detected from the rates.
    """
    n = len(rates)
    still = find_still_samples(rates, rate) if rests is None else rests
    used = np.flatnonzero(still & np.isfinite(rates).all(axis=1))
    length = max(min(_BLOCK_S * rate, used.size / _MIN_BLOCKS), n / _MAX_BLOCKS)
    size = max(int(length), 1)
    number = used // size
    counts = np.bincount(number, minlength=-(-n // size))
    full_blocks = np.flatnonzero(counts >= max(_MIN_REST_SHARE * size, 1.0))
    return Blocks(
        time=_block_means(used / rate, number, counts)[full_blocks],
        temperature=_block_means(temperature[used], number, counts)[full_blocks],
        bias=np.column_stack(
            [_block_means(axis[used], number, counts)[full_blocks] for axis in rates.T]
        ),
        count=counts[full_blocks],
        length=size / rate,
        still=float(counts[full_blocks].sum()) / n,
    )


def _block_means(values: Floats, number: Integers, counts: Integers) -> Floats:
    """Return the mean of each block, relative to its first value to keep digits."""
    origin = values[0] if values.size else 0.0
    sums = np.bincount(number, values - origin, minlength=counts.size)
    return np.asarray(origin + sums / np.maximum(counts, 1))


def find_still_samples(rates: Floats, rate: float) -> Booleans:
    """Return the mask of samples at rest, shape (n,), from rates of shape (n, k).

    The variance of each axis about a line is computed in windows of half a second. A window is at
    rest if no axis exceeds five times its variance at rest. Its neighbouring windows must also be
    at rest. A rotation at constant rate counts as rest.
    """
    n, size = len(rates), max(round(_WINDOW_S * rate), 8)
    count = n // size
    if count < 3:
        return np.ones(n, dtype=bool)
    windows = rates[: count * size].reshape(count, size, -1)
    chunk_windows = max(_CHUNK_SAMPLES // size, 1)
    parts = [
        _detrended_variances(windows[i : i + chunk_windows]) for i in range(0, count, chunk_windows)
    ]
    variance, full = (np.concatenate(part) for part in zip(*parts, strict=True))
    if not full.any():
        return np.zeros(n, dtype=bool)
    variance = np.maximum(variance, np.maximum(_resolution(rates) ** 2 / 12.0, _TINY))
    loud = ~full | np.asarray(
        (variance / _estimate_floors(variance[full]) >= _MAX_VARIANCE_RATIO).any(axis=1)
    )
    near_motion = loud.copy()
    near_motion[1:] |= loud[:-1]
    near_motion[:-1] |= loud[1:]
    return np.asarray(~near_motion[np.minimum(np.arange(n) // size, count - 1)])


def _detrended_variances(windows: Floats) -> tuple[Floats, Booleans]:
    """Return each window's variance about a line, and the mask of windows with enough samples."""
    present = np.isfinite(windows)
    number = np.maximum(present.sum(axis=1, keepdims=True), 1)
    position = np.where(present, np.arange(windows.shape[1])[:, np.newaxis], 0.0)
    position = np.where(present, position - position.sum(axis=1, keepdims=True) / number, 0.0)
    # The first sample is subtracted, to keep digits with a large offset.
    first = np.take_along_axis(windows, present.argmax(axis=1)[:, np.newaxis], axis=1)
    off = np.where(present, windows - np.nan_to_num(first), 0.0)
    off = np.where(present, off - off.sum(axis=1, keepdims=True) / number, 0.0)
    products = (position * off).sum(axis=1, keepdims=True)
    slope = products / np.maximum((position**2).sum(axis=1, keepdims=True), 1.0)
    squares = ((off - slope * position) ** 2).sum(axis=1)
    full = np.asarray((2 * number[:, 0] >= windows.shape[1]).all(axis=1))
    return squares / np.maximum(number[:, 0] - 2, 1), full


def _resolution(rates: Floats) -> Floats:
    """Return the smallest change of each axis, zero if there is none."""
    sizes = np.abs(np.diff(rates[: 1 << 16], axis=0))
    sizes[~(sizes > 0.0)] = np.inf
    least = sizes.min(axis=0, initial=np.inf)
    return np.where(np.isfinite(least), least, 0.0)


def _estimate_floors(variance: Floats) -> Floats:
    """Return the median of the small variances of each axis."""
    floor = np.percentile(variance, 10, axis=0)
    for _ in range(3):
        floor = np.nanmedian(np.where(variance < 3.0 * floor, variance, np.nan), axis=0)
    return np.asarray(floor)
