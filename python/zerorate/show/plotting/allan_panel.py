"""One axis: points with bounds, and what was fitted to them."""

from typing import TYPE_CHECKING, Final, NamedTuple

import numpy as np
import numpy.typing as npt

from zerorate.noise import AllanResult, NoiseModel
from zerorate.noise.quantities import shown_unit
from zerorate.show.plotting.allan_terms import DrawnTerm, drawn_terms, fitted_curve, other_terms
from zerorate.show.plotting.coefficient_list import FAR, Window, with_room, write_list
from zerorate.show.plotting.style import BLACK, BLUE, FONT

if TYPE_CHECKING:
    from matplotlib.axes import Axes

__all__ = ["LEAST_FREEDOM", "Panel", "draw", "share_limits"]

Floats = npt.NDArray[np.float64]

LEAST_FREEDOM: Final = 5.0
"""Degrees of freedom below which a deviation says little."""

_MARGIN: Final = 0.06

_DEPTH: Final = 3.0
"""How far below a curve marks are shown, as a factor: the floor, and what is near it."""
_DEPTH_ALONE: Final = 500.0
"""The same of a figure of one axis, which has room for the marks of walk and ramp."""


class Panel(NamedTuple):
    """What is drawn: the curve of one axis, and its model if there is one."""

    curve: AllanResult
    model: NoiseModel | None


def draw(axes: "Axes", panel: Panel) -> None:
    """Draw one axis."""
    curve, model = panel
    axes.set_xscale("log")
    axes.set_yscale("log")
    axes.set_title(curve.names[0])
    axes.set_xlabel("averaging time [s]")
    if not np.any(curve.deviation > 0.0):
        axes.text(
            0.5, 0.5, "no noise", transform=axes.transAxes, ha="center", size=FONT, color="0.4"
        )
        return
    _draw_points(axes, curve)
    if model is not None:
        _draw_model(axes, curve, model)
    edge = _last_sure(curve)
    if edge is not None:
        axes.axvline(edge, color="0.5", lw=0.6, ls=":")


def share_limits(row: list["Axes"], panels: list[Panel]) -> None:
    """Give panels the same limits, with room in a corner for the lists of coefficients."""
    times = np.concatenate([_times(panel) for panel in panels])
    left, right = times.min() / 1.6, max(times.max(), 10.0 * times.min()) * 1.6
    depth = _DEPTH if len(row) > 1 else _DEPTH_ALONE
    spans = [_span(panel, depth) for panel in panels if np.any(panel.curve.deviation > 0.0)]
    low = min((span[0] for span in spans), default=0.1)
    high = max((span[1] for span in spans), default=1.0)
    margin = max(high / low, 10.0) ** _MARGIN
    window = Window(left, right, low / margin, high * margin)
    lists = [drawn_terms(p.model, p.curve) if p.model is not None else [] for p in panels]
    corner, window = with_room([panel.curve for panel in panels], lists, window)
    for axes, terms in zip(row, lists, strict=True):
        axes.set_xlim(window.left, window.right)
        axes.set_ylim(window.low, window.high)
        write_list(axes, terms, corner)
        _hide_outside(axes, window)


def _draw_points(axes: "Axes", curve: AllanResult) -> None:
    factor = shown_unit(curve).factor
    y, low, high = (factor * values for values in (curve.deviation, curve.lower, curve.upper))
    axes.fill_between(curve.taus, low, high, color=BLUE, alpha=0.22, lw=0.0)
    axes.plot(curve.taus, y, color=BLUE, lw=0.6, marker="o", ms=2.2, mew=0.0)


def _draw_model(axes: "Axes", curve: AllanResult, model: NoiseModel) -> None:
    axes.plot(curve.taus, fitted_curve(model, curve), color=BLACK, lw=0.9, ls=(0, (4, 2)))
    for line in other_terms(model, curve):
        axes.plot(curve.taus, line, color=BLACK, lw=0.5, ls=":")
    for term in drawn_terms(model, curve):
        style = {"lw": 0.7} if term.identifiable else {"lw": 0.6, "ls": (0, (1, 2))}
        axes.plot(curve.taus, term.line, color=term.colour, **style)
        _mark(axes, term)


def _mark(axes: "Axes", term: DrawnTerm) -> None:
    axes.plot(
        [term.read_at],
        [term.height],
        color=term.colour,
        marker="D" if term.identifiable else "v",
        ms=3.0 if term.identifiable else 3.6,
        mfc=term.colour if term.inside else "white",
        mew=0.7,
        ls="none",
    )


def _last_sure(curve: AllanResult) -> float | None:
    """Return the averaging time beyond which there are too few degrees of freedom."""
    few = np.flatnonzero(~(curve.edf >= LEAST_FREEDOM))
    if few.size == 0 or few[0] == 0:
        return None
    return float(np.sqrt(curve.taus[few[0] - 1] * curve.taus[few[0]]))


def _span(panel: Panel, depth: float) -> tuple[float, float]:
    """Return the lowest and the highest thing that must be seen."""
    curve = panel.curve
    factor = shown_unit(curve).factor
    low = float(factor * np.fmin(curve.deviation, _positive(curve.lower)).min())
    high = float(factor * np.fmin(curve.upper, FAR * curve.deviation).max())
    terms = [] if panel.model is None else drawn_terms(panel.model, curve)
    marks = [term.height for term in terms if term.identifiable and term.height > low / depth]
    return min([low, *marks]), high


def _positive(values: Floats) -> Floats:
    return np.where(values > 0.0, values, np.inf)


def _times(panel: Panel) -> Floats:
    """Return the averaging times that must be seen, those of the marks among them."""
    if panel.model is None:
        return panel.curve.taus
    marks = [term.read_at for term in drawn_terms(panel.model, panel.curve)]
    return np.concatenate((panel.curve.taus, marks))


def _hide_outside(axes: "Axes", window: Window) -> None:
    """Hide marks that lie outside, which would hang on the frame."""
    for line in axes.lines:
        heights = np.asarray(line.get_ydata(), dtype=np.float64)
        if heights.size == 1 and line.get_linestyle() == "None":
            line.set_visible(bool(window.low < heights[0] < window.high))
