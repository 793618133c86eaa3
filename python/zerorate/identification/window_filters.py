"""Filters over a window of samples: moving averages, outliers, decimation."""

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

    Beware: it makes noise correlated. White noise comes out with a correlation of (w - j)/w at lag
    j < w for a width of w, 0.8 at lag 1 for w = 5; an AR model of the result describes the window
    as much as the sensor.

    Parameters
    ----------
    z : array_like, shape (n,)
        Samples; those not finite are missing.
    width : int
        Samples of a window, at least 1. An even width reaches one sample further back than ahead.

    Returns
    -------
    ndarray of float64, shape (n,)
        In the unit of `z`. Windows end where the record ends. Missing samples are left out of the
        means and stay missing.

    Raises
    ------
    TypeError
        If `z` does not hold real numbers.
    ValueError
        If `z` is not one axis with a sample, or the width not a whole number from 1 on.

    Notes
    -----
    No sum spans more than two windows, so an outlier of any size leaves no rounding error behind.

    Examples
    --------
    >>> moving_average([0.0, 3.0, 0.0, 0.0], width=3).tolist()
    [1.5, 1.0, 1.0, 0.0]
    """
    check_width(width)
    return running_mean(mark_gaps(as_record(z)), width)


def running_mean(record: Floats, width: int) -> Floats:
    """Return `moving_average` of a record with NaN where a sample is missing."""
    present = np.isfinite(record)
    width = min(width, 2 * record.size)
    origin = record[int(np.argmax(present))]
    sums = _window_sums(np.where(present, record - origin, 0.0), width)
    counts = _window_sums(present.astype(np.float64), width)
    return np.where(present, origin + sums / np.maximum(counts, 1.0), np.nan)


def _window_sums(values: Floats, width: int) -> Floats:
    """Sum every window as the end of one block of its width and the beginning of the next."""
    before, n = width // 2, values.size
    blocks = np.zeros((-(-(n + width) // width), width))
    blocks.reshape(-1)[before : before + n] = values
    ends = np.cumsum(blocks[:, ::-1], axis=1)[:, ::-1].reshape(-1)[:n]
    beginnings = np.cumsum(blocks, axis=1).reshape(-1)[width - 1 : width - 1 + n]
    whole = np.arange(n) % width == 0
    return np.where(whole, ends, ends + beginnings)


class CleanedRecord(NamedTuple):
    """A record without its outliers, shape (n,), and which samples they were."""

    data: Floats
    outliers: Booleans


def hampel(z: npt.ArrayLike, width: int = 11, threshold: float = 4.0) -> CleanedRecord:
    """Replace samples far from the median of their window by that median.

    Parameters
    ----------
    z : array_like, shape (n,)
        Samples; those not finite are missing, and stay so.
    width : int, default 11
        Samples of the window centred on each, at least 1; an even one reaches one sample further
        back than ahead, and all end where the record ends. For Gaussian noise and a threshold of 4,
        a window of 11 calls one sample in 90 an outlier, one of 51 one in 1500.
    threshold : float, default 4.0
        Standard deviations from the median beyond which a sample is an outlier, not negative. They
        are estimated by 1.4826 times the median distance from the median (MAD), as for Gaussian
        noise.

    Returns
    -------
    data : ndarray of float64, shape (n,)
        In the unit of `z`.
    outliers : ndarray of bool, shape (n,)
        Mask of replaced samples.

    Raises
    ------
    TypeError
        If `z` does not hold real numbers.
    ValueError
        If `z` is not one axis with a sample, or `width` or `threshold` not as described.

    Notes
    -----
    If more than half of a window is equal, as in coarse records, its MAD is 0. So the standard
    deviation is never less than the step of quantisation, the least difference between a sample and
    the next: an outlier is more than `threshold` steps off.

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

    Beware: an outlier raises the average around it and the standard deviation of all, so `hampel`
    finds more.

    Parameters
    ----------
    z : array_like, shape (n,)
        Samples; those not finite are missing, and stay so.
    width : int, default 11
        Samples of the moving average.
    threshold : float, default 4.0
        Standard deviations, of all distances from the average, beyond which a sample is an
        outlier; not negative.

    Returns
    -------
    data : ndarray of float64, shape (n,)
        In the unit of `z`.
    outliers : ndarray of bool, shape (n,)
        Mask of replaced samples.

    Raises
    ------
    TypeError
        If `z` does not hold real numbers.
    ValueError
        If `z` is not one axis with a sample, or `width` or `threshold` not as described.

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
"""Attenuation in dB; the ripple of the pass band is the same 1e-4."""

_PASS_BAND: Final = 0.8
"""End of the pass band, in the new Nyquist frequency, which is where the stop band begins."""

_BLOCK_SAMPLES: Final = 1 << 17
"""Samples that are gathered at a time, so that they stay in the cache."""


def decimate(z: npt.ArrayLike, factor: int) -> Floats:
    """Return every `factor`-th sample of a record after a low-pass against aliasing.

    The low-pass is a windowed sinc (Kaiser's window) of no delay: gain 1 within 1e-4 up to 0.8 of
    the new Nyquist frequency, and 80 dB down from that frequency on.

    Parameters
    ----------
    z : array_like, shape (n,)
        Samples; those not finite are missing.
    factor : int
        Return one of so many samples, at least 1; 1 changes nothing.

    Returns
    -------
    ndarray of float64, shape (ceil(n / factor),)
        Sample k has the time of z[k factor]. It is missing where the filter, which reaches
        just over 25 `factor` samples to each side, meets a missing sample or an end of the record.

    Raises
    ------
    TypeError
        If `z` does not hold real numbers.
    ValueError
        If `z` is not one axis, the factor not a whole number from 1 on, or the record nowhere as
        long as the filter without a gap.

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
    """Return a symmetric filter of gain 1 with its 6 dB point amid the transition."""
    transition = math.pi * (1.0 - _PASS_BAND) / factor
    half = math.ceil((_STOP_BAND_DB - 7.95) / (2.285 * transition) / 2.0)
    beta = 0.1102 * (_STOP_BAND_DB - 8.7)
    cutoff = 0.5 * (1.0 + _PASS_BAND) / factor
    taps = np.sinc(cutoff * np.arange(-half, half + 1)) * np.kaiser(2 * half + 1, beta)
    taps /= taps.sum()
    taps.flags.writeable = False
    return np.asarray(taps)


def _filter_decimated(record: Floats, taps: Floats, factor: int) -> Floats:
    """Convolve where a sample is kept only; beyond its ends the record is missing."""
    half = taps.size // 2
    padded = np.pad(record, half, constant_values=np.nan)
    windows = np.lib.stride_tricks.sliding_window_view(padded, taps.size)[::factor]
    rows = max(_BLOCK_SAMPLES // taps.size, 1)
    parts = [windows[i : i + rows].copy() @ taps for i in range(0, len(windows), rows)]
    return np.concatenate(parts)
