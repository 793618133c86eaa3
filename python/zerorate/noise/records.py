"""Records from a caller: checks, gaps, size and resolution."""

from __future__ import annotations

import math
import numbers
from typing import Any, Final

import numpy as np
import numpy.typing as npt

from zerorate.faults import ArgumentError
from zerorate.record.log import check_rate
from zerorate.record.missing import floats
from zerorate.types import Floats

_GLANCE_SAMPLES: Final = 1000


def as_record(z: npt.ArrayLike, min_samples: int = 1, purpose: str = "this") -> Floats:
    """Return one axis as contiguous float64, NaN where missing, after a check.

    Parameters
    ----------
    z : array_like, shape (n,)
        Samples; values that are masked or not finite count as missing.
    min_samples : int
        Smallest number of present samples.
    purpose : str
        Purpose of the samples, for the error message.

    Raises
    ------
    TypeError
        If `z` does not hold real numbers.
    ValueError
        If `z` is not one axis, has too few samples, or all are equal.
    """
    record = np.ascontiguousarray(floats(z, "z"))
    if record.ndim != 1:
        raise ArgumentError("z", f"must be one axis of shape (n,), got shape {record.shape}")
    present = np.isfinite(record)
    count = int(np.count_nonzero(present))
    if count == 0:
        raise ValueError("z holds no finite sample")
    if count < min_samples:
        raise ValueError(f"{purpose} needs at least {min_samples} samples, got {count}")
    first = float(record[int(np.argmax(present))])
    if min_samples > 1 and is_constant(record, first):
        raise ValueError(f"{purpose} needs samples that differ, all {count} are {first:g}")
    return record


def check_record(z: npt.ArrayLike, rate: float) -> Floats:
    """Return a record as floats, shape (n,), after a check of record and rate."""
    check_rate(rate)
    record = floats(z, "z")
    if record.ndim != 1:
        raise ArgumentError("z", f"must have shape (n,), got {record.shape}")
    return record


def is_constant(record: npt.NDArray[Any], value: float) -> bool:
    """Return True if all present samples equal a value."""
    # The first samples are usually sufficient.
    parts = (record[:_GLANCE_SAMPLES], record[_GLANCE_SAMPLES:])
    return all(bool(np.all((part == value) | ~np.isfinite(part))) for part in parts)


def power_of_two(values: Floats) -> float:
    """Return the power of two at or below the largest size; division by it is exact."""
    largest = float(np.max(np.abs(values)))
    return math.ldexp(1.0, math.frexp(largest)[1] - 1)


def longest_stretch(record: Floats) -> Floats:
    """Return the longest part of a record without a missing sample."""
    missing = np.flatnonzero(~np.isfinite(record))
    ends = np.concatenate(([-1], missing, [record.size]))
    longest = int(np.argmax(np.diff(ends)))
    return record[ends[longest] + 1 : ends[longest + 1]]


def check_width(width: int, name: str = "width") -> int:
    """Return a number of samples; ValueError if it is not a whole number from 1."""
    is_whole = isinstance(width, numbers.Integral) and not isinstance(width, bool)
    if not is_whole or width < 1:
        raise ArgumentError(name, f"must be a whole number from 1 on, got {width!r}")
    return int(width)


def mark_gaps(record: Floats) -> Floats:
    """Return the record with NaN for values that are not finite; unchanged if all are finite."""
    finite = np.isfinite(record)
    return record if finite.all() else np.where(finite, record, np.nan)


def centre_record(record: Floats) -> Floats:
    """Return the present samples minus their mean, scaled to a size of about 1.

    Use it for results that do not depend on the unit. The mean is computed relative to one of the
    samples, so a large offset does not reduce the precision. The scale is a power of two, so
    scaling is exact.
    """
    finite = np.isfinite(record)
    present = record if finite.all() else record[finite]
    scaled = present / size_of(present)
    scaled -= scaled[0]
    scaled -= scaled.mean()
    # Scale again, because a nearly constant record is small after centring.
    scaled /= size_of(scaled)
    if present is record:
        return scaled
    result = np.full(record.size, np.nan)
    result[finite] = scaled
    return result


def size_of(values: Floats) -> float:
    """Return a power of two near the largest of finite values, 1 if all are 0."""
    return power_of_two(values) if np.any(values) else 1.0


def resolution(record: Floats) -> float:
    """Return the smallest non-zero difference between successive samples, 0 if there is none.

    For a coarse record this is the step of quantisation; otherwise it is nearly zero.
    """
    steps = np.abs(np.diff(record))
    steps = steps[steps > 0.0]
    return float(steps.min()) if steps.size else 0.0
