"""A comparison as a figure: each measure a panel, each method a row, each axis a dot."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Final, NamedTuple

from zerorate.numerals import significant
from zerorate.show.compare_tables import Measure, label, leading_section
from zerorate.show.stack import Stack, head
from zerorate.show.style import (
    BLUE,
    COLUMN,
    GREY,
    MM,
    SMALL,
    VERMILION,
    style_panels,
    text_colour,
    write_corner,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from zerorate.tasks.compare.comparison import Comparison
    from zerorate.tasks.compare.measures import Row
    from zerorate.tasks.compare.task import Compared

_MOST: Final = 3
"""Panels: a fourth would leave no room for numbers. The table has all measures."""

# Millimetres.
_LABELS, _NUMBERS, _EDGE = 20.0, 8.0, 1.5
_ROW: Final = 3.4
_POINTS: Final = 72.0
"""In an inch."""

_WIDE: Final = 20.0
"""Ratio of the largest value to the least above which a scale is logarithmic."""


class _Method(NamedTuple):
    """A method and what it reached by each measure, axis by axis."""

    name: str
    values: tuple[tuple[float, ...], ...]

    def mean(self, measure: int) -> float:
        values = self.values[measure]
        return sum(values) / len(values) if values else math.nan


def plot_compared(found: Compared) -> Figure:
    """Return the figure of the first kind of recording; ValueError without any."""
    drawn = next((one for one in found.comparisons if one.rows), None)
    if drawn is None:
        raise ValueError("there is no figure of simulated gyros: the table has all numbers")
    return plot_compare(drawn)


def plot_compare(found: Comparison) -> Figure:
    """Return how each method did, by the measures that its kind of recording is judged by first.

    A panel a measure, three at most, with a row a method: a dot an axis, and a bar and a number for
    their mean; in colour the best, by the first measure, of those that use no later sample.
    """
    section = leading_section(found)
    grouped = [[row for row in found.rows if row.method == one] for one in found.methods]
    several = len({(row.source, row.axis) for row in found.rows}) > 1
    usable = [one for one in section.measures if not (several and one.of_one)]
    measures = [one for one in usable if any(_values(one, rows) for rows in grouped)][:_MOST]
    methods = [_method(rows, measures) for rows in grouped]
    methods = [one for one in methods if any(one.values)]
    figure = Stack(
        section.question,
        _answer(methods, measures),
        "Dots: axes of the recordings; bars and numbers: their means.",
        [_ROW * max(len(methods), 1)],
    )
    best = _best(methods, measures)
    wide = (COLUMN - _LABELS - _EDGE) / max(len(measures), 1)
    for i, measure in enumerate(measures):
        last = i + 1 == len(measures)
        panel = figure.add(_LABELS + i * wide, wide - _NUMBERS, last=last)
        _draw(panel, measure, [(one.values[i], one.mean(i)) for one in methods], best)
    # No `finish`: its powers of ten are for scales, and a row is no number.
    style_panels(figure.panels)
    write_corner(figure.figure, _source(found.rows), 0.0, 0.0)
    for i, panel in enumerate(figure.panels):
        names = [one.name for one in methods] if i == 0 else [""] * len(methods)
        _thin_out(panel)
        panel.set_yticks(range(len(methods)), names, size=SMALL)
        panel.tick_params(axis="y", length=0.0)
    return figure.figure


def _method(rows: Sequence[Row], measures: Sequence[Measure]) -> _Method:
    values = tuple(tuple(_values(one, rows)) for one in measures)
    return _Method(label(rows), values)


def _source(rows: Sequence[Row]) -> str:
    sources = list(dict.fromkeys(row.source for row in rows))
    return sources[0] if len(sources) == 1 else f"{len(sources)} recordings"


def _values(measure: Measure, rows: Sequence[Row]) -> list[float]:
    return [value for value in map(measure.of, rows) if math.isfinite(value)]


def _best(methods: Sequence[_Method], measures: Sequence[Measure]) -> int | None:
    """Return which of the methods that see no later sample does best by the first measure."""
    if not measures:
        return None
    means = {i: one.mean(0) for i, one in enumerate(methods) if _fair(one)}
    known = {i: mean for i, mean in means.items() if math.isfinite(mean)}
    return min(known, key=lambda i: measures[0].badness(known[i]), default=None)


def _fair(method: _Method) -> bool:
    """Return whether no dagger stands at a method."""
    return method.name[-1] not in "†‡"


def _answer(methods: Sequence[_Method], measures: Sequence[Measure]) -> str:
    if (best := _best(methods, measures)) is None:
        return "no measure means anything here"
    first = measures[0].head
    found = f"{methods[best].name}: {significant(methods[best].mean(0))} ({first})"
    later = [one for one in methods if one.name[-1] == "‡" and math.isfinite(one.mean(0))]
    if later:
        least = min(later, key=lambda one: measures[0].badness(one.mean(0)))
        found += f"; with later samples {least.name[:-1]}: {significant(least.mean(0))}"
    return found


def _thin_out(axes: Axes) -> None:
    """Leave a narrow panel as few numbers as it has room for."""
    from matplotlib.ticker import FuncFormatter, MaxNLocator

    if axes.get_xscale() == "log":
        axes.xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    else:
        axes.xaxis.set_major_locator(MaxNLocator(2))


def _draw(
    axes: Axes,
    measure: Measure,
    rows: Sequence[tuple[Sequence[float], float]],
    best: int | None,
) -> None:
    head(axes, measure.head)
    axes.set_ylim(len(rows) - 0.5, -0.5)
    shown = [value for values, _ in rows for value in values]
    if min(shown) > 0.0 and max(shown) > _WIDE * min(shown):
        axes.set_xscale("log")
    if measure.ideal:
        axes.axvline(measure.ideal, color=GREY, lw=1.0)
    for i, (values, mean) in enumerate(rows):
        axes.axhline(i, color=GREY, lw=0.4, zorder=0.5)
        axes.plot(values, [i] * len(values), "o", ms=2.0, color=BLUE, alpha=0.5, mew=0.0)
        if not math.isfinite(mean):
            continue
        colour = VERMILION if i == best else "black"
        axes.plot([mean], [i], "|", ms=6.0, mew=1.3, color=colour)
        axes.annotate(
            significant(mean),
            (1.0, i),
            ((_NUMBERS - _EDGE) * MM * _POINTS, 0.0),
            xycoords=axes.get_yaxis_transform(),
            textcoords="offset points",
            ha="right",
            va="center",
            size=SMALL,
            color=text_colour(colour),
            weight="bold" if i == best else "normal",
        )
