"""Figures of deviation curves."""

from __future__ import annotations

import textwrap
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Final

from zerorate.noise import AllanResult, NoiseModel
from zerorate.noise.kinds import KINDS
from zerorate.noise.quantities import shown_unit
from zerorate.show.plotting.allan_panel import LEAST_FREEDOM, Panel, draw, share_limits
from zerorate.show.plotting.style import FONT, new_figure, style_decades, style_panels

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from zerorate.noise.characterise import Characterisation

__all__ = ["MOST_COLUMNS", "plot_allan", "plot_characterisation"]

MOST_COLUMNS: Final = 4
"""Axes side by side."""

# Millimetres.
_SINGLE: Final = (110.0, 72.0)
_PANEL: Final = (52.0, 50.0)
_LEFT, _RIGHT, _TOP, _BOTTOM = 15.0, 3.0, 7.0, 17.0
_TITLE: Final = 5.0
_BETWEEN_COLUMNS, _BETWEEN_ROWS = 4.0, 15.0


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
        Without matplotlib: ``pip install 'zerorate[plot]'``.
    """
    listed = [models] if isinstance(models, NoiseModel) else models
    if listed is None:
        listed = [None] * len(result.names)  # type: ignore[list-item]
    if len(listed) != len(result.names):
        raise ValueError(f"models must be one an axis: {len(result.names)}, got {len(listed)}")
    panels = [Panel(_seen(axis), model) for axis, model in zip(result, listed, strict=True)]
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
    return _figure([row[:MOST_COLUMNS] for row in rows], title, max(map(len, rows)))


def _panels(found: Characterisation) -> Iterator[Panel]:
    for curve, axis in zip(found.curve, found.axes, strict=True):
        title = f"{axis.name} (moved?)" if axis.moved else axis.name
        yield Panel(replace(_seen(curve), names=(title,)), axis.model)


def _seen(curve: AllanResult) -> AllanResult:
    """Return the part of a curve of one axis that has a place on a logarithmic scale."""
    seen = curve.deviation > 0.0
    if seen.all() or not seen.any():
        return curve
    names = ("taus", "factors", "deviation", "lower", "upper", "edf", "exponent", "terms")
    return replace(curve, **{name: getattr(curve, name)[seen] for name in names})


def _rows(panels: list[Panel]) -> list[list[Panel]]:
    return [panels[i : i + MOST_COLUMNS] for i in range(0, len(panels), MOST_COLUMNS)]


def _figure(rows: list[list[Panel]], title: str, axes_of_log: int = 0) -> Figure:
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
        figure.text(0.5, 1.0 - 2.0 / height, title, ha="center", va="top", size=FONT + 1.5)
    caption = _caption(rows, axes_of_log, round(0.9 * width))
    figure.text(0.5, 2.0 / height, caption, ha="center", va="bottom", size=FONT - 0.5, color="0.25")
    return figure


def _draw_row(row: list[Axes], panels: list[Panel]) -> None:
    for axes, panel in zip(row, panels, strict=True):
        draw(axes, panel)
    share_limits(row, panels)
    unit = shown_unit(panels[0].curve).unit.replace("ug", "µg").replace("^2", "²")
    title = KINDS[panels[0].curve.kind].title
    row[0].set_ylabel(f"{title} [{unit}]")
    style_panels(row)
    for axes in row:
        style_decades(axes)
    for axes in row[1:]:
        axes.tick_params(which="both", labelleft=False)


def _caption(rows: list[list[Panel]], axes_of_log: int, width: int) -> str:
    """Return what a reader must know, in lines of at most so many letters."""
    curve = rows[0][0].curve
    sentences = [
        f"{curve.duration:,.6g} s at {curve.rate:.4g} Hz; band: {100.0 * curve.confidence:.0f} % "
        f"bounds; right of the grey line fewer than {LEAST_FREEDOM:g} degrees of freedom."
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
