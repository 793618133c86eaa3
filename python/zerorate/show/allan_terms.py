"""Lines, marks and list of a model's coefficients over a deviation curve."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final, NamedTuple

import numpy as np

from zerorate.noise import AllanResult, Coefficient, NoiseModel
from zerorate.noise.curve_fit import expected_deviation, expected_terms
from zerorate.noise.kinds import KINDS
from zerorate.noise.quantities import TERMS, Term, shown_unit, si_unit
from zerorate.numerals import significant, with_error
from zerorate.show.style import FONT, GREEN, ORANGE, PURPLE, SKY, VERMILION, Corner
from zerorate.types import Floats
from zerorate.units import convert

if TYPE_CHECKING:
    from matplotlib.axes import Axes

__all__ = [
    "COLOURS",
    "FAR",
    "DrawnTerm",
    "Window",
    "drawn_terms",
    "fitted_curve",
    "other_terms",
    "with_room",
    "write_list",
]

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

# Parts of the panel's height and width.
_LINE: Final = 0.058
_EDGE: Final = 0.035
_WIDTH: Final = 0.6

_CROSSED: Final = 10.0
"""How much more room the upper right may take: in the lower left the list hides lines."""

FAR: Final = 5.0
"""How far over a deviation its upper bound is shown; beyond, the frame cuts it."""


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


class Window(NamedTuple):
    """Limits of logarithmic axes."""

    left: float
    right: float
    low: float
    high: float


def with_room(
    curves: Sequence[AllanResult], lists: Sequence[list[DrawnTerm]], window: Window
) -> tuple[Corner, Window]:
    """Return the corner where the lists need least room, and a window that has this room."""
    below, above = window, window
    for curve, terms in zip(curves, lists, strict=True):
        if terms and np.any(curve.deviation > 0.0):
            below = below._replace(low=min(below.low, _low(curve, terms, window)))
            above = above._replace(high=max(above.high, _high(curve, terms, window)))
    if above.high / window.high <= _CROSSED * window.low / below.low:
        return "upper right", above
    return "lower left", below


def write_list(axes: "Axes", terms: list[DrawnTerm], corner: Corner) -> None:
    """Write the coefficients into a corner, each in the colour of its line."""
    for i, term in enumerate(terms):
        above = corner == "upper right"
        line = 1.0 - _EDGE - _LINE * (i + 1) if above else _EDGE + _LINE * (len(terms) - 1 - i)
        axes.text(
            1.0 - _EDGE if above else _EDGE,
            line,
            term.text,
            ha="right" if above else "left",
            transform=axes.transAxes,
            size=FONT - 0.8,
            color=term.colour,
            bbox={"facecolor": "white", "edgecolor": "none", "pad": 0.3},
        )


def _low(curve: AllanResult, terms: list[DrawnTerm], window: Window) -> float:
    """Return the lower limit that keeps the left of a curve above a list."""
    part = 2.0 * _EDGE + _LINE * len(terms)
    left = np.log(curve.taus / window.left) < _WIDTH * np.log(window.right / window.left)
    heights = shown_unit(curve).factor * curve.deviation
    lowest = np.log(heights[left].min(initial=window.high))
    return float(np.exp((lowest - part * np.log(window.high)) / (1.0 - part)))


def _high(curve: AllanResult, terms: list[DrawnTerm], window: Window) -> float:
    """Return the upper limit that keeps the right of a curve below a list."""
    part = 2.0 * _EDGE + _LINE * len(terms)
    right = np.log(window.right / curve.taus) < _WIDTH * np.log(window.right / window.left)
    heights = shown_unit(curve).factor * np.fmin(curve.upper, FAR * curve.deviation)
    highest = np.log(heights[right].max(initial=window.low))
    return float(np.exp((highest - part * np.log(window.low)) / (1.0 - part)))
