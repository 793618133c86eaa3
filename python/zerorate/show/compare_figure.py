"""Figure of a comparison: a panel per measure, a row per method, a dot per axis."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Final, NamedTuple

from zerorate.numerals import format_significant
from zerorate.show.compare_tables import Measure, leading_section, method_label
from zerorate.show.stack import Stack, write_head
from zerorate.show.style import (
    BLUE,
    COLUMN_WIDTH_MM,
    GREY,
    INCHES_PER_MM,
    SMALL_FONT_PT,
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

_MAX_PANELS: Final = 3
"""Largest number of panels, so that numbers fit. The table has all measures."""

# Sizes in mm.
_LABELS_WIDTH_MM, _NUMBERS_WIDTH_MM, _EDGE_MM = 20.0, 8.0, 1.5
_ROW_HEIGHT_MM: Final = 3.4
_POINTS_PER_INCH: Final = 72.0
"""Points in an inch."""

_MIN_LOG_RATIO: Final = 20.0
"""Ratio of the largest to the smallest value above which a scale is logarithmic."""


class _Method(NamedTuple):
    """A method with its results for each measure and axis."""

    name: str
    values: tuple[tuple[float, ...], ...]

    def mean(self, measure: int) -> float:
        values = self.values[measure]
        return sum(values) / len(values) if values else math.nan


def plot_compared(result: Compared) -> Figure:
    """Return the figure for the first kind of recording. Raises ValueError without recordings."""
    comparison = next((candidate for candidate in result.comparisons if candidate.rows), None)
    if comparison is None:
        raise ValueError("simulated gyros have no figure: the table has all numbers")
    return plot_compare(comparison)


def plot_compare(comparison: Comparison) -> Figure:
    """Return a figure of each method's scores by the main measures of its kind of recording.

    There is one panel per measure, three at most, with one row per method. A row has one dot per
    axis, and a bar and a number for the mean. The best method by the first measure is coloured;
    methods that use later samples are not considered.
    """
    section = leading_section(comparison)
    rows_by_method = [
        [row for row in comparison.rows if row.method == item] for item in comparison.methods
    ]
    several = len({(row.source, row.axis) for row in comparison.rows}) > 1
    usable = [item for item in section.measures if not (several and item.of_one)]
    measures = [
        item for item in usable if any(_finite_values(item, rows) for rows in rows_by_method)
    ][:_MAX_PANELS]
    methods = [_make_method(rows, measures) for rows in rows_by_method]
    methods = [item for item in methods if any(item.values)]
    figure = Stack(
        section.question,
        _describe_best(methods, measures),
        "Dots: axes of the recordings. Bars and numbers: means.",
        [_ROW_HEIGHT_MM * max(len(methods), 1)],
    )
    best = _find_best(methods, measures)
    panel_width = (COLUMN_WIDTH_MM - _LABELS_WIDTH_MM - _EDGE_MM) / max(len(measures), 1)
    for i, measure in enumerate(measures):
        last = i + 1 == len(measures)
        panel = figure.add(
            _LABELS_WIDTH_MM + i * panel_width, panel_width - _NUMBERS_WIDTH_MM, last=last
        )
        _draw_measure(panel, measure, [(item.values[i], item.mean(i)) for item in methods], best)
    # Do not call `finish`: its powers of ten are for scales, and the rows have no scale.
    style_panels(figure.panels)
    write_corner(figure.figure, _describe_source(comparison.rows), 0.0, 0.0)
    for i, panel in enumerate(figure.panels):
        names = [item.name for item in methods] if i == 0 else [""] * len(methods)
        _thin_ticks(panel)
        panel.set_yticks(range(len(methods)), names, size=SMALL_FONT_PT)
        panel.tick_params(axis="y", length=0.0)
    return figure.figure


def _make_method(rows: Sequence[Row], measures: Sequence[Measure]) -> _Method:
    values = tuple(tuple(_finite_values(measure, rows)) for measure in measures)
    return _Method(method_label(rows), values)


def _describe_source(rows: Sequence[Row]) -> str:
    sources = list(dict.fromkeys(row.source for row in rows))
    return sources[0] if len(sources) == 1 else f"{len(sources)} recordings"


def _finite_values(measure: Measure, rows: Sequence[Row]) -> list[float]:
    return [value for value in map(measure.of, rows) if math.isfinite(value)]


def _find_best(methods: Sequence[_Method], measures: Sequence[Measure]) -> int | None:
    """Return the index of the best causal method by the first measure."""
    if not measures:
        return None
    means = {i: method.mean(0) for i, method in enumerate(methods) if _is_causal(method)}
    known = {i: mean for i, mean in means.items() if math.isfinite(mean)}
    return min(known, key=lambda i: measures[0].badness(known[i]), default=None)


def _is_causal(method: _Method) -> bool:
    """Return True if a method is not marked with a dagger."""
    return method.name[-1] not in "†‡"


def _describe_best(methods: Sequence[_Method], measures: Sequence[Measure]) -> str:
    if (best := _find_best(methods, measures)) is None:
        return "no measure applies here"
    first = measures[0].head
    text = f"{methods[best].name}: {format_significant(methods[best].mean(0))} ({first})"
    acausal = [one for one in methods if one.name[-1] == "‡" and math.isfinite(one.mean(0))]
    if acausal:
        best_acausal = min(acausal, key=lambda one: measures[0].badness(one.mean(0)))
        text += (
            f"; with later samples {best_acausal.name[:-1]}: "
            f"{format_significant(best_acausal.mean(0))}"
        )
    return text


def _thin_ticks(axes: Axes) -> None:
    """Reduce the numbers of a narrow panel to those that fit."""
    from matplotlib.ticker import FuncFormatter, MaxNLocator

    if axes.get_xscale() == "log":
        axes.xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    else:
        axes.xaxis.set_major_locator(MaxNLocator(2))


def _draw_measure(
    axes: Axes,
    measure: Measure,
    rows: Sequence[tuple[Sequence[float], float]],
    best: int | None,
) -> None:
    write_head(axes, measure.head)
    axes.set_ylim(len(rows) - 0.5, -0.5)
    shown = [value for values, _ in rows for value in values]
    if min(shown) > 0.0 and max(shown) > _MIN_LOG_RATIO * min(shown):
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
            format_significant(mean),
            (1.0, i),
            ((_NUMBERS_WIDTH_MM - _EDGE_MM) * INCHES_PER_MM * _POINTS_PER_INCH, 0.0),
            xycoords=axes.get_yaxis_transform(),
            textcoords="offset points",
            ha="right",
            va="center",
            size=SMALL_FONT_PT,
            color=text_colour(colour),
            weight="bold" if i == best else "normal",
        )
