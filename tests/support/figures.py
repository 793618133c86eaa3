"""Where the parts of a figure lie."""

import itertools
from collections.abc import Sequence
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

__all__ = ["check_layout"]


def check_layout(figure: "Figure", second_scales: Sequence["Axes"] = ()) -> None:
    """Check that no panel or text lies over another or outside the figure.

    Second scales lie over the panel that they belong to.
    """
    figure.draw_without_rendering()
    boxes = [axes.get_tightbbox() for axes in figure.axes if axes not in second_scales]
    boxes += [part.get_window_extent() for part in (*figure.texts, *figure.legends)]
    for one, other in itertools.combinations(boxes, 2):
        assert not one.overlaps(other)
    for box in (*boxes, *(axes.get_tightbbox() for axes in second_scales)):
        assert min(box.x0, box.y0) >= 0.0
        assert box.x1 <= figure.bbox.x1
        assert box.y1 <= figure.bbox.y1
