"""A record as it is given: its samples, its gaps and its size."""

import math

import numpy as np
import numpy.typing as npt

from zerorate.io.rates import checked_rate
from zerorate.types import Floats

__all__ = ["longest_stretch", "power_of_two", "samples", "unmasked"]


def samples(z: npt.ArrayLike, rate: float) -> Floats:
    """Return a record as floats, shape (n,), after checking it and its rate."""
    checked_rate(rate)
    record = np.asarray(unmasked(z), dtype=np.float64)
    if record.ndim != 1:
        raise ValueError(f"z must have shape (n,), got {record.shape}")
    return record


def power_of_two(values: Floats) -> float:
    """Return the power of two at or below the largest size: dividing by it rounds nothing."""
    largest = float(np.max(np.abs(values)))
    return math.ldexp(1.0, math.frexp(largest)[1] - 1)


def unmasked(z: npt.ArrayLike) -> npt.ArrayLike:
    """Return the record with NaN in place of what is masked."""
    if np.ma.isMaskedArray(z):
        return np.ma.filled(np.ma.asarray(z, dtype=np.float64), np.nan)
    return z


def longest_stretch(record: Floats) -> Floats:
    """Return the longest part of a record without a missing sample."""
    missing = np.flatnonzero(~np.isfinite(record))
    ends = np.concatenate(([-1], missing, [record.size]))
    longest = int(np.argmax(np.diff(ends)))
    return record[ends[longest] + 1 : ends[longest + 1]]
