"""A comparison as a figure: each measure a panel, each method a row, each axis a dot."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Final

from zerorate.show.compare_tables import Measure, label, leading_section
from zerorate.show.style import (
    BLUE,
    GREY,
    VERMILION,
    add_panel,
    new_figure,
    style_panels,
    write_caption,
    write_title,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from zerorate.compare.comparison import Comparison
    from zerorate.compare.measures import Row

# Millimetres.
_PANEL, _LEFT, _BETWEEN, _UNDER = 42.0, 24.0, 6.0, 11.0
_ROW, _BELOW, _ABOVE = 5.0, 14.0, 9.0
_COLUMNS: Final = 3
_WIDE: Final = 20.0
"""Ratio of the largest value to the least above which a scale is logarithmic."""


def plot_compare(found: Comparison) -> Figure:
    """Return how each method did, by the measures that its kind of recording is judged by first.

    Parameters
    ----------
    found : Comparison
        Of one kind of recording.

    Returns
    -------
    matplotlib.figure.Figure
        A panel a measure with a row a method: a dot an axis, and the mean of all.
    """
    section = leading_section(found)
    rows = [[row for row in found.rows if row.method == method] for method in found.methods]
    measures = [one for one in section.measures if any(_values(one, own) for own in rows)]
    down, across = -(-len(measures) // _COLUMNS), min(len(measures), _COLUMNS)
    own = _ROW * len(rows)
    width = _LEFT + max(1, across) * (_PANEL + _BETWEEN)
    height = _BELOW + _ABOVE + max(1, down) * (own + _UNDER) - _UNDER
    figure = new_figure(width, height)
    panels = []
    for i, measure in enumerate(measures):
        left = _LEFT + i % _COLUMNS * (_PANEL + _BETWEEN)
        bottom = _BELOW + (down - 1 - i // _COLUMNS) * (own + _UNDER)
        panels.append(add_panel(figure, left, bottom, _PANEL, own))
        _draw(panels[-1], measure, rows)
    style_panels(panels)
    for i, panel in enumerate(panels):
        names = [] if i % _COLUMNS else [label(one) for one in rows]
        panel.set_yticks(range(len(rows)), names or [""] * len(rows))
    write_title(figure, section.title)
    write_caption(figure, "Dots: axes of the recordings. Bars: their mean.")
    return figure


def _values(measure: Measure, rows: Sequence[Row]) -> list[float]:
    return [value for value in map(measure.of, rows) if math.isfinite(value)]


def _draw(axes: Axes, measure: Measure, rows: Sequence[Sequence[Row]]) -> None:
    axes.set_xlabel(measure.head)
    axes.set_ylim(len(rows) - 0.5, -0.5)
    values = [_values(measure, own) for own in rows]
    shown = [value for own in values for value in own]
    if min(shown) > 0.0 and max(shown) > _WIDE * min(shown):
        axes.set_xscale("log")
    if measure.ideal:
        axes.axvline(measure.ideal, color=GREY, lw=1.0)
    for i, own in enumerate(values):
        axes.plot(own, [i] * len(own), "o", ms=2.0, color=BLUE, alpha=0.5, mew=0.0)
        if own:
            axes.plot([sum(own) / len(own)], [i], "|", ms=7.0, mew=1.2, color=VERMILION)
