"""What is said of a sensor's unit and axes."""

from __future__ import annotations

from typing import Final

import numpy as np

from zerorate.checks.senses import changes, typed
from zerorate.types import Floats, Integers

_AXES: Final = np.array(["x", "y", "z"])


def on_unit(sensor: str, named: str, unit: str, factor: float) -> str:
    """Return a sentence on a unit that is not the one named."""
    if unit != named:
        return f"the {sensor}'s values are in {unit}, not in {named}"
    return f"the {sensor}'s values are {1.0 / factor:.4g} times what they are in {named}"


def on_axes(sensor: str, other: str, sense: Floats) -> str:
    """Return a sentence on a signed permutation that puts a sensor's axes right."""
    places = np.abs(sense).argmax(axis=1)
    negative = np.flatnonzero(sense.sum(axis=1) < 0.0)
    if (places == np.arange(3)).all():
        return _on_signs(sensor, other, negative)
    if changes(sense) == 1:
        first, second = _AXES[np.flatnonzero(places != np.arange(3))]
        return f"the {sensor}'s {first} and {second} axes are exchanged, against the {other}'s"
    return f"the {sensor}'s ({typed(sense)}) are the {other}'s (x,y,z)"


def _on_signs(sensor: str, other: str, negative: Integers) -> str:
    if len(negative) == 3:
        return f"all axes of the {sensor} have the sign other than the {other}'s"
    named = " and ".join(_AXES[negative])
    axes = "axis has" if len(negative) == 1 else "axes have"
    return f"the {sensor}'s {named} {axes} the sign other than the {other}'s"


def mistaken(accel: Floats) -> str:
    """Return what the accelerometer's axes are if it is they that are mistaken."""
    places = np.abs(accel).argmax(axis=1)
    negative = np.flatnonzero(accel.sum(axis=1) < 0.0)
    if (places == np.arange(3)).all() and len(negative) == 1:
        return f"or it is the accelerometer's {_AXES[negative[0]]} axis that has the wrong sign"
    return f"or it is the accelerometer whose ({typed(accel)}) are (x,y,z)"
