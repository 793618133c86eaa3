"""Lines, marks and list of a model's coefficients in a deviation figure."""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

from zerorate.noise import AllanResult, Coefficient, NoiseModel
from zerorate.noise.curve_fit import expected_deviation, expected_terms
from zerorate.noise.kinds import KINDS
from zerorate.noise.quantities import TERMS, DisplayUnit, Term, si_unit
from zerorate.numerals import format_significant, format_with_error
from zerorate.show.style import (
    BROWN,
    FONT_PT,
    GREEN,
    INCHES_PER_MM,
    ORANGE,
    PURPLE,
    VERMILION,
    text_colour,
)
from zerorate.types import Floats

if TYPE_CHECKING:
    from matplotlib.axes import Axes

COLOURS: Final = {
    "quantization": PURPLE,
    "angle_random_walk": VERMILION,
    "bias_instability": GREEN,
    "rate_random_walk": ORANGE,
    "rate_ramp": BROWN,
}
_SYMBOLS: Final = dict(zip(COLOURS, "QNBKR", strict=True))
_READING_TAU_S: Final = {
    "quantization": math.sqrt(3.0),
    "angle_random_walk": 1.0,
    "rate_random_walk": 3.0,
    "rate_ramp": math.sqrt(2.0),
}
"""Averaging times at which the Allan deviation of a term equals its coefficient, s."""


@dataclass(frozen=True)
class DrawnTerm:
    """A coefficient in a figure: its line, or its bound if it is not identifiable, and its mark.

    Attributes
    ----------
    symbol : str
        Letter of the coefficient.
    colour : str
        Colour of line and mark.
    line : ndarray, shape (t,)
        Deviation of the term at the curve's averaging times. If the term is not identifiable, it is
        the deviation of the bound.
    read_at : float
        Averaging time of the mark, s.
    height : float
        Deviation at the mark.
    inside : bool
        True if the curve reaches the averaging time of the mark.
    identifiable : bool
        True if the record determines the coefficient.
    text : str
        Symbol, value with standard error or bound, and unit.
    """

    symbol: str
    colour: str
    line: Floats
    read_at: float
    height: float
    inside: bool
    identifiable: bool
    text: str


def fitted_curve(model: NoiseModel, curve: AllanResult, shown: DisplayUnit) -> Floats:
    """Return the deviation of the model at the curve's averaging times."""
    return expected_deviation(model, curve) * _unit_scale(curve, shown)


def draw_other_terms(model: NoiseModel, curve: AllanResult, shown: DisplayUnit) -> Iterator[Floats]:
    """Yield the lines of Markov terms and sinusoids."""
    for field, deviation in expected_terms(model, curve):
        if field not in COLOURS:
            yield deviation * _unit_scale(curve, shown)


def select_terms(model: NoiseModel, curve: AllanResult, shown: DisplayUnit) -> list[DrawnTerm]:
    """Return the coefficients of a model that have a value other than zero, or a bound."""
    ones = NoiseModel(**dict.fromkeys(COLOURS, 1.0), quantity=model.quantity)  # type: ignore[arg-type]
    lines = dict(expected_terms(ones, curve))
    lowest = float(curve.taus[np.argmin(expected_deviation(model, curve))])
    terms = []
    for term in TERMS[model.quantity]:
        coefficient = getattr(model, term.field)
        size = abs(coefficient.conservative)
        if coefficient.known and size > 0.0 and term.field in lines:
            line = size * lines[term.field] * _unit_scale(curve, shown)
            terms.append(_make_term(term, coefficient, line, lowest, curve.taus))
    return terms


def _make_term(
    term: Term, coefficient: Coefficient, line: Floats, lowest: float, taus: Floats
) -> DrawnTerm:
    reading_tau, symbol = _READING_TAU_S.get(term.field, lowest), _SYMBOLS[term.field]
    return DrawnTerm(
        symbol=symbol,
        colour=COLOURS[term.field],
        line=line,
        read_at=reading_tau,
        height=_interpolate(reading_tau, taus, line),
        inside=bool(taus[0] <= reading_tau <= taus[-1]),
        identifiable=coefficient.identifiable,
        text=f"{symbol} {_format_term(coefficient, term)}",
    )


def _format_term(coefficient: Coefficient, term: Term) -> str:
    shown = coefficient.scaled(term.factor)
    unit = term.shown.replace("sqrt(h)", "√h").replace("sqrt(Hz)", "√Hz")
    unit = unit.replace("^2", "²").replace("ug", "µg")
    if not shown.identifiable:
        return f"< {format_significant(shown.upper_bound, 2)} {unit}"
    return f"= {format_with_error(shown.value, shown.sigma)} {unit}"


def _interpolate(tau: float, taus: Floats, line: Floats) -> float:
    """Return a line's value at a time, with straight continuation beyond its ends."""
    if taus.size < 2:
        return float(line[0])
    i = int(np.clip(np.searchsorted(taus, tau), 1, taus.size - 1))
    x, y = np.log(taus[i - 1 : i + 1]), np.log(line[i - 1 : i + 1])
    return float(np.exp(y[0] + (np.log(tau) - x[0]) * (y[1] - y[0]) / (x[1] - x[0])))


def _unit_scale(curve: AllanResult, shown: DisplayUnit) -> Floats:
    """Return the factor from an SI deviation to the shown unit."""
    scale = shown.factor / si_unit(curve.unit)[0]
    time = curve.taus / math.sqrt(3.0) if KINDS[curve.kind].time else np.ones_like(curve.taus)
    return scale * time


def write_list(axes: "Axes", terms: list[DrawnTerm], columns: int, rows: int, line: float) -> None:
    """Write the coefficients above a panel, each in the colour of its line.

    `rows` is the number of rows below the title, and `line` is the height of a row in mm.
    """
    for i, term in enumerate(terms):
        row, column = divmod(i, columns)
        axes.annotate(
            term.text,
            (column / columns, 1.0),
            (0.0, (rows - row - 1 + 0.4) * line * INCHES_PER_MM * 72.0),
            xycoords="axes fraction",
            textcoords="offset points",
            va="bottom",
            size=FONT_PT - 0.8,
            color=text_colour(term.colour),
        )
