"""Names and units of noise coefficients, records and displayed curves."""

from typing import TYPE_CHECKING, Final, Literal, NamedTuple

import numpy as np

from zerorate.faults import ArgumentError
from zerorate.noise.kinds import KINDS
from zerorate.units import convert, kind

if TYPE_CHECKING:
    from zerorate.noise.dynamic import DynamicAllan
    from zerorate.noise.result import AllanResult

Quantity = Literal["angular rate", "acceleration", "unknown"]

UNKNOWN: Final = "unit"
"""Unit of a log with an unknown unit."""

UNKNOWN_UNIT_REASON: Final = (
    'the unit of the samples is not known: give unit="deg/s", or whatever it is, where the noise '
    "is estimated"
)
"""Reason why a model in the unit of the samples cannot be converted."""

_QUANTITIES: Final[dict[str, tuple[Quantity, str]]] = {
    "rate": ("angular rate", "rad/s"),
    "acceleration": ("acceleration", "m/s^2"),
}

# Fine and coarse unit of each kind, and the smallest deviation for the coarse unit.
_DISPLAY_UNITS: Final = {
    "rate": ("deg/h", "deg/s", 1000.0),
    "acceleration": ("ug", "m/s^2", 1e5),
}


class Term(NamedTuple):
    """Coefficient of the model: field, name, SI unit and display unit."""

    field: str
    name: str
    unit: str
    shown: str

    @property
    def factor(self) -> float:
        """Factor from the unit of a coefficient to its display unit."""
        return 1.0 if self.unit == self.shown else convert(1.0, self.unit, self.shown)


TERMS: Final[dict[Quantity, tuple[Term, ...]]] = {
    "angular rate": (
        Term("quantization", "quantization", "rad", "arcsec"),
        Term("angle_random_walk", "angle random walk", "rad/s/sqrt(Hz)", "deg/sqrt(h)"),
        Term("bias_instability", "bias instability", "rad/s", "deg/h"),
        Term("rate_random_walk", "rate random walk", "rad/s^2/sqrt(Hz)", "deg/h/sqrt(h)"),
        Term("rate_ramp", "rate ramp", "rad/s^2", "deg/h^2"),
    ),
    "acceleration": (
        Term("quantization", "quantization", "m/s", "m/s"),
        Term("angle_random_walk", "velocity random walk", "m/s^2/sqrt(Hz)", "m/s/sqrt(h)"),
        Term("bias_instability", "bias instability", "m/s^2", "ug"),
        Term("rate_random_walk", "acceleration random walk", "m/s^3/sqrt(Hz)", "ug/sqrt(h)"),
        Term("rate_ramp", "acceleration ramp", "m/s^3", "ug/h"),
    ),
    "unknown": (
        Term("quantization", "quantization", "unit s", "unit s"),
        Term("angle_random_walk", "white noise", "unit/sqrt(Hz)", "unit/sqrt(Hz)"),
        Term("bias_instability", "bias instability", "unit", "unit"),
        Term("rate_random_walk", "random walk", "unit/s/sqrt(Hz)", "unit/s/sqrt(Hz)"),
        Term("rate_ramp", "ramp", "unit/s", "unit/s"),
    ),
}


class DisplayUnit(NamedTuple):
    """Unit for display, and the factor from a deviation to it."""

    unit: str
    factor: float


def term_of(quantity: Quantity, field: str) -> Term:
    """Return the term of a field of the model."""
    return next(term for term in TERMS[quantity] if term.field == field)


def check_unit(unit: str | None) -> str:
    """Return a valid unit of records, or the word for an unknown unit."""
    if unit is None or unit == UNKNOWN:
        return UNKNOWN
    _find_quantity(unit)
    return unit


def si_unit(unit: str) -> tuple[float, Quantity]:
    """Return the factor from a unit to SI (1 if unknown) and the quantity of the unit."""
    if unit == UNKNOWN:
        return 1.0, "unknown"
    quantity, si = _find_quantity(unit)
    return convert(1.0, unit, si), quantity


def _find_quantity(unit: str) -> tuple[Quantity, str]:
    entry = _QUANTITIES.get(kind(unit))
    if entry is None:
        raise ArgumentError(
            "unit",
            f"must be one of an angular rate or an acceleration, got {unit!r}, "
            f"which is one of {kind(unit)}",
        )
    return entry


def choose_display_unit(*curves: "AllanResult | DynamicAllan") -> DisplayUnit:
    """Return the data-sheet unit for displaying all axes of curves of one unit and kind.

    Angular rates are shown in deg/h, or in deg/s if none is below 1000 deg/h. Accelerations are
    shown in ug, or in m/s^2 if none is below 0.1 g. Time deviations, and records of unknown unit,
    are not converted.
    """
    own, time = curves[0].unit, KINDS[curves[0].kind].time
    if own == UNKNOWN or time:
        return DisplayUnit(f"{own}·s" if time else own, 1.0)
    fine, coarse, limit = _DISPLAY_UNITS[kind(own)]
    positive = [curve.deviation[curve.deviation > 0.0] for curve in curves]
    least = convert(float(np.min(np.concatenate(positive), initial=np.inf)), own, fine)
    unit = coarse if limit <= least < np.inf else fine
    return DisplayUnit(unit, convert(1.0, own, unit))
