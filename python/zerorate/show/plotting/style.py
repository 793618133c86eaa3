"""Colours that colour-blind readers can tell apart (Okabe and Ito), sizes, units of time."""

from math import ceil, floor, log10
from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    from collections.abc import Sequence

    from matplotlib.axes import Axes
    from matplotlib.axis import Axis
    from matplotlib.figure import Figure

__all__ = [
    "AR_COLOURS",
    "BLACK",
    "BLUE",
    "DPI",
    "FONT",
    "GREEN",
    "GREY",
    "MA_COLOURS",
    "MM",
    "ORANGE",
    "PURPLE",
    "SKY",
    "VERMILION",
    "new_figure",
    "style_decades",
    "style_panels",
    "time_unit",
]

BLACK: Final = "#000000"
ORANGE: Final = "#E69F00"
SKY: Final = "#56B4E9"
GREEN: Final = "#009E73"
BLUE: Final = "#0072B2"
VERMILION: Final = "#D55E00"
PURPLE: Final = "#CC79A7"
GREY: Final = "#DDDDDD"

AR_COLOURS: Final = (BLUE, SKY, GREEN)
MA_COLOURS: Final = (VERMILION, ORANGE, PURPLE)

MM: Final = 1.0 / 25.4
"""A millimetre in inches."""

FONT: Final = 6.5
DPI: Final = 200


def time_unit(duration: float) -> tuple[str, float]:
    """Return the unit in which a time axis of so many seconds reads well, and its length in s."""
    if duration <= 600.0:
        return "s", 1.0
    return ("min", 60.0) if duration <= 4 * 3600.0 else ("h", 3600.0)


def new_figure(width: float, height: float) -> "Figure":
    """Return an empty figure of so many millimetres, outside of matplotlib's global state."""
    try:
        from matplotlib.backends.backend_agg import FigureCanvasAgg
        from matplotlib.figure import Figure
    except ImportError:
        raise ImportError("this needs matplotlib: pip install 'zerorate[plot]'") from None
    figure = Figure(figsize=(width * MM, height * MM), dpi=DPI)
    FigureCanvasAgg(figure)
    return figure


def style_decades(axes: "Axes") -> None:
    """Write decades as plain numbers, and 2 and 5 where the scale shows too few of them."""
    from matplotlib.ticker import FuncFormatter, LogLocator

    plain = FuncFormatter(lambda value, _: f"{value:g}")
    axes.xaxis.set_major_formatter(plain)
    axes.yaxis.set_major_formatter(plain)
    low, high = axes.get_ylim()
    if floor(log10(high)) - ceil(log10(low)) < 1:
        axes.yaxis.set_minor_locator(LogLocator(subs=(2.0, 5.0)))
        axes.yaxis.set_minor_formatter(plain)
        axes.tick_params(axis="y", which="minor", labelsize=FONT - 0.5)


def style_panels(panels: "Sequence[Axes]") -> None:
    """Make lines, letters and ticks small and few."""
    for axes in panels:
        axes.tick_params(labelsize=FONT - 0.5, width=0.5, length=2.0, pad=1.5)
        axes.tick_params(which="minor", width=0.3, length=1.2)
        axes.title.set_fontsize(FONT + 0.5)
        for spine in axes.spines.values():
            spine.set_linewidth(0.5)
        for axis in (axes.xaxis, axes.yaxis):
            axis.label.set_fontsize(FONT)
            axis.labelpad = 2.0
            axis.offsetText.set_fontsize(FONT - 1.0)
            _set_ticks(axis, vertical=axis is axes.yaxis)


def _set_ticks(axis: "Axis", vertical: bool) -> None:
    """Keep ticks few: each one costs as much time as a curve."""
    from matplotlib.ticker import LogLocator, MaxNLocator, NullFormatter, ScalarFormatter

    if axis.get_scale() == "log":
        axis.set_minor_locator(LogLocator(subs=(2.0, 5.0) if vertical else ()))
        axis.set_minor_formatter(NullFormatter())
        return
    axis.set_major_locator(MaxNLocator(5, steps=(1, 2, 5, 10)))
    formatter = ScalarFormatter()
    formatter.set_powerlimits((-3, 4) if vertical else (-3, 6))
    axis.set_major_formatter(formatter)
