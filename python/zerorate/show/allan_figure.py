"""Figures of deviation curves: a panel an axis, with bounds and what was fitted."""

from __future__ import annotations

import textwrap
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Final, NamedTuple

import numpy as np

from zerorate.noise import AllanResult, NoiseModel
from zerorate.noise.kinds import KINDS
from zerorate.noise.quantities import shown_unit
from zerorate.show.allan_terms import (
    FAR,
    DrawnTerm,
    Window,
    drawn_terms,
    fitted_curve,
    other_terms,
    with_room,
    write_list,
)
from zerorate.show.style import (
    BLACK,
    BLUE,
    new_figure,
    style_decades,
    style_panels,
    write_caption,
    write_in_middle,
    write_title,
)
from zerorate.types import Floats

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from zerorate.noise.characterise import Characterisation

__all__ = ["plot_allan", "plot_characterisation"]

_MOST_COLUMNS: Final = 4
"""Axes side by side."""

# Millimetres.
_SINGLE: Final = (110.0, 72.0)
_PANEL: Final = (52.0, 50.0)
_LEFT, _RIGHT, _TOP, _BOTTOM = 15.0, 3.0, 7.0, 17.0
_TITLE: Final = 5.0
_BETWEEN_COLUMNS, _BETWEEN_ROWS = 4.0, 15.0

_LEAST_FREEDOM: Final = 5.0
"""Degrees of freedom below which a deviation says little."""

_MARGIN: Final = 0.06

_DEPTH: Final = 3.0
"""How far below a curve marks are shown, as a factor: the floor, and what is near it."""

_DEPTH_ALONE: Final = 500.0
"""The same of a figure of one axis, which has room for the marks of walk and ramp."""


def plot_allan(
    result: AllanResult, models: Sequence[NoiseModel] | NoiseModel | None = None
) -> Figure:
    """Return a figure of a deviation curve with bounds, and of the models fitted to it.

    Parameters
    ----------
    result : AllanResult
        One panel an axis, four side by side.
    models : NoiseModel or sequence of NoiseModel, optional
        One an axis: drawn are the deviation that the model expects, each identifiable term with
        a mark where IEEE Std 952 reads it, and a triangle at the bound of each that is not.

    Returns
    -------
    matplotlib.figure.Figure
        Angular rates in deg/h or deg/s, accelerations in ug or m/s^2, by their size. No global
        state of matplotlib is used.

    Raises
    ------
    ValueError
        If there is not one model an axis.
    ImportError
        Without matplotlib, of the extra ``plot``.
    """
    listed = [models] if isinstance(models, NoiseModel) else models
    if listed is None:
        listed = [None] * len(result.names)  # type: ignore[list-item]
    if len(listed) != len(result.names):
        raise ValueError(f"models must be one an axis: {len(result.names)}, got {len(listed)}")
    panels = [
        _Panel(_positive_part(axis), model) for axis, model in zip(result, listed, strict=True)
    ]
    return _figure(_rows(panels), "")


def plot_characterisation(found: Sequence[Characterisation]) -> Figure:
    """Return a figure of all sensors of one log: gyros above, accelerometers below.

    Parameters
    ----------
    found : sequence of Characterisation
        At least one.

    Returns
    -------
    matplotlib.figure.Figure
        A panel an axis, as of `plot_allan`, of the first four axes of each.
    """
    rows = [list(_panels(one)) for one in found]
    meta = found[0].log.meta
    title = meta.get("sensor") or Path(meta.get("source", "")).name
    return _figure([row[:_MOST_COLUMNS] for row in rows], title, max(map(len, rows)))


def _panels(found: Characterisation) -> Iterator[_Panel]:
    for curve, axis in zip(found.curve, found.axes, strict=True):
        title = f"{axis.name} (moved?)" if axis.moved else axis.name
        yield _Panel(replace(_positive_part(curve), names=(title,)), axis.model)


def _positive_part(curve: AllanResult) -> AllanResult:
    """Return the part of a curve of one axis that has a place on a logarithmic scale."""
    seen = curve.deviation > 0.0
    if seen.all() or not seen.any():
        return curve
    names = ("taus", "factors", "deviation", "lower", "upper", "edf", "exponent", "terms")
    return replace(curve, **{name: getattr(curve, name)[seen] for name in names})


def _rows(panels: list[_Panel]) -> list[list[_Panel]]:
    return [panels[i : i + _MOST_COLUMNS] for i in range(0, len(panels), _MOST_COLUMNS)]


def _figure(rows: list[list[_Panel]], title: str, axes_of_log: int = 0) -> Figure:
    columns = max(map(len, rows))
    panel = _SINGLE if len(rows) == columns == 1 else _PANEL
    width = _LEFT + _RIGHT + columns * panel[0] + (columns - 1) * _BETWEEN_COLUMNS
    top = _TOP + (_TITLE if title else 0.0)
    height = top + _BOTTOM + len(rows) * panel[1] + (len(rows) - 1) * _BETWEEN_ROWS
    figure = new_figure(width, height)
    for i, row in enumerate(rows):
        bottom = height - top - (i + 1) * panel[1] - i * _BETWEEN_ROWS
        lefts = [_LEFT + j * (panel[0] + _BETWEEN_COLUMNS) for j in range(len(row))]
        boxes = ((left / width, bottom / height, panel[0] / width, panel[1] / height)
                 for left in lefts)  # fmt: skip
        _draw_row([figure.add_axes(box) for box in boxes], row)
    if title:
        write_title(figure, height, title)
    write_caption(figure, height, _caption(rows, axes_of_log, round(0.9 * width)))
    return figure


def _draw_row(row: list[Axes], panels: list[_Panel]) -> None:
    for axes, panel in zip(row, panels, strict=True):
        _draw(axes, panel)
    _share_limits(row, panels)
    unit = shown_unit(panels[0].curve).unit.replace("ug", "µg").replace("^2", "²")
    title = KINDS[panels[0].curve.kind].title
    row[0].set_ylabel(f"{title} [{unit}]")
    style_panels(row)
    for axes in row:
        style_decades(axes)
    for axes in row[1:]:
        axes.tick_params(which="both", labelleft=False)


def _caption(rows: list[list[_Panel]], axes_of_log: int, width: int) -> str:
    """Return what a reader must know, in lines of at most so many letters."""
    curve = rows[0][0].curve
    sentences = [
        f"{curve.duration:,.6g} s at {curve.rate:.4g} Hz; band: {100.0 * curve.confidence:.0f} % "
        f"bounds; right of the grey line fewer than {_LEAST_FREEDOM:g} degrees of freedom."
    ]
    if any(panel.model is not None for row in rows for panel in row):
        sentences.append(
            "Dashed: the model. Lines: its terms, marked where each is read (hollow: outside "
            "the record). Dotted, with triangle: not identifiable, upper bound at 95 %."
        )
    shown = max(map(len, rows))
    if axes_of_log > shown:
        sentences.append(f"Shown are the first {shown} of {axes_of_log} axes.")
    return "\n".join(textwrap.fill(sentence, width) for sentence in sentences)


class _Panel(NamedTuple):
    """What is drawn: the curve of one axis, and its model if there is one."""

    curve: AllanResult
    model: NoiseModel | None


def _draw(axes: Axes, panel: _Panel) -> None:
    """Draw one axis."""
    curve, model = panel
    axes.set_xscale("log")
    axes.set_yscale("log")
    axes.set_title(curve.names[0])
    axes.set_xlabel("averaging time [s]")
    if not np.any(curve.deviation > 0.0):
        write_in_middle(axes, "no noise")
        return
    _draw_points(axes, curve)
    if model is not None:
        _draw_model(axes, curve, model)
    edge = _last_sure(curve)
    if edge is not None:
        axes.axvline(edge, color="0.5", lw=0.6, ls=":")


def _share_limits(row: list[Axes], panels: list[_Panel]) -> None:
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


def _draw_points(axes: Axes, curve: AllanResult) -> None:
    factor = shown_unit(curve).factor
    y, low, high = (factor * values for values in (curve.deviation, curve.lower, curve.upper))
    axes.fill_between(curve.taus, low, high, color=BLUE, alpha=0.22, lw=0.0)
    axes.plot(curve.taus, y, color=BLUE, lw=0.6, marker="o", ms=2.2, mew=0.0)


def _draw_model(axes: Axes, curve: AllanResult, model: NoiseModel) -> None:
    axes.plot(curve.taus, fitted_curve(model, curve), color=BLACK, lw=0.9, ls=(0, (4, 2)))
    for line in other_terms(model, curve):
        axes.plot(curve.taus, line, color=BLACK, lw=0.5, ls=":")
    for term in drawn_terms(model, curve):
        style = {"lw": 0.7} if term.identifiable else {"lw": 0.6, "ls": (0, (1, 2))}
        axes.plot(curve.taus, term.line, color=term.colour, **style)
        _mark(axes, term)


def _mark(axes: Axes, term: DrawnTerm) -> None:
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
    few = np.flatnonzero(~(curve.edf >= _LEAST_FREEDOM))
    if few.size == 0 or few[0] == 0:
        return None
    return float(np.sqrt(curve.taus[few[0] - 1] * curve.taus[few[0]]))


def _span(panel: _Panel, depth: float) -> tuple[float, float]:
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


def _times(panel: _Panel) -> Floats:
    """Return the averaging times that must be seen, those of the marks among them."""
    if panel.model is None:
        return panel.curve.taus
    marks = [term.read_at for term in drawn_terms(panel.model, panel.curve)]
    return np.concatenate((panel.curve.taus, marks))


def _hide_outside(axes: Axes, window: Window) -> None:
    """Hide marks that lie outside, which would hang on the frame."""
    for line in axes.lines:
        heights = np.asarray(line.get_ydata(), dtype=np.float64)
        if heights.size == 1 and line.get_linestyle() == "None":
            line.set_visible(bool(window.low < heights[0] < window.high))
