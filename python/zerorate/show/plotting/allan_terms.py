"""What of a noise model is drawn over a deviation curve, in the curve's shown unit."""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Final

import numpy as np
import numpy.typing as npt

from zerorate.noise import AllanResult, Coefficient, NoiseModel
from zerorate.noise.curve_fit import expected_deviation, expected_terms
from zerorate.noise.kinds import KINDS
from zerorate.noise.quantities import TERMS, Term, shown_unit, si_unit
from zerorate.numerals import significant, with_error
from zerorate.show.plotting.style import GREEN, ORANGE, PURPLE, SKY, VERMILION
from zerorate.units import convert

__all__ = ["COLOURS", "DrawnTerm", "drawn_terms", "fitted_curve", "other_terms"]

Floats = npt.NDArray[np.float64]

COLOURS: Final = {
    "quantization": PURPLE,
    "angle_random_walk": VERMILION,
    "bias_instability": GREEN,
    "rate_random_walk": ORANGE,
    "rate_ramp": SKY,
}
_SYMBOLS: Final = dict(zip(COLOURS, "QNBKR", strict=True))
_READ_AT: Final = {
    "quantization": math.sqrt(3.0),
    "angle_random_walk": 1.0,
    "rate_random_walk": 3.0,
    "rate_ramp": math.sqrt(2.0),
}
"""Averaging times, s, at which the Allan deviation of a term equals its coefficient."""


@dataclass(frozen=True)
class DrawnTerm:
    """One coefficient: its line where it is identifiable, else a bound, and where it is read.

    Attributes
    ----------
    colour : str
        Of line, mark and text.
    line : ndarray, shape (t,)
        Deviation at the curve's averaging times; of the bound where it is not identifiable.
    read_at : float
        Averaging time of the mark, s.
    height : float
        Deviation of the mark.
    inside : bool
        Whether the curve reaches so far.
    identifiable : bool
        Whether the record determines the coefficient.
    text : str
        Symbol, value with standard error or bound, and unit.
    """

    colour: str
    line: Floats
    read_at: float
    height: float
    inside: bool
    identifiable: bool
    text: str


def fitted_curve(model: NoiseModel, curve: AllanResult) -> Floats:
    """Return the deviation that the model expects at the curve's averaging times."""
    return expected_deviation(model, curve) * _scale(curve)


def other_terms(model: NoiseModel, curve: AllanResult) -> Iterator[Floats]:
    """Yield the lines of Markov terms and sinusoids."""
    for field, deviation in expected_terms(model, curve):
        if field not in COLOURS:
            yield deviation * _scale(curve)


def drawn_terms(model: NoiseModel, curve: AllanResult) -> list[DrawnTerm]:
    """Return the coefficients of a model that are not known to be zero."""
    ones = NoiseModel(**dict.fromkeys(COLOURS, 1.0), quantity=model.quantity)  # type: ignore[arg-type]
    lines = dict(expected_terms(ones, curve))
    lowest = float(curve.taus[np.argmin(expected_deviation(model, curve))])
    drawn = []
    for term in TERMS[model.quantity]:
        coefficient = getattr(model, term.field)
        if coefficient.conservative != 0.0 and term.field in lines:
            line = abs(coefficient.conservative) * lines[term.field] * _scale(curve)
            drawn.append(_drawn(term, coefficient, line, lowest, curve.taus))
    return drawn


def _drawn(
    term: Term, coefficient: Coefficient, line: Floats, lowest: float, taus: Floats
) -> DrawnTerm:
    read_at = _READ_AT.get(term.field, lowest)
    return DrawnTerm(
        colour=COLOURS[term.field],
        line=line,
        read_at=read_at,
        height=_at(read_at, taus, line),
        inside=bool(taus[0] <= read_at <= taus[-1]),
        identifiable=coefficient.identifiable,
        text=f"{_SYMBOLS[term.field]} {_text(coefficient, term)}",
    )


def _text(coefficient: Coefficient, term: Term) -> str:
    shown = coefficient.scaled(convert(1.0, term.unit, term.shown))
    unit = term.shown.replace("sqrt(h)", "√h").replace("^2", "²").replace("ug", "µg")
    if not shown.identifiable:
        return f"< {significant(shown.upper_bound, 2)} {unit}"
    return f"= {with_error(shown.value, shown.sigma)} {unit}"


def _at(tau: float, taus: Floats, line: Floats) -> float:
    """Return the height of a line at a time, on its straight continuation beyond its ends."""
    if taus.size < 2:
        return float(line[0])
    i = int(np.clip(np.searchsorted(taus, tau), 1, taus.size - 1))
    x, y = np.log(taus[i - 1 : i + 1]), np.log(line[i - 1 : i + 1])
    return float(np.exp(y[0] + (np.log(tau) - x[0]) * (y[1] - y[0]) / (x[1] - x[0])))


def _scale(curve: AllanResult) -> Floats:
    """Return what an SI deviation of the rate is multiplied by."""
    scale = shown_unit(curve).factor / si_unit(curve.unit)[0]
    time = curve.taus / math.sqrt(3.0) if KINDS[curve.kind].time else np.ones_like(curve.taus)
    return scale * time
