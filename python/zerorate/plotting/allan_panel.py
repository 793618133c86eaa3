"""One axis: points with bounds, and what was fitted to them."""

from typing import TYPE_CHECKING, Final, NamedTuple

import numpy as np
import numpy.typing as npt

from zerorate.noise import AllanResult, NoiseModel
from zerorate.noise.shown import shown_unit
from zerorate.plotting.allan_terms import DrawnTerm, drawn_terms, fitted_curve, other_terms
from zerorate.plotting.style import BLACK, BLUE, FONT

if TYPE_CHECKING:
    from matplotlib.axes import Axes

__all__ = ["LEAST_FREEDOM", "Panel", "draw", "share_limits"]

Floats = npt.NDArray[np.float64]

LEAST_FREEDOM: Final = 5.0
"""Degrees of freedom below which a deviation says little."""

_LINE: Final = 0.058
_LIST_RIGHT: Final = 0.62
_MARGIN: Final = 0.06


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
    """Give panels the same limits, which leave room for the list of coefficients."""
    spans = [_span(panel) for panel in panels if np.any(panel.curve.deviation > 0.0)]
    taus = np.concatenate([_times(panel) for panel in panels])
    left, right = taus.min() / 1.6, max(taus.max(), 10.0 * taus.min()) * 1.6
    low = min((span[0] for span in spans), default=0.1)
    high = max((span[1] for span in spans), default=1.0)
    high *= max(high / low, 10.0) ** _MARGIN
    low /= max(high / low, 10.0) ** _MARGIN
    for panel in panels:
        low = min(low, _below_list(panel, (left, right), high))
    for axes in row:
        axes.set_xlim(left, right)
        axes.set_ylim(low, high)
        _hide_outside(axes, low, high)
    for axes in row[1:]:
        axes.tick_params(labelleft=False)


def _draw_points(axes: "Axes", curve: AllanResult) -> None:
    factor = shown_unit(curve).factor
    y, low, high = (
        np.where(values > 0.0, factor * values, np.nan)
        for values in (curve.deviation, curve.lower, curve.upper)
    )
    axes.fill_between(curve.taus, low, high, color=BLUE, alpha=0.22, lw=0.0)
    axes.plot(curve.taus, y, color=BLUE, lw=0.6, marker="o", ms=2.2, mew=0.0)


def _draw_model(axes: "Axes", curve: AllanResult, model: NoiseModel) -> None:
    axes.plot(curve.taus, fitted_curve(model, curve), color=BLACK, lw=0.9, ls=(0, (4, 2)))
    for line in other_terms(model, curve):
        axes.plot(curve.taus, line, color=BLACK, lw=0.5, ls=":")
    terms = drawn_terms(model, curve)
    for term in terms:
        if term.identifiable:
            axes.plot(curve.taus, term.line, color=term.colour, lw=0.7)
        _mark(axes, term)
    for i, term in enumerate(reversed(terms)):
        axes.text(
            0.03, 0.03 + _LINE * i, term.text, transform=axes.transAxes, size=FONT - 0.8,
            color=term.colour,
        )  # fmt: skip


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


def _span(panel: Panel) -> tuple[float, float]:
    """Return the lowest and the highest thing that must be seen."""
    curve = panel.curve
    positive = curve.deviation > 0.0
    factor = shown_unit(curve).factor
    low = factor * np.nanmin(curve.lower[positive], initial=np.inf)
    high = factor * np.nanmax(np.fmin(curve.upper, 5.0 * curve.deviation)[positive])
    return float(low if low > 0.0 else factor * curve.deviation[positive].min()), float(high)


def _times(panel: Panel) -> Floats:
    """Return the averaging times that must be seen, those of the marks among them."""
    if panel.model is None:
        return panel.curve.taus
    marks = [term.read_at for term in drawn_terms(panel.model, panel.curve)]
    return np.concatenate((panel.curve.taus, marks))


def _below_list(panel: Panel, times: tuple[float, float], high: float) -> float:
    """Return the lower limit that keeps the curve above the list of coefficients."""
    if panel.model is None:
        return np.inf
    curve, (left, right) = panel.curve, times
    top = 0.05 + _LINE * len(drawn_terms(panel.model, curve))
    place = np.log(curve.taus / left) / np.log(right / left)
    heights = (shown_unit(curve).factor * curve.deviation)[(place < _LIST_RIGHT)]
    heights = heights[heights > 0.0]
    if not heights.size:
        return np.inf
    return float(np.exp((np.log(heights.min()) - top * np.log(high)) / (1.0 - top)))


def _hide_outside(axes: "Axes", low: float, high: float) -> None:
    """Hide marks that lie outside, which would hang on the frame."""
    for line in axes.lines:
        heights = np.asarray(line.get_ydata(), dtype=np.float64)
        if heights.size == 1 and line.get_linestyle() == "None":
            line.set_visible(bool(low < heights[0] < high))
