"""Filters over a window of samples: moving average, outliers, decimation."""

from __future__ import annotations

import math
from functools import lru_cache
from typing import Final, NamedTuple

import numpy as np
import numpy.typing as npt

from zerorate import _native
from zerorate.faults import ArgumentError
from zerorate.noise.records import as_record, check_width, mark_gaps, resolution
from zerorate.types import Booleans, Floats


def moving_average(z: npt.ArrayLike, width: int) -> Floats:
    """Return the mean of a window centred on each sample.

    A moving average makes noise correlated. White noise gets a correlation of (w - j)/w at lag j,
    if j is less than the width w: for example 0.8 at lag 1 for w = 5. An AR model of the result
    therefore describes the window and the sensor together.

    Parameters
    ----------
    z : array_like, shape (n,)
        Samples; values that are not finite count as missing.
    width : int
        Width of the window in samples, at least 1. A window of even width extends one sample more
        to the past.

    Returns
    -------
    ndarray of float64, shape (n,)
        Means in the unit of `z`. Windows are cut at the ends of the record. Missing samples are
        left out of the means and stay missing.

    Raises
    ------
    TypeError
        If `z` does not hold real numbers.
    ValueError
        If `z` is not one axis with a sample, or the width is not a whole number from 1.

    Notes
    -----
    No sum spans more than two windows, so a large outlier leaves no rounding error in later means.

    Examples
    --------
    >>> moving_average([0.0, 3.0, 0.0, 0.0], width=3).tolist()
    [1.5, 1.0, 1.0, 0.0]
    """
    check_width(width)
    return running_mean(mark_gaps(as_record(z)), width)


def running_mean(record: Floats, width: int) -> Floats:
    """Return `moving_average` of a record with NaN for missing samples."""
    present = np.isfinite(record)
    width = min(width, 2 * record.size)
    origin = record[int(np.argmax(present))]
    sums = _window_sums(np.where(present, record - origin, 0.0), width)
    counts = _window_sums(present.astype(np.float64), width)
    return np.where(present, origin + sums / np.maximum(counts, 1.0), np.nan)


def _window_sums(values: Floats, width: int) -> Floats:
    """Return the sum of every window from the end of one block and the beginning of the next."""
    before, n = width // 2, values.size
    blocks = np.zeros((-(-(n + width) // width), width))
    blocks.reshape(-1)[before : before + n] = values
    ends = np.cumsum(blocks[:, ::-1], axis=1)[:, ::-1].reshape(-1)[:n]
    beginnings = np.cumsum(blocks, axis=1).reshape(-1)[width - 1 : width - 1 + n]
    whole = np.arange(n) % width == 0
    return np.where(whole, ends, ends + beginnings)


class CleanedRecord(NamedTuple):
    """Record without outliers, shape (n,), and the mask of the outliers."""

    data: Floats
    outliers: Booleans


def hampel(z: npt.ArrayLike, width: int = 11, threshold: float = 4.0) -> CleanedRecord:
    """Replace outliers by the median of their window (Hampel filter).

    Parameters
    ----------
    z : array_like, shape (n,)
        Samples; values that are not finite count as missing, and stay missing.
    width : int, default 11
        Width of the window around each sample, at least 1. An even window extends one sample more
        to the past. Windows are cut at the ends of the record. For Gaussian noise and a threshold
        of 4, a window of 11 marks one sample in 90 as outlier. A window of 51 marks one in 1500.
    threshold : float, default 4.0
        Distance from the median, in standard deviations, above which a sample is an outlier. The
        standard deviation is estimated as 1.4826 times the median distance from the median (MAD),
        as for Gaussian noise.

    Returns
    -------
    data : ndarray of float64, shape (n,)
        Record with replaced outliers, in the unit of `z`.
    outliers : ndarray of bool, shape (n,)
        Mask of replaced samples.

    Raises
    ------
    TypeError
        If `z` does not hold real numbers.
    ValueError
        If `z` is not one axis with a sample. If `width` or `threshold` is not as described.

    Notes
    -----
    If more than half of the samples in a window are equal, as in coarse records, their MAD is 0.
    The standard deviation is therefore at least the step of quantisation, which is the smallest
    difference between successive samples. An outlier is then more than `threshold` steps from the
    median.

    F. R. Hampel, "The influence curve and its role in robust estimation", JASA 69, 1974.

    Examples
    --------
    >>> data, outliers = hampel([0.0, 1.0, 0.0, 90.0, 1.0, 0.0, 1.0], width=5)
    >>> data.tolist(), int(outliers.sum())
    ([0.0, 1.0, 0.0, 1.0, 1.0, 0.0, 1.0], 1)
    """
    check_width(width)
    _check_threshold(threshold)
    record = mark_gaps(as_record(z))
    data, indices = _native.without_outliers(record, width, threshold, resolution(record))
    outliers = np.zeros(record.size, dtype=np.bool_)
    outliers[indices] = True
    return CleanedRecord(data, outliers)


def far_from_average(z: npt.ArrayLike, width: int = 11, threshold: float = 4.0) -> CleanedRecord:
    """Replace samples far from the moving average by the average, as Bao and Yuan do.

    An outlier increases its average and the standard deviation, so `hampel` finds more outliers.

    Parameters
    ----------
    z : array_like, shape (n,)
        Samples; values that are not finite count as missing, and stay missing.
    width : int, default 11
        Width of the moving average in samples.
    threshold : float, default 4.0
        Distance from the average, in standard deviations of all these distances, above which a
        sample is an outlier. Not negative.

    Returns
    -------
    data : ndarray of float64, shape (n,)
        Record with replaced outliers, in the unit of `z`.
    outliers : ndarray of bool, shape (n,)
        Mask of replaced samples.

    Raises
    ------
    TypeError
        If `z` does not hold real numbers.
    ValueError
        If `z` is not one axis with a sample. If `width` or `threshold` is not as described.

    Examples
    --------
    >>> from zerorate.identification import far_from_average
    >>> data, outliers = far_from_average([0.0] * 20 + [90.0] + [0.0] * 20, width=5)
    >>> data[20:22].tolist(), outliers.nonzero()[0].tolist()
    ([18.0, 0.0], [20])
    """
    check_width(width)
    _check_threshold(threshold)
    record = mark_gaps(as_record(z))
    average = running_mean(record, width)
    distance = record - average
    outliers = np.abs(distance) > threshold * float(np.nanstd(distance))
    return CleanedRecord(np.where(outliers, average, record), outliers)


def _check_threshold(threshold: float) -> None:
    if not (math.isfinite(threshold) and threshold >= 0.0):
        raise ArgumentError("threshold", f"must be finite and not negative, got {threshold!r}")


_STOP_BAND_DB: Final = 80.0
"""Attenuation of the stop band, dB; the ripple of the pass band is also 1e-4."""

_PASS_BAND: Final = 0.8
"""End of the pass band as a share of the new Nyquist frequency, where the stop band begins."""

_BLOCK_SAMPLES: Final = 1 << 17
"""Number of samples processed at once, so that they stay in the cache."""


def decimate(z: npt.ArrayLike, factor: int) -> Floats:
    """Return every `factor`-th sample of a record after a low-pass against aliasing.

    The low-pass is a windowed sinc (Kaiser's window) without delay. Its gain is 1 within 1e-4 up to
    0.8 of the new Nyquist frequency. Above the new Nyquist frequency the attenuation is 80 dB.

    Parameters
    ----------
    z : array_like, shape (n,)
        Samples; values that are not finite count as missing.
    factor : int
        Decimation factor: one of this number of samples is returned. At least 1; 1 changes nothing.

    Returns
    -------
    ndarray of float64, shape (ceil(n / factor),)
        Decimated record; sample k has the time of z[k factor]. The filter extends just over 25
        times `factor` samples to each side. A sample is missing if the filter includes a missing
        sample or extends beyond an end of the record.

    Raises
    ------
    TypeError
        If `z` does not hold real numbers.
    ValueError
        If `z` is not one axis. If the factor is not a whole number from 1. If every stretch without
        a gap is shorter than the filter.

    Notes
    -----
    A. V. Oppenheim, R. W. Schafer, Discrete-Time Signal Processing, section 7.6: Kaiser's design.

    Examples
    --------
    >>> slow = decimate(np.full(1000, 2.0), 10)
    >>> slow.shape, round(float(slow[50]), 12)
    ((100,), 2.0)
    """
    record = mark_gaps(as_record(z))
    if check_width(factor, "factor") == 1:
        return record.copy()
    taps = _low_pass(factor)
    origin = record[int(np.argmax(np.isfinite(record)))]
    slow = origin + _filter_decimated(record - origin, taps, factor)
    if not np.isfinite(slow).any():
        raise ValueError(
            f"decimation by {factor} needs {taps.size} samples in a row, and z nowhere has them"
        )
    return np.asarray(slow)


@lru_cache(maxsize=16)
def _low_pass(factor: int) -> Floats:
    """Return a symmetric filter of gain 1 with its 6 dB point in the middle of the transition."""
    transition = math.pi * (1.0 - _PASS_BAND) / factor
    half = math.ceil((_STOP_BAND_DB - 7.95) / (2.285 * transition) / 2.0)
    beta = 0.1102 * (_STOP_BAND_DB - 8.7)
    cutoff = 0.5 * (1.0 + _PASS_BAND) / factor
    taps = np.sinc(cutoff * np.arange(-half, half + 1)) * np.kaiser(2 * half + 1, beta)
    taps /= taps.sum()
    taps.flags.writeable = False
    return np.asarray(taps)


def _filter_decimated(record: Floats, taps: Floats, factor: int) -> Floats:
    """Convolve at the kept samples only; samples outside the record count as missing."""
    half = taps.size // 2
    padded = np.pad(record, half, constant_values=np.nan)
    windows = np.lib.stride_tricks.sliding_window_view(padded, taps.size)[::factor]
    rows = max(_BLOCK_SAMPLES // taps.size, 1)
    parts = [windows[i : i + rows].copy() @ taps for i in range(0, len(windows), rows)]
    return np.concatenate(parts)
