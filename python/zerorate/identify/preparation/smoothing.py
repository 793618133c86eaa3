"""Running means."""

import numbers

import numpy as np
import numpy.typing as npt

from zerorate.identify.preparation.centring import with_gaps
from zerorate.identify.records import as_record

__all__ = ["checked_width", "moving_average", "running_mean"]

Floats = npt.NDArray[np.float64]


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
    No sum outlives two windows, so an outlier of any size leaves no rounding behind it.

    Examples
    --------
    >>> moving_average([0.0, 3.0, 0.0, 0.0], width=3).tolist()
    [1.5, 1.0, 1.0, 0.0]
    """
    checked_width(width)
    return running_mean(with_gaps(as_record(z)), width)


def checked_width(width: int, name: str = "width") -> int:
    """Return a number of samples; ValueError unless it is a whole number from 1 on."""
    whole = isinstance(width, numbers.Integral) and not isinstance(width, bool)
    if not whole or width < 1:
        raise ValueError(f"{name} must be a whole number from 1 on, got {width!r}")
    return int(width)


def running_mean(record: Floats, width: int) -> Floats:
    """Return `moving_average` of a record with NaN where a sample is missing."""
    there = np.isfinite(record)
    width = min(width, 2 * record.size)
    origin = record[int(np.argmax(there))]
    sums = _window_sums(np.where(there, record - origin, 0.0), width)
    counts = _window_sums(there.astype(np.float64), width)
    return np.where(there, origin + sums / np.maximum(counts, 1.0), np.nan)


def _window_sums(values: Floats, width: int) -> Floats:
    """Sum every window as the end of one block of its width and the beginning of the next."""
    before, n = width // 2, values.size
    blocks = np.zeros((-(-(n + width) // width), width))
    blocks.reshape(-1)[before : before + n] = values
    ends = np.cumsum(blocks[:, ::-1], axis=1)[:, ::-1].reshape(-1)[:n]
    beginnings = np.cumsum(blocks, axis=1).reshape(-1)[width - 1 : width - 1 + n]
    whole = np.arange(n) % width == 0
    return np.where(whole, ends, ends + beginnings)
