"""Panels of a figure, drawn into axes of the caller.

A function that draws a figure calls `next_panel` for each panel. While `draw_into` runs, the main
panel and the panels after it are the caller's axes. All other panels are thrown away.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextvars import ContextVar
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Final

import numpy as np

from zerorate.faults import ArgumentError

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


@dataclass
class _Panels:
    """Axes of the caller, the number of panels to skip before them, and the panels added."""

    axes: Sequence[Axes]
    main: int
    added: list[Axes] = field(default_factory=list)

    def add(self, make: Callable[[], Axes]) -> Axes:
        index = len(self.added) - self.main
        self.added.append(self.axes[index] if 0 <= index < len(self.axes) else make())
        return self.added[-1]


_PANELS: Final[ContextVar[_Panels | None]] = ContextVar("panels", default=None)


def next_panel(make: Callable[[bool], Axes]) -> Axes:
    """Return the caller's axes for the next panel of a figure, or axes made by `make`.

    `make` is called with True if the new axes may share the time axis of an earlier panel.
    """
    panels = _PANELS.get()
    return make(True) if panels is None else panels.add(lambda: make(False))


def draw_into(draw: Callable[[], Figure], ax: Axes | Sequence[Axes], main: int) -> Figure:
    """Draw panels of a figure into given axes, and return the figure of these axes.

    Parameters
    ----------
    draw : callable
        Function that draws the figure.
    ax : Axes or sequence of Axes
        Axes for the main panel, or for the main panel and the panels after it.
    main : int
        Index of the main panel in the figure.

    Raises
    ------
    ArgumentError
        If there are more axes than panels.
    """
    panels = _Panels(np.asarray(ax, dtype=object).ravel().tolist(), main)
    token = _PANELS.set(panels)
    try:
        figure = draw()
    finally:
        _PANELS.reset(token)
    count = max(len(panels.added) - main, 0)
    if not 1 <= len(panels.axes) <= count:
        raise ArgumentError("ax", f"must be 1 to {count} axes, got {len(panels.axes)}")
    for axes in panels.axes:
        _finish(axes, figure, panels.added)
    return panels.axes[0].figure.figure


def _finish(axes: Axes, figure: Figure, panels: Sequence[Axes]) -> None:
    """Add to the axes what the figure has outside them: time numbers and names of lines."""
    axes.tick_params(bottom=True, labelbottom=True, left=True, labelleft=True)
    if not axes.get_xlabel():
        axes.set_xlabel(next((one.get_xlabel() for one in panels[::-1] if one.get_xlabel()), ""))
    for legend in figure.legends if axes.get_legend() is None else ():
        names = [text.get_text() for text in legend.get_texts()]
        handles = [handle for handle in legend.legend_handles if handle is not None]
        axes.legend(handles, names, fontsize=legend.get_texts()[0].get_fontsize())
    _scale_texts(axes)


def _scale_texts(axes: Axes) -> None:
    """Scale the letters, so that axis labels have matplotlib's ``font.size``."""
    from matplotlib import rcParams
    from matplotlib.text import Text

    label_size = axes.xaxis.label.get_fontsize()
    scale = rcParams["font.size"] / label_size
    for which in ("major", "minor"):
        size = axes.xaxis.get_tick_params(which).get("labelsize", label_size)
        axes.tick_params(which=which, labelsize=scale * size)
    ticks = {*axes.get_xticklabels(which="both"), *axes.get_yticklabels(which="both")}
    for text in axes.findobj(Text):
        if text not in ticks:
            text.set_fontsize(scale * text.get_fontsize())
            # A dollar sign in a name must not start a formula.
            text.set_parse_math(False)
