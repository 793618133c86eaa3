"""Where the parts of a figure lie, and whether they can be read."""

import itertools
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.colors import to_hex
from matplotlib.text import Text

from zerorate.show.style import contrast

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

__all__ = ["check_colours", "check_contrast", "check_layout", "distance"]

WHITE = "#ffffff"

APART = 20.0
"""Least distance in CIELAB (CIE 1976) of two lines of a panel; 2.3 is just seen side by side."""

# Machado, Oliveira and Fernandes (2009), table of severity 1, for linear RGB.
SEEN_BY = {
    "everybody": np.eye(3),
    "protanopes": np.array(
        [
            [0.152286, 1.052583, -0.204868],
            [0.114503, 0.786281, 0.099216],
            [-0.003882, -0.048116, 1.051998],
        ]
    ),
    "deuteranopes": np.array(
        [
            [0.367322, 0.860646, -0.227968],
            [0.280085, 0.672501, 0.047413],
            [-0.011820, 0.042940, 0.968881],
        ]
    ),
}
_XYZ = np.array(
    [
        [0.4124564, 0.3575761, 0.1804375],
        [0.2126729, 0.7151522, 0.0721750],
        [0.0193339, 0.1191920, 0.9503041],
    ]
)
"""Of linear sRGB, white at D65."""


def _lab(linear: np.ndarray) -> np.ndarray:
    white = _XYZ.sum(axis=1)
    parts = _XYZ @ np.clip(linear, 0.0, 1.0) / white
    x, y, z = np.where(parts > 216 / 24389, np.cbrt(parts), (24389 / 27 * parts + 16) / 116)
    return np.array([116 * y - 16, 500 * (x - y), 200 * (y - z)])


def distance(one: str, other: str, seen_by: str = "everybody") -> float:
    """Return how far apart two colours ``#rrggbb`` are in CIELAB for these readers."""
    places = []
    for colour in (one, other):
        levels = np.array([int(colour[i : i + 2], 16) / 255 for i in (1, 3, 5)])
        linear = np.where(levels <= 0.04045, levels / 12.92, ((levels + 0.055) / 1.055) ** 2.4)
        places.append(_lab(SEEN_BY[seen_by] @ linear))
    return float(np.linalg.norm(places[0] - places[1]))


def check_colours(figure: "Figure") -> None:
    """Check that named lines of a panel are told apart by all, by their colour or their stroke."""
    for axes in figure.axes:
        named = [line for line in axes.lines if not line.get_label().startswith("_")]
        strokes = {}
        for line in named:
            stroke = (line.get_linestyle(), line.get_marker(), line.get_linewidth() > 1.5)
            strokes.setdefault(stroke, set()).add(to_hex(line.get_color()))
        for colours in strokes.values():
            for pair in itertools.combinations(sorted(colours), 2):
                for readers in SEEN_BY:
                    assert distance(*pair, readers) >= APART, (axes.get_title(), pair, readers)


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
