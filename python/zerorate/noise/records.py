"""What a caller gives: a record, its rate and its unit."""

import math
from typing import Final

import numpy as np
import numpy.typing as npt

from zerorate.io.log import checked_rate
from zerorate.noise.quantities import Quantity
from zerorate.units import convert, kind

__all__ = ["check_unit", "longest_stretch", "power_of_two", "samples", "si_unit", "unmasked"]

Floats = npt.NDArray[np.float64]

_QUANTITIES: Final[dict[str, tuple[Quantity, str]]] = {
    "rate": ("angular rate", "rad/s"),
    "acceleration": ("acceleration", "m/s^2"),
}
UNKNOWN: Final = "unit"
"""What a log says whose unit is not known."""


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


def check_unit(unit: str) -> str:
    """Return a unit that records may be in, or the word for an unknown one."""
    if unit != UNKNOWN:
        _quantity(unit)
    return unit


def si_unit(unit: str) -> tuple[float, Quantity]:
    """Return what one of a unit is in SI, and which quantity it measures."""
    if unit == UNKNOWN:
        raise ValueError("the unit of the record is not known: give unit=, deg/s for instance")
    quantity, si = _quantity(unit)
    return convert(1.0, unit, si), quantity


def _quantity(unit: str) -> tuple[Quantity, str]:
    found = _QUANTITIES.get(kind(unit))
    if found is None:
        raise ValueError(
            f"unit must be one of an angular rate or an acceleration, got {unit!r}, "
            f"which is one of {kind(unit)}"
        )
    return found
