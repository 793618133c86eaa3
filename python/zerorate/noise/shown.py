"""The units that deviations and coefficients are shown in."""

from typing import TYPE_CHECKING, Final, NamedTuple

import numpy as np

from zerorate.noise.kinds import KINDS
from zerorate.noise.records import UNKNOWN
from zerorate.units import convert, kind

if TYPE_CHECKING:
    from zerorate.noise.dynamic import DynamicAllan
    from zerorate.noise.result import AllanResult

__all__ = ["Shown", "shown_unit"]

# Fine and coarse unit of each kind, and from which least deviation on the coarse one reads better.
_CHOICES: Final = {
    "rate": ("deg/h", "deg/s", 1000.0),
    "acceleration": ("ug", "m/s^2", 1e5),
}


class Shown(NamedTuple):
    """A unit, and what a deviation is multiplied by to be in it."""

    unit: str
    factor: float


def shown_unit(curve: "AllanResult | DynamicAllan") -> Shown:
    """Return the data-sheet unit in which the deviations of a curve read well.

    Angular rates in deg/h, in deg/s where none is below 1000 deg/h; accelerations in ug, in
    m/s^2 where none is below 0.1 g. Time deviations, and records of unknown unit, stay as they
    are.
    """
    if curve.unit == UNKNOWN or KINDS[curve.kind].time:
        return Shown(f"{curve.unit}·s" if KINDS[curve.kind].time else curve.unit, 1.0)
    fine, coarse, limit = _CHOICES[kind(curve.unit)]
    positive = curve.deviation[curve.deviation > 0.0]
    least = convert(float(np.min(positive, initial=np.inf)), curve.unit, fine)
    unit = coarse if limit <= least < np.inf else fine
    return Shown(unit, convert(1.0, curve.unit, unit))
