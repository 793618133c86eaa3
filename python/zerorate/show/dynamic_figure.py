"""Map of a deviation that changes along a record."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np

from zerorate.noise.dynamic import DynamicAllan
from zerorate.noise.kinds import KINDS
from zerorate.noise.quantities import choose_display_unit
from zerorate.show.style import (
    FONT_PT,
    add_colour_bar,
    add_panel,
    new_figure,
    style_decades,
    style_panels,
    time_unit,
    write_caption,
)

if TYPE_CHECKING:
    import numpy.typing as npt
    from matplotlib.figure import Figure

# Sizes in mm.
_WIDTH, _HEIGHT = 125.0, 70.0
_MAP_MM: Final = (15.0, 15.0, 88.0, 52.0)
_BAR_MM: Final = (106.0, 15.0, 3.5, 52.0)


def plot_dynamic(result: DynamicAllan) -> Figure:
    """Return the map of a dynamic deviation: time across, averaging time up, deviation as colour.

    The colours have visually equal steps on a logarithmic scale, and colour-blind readers can
    distinguish them.

    `result`: dynamic deviation. Missing values are grey.
    """
    figure = new_figure(_WIDTH, _HEIGHT)
    axes = add_panel(figure, *_MAP_MM)
    bar = add_colour_bar(axes, figure, *_BAR_MM)
    from matplotlib.colors import LogNorm
    from matplotlib.ticker import MaxNLocator

    shown = choose_display_unit(result)
    unit, seconds = time_unit(result.times[-1] + result.window / 2.0)
    values = np.ma.masked_invalid(shown.factor * result.deviation.T)
    values = np.ma.masked_less_equal(values, 0.0)
    low, high = (float(values.min()), float(values.max())) if values.count() else (0.1, 1.0)
    axes.set_facecolor("0.8")
    mesh = axes.pcolormesh(
        _edges(result.times / seconds),
        np.exp(_edges(np.log(result.taus))),
        values,
        norm=LogNorm(low, high if high > low else 2.0 * low),
        cmap="viridis",
        rasterized=True,
    )
    axes.set_yscale("log")
    axes.set_xlabel(f"middle of the window [{unit}]")
    axes.set_ylabel("averaging time [s]")
    scale = axes.figure.colorbar(mesh, cax=bar)
    scale.set_label(f"{KINDS[result.kind].title} [{shown.unit}]")
    duration = (result.times[-1] + result.window / 2.0) / seconds
    axes.set_xlim(0.0, duration)
    style_panels([axes])
    axes.xaxis.set_major_locator(MaxNLocator(7, steps=(1, 1.5, 2, 3, 5, 6, 10)))
    bar.tick_params(labelsize=FONT_PT - 0.5, width=0.5, length=2.0, pad=1.5)
    bar.yaxis.label.set_fontsize(FONT_PT)
    scale.outline.set_linewidth(0.5)
    style_decades(bar)
    axes.yaxis.set_major_formatter(bar.yaxis.get_major_formatter())
    write_caption(figure, _caption(result))
    return figure


def _caption(result: DynamicAllan) -> str:
    """Return the length of a window, and the reason for grey areas."""
    reasons = ["no window centred there"]
    if not np.all(result.deviation > 0.0):
        reasons.append("no deviation because of gaps or constant samples")
    return f"Window of {result.window:g} s. Grey: {', or '.join(reasons)}."


def _edges(centres: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
    """Return the borders of cells about their centres."""
    half = np.diff(centres) / 2.0 if centres.size > 1 else np.array([0.5])
    inner = centres[:-1] + half[: centres.size - 1]
    edges: npt.NDArray[np.float64] = np.concatenate(
        ([centres[0] - half[0]], inner, [centres[-1] + half[-1]])
    )
    return edges
