"""The mean or the straight line of a record taken off, and records cut into segments."""

from typing import Final, Literal, get_args

import numpy as np
import numpy.typing as npt

from zerorate.identify.preparation.centring import with_gaps
from zerorate.identify.preparation.smoothing import checked_width
from zerorate.identify.records import as_record

__all__ = ["Trend", "detrend", "segments"]

Floats = npt.NDArray[np.float64]
Trend = Literal["mean", "linear"]

_LEAST: Final[dict[str, int]] = {"mean": 1, "linear": 2}


def detrend(z: npt.ArrayLike, kind: Trend = "mean") -> Floats:
    """Return a record less its mean, or less the straight line that fits it best.

    Parameters
    ----------
    z : array_like, shape (n,)
        Samples; those not finite are missing, and stay so.
    kind : {"mean", "linear"}
        What is taken off. The line is that of least squares over the samples that are there.

    Returns
    -------
    ndarray of float64, shape (n,)
        In the unit of `z`.

    Raises
    ------
    TypeError
        If `z` does not hold real numbers.
    ValueError
        If `z` is not one axis, has too few samples, or the kind is unknown.

    Examples
    --------
    >>> detrend([1.0, 3.0, float("nan"), 7.0], "linear").tolist()
    [0.0, 0.0, nan, 0.0]
    """
    if kind not in _LEAST:
        raise ValueError(f"kind must be one of {_names()}, got {kind!r}")
    record = with_gaps(as_record(z))
    there = np.isfinite(record)
    if np.count_nonzero(there) < _LEAST[kind]:
        raise ValueError(f"a {kind} trend needs at least {_LEAST[kind]} samples, got 1")
    # About one of the samples first: an offset costs no precision then.
    level = record - record[int(np.argmax(there))]
    level -= level[there].mean()
    if kind == "linear":
        time = np.arange(record.size) - np.flatnonzero(there).mean()
        level -= time * (time[there] @ level[there] / (time[there] @ time[there]))
    return np.asarray(level)


def segments(z: npt.ArrayLike, count: int) -> Floats:
    """Return a record cut into segments of one length.

    Parameters
    ----------
    z : array_like, shape (n,)
        Samples; those not finite are missing.
    count : int
        Number of segments, 1 to n.

    Returns
    -------
    ndarray of float64, shape (count, n // count)
        One row a segment, NaN where missing; the fewer than `count` samples that are left over
        at the end are not in it.

    Raises
    ------
    TypeError
        If `z` does not hold real numbers.
    ValueError
        If `z` is not one axis with a sample, or the count not a whole number from 1 to n.

    Examples
    --------
    >>> segments([1, 2, 3, 4, 5], 2).tolist()
    [[1.0, 2.0], [3.0, 4.0]]
    """
    record = with_gaps(as_record(z))
    if checked_width(count, "segments") > record.size:
        raise ValueError(
            f"segments must be at most the number of samples, {record.size}, got {count}"
        )
    length = record.size // count
    return record[: count * length].reshape(count, length)


def _names() -> str:
    return ", ".join(repr(name) for name in get_args(Trend))
