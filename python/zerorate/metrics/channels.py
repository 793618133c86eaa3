"""Samples in channels, and the mask of present ones."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from zerorate.faults import ArgumentError
from zerorate.record.missing import floats
from zerorate.types import Booleans, Floats


def columns(name: str, data: npt.ArrayLike) -> Floats:
    """Return the channels as rows, without copying."""
    array = floats(data, name)
    if array.ndim not in (1, 2):
        raise ArgumentError(name, f"must have shape (n,) or (n, k), got {array.shape}")
    if array.size == 0:
        raise ValueError(f"{name} is empty")
    return array.reshape(len(array), -1).T


def is_single(data: npt.ArrayLike) -> bool:
    """Return True if data are one channel, shape (n,), or a table of one column."""
    return floats(data, "data").ndim == 1


def check_same_shape(first: str, x: Floats, second: str, y: Floats) -> None:
    """Raise ValueError if two series differ in shape."""
    if x.shape != y.shape:
        raise ValueError(
            f"{first} and {second} must have the same shape, got {x.shape[::-1]} and "
            f"{y.shape[::-1]} (samples, channels)"
        )


def present_pairs(
    first: str, a: npt.ArrayLike, second: str, b: npt.ArrayLike
) -> list[tuple[Floats, Floats]]:
    """Return the samples present in both, channel by channel."""
    x, y = columns(first, a), columns(second, b)
    check_same_shape(first, x, second, y)
    return [_drop_missing(u, v) for u, v in zip(x, y, strict=True)]


def _drop_missing(x: Floats, y: Floats) -> tuple[Floats, Floats]:
    """Return both series at the samples present in both."""
    there = present_mask(x, y)
    return (x, y) if there.all() else (x[there], y[there])


def present_mask(*series: Floats) -> Booleans:
    """Return the mask of samples present in all series."""
    there = np.isfinite(series[0])
    for other in series[1:]:
        there &= np.isfinite(other)
    if not there.any():
        raise ValueError("no sample is present in every series")
    return there


def spread(z: Floats) -> float:
    """Return the standard deviation of one column; ValueError if it is zero."""
    # For equal samples the standard deviation may be a rounding error instead of 0.
    if z.max() == z.min():
        raise ValueError("raw is constant, so it has no deviation to compare with")
    return float(z.std())


def rms(x: Floats) -> float:
    """Return the root of the mean square."""
    return math.sqrt(float(np.dot(x, x)) / x.size)


def check_positive(name: str, value: float) -> float:
    """Return a number that must be positive and finite."""
    if not (math.isfinite(value) and value > 0.0):
        raise ArgumentError(name, f"must be positive and finite, got {value}")
    return float(value)


def per_channel(values: Sequence[float], like: npt.ArrayLike) -> float | Floats:
    """Return a float for one channel, an array for several."""
    return float(values[0]) if is_single(like) else np.array(values, dtype=np.float64)
