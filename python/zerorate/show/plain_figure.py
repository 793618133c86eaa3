"""Figure with plain texts: a dollar sign in a name does not start a formula."""

from __future__ import annotations

from matplotlib.backend_bases import RendererBase
from matplotlib.figure import Figure
from matplotlib.text import Text
from matplotlib.ticker import LogFormatter


class PlainFigure(Figure):
    """Figure that draws texts unchanged; only powers of ten on logarithmic axes are formulas."""

    def draw(self, renderer: RendererBase) -> None:
        """Draw the figure; every backend calls this method."""
        for text in self.findobj(Text):
            text.set_parse_math(False)
        for axes in self.axes:
            for axis in (axes.xaxis, axes.yaxis):
                if isinstance(axis.get_major_formatter(), LogFormatter):
                    for tick in (*axis.get_major_ticks(), *axis.get_minor_ticks()):
                        tick.label1.set_parse_math(True)
                        tick.label2.set_parse_math(True)
        super().draw(renderer)
