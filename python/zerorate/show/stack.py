"""Column of panels over one time axis, as the frame of figures of series.

The figure is as wide as a page column. Above each panel are its quantity, its unit and the names of
its lines. The title is the question that the figure answers.
"""

from __future__ import annotations

import math
import textwrap
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from zerorate.record.runs import runs
from zerorate.show.scales import MAX_COLUMNS, Band, split_into_parts
from zerorate.show.style import (
    COLUMN_WIDTH_MM,
    FONT_PT,
    GREY,
    GREY_TEXT,
    SMALL_FONT_PT,
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

# Sizes in mm.
LEFT_MM: Final = 10.0
RIGHT_MM: Final = 2.5
INNER_WIDTH_MM: Final = COLUMN_WIDTH_MM - LEFT_MM - RIGHT_MM
_TOP, _TITLE_LINE, _ANSWER_LINE = 1.5, 3.5, 3.0
_AXIS, _CAPTION_LINE, _CORNER = 7.5, 2.6, 3.6
HEAD_HEIGHT_MM: Final = 4.6
"""Height above a panel for its quantity and the names of its lines, mm."""

_EDGE: Final = 1.5
_TITLE_LETTERS, _ANSWER_LETTERS, _CAPTION_LETTERS = 50, 64, 72
_MIN_PLAIN, _MAX_PLAIN, _COMMON_OFFSET_RATIO = 0.01, 1e4, 1e-2
_SUPERSCRIPTS: Final = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")

BAND_SIGMAS: Final = 2.0
"""Half width of a band, in standard deviations."""


class Stack:
    """A figure with panels from top to bottom; each is added below the previous panel.

    Parameters
    ----------
    title : str
        Question that the figure answers.
    answer : str
        Answer, in a line or two.
    caption : str
        Explanation for the reader.
    heights : sequence of float
        Heights of the rows of panels, mm.
    between : float
        Additional space between rows, mm, used by `skip`.
    colour : str
        Colour of the answer.
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
        title_lines = textwrap.wrap(title, _TITLE_LETTERS)
        answer_lines = textwrap.wrap(answer, _ANSWER_LETTERS, max_lines=2, placeholder=" …")
        caption_text = textwrap.fill(caption, _CAPTION_LETTERS)
        below = _CORNER + _CAPTION_LINE * (caption_text.count("\n") + 1) + 1.0
        above = _TOP + _TITLE_LINE * len(title_lines) + _ANSWER_LINE * len(answer_lines)
        self.height = (
            above + sum(HEAD_HEIGHT_MM + height for height in heights) + between + _AXIS + below
        )
        self.figure = new_figure(COLUMN_WIDTH_MM, self.height)
        self.panels: list[Axes] = []
        self._groups: list[list[Axes]] = []
        self._heights, self._above = list(heights), above
        self._write(_TOP, title_lines, size=FONT_PT + 0.9, weight="bold")
        self._write(_TOP + _TITLE_LINE * len(title_lines), answer_lines, size=FONT_PT, color=colour)
        left, low = _EDGE / COLUMN_WIDTH_MM, _CORNER / self.height
        self.figure.text(left, low, caption_text, va="bottom", size=SMALL_FONT_PT, color=GREY_TEXT)

    def _write(self, below: float, lines: Sequence[str], **look: Any) -> None:  # noqa: ANN401
        if lines:
            corner = _EDGE / COLUMN_WIDTH_MM, 1.0 - below / self.height
            self.figure.text(*corner, "\n".join(lines), va="top", **look)

    def add(self, left: float = LEFT_MM, width: float = INNER_WIDTH_MM, last: bool = True) -> Axes:
        """Return the next panel; with `last=False` another panel follows in the same row."""
        height = self._heights[0]
        panel = add_panel(
            self.figure, left, self.height - self._above - HEAD_HEIGHT_MM - height, width, height
        )
        self.panels.append(panel)
        if last:
            self.skip(HEAD_HEIGHT_MM + self._heights.pop(0))
        return panel

    def skip(self, millimetres: float) -> None:
        """Leave space below the last panel, from the space between rows."""
        self._above += millimetres

    def share_scale(self, panels: Sequence[Axes]) -> None:
        """Give panels of one quantity the same span, and numbers with a common power of ten.

        If the span is small compared with the values, each panel shows its values minus their
        median.
        """
        limits = [panel.get_ylim() for panel in panels]
        span = max(high - low for low, high in limits)
        for panel, (low, high) in zip(panels, limits, strict=True):
            middle = 0.5 * (low + high)
            panel.set_ylim(middle - 0.5 * span, middle + 0.5 * span)
        self._groups.append(list(panels))

    def finish(self, source: str, rate: float, seconds: float) -> Figure:
        """Write the recording's name into the corner, style all panels, and return the figure."""
        visible = [panel for panel in self.panels if panel.axison]
        style_panels(visible)
        grouped = {id(panel) for group in self._groups for panel in group}
        others = [[panel] for panel in visible if id(panel) not in grouped]
        for group in [*self._groups, *others]:
            if group[0].get_yscale() == "linear":
                _shorten_numbers(group)
        write_corner(self.figure, source, rate, seconds)
        return self.figure


def share_time_axis(panels: Sequence[Axes], first: float, last: float, unit: str) -> None:
    """Give panels one time axis, with numbers below the last panel only."""
    for panel in panels:
        panel.set_xlim(first, last if last > first else first + 1.0)
    for panel in panels[:-1]:
        panel.tick_params(bottom=False, labelbottom=False)
    panels[-1].set_xlabel(f"time [{unit}]")


def write_head(panel: Axes, text: str) -> None:
    """Write the title of a panel above it."""
    # Without y, matplotlib lays out all ticks to find it: a quarter of the drawing time.
    panel.set_title(text, loc="left", size=FONT_PT, pad=2.2, y=1.0)


def _shorten_numbers(panels: Sequence[Axes]) -> None:
    """Write the common power of ten above the panels, and the median if it is large.

    Matplotlib would write the power of ten over other letters.
    """
    limits = [panel.get_ylim() for panel in panels]
    span = max(high - low for low, high in limits)
    largest = max(abs(bound) for pair in limits for bound in pair)
    has_offset = span < _COMMON_OFFSET_RATIO * largest
    largest = span if has_offset else largest
    power = 0
    if not _MIN_PLAIN <= largest < _MAX_PLAIN:
        power = 3 * math.floor(math.log10(largest) / 3.0)
    if power == 0 and not has_offset:
        return
    digits = 2 - math.floor(math.log10(span))
    for panel in panels:
        offset = round(_median_of(panel), digits) if has_offset else 0.0
        _write_shortened(panel, offset, power)


def _median_of(panel: Axes) -> float:
    """Return the median of a panel's first curve, or the middle of its scale without a curve."""
    low, high = panel.get_ylim()
    for line in panel.get_lines():
        values = np.asarray(line.get_ydata(), dtype=np.float64)
        inside = values[(values >= low) & (values <= high)]
        if inside.size > 1:
            return float(np.median(inside))
    return 0.5 * (low + high)


def _write_shortened(panel: Axes, offset: float, power: int) -> None:
    from matplotlib.ticker import FixedLocator, Formatter, FuncFormatter, MaxNLocator

    unit = 10.0**power

    def shortened(value: float, _: int) -> str:
        # Round, so that a zero has neither a rounding error nor a minus sign.
        return Formatter.fix_minus(f"{round((value - offset) / unit, 6) + 0.0:.6g}")

    text = panel.get_title(loc="left")
    if offset:
        low, high = panel.get_ylim()
        ticks = MaxNLocator(5, steps=(1, 2, 5, 10)).tick_values(low - offset, high - offset)
        panel.yaxis.set_major_locator(
            FixedLocator([t + offset for t in ticks if low <= t + offset <= high])
        )
        text = text.replace(" [", f", from its median {Formatter.fix_minus(f'{offset:.12g}')} [", 1)
    panel.yaxis.set_major_formatter(FuncFormatter(shortened))
    if power:
        text = text.replace("[", f"[10{str(power).translate(_SUPERSCRIPTS)} ", 1).replace(" ]", "]")
    write_head(panel, text)


def write_names(panel: Axes, columns: int = 4) -> None:
    """Write the names of a panel's lines above its right half."""
    panel.legend(
        loc="lower right",
        bbox_to_anchor=(1.005, 1.0),
        ncols=columns,
        fontsize=SMALL_FONT_PT,
        frameon=False,
        borderpad=0.15,
        borderaxespad=0.0,
        handlelength=1.1,
        columnspacing=0.9,
        handletextpad=0.35,
    )


def draw_band(panel: Axes, times: Floats, band: Band, colour: str, name: str) -> None:
    """Draw a series as a band, with its median as a line."""
    panel.fill_between(times, band.low, band.high, color=colour, alpha=0.35, lw=0.0)
    panel.plot(times, band.median, color=colour, lw=0.6, label=name)


def draw_with_sigma(
    panel: Axes, times: Floats, values: Floats, sigma: Floats, colour: str, name: str
) -> None:
    """Draw a series with plus and minus two standard deviations."""
    half = BAND_SIGMAS * sigma
    panel.fill_between(times, values - half, values + half, color=colour, alpha=0.22, lw=0.0)
    panel.plot(times, values, color=colour, lw=0.7, label=name)


def shade(
    panel: Axes, begins: Floats, ends: Floats, colour: str = GREY, alpha: float = 0.8
) -> None:
    """Shade time spans of a panel, behind all curves."""
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


def find_spans(mask: Booleans, columns: int = MAX_COLUMNS) -> tuple[Floats, Floats]:
    """Return start and end of each run of True, in samples; each is wide enough to be visible."""
    if not mask.any():
        return np.empty(0), np.empty(0)
    starts = split_into_parts(mask.size, columns)
    edges = np.append(starts, mask.size).astype(np.float64)
    begins, ends = edges[runs(np.logical_or.reduceat(mask, starts))].T
    return begins, ends


def add_margin(low: float, high: float, margin: float = 0.08) -> tuple[float, float]:
    """Return limits with a margin; they are always finite and different."""
    if not (np.isfinite(low) and np.isfinite(high)):
        return -1.0, 1.0
    span = high - low
    if not span > 1e-9 * max(abs(low), abs(high)):
        span = 0.1 * abs(high) or 1.0
    return low - margin * span, high + margin * span
