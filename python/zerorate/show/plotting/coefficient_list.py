"""The list of coefficients in a corner of a panel, and the room that it needs."""

from collections.abc import Sequence
from typing import TYPE_CHECKING, Final, Literal, NamedTuple

import numpy as np

from zerorate.noise import AllanResult
from zerorate.noise.quantities import shown_unit
from zerorate.show.plotting.allan_terms import DrawnTerm
from zerorate.show.plotting.style import FONT

if TYPE_CHECKING:
    from matplotlib.axes import Axes

__all__ = ["FAR", "Corner", "Window", "with_room", "write_list"]

Corner = Literal["lower left", "upper right"]

# Parts of the panel's height and width.
_LINE: Final = 0.058
_EDGE: Final = 0.035
_WIDTH: Final = 0.6

_CROSSED: Final = 10.0
"""How much more room the upper right may take: in the lower left the list hides lines."""


FAR: Final = 5.0
"""How far over a deviation its upper bound is shown; beyond, the frame cuts it."""


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
