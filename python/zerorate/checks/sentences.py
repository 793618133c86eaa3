"""Sentences on a sensor's unit and axes."""

from __future__ import annotations

from typing import Final

import numpy as np

from zerorate.checks.axis_permutations import count_mistakes, format_sense
from zerorate.types import Floats, Integers

_AXES: Final = np.array(["x", "y", "z"])


def describe_unit(sensor: str, stated_unit: str, unit: str, factor: float) -> str:
    """Return a sentence on a wrong unit."""
    if unit != stated_unit:
        return f"the {sensor}'s values are in {unit}, not in {stated_unit}"
    return f"the {sensor}'s values are {1.0 / factor:.4g} times the values in {stated_unit}"


def describe_axes(sensor: str, other: str, sense: Floats) -> str:
    """Return a sentence on a signed permutation that corrects a sensor's axes."""
    columns = np.abs(sense).argmax(axis=1)
    negative = np.flatnonzero(sense.sum(axis=1) < 0.0)
    if (columns == np.arange(3)).all():
        return _describe_signs(sensor, other, negative)
    if count_mistakes(sense) == 1:
        first, second = _AXES[np.flatnonzero(columns != np.arange(3))]
        return f"the {sensor}'s {first} and {second} axes are exchanged compared with the {other}'s"
    return f"the {sensor}'s ({format_sense(sense)}) are the {other}'s (x,y,z)"


def _describe_signs(sensor: str, other: str, negative: Integers) -> str:
    if len(negative) == 3:
        return f"all axes of the {sensor} have the opposite sign to the {other}'s"
    axis_names = " and ".join(_AXES[negative])
    axes = "axis has" if len(negative) == 1 else "axes have"
    return f"the {sensor}'s {axis_names} {axes} the opposite sign to the {other}'s"


def describe_accel_axes(accel: Floats) -> str:
    """Return axes of the accelerometer that would explain the mismatch in place of the gyro's."""
    columns = np.abs(accel).argmax(axis=1)
    negative = np.flatnonzero(accel.sum(axis=1) < 0.0)
    if (columns == np.arange(3)).all() and len(negative) == 1:
        return f"or the accelerometer's {_AXES[negative[0]]} axis has the wrong sign"
    return f"or the accelerometer's ({format_sense(accel)}) are (x,y,z)"
