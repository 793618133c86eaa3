"""Panels in a column over one time axis: the frame of every figure of series.

It is as wide as a column of a page. What a panel shows and its unit stand over it, with the names
of its lines; the title is the question that the figure answers.
"""

from __future__ import annotations

import math
import textwrap
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from zerorate.record.runs import runs
from zerorate.show.scales import COLUMNS, Band, parts
from zerorate.show.style import (
    COLUMN,
    FONT,
    GREY,
    GREY_TEXT,
    SMALL,
    add_panel,
    new_figure,
    style_panels,
    write_corner,
)

if TYPE_CHECKING:
    from collections.abc import Sequence

    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from zerorate.types import Booleans, Floats

# Millimetres.
LEFT: Final = 10.0
RIGHT: Final = 2.5
INNER: Final = COLUMN - LEFT - RIGHT
_TOP, _TITLE_LINE, _ANSWER_LINE = 1.5, 3.5, 3.0
_AXIS, _CAPTION_LINE, _CORNER = 7.5, 2.6, 3.6
HEAD: Final = 4.6
"""Over a panel, for what it shows and for the names of its lines."""

_EDGE: Final = 1.5
_TITLE_LETTERS, _ANSWER_LETTERS, _CAPTION_LETTERS = 50, 64, 72
_SMALL, _LARGE, _CLOSE = 0.01, 1e4, 1e-2
_RAISED: Final = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")

SIGMAS: Final = 2.0
"""Half of what a band is wide, in standard deviations."""


class Stack:
    """A figure and its panels, from above; each is added where the one before ended.

    Parameters
    ----------
    title : str
        The question that the figure answers.
    answer : str
        What it answers, in a line or two.
    caption : str
        What a reader must know to read it.
    heights : sequence of float
        Of the rows of panels, mm.
    between : float
        What is left free between rows besides, mm, as by `skip`.
    colour : str
        Of the answer.
    """

    def __init__(
        self,
        title: str,
        answer: str,
        caption: str,
        heights: Sequence[float],
        between: float = 0.0,
        colour: str = GREY_TEXT,
    ) -> None:
        said = textwrap.wrap(title, _TITLE_LETTERS)
        answered = textwrap.wrap(answer, _ANSWER_LETTERS, max_lines=2, placeholder=" …")
        told = textwrap.fill(caption, _CAPTION_LETTERS)
        under = _CORNER + _CAPTION_LINE * (told.count("\n") + 1) + 1.0
        above = _TOP + _TITLE_LINE * len(said) + _ANSWER_LINE * len(answered)
        self.height = above + sum(HEAD + one for one in heights) + between + _AXIS + under
        self.figure = new_figure(COLUMN, self.height)
        self.panels: list[Axes] = []
        self._heights, self._above = list(heights), above
        self._write(_TOP, said, size=FONT + 0.9, weight="bold")
        self._write(_TOP + _TITLE_LINE * len(said), answered, size=FONT, color=colour)
        left, low = _EDGE / COLUMN, _CORNER / self.height
        self.figure.text(left, low, told, va="bottom", size=SMALL, color=GREY_TEXT)

    def _write(self, below: float, lines: Sequence[str], **look: Any) -> None:  # noqa: ANN401
        if lines:
            place = _EDGE / COLUMN, 1.0 - below / self.height
            self.figure.text(*place, "\n".join(lines), va="top", **look)

    def add(self, left: float = LEFT, width: float = INNER, last: bool = True) -> Axes:
        """Return the next panel; one that is not the last of its row has others beside it."""
        tall = self._heights[0]
        panel = add_panel(self.figure, left, self.height - self._above - HEAD - tall, width, tall)
        self.panels.append(panel)
        if last:
            self.skip(HEAD + self._heights.pop(0))
        return panel

    def skip(self, millimetres: float) -> None:
        """Leave room under the last panel, of what is free between rows."""
        self._above += millimetres

    def finish(self, source: str, rate: float, seconds: float) -> Figure:
        """Write the recording into the corner, style all panels, and return the figure."""
        shown = [panel for panel in self.panels if panel.axison]
        style_panels(shown)
        for panel in shown:
            if panel.get_yscale() == "linear":
                _shorten_numbers(panel)
        write_corner(self.figure, source, rate, seconds)
        return self.figure


def over_time(panels: Sequence[Axes], first: float, last: float, unit: str) -> None:
    """Give panels one time axis, whose numbers stand under the last."""
    for panel in panels:
        panel.set_xlim(first, last if last > first else first + 1.0)
    for panel in panels[:-1]:
        panel.tick_params(bottom=False, labelbottom=False)
    panels[-1].set_xlabel(f"time [{unit}]")


def head(panel: Axes, text: str) -> None:
    """Write over a panel what it shows."""
    # With no y matplotlib lays out all ticks to find one: a quarter of the time of drawing.
    panel.set_title(text, loc="left", size=FONT, pad=2.2, y=1.0)


def _shorten_numbers(panel: Axes) -> None:
    """Write a power of ten, or what the numbers of a scale have in common, over the panel.

    Matplotlib would write it there by itself, over other letters.
    """
    from matplotlib.ticker import Formatter, FuncFormatter

    low, high = panel.get_ylim()
    largest, span = max(abs(low), abs(high)), high - low
    taken = 0.0
    if span < _CLOSE * largest:
        taken = float(np.round(0.5 * (low + high), -math.floor(math.log10(span))))
        largest = span
    power = 0
    if not _SMALL <= largest < _LARGE:
        power = 3 * math.floor(math.log10(largest) / 3.0)
    if power == 0 and taken == 0.0:
        return
    unit = 10.0**power

    def shortened(value: float, _: int) -> str:
        # What is left of a difference that should be zero is none; nor is a zero negative.
        return Formatter.fix_minus(f"{round((value - taken) / unit, 6) + 0.0:.6g}")

    panel.yaxis.set_major_formatter(FuncFormatter(shortened))
    text = panel.get_title(loc="left")
    if taken:
        text = text.replace(" [", f" less {Formatter.fix_minus(f'{taken:.12g}')} [", 1)
    if power:
        text = text.replace("[", f"[10{str(power).translate(_RAISED)} ", 1).replace(" ]", "]")
    head(panel, text)


def names(panel: Axes, columns: int = 4) -> None:
    """Write the names of a panel's lines over its right half."""
    panel.legend(
        loc="lower right",
        bbox_to_anchor=(1.005, 1.0),
        ncols=columns,
        fontsize=SMALL,
        frameon=False,
        borderpad=0.15,
        borderaxespad=0.0,
        handlelength=1.1,
        columnspacing=0.9,
        handletextpad=0.35,
    )


def draw_scatter(panel: Axes, times: Floats, drawn: Band, colour: str, name: str) -> None:
    """Draw a series as a band, and through it its median."""
    panel.fill_between(times, drawn.low, drawn.high, color=colour, alpha=0.35, lw=0.0)
    panel.plot(times, drawn.median, color=colour, lw=0.6, label=name)


def draw_known(
    panel: Axes, times: Floats, values: Floats, sigma: Floats, colour: str, name: str
) -> None:
    """Draw a series with two standard deviations to either side."""
    half = SIGMAS * sigma
    panel.fill_between(times, values - half, values + half, color=colour, alpha=0.22, lw=0.0)
    panel.plot(times, values, color=colour, lw=0.7, label=name)


def shade(
    panel: Axes, begins: Floats, ends: Floats, colour: str = GREY, alpha: float = 0.8
) -> None:
    """Shade a panel in these spans of time, behind all else."""
    if len(begins) == 0:
        return
    panel.broken_barh(
        list(zip(begins, ends - begins, strict=True)),
        (0.0, 1.0),
        transform=panel.get_xaxis_transform(),
        color=colour,
        alpha=alpha,
        lw=0.0,
        zorder=0.5,
    )


def spans_of(there: Booleans, columns: int = COLUMNS) -> tuple[Floats, Floats]:
    """Return begins and ends, in samples, of where something is so, each as wide as can be seen."""
    if not there.any():
        return np.empty(0), np.empty(0)
    starts = parts(there.size, columns)
    edges = np.append(starts, there.size).astype(np.float64)
    begins, ends = edges[runs(np.logical_or.reduceat(there, starts))].T
    return begins, ends


def room(low: float, high: float, margin: float = 0.08) -> tuple[float, float]:
    """Return limits with a margin; they are apart and finite whatever is given."""
    if not (np.isfinite(low) and np.isfinite(high)):
        return -1.0, 1.0
    span = high - low
    if not span > 1e-9 * max(abs(low), abs(high)):
        span = 0.1 * abs(high) or 1.0
    return low - margin * span, high + margin * span
