"""Where the parts of a figure lie, and whether they can be read."""

import itertools
from collections.abc import Sequence
from typing import TYPE_CHECKING

from matplotlib.colors import to_hex
from matplotlib.text import Text

from zerorate.show.style import contrast

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

__all__ = ["check_contrast", "check_layout"]

WHITE = "#ffffff"


def check_contrast(figure: "Figure") -> None:
    """Check that every text of a figure can be read on white, as WCAG 2.1 asks: 4.5 to 1."""
    texts = [text for text in figure.findobj(Text) if text.get_visible() and text.get_text()]
    assert texts
    pale = {text.get_text() for text in texts if contrast(to_hex(text.get_color()), WHITE) < 4.5}
    assert not pale


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
