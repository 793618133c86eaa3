"""Views of two feet: the asymmetry as a table, the tracks as a figure."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from zerorate.numerals import format_significant, format_with_error
from zerorate.show.stack import Stack, write_head, write_names
from zerorate.show.style import BLUE, VERMILION
from zerorate.show.tables import Table, as_text, wrap_prose

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from zerorate.foot.feet import Feet

_STRIDE_LABELS = {
    "stride_length": "length, m",
    "stride_time": "time, s",
    "gait_velocity": "speed, m/s",
    "swing_time": "swing, s",
    "stance_time": "stance, s",
    "max_sensor_lift": "lift, m",
}
_PATH_HEIGHT_MM = 70.0
_MAX_POINTS = 4000


def format_feet(feet: Feet) -> str:
    """Return the differences between both feet as text."""
    summary = wrap_prose(
        f"Two feet: {feet.left.distance:.1f} m left, {feet.right.distance:.1f} m right; "
        f"{feet.bound_count} times at the bound of {feet.distance:g} m between them"
    )
    rows = tuple(
        (
            _STRIDE_LABELS[name],
            format_significant(asymmetry.left),
            format_significant(asymmetry.right),
            format_with_error(asymmetry.percent, asymmetry.percent_sigma),
        )
        for name, asymmetry in feet.asymmetry().items()
    )
    note = "Asymmetry: left minus right, over the mean of both."
    head = ("", "left", "right", "asymmetry, % ± σ")
    return "\n\n".join((summary, as_text(Table("Strides, means", head, rows, note=note))))


def plot_feet(feet: Feet) -> Figure:
    """Return the figure of both tracks, as wide as a page column."""
    caption = f"Dots: stances. {feet.bound_count} times at the bound of {feet.distance:g} m."
    answer = f"{feet.left.distance:.1f} m left, {feet.right.distance:.1f} m right."
    stack = Stack("Where did both feet walk?", answer, caption, [_PATH_HEIGHT_MM], 6.5)
    axes = stack.add()
    axes.set_xlabel("left to right [m]")
    write_head(axes, "ahead [m]")
    for name, track, colour in (("left", feet.left, BLUE), ("right", feet.right, VERMILION)):
        rows = np.unique(np.linspace(0, track.n - 1, min(track.n, _MAX_POINTS)).astype(int))
        ahead, right = track.position[:, 0], -track.position[:, 1]
        axes.plot(right[rows], ahead[rows], color=colour, linewidth=0.6, label=name)
        axes.plot(right[track.lowest], ahead[track.lowest], ".", color=colour, ms=2.0, mew=0.0)
    axes.set_aspect("equal", adjustable="datalim")
    write_names(axes, 2)
    span = float(np.ptp(feet.left.time))
    return stack.finish(feet.left.source, (feet.left.n - 1) / span, span)
