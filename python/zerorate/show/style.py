"""Common style of all figures: colours, sizes, ticks, legends, titles, captions, files."""

from __future__ import annotations

import re
from math import ceil, floor, log10
from pathlib import Path
from typing import TYPE_CHECKING, Final, Literal

from zerorate.numerals import shorten
from zerorate.show.given_axes import next_panel
from zerorate.texts import describe_missing_extra

if TYPE_CHECKING:
    from collections.abc import Sequence

    from matplotlib.axes import Axes
    from matplotlib.axis import Axis
    from matplotlib.figure import Figure

Corner = Literal["upper right", "lower left"]

# Colours of Okabe and Ito, which colour-blind readers can distinguish.
BLACK: Final = "#000000"
ORANGE: Final = "#E69F00"
SKY: Final = "#56B4E9"
GREEN: Final = "#009E73"
BLUE: Final = "#0072B2"
VERMILION: Final = "#D55E00"
PURPLE: Final = "#CC79A7"
YELLOW: Final = "#F0E442"
GREY: Final = "#DDDDDD"
ROSE: Final = "#F4CFE0"
BROWN: Final = "#7A4A1E"
"""Further colour, not of Okabe and Ito, dark enough for text."""

# The same hues for text on white, grey or rose, with a contrast of at least 4.5.
ORANGE_TEXT: Final = "#7E5700"
SKY_TEXT: Final = "#2F6482"
GREEN_TEXT: Final = "#006C4F"
BLUE_TEXT: Final = "#00639B"
VERMILION_TEXT: Final = "#9C4500"
PURPLE_TEXT: Final = "#844E6C"
GREY_TEXT: Final = "#404040"

_TEXT_COLOURS: Final = {
    ORANGE: ORANGE_TEXT,
    SKY: SKY_TEXT,
    GREEN: GREEN_TEXT,
    BLUE: BLUE_TEXT,
    VERMILION: VERMILION_TEXT,
    PURPLE: PURPLE_TEXT,
    GREY: GREY_TEXT,
    ROSE: PURPLE_TEXT,
}

AXIS_COLOURS: Final = (BLUE, VERMILION, GREEN)
"""Colours of x, y and z in all figures; readers with colour-blindness can distinguish them."""

AR_COLOURS: Final = (BLUE, SKY, GREEN)
MA_COLOURS: Final = (VERMILION, ORANGE, PURPLE)

INCHES_PER_MM: Final = 1.0 / 25.4
"""Factor from mm to inches."""

COLUMN_WIDTH_MM: Final = 85.0
"""Width of a journal column, mm; figures of this width have letters of the text's size."""

FONT_PT: Final = 6.5
SMALL_FONT_PT: Final = 5.8
"""Size of letters in captions, corners and ticks, points."""

_COLUMN_DPI: Final = 254
WIDE_DPI: Final = 200
"""Resolution of figures across two columns, pixels per inch."""


def time_unit(duration: float) -> tuple[str, float]:
    """Return a readable unit for a time axis of `duration` s, and the unit's length, s."""
    if duration <= 600.0:
        return "s", 1.0
    return ("min", 60.0) if duration <= 4 * 3600.0 else ("h", 3600.0)


def text_colour(colour: str) -> str:
    """Return the text colour for a line of this colour."""
    return _TEXT_COLOURS.get(colour, colour)


def contrast(colour: str, other_colour: str) -> float:
    """Return the contrast of two colours ``#rrggbb``, 1 to 21, as defined by WCAG 2.1."""
    low, high = sorted((_luminance(colour), _luminance(other_colour)))
    return (high + 0.05) / (low + 0.05)


def _luminance(colour: str) -> float:
    levels = (int(colour[i : i + 2], 16) / 255.0 for i in (1, 3, 5))
    linear = [v / 12.92 if v <= 0.04045 else ((v + 0.055) / 1.055) ** 2.4 for v in levels]
    return 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2]


def new_figure(width: float, height: float) -> Figure:
    """Return an empty figure, with sizes in mm, outside matplotlib's global state."""
    try:
        from matplotlib.backends.backend_agg import FigureCanvasAgg

        from zerorate.show.plain_figure import PlainFigure
    except ImportError:
        raise ImportError(describe_missing_extra("matplotlib", "plot")) from None
    dpi = WIDE_DPI if width > 1.2 * COLUMN_WIDTH_MM else _COLUMN_DPI
    figure = PlainFigure(figsize=(width * INCHES_PER_MM, height * INCHES_PER_MM), dpi=dpi)
    FigureCanvasAgg(figure)
    return figure


def add_panel(
    figure: Figure,
    left: float,
    bottom: float,
    width: float,
    height: float,
    sharex: Axes | None = None,
) -> Axes:
    """Return the next panel of a figure, with position and size in mm."""
    rectangle = _place_of(figure, left, bottom, width, height)
    return next_panel(lambda shared: figure.add_axes(rectangle, sharex=sharex if shared else None))


def add_colour_bar(
    axes: Axes, figure: Figure, left: float, bottom: float, width: float, height: float
) -> Axes:
    """Return axes for a panel's colour bar: in its figure, or next to axes of the caller."""
    if axes.figure is not figure:
        return axes.inset_axes((1.03, 0.0, 0.04, 1.0))
    return figure.add_axes(_place_of(figure, left, bottom, width, height))


def _place_of(
    figure: Figure, left: float, bottom: float, width: float, height: float
) -> tuple[float, float, float, float]:
    """Return a rectangle, given in mm, in fractions of the figure."""
    across, up = figure.get_size_inches() / INCHES_PER_MM
    return left / across, bottom / up, width / across, height / up


def _height_fraction(figure: Figure, millimetres: float) -> float:
    """Return a height, given in mm, as a fraction of the figure's height."""
    return float(millimetres * INCHES_PER_MM / figure.get_figheight())


def write_title(figure: Figure, text: str) -> None:
    """Write the title of a figure."""
    figure.text(
        0.5,
        1.0 - _height_fraction(figure, 2.0),
        with_minus_signs(text),
        ha="center",
        va="top",
        size=FONT_PT + 1.5,
    )


def with_minus_signs(text: str) -> str:
    """Return a text with the minus sign of ticks before numbers."""
    return re.sub(r"(?<![\w.)])-(?=\d)", "\N{MINUS SIGN}", text)


def write_caption(figure: Figure, text: str, size: float = FONT_PT - 0.5) -> None:
    """Write the caption below a figure."""
    figure.text(
        0.5,
        _height_fraction(figure, 2.0),
        with_minus_signs(text),
        ha="center",
        va="bottom",
        size=size,
        color=GREY_TEXT,
    )


def write_corner(figure: Figure, source: str, rate: float, seconds: float) -> None:
    """Write a recording's name, rate and length, if known, into the lower right corner."""
    unit, length = time_unit(seconds)
    details = [f"{shorten(rate, 4)} Hz"] if rate > 0.0 else []
    details += [f"{shorten(seconds / length, 4)} {unit}"] if seconds > 0.0 else []
    text = " · ".join([shorten_source(source), *details] if source else details)
    right = 1.0 - 1.5 * INCHES_PER_MM / figure.get_figwidth()
    figure.text(
        right,
        _height_fraction(figure, 1.2),
        text,
        ha="right",
        va="bottom",
        size=SMALL_FONT_PT,
        color=GREY_TEXT,
    )


def shorten_source(source: str, max_letters: int = 44) -> str:
    """Return the last part of a path, shortened in its middle if it is too long."""
    name = Path(source).name or source
    half = max_letters // 2
    return name if len(name) <= max_letters else f"{name[:half]}…{name[-half:]}"


def write_in_middle(axes: Axes, text: str) -> None:
    """Write into a panel the reason why it is empty."""
    axes.text(0.5, 0.5, text, transform=axes.transAxes, ha="center", size=FONT_PT, color=GREY_TEXT)


def write_legend(axes: Axes, corner: Corner, columns: int, sample_length: float = 1.1) -> None:
    """Write a legend into a panel's corner; line samples are `sample_length` letters long."""
    axes.legend(
        loc=corner,
        ncols=columns,
        fontsize=FONT_PT - 0.5,
        frameon=True,
        framealpha=0.85,
        edgecolor="none",
        borderpad=0.1,
        handlelength=sample_length,
        columnspacing=0.8,
        handletextpad=0.4,
        borderaxespad=0.35,
    )


def style_decades(axes: Axes, min_decades: int = 1) -> None:
    """Write powers of ten as plain numbers, and 2 and 5 if the scale has fewer decades."""
    from matplotlib.ticker import FuncFormatter, LogLocator

    formatter = FuncFormatter(lambda value, _: f"{value:g}")
    axes.xaxis.set_major_formatter(formatter)
    axes.yaxis.set_major_formatter(formatter)
    low, high = axes.get_ylim()
    if floor(log10(high)) - ceil(log10(low)) < min_decades:
        axes.yaxis.set_minor_locator(LogLocator(subs=(2.0, 5.0)))
        axes.yaxis.set_minor_formatter(formatter)
        axes.tick_params(axis="y", which="minor", labelsize=FONT_PT - 0.5)


def style_panels(panels: Sequence[Axes]) -> None:
    """Set small lines and letters, and few ticks."""
    for axes in panels:
        axes.tick_params(labelsize=FONT_PT - 0.5, width=0.5, length=2.0, pad=1.5)
        axes.tick_params(which="minor", width=0.3, length=1.2)
        axes.title.set_fontsize(FONT_PT + 0.5)
        for spine in axes.spines.values():
            spine.set_linewidth(0.5)
        for axis in (axes.xaxis, axes.yaxis):
            axis.label.set_fontsize(FONT_PT)
            axis.labelpad = 2.0
            axis.offsetText.set_fontsize(FONT_PT - 1.0)
            _set_ticks(axis, vertical=axis is axes.yaxis)


def _set_ticks(axis: Axis, vertical: bool) -> None:
    """Limit the number of ticks, because each tick takes as long to draw as a curve."""
    from matplotlib.ticker import LogLocator, MaxNLocator, NullFormatter, ScalarFormatter

    if axis.get_scale() == "log":
        axis.set_minor_locator(LogLocator(subs=(2.0, 5.0) if vertical else ()))
        axis.set_minor_formatter(NullFormatter())
        return
    axis.set_major_locator(MaxNLocator(5, steps=(1, 2, 5, 10)))
    formatter = ScalarFormatter()
    formatter.set_powerlimits((-3, 4) if vertical else (-3, 6))
    axis.set_major_formatter(formatter)
