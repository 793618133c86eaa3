"""Scales that panels side by side share."""

from collections.abc import Iterable
from typing import TYPE_CHECKING, Any

import numpy as np

from zerorate.show.plotting.envelope import limits

if TYPE_CHECKING:
    from matplotlib.axes import Axes

Panels = np.ndarray[Any, np.dtype[np.object_]]

__all__ = ["share_decades", "share_heights", "share_limits"]


def share_limits(row: Iterable["Axes"]) -> None:
    """Give panels the limits that hold those of each in which something is drawn."""
    panels = list(row)
    drawn = [axes.get_ylim() for axes in panels if _is_drawn(axes)]
    if drawn:
        lows, highs = zip(*drawn, strict=True)
        for axes in panels:
            axes.set_ylim(min(lows), max(highs))


def share_heights(row: Panels) -> None:
    """Give panels the same limits, from all of their lines but for the first leaps."""
    start = 2.0 * row[0].get_xlim()[0]
    drawn = [
        np.where(line.get_xdata() > start, line.get_ydata(), np.nan)
        for axes in row
        for line in axes.lines
        if not line.get_label().startswith("_")
    ]
    low, high = limits(np.concatenate(drawn), 0.1, 0.35)
    for axes in row:
        axes.set_ylim(low, high)
    for axes in row[1:]:
        axes.tick_params(labelleft=False)


def share_decades(row: Panels) -> None:
    """Give logarithmic panels the same limits, with room for a legend below the lines."""
    drawn = np.concatenate([line.get_ydata() for axes in row for line in axes.lines])
    drawn = drawn[np.isfinite(drawn)]
    least, most = (drawn.min(), drawn.max()) if drawn.size else (1.0, 1.0)
    room = max(most / least, 10.0) ** 0.15
    for axes in row:
        axes.set_ylim(least / room**1.5, most * room)
    for axes in row[1:]:
        axes.tick_params(labelleft=False)


def _is_drawn(axes: "Axes") -> bool:
    return any(np.isfinite(np.asarray(line.get_ydata())).any() for line in axes.lines)
