"""Samples too far from their neighbours."""

import math
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from zerorate import _native
from zerorate.identify.preparation.centring import with_gaps
from zerorate.identify.preparation.smoothing import checked_width, running_mean
from zerorate.identify.records import as_record

__all__ = ["Cleaned", "far_from_average", "hampel", "resolution"]

Floats = npt.NDArray[np.float64]
Flags = npt.NDArray[np.bool_]


class Cleaned(NamedTuple):
    """A record without its outliers, shape (n,), and which samples they were."""

    data: Floats
    outliers: Flags


def hampel(z: npt.ArrayLike, width: int = 11, threshold: float = 4.0) -> Cleaned:
    """Replace samples far from the median of their window by that median.

    Parameters
    ----------
    z : array_like, shape (n,)
        Samples; those not finite are missing, and stay so.
    width : int, default 11
        Samples of the window centred on each, at least 1; an even one reaches one sample further
        back than ahead, and all end where the record ends. Of Gaussian noise, a window of 11 takes
        one sample in 90 for an outlier at a threshold of 4, one of 51 one in 1500.
    threshold : float, default 4.0
        Deviations from the median beyond which a sample is an outlier, not negative. A deviation
        is 1.4826 times the median distance from the median (MAD), as for Gaussian noise.

    Returns
    -------
    data : ndarray of float64, shape (n,)
        In the unit of `z`.
    outliers : ndarray of bool, shape (n,)
        Which samples were replaced.

    Raises
    ------
    TypeError
        If `z` does not hold real numbers.
    ValueError
        If `z` is not one axis with a sample, or `width` or `threshold` not as described.

    Notes
    -----
    Where more than half a window is equal, as in coarse records, its MAD is 0. So a deviation is
    never taken for less than the step of quantisation, the least difference between a sample and
    the next: to be an outlier, a sample is more than `threshold` steps off.

    F. R. Hampel, "The influence curve and its role in robust estimation", JASA 69, 1974.

    Examples
    --------
    >>> data, outliers = hampel([0.0, 1.0, 0.0, 90.0, 1.0, 0.0, 1.0], width=5)
    >>> data.tolist(), int(outliers.sum())
    ([0.0, 1.0, 0.0, 1.0, 1.0, 0.0, 1.0], 1)
    """
    checked_width(width)
    _check_threshold(threshold)
    record = with_gaps(as_record(z))
    data, places = _native.without_outliers(record, width, threshold, resolution(record))
    outliers = np.zeros(record.size, dtype=np.bool_)
    outliers[places] = True
    return Cleaned(data, outliers)


def far_from_average(z: npt.ArrayLike, width: int = 11, threshold: float = 4.0) -> Cleaned:
    """Replace samples far from the moving average by it, as Bao and Yuan do.

    Beware: an outlier raises the average round it and the deviation of them all, so `hampel` finds
    more.

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
        Which samples were replaced.

    Raises
    ------
    TypeError
        If `z` does not hold real numbers.
    ValueError
        If `z` is not one axis with a sample, or `width` or `threshold` not as described.
    """
    checked_width(width)
    _check_threshold(threshold)
    record = with_gaps(as_record(z))
    average = running_mean(record, width)
    distance = record - average
    outliers = np.abs(distance) > threshold * float(np.nanstd(distance))
    return Cleaned(np.where(outliers, average, record), outliers)


def resolution(record: Floats) -> float:
    """Return the least difference between a sample and the next that is not 0, or 0 if all are.

    For a coarse record it is the step of quantisation; otherwise it is next to nothing.
    """
    steps = np.abs(np.diff(record))
    steps = steps[steps > 0.0]
    return float(steps.min()) if steps.size else 0.0


def _check_threshold(threshold: float) -> None:
    if not (math.isfinite(threshold) and threshold >= 0.0):
        raise ValueError(f"threshold must be finite and not negative, got {threshold!r}")
