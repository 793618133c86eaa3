"""Two feet: their asymmetry as a table, their tracks as a figure."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from zerorate.numerals import significant, with_error
from zerorate.show.stack import Stack, head, names
from zerorate.show.style import BLUE, VERMILION
from zerorate.show.tables import Table, as_text, prose

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from zerorate.foot.feet import Feet

_NAMES = {
    "stride_length": "length, m",
    "stride_time": "time, s",
    "gait_velocity": "speed, m/s",
    "swing_time": "swing, s",
    "stance_time": "stance, s",
    "max_sensor_lift": "lift, m",
}
_PATH = 70.0
_POINTS = 4000


def format_feet(feet: Feet) -> str:
    """Return what differs between both feet as text."""
    said = prose(
        f"Two feet: {feet.left.distance:.1f} m left, {feet.right.distance:.1f} m right; "
        f"{feet.bound_count} times at the bound of {feet.distance:g} m between them"
    )
    rows = tuple(
        (
            _NAMES[name],
            significant(one.left),
            significant(one.right),
            with_error(one.percent, one.percent_sigma),
        )
        for name, one in feet.asymmetry().items()
    )
    note = "Asymmetry: left less right, over the mean of both."
    head = ("", "left", "right", "asymmetry, % ± σ")
    return "\n\n".join((said, as_text(Table("Strides, means", head, rows, note=note))))


def plot_feet(feet: Feet) -> Figure:
    """Return the figure of both tracks, a column of a page wide."""
    said = f"Dots: stances. {feet.bound_count} times at the bound of {feet.distance:g} m."
    answer = f"{feet.left.distance:.1f} m left, {feet.right.distance:.1f} m right."
    stack = Stack("Where did both feet walk?", answer, said, [_PATH], 6.5)
    axes = stack.add()
    axes.set_xlabel("left to right [m]")
    head(axes, "ahead [m]")
    for name, track, colour in (("left", feet.left, BLUE), ("right", feet.right, VERMILION)):
        few = np.unique(np.linspace(0, track.n - 1, min(track.n, _POINTS)).astype(int))
        ahead, aside = track.position[:, 0], -track.position[:, 1]
        axes.plot(aside[few], ahead[few], color=colour, linewidth=0.6, label=name)
        axes.plot(aside[track.lowest], ahead[track.lowest], ".", color=colour, ms=2.0, mew=0.0)
    axes.set_aspect("equal", adjustable="datalim")
    names(axes, 2)
    span = float(np.ptp(feet.left.time))
    return stack.finish(feet.left.source, (feet.left.n - 1) / span, span)
