"""A magnetometer's calibration as a figure: the heading error to expect, by heading."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np

from zerorate.numerals import significant
from zerorate.show.stack import Stack, head, names
from zerorate.show.style import BLUE, VERMILION, write_in_middle

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from zerorate.calibration.magnetometer import MagnetometerCalibration

_TALL: Final = 38.0
"""Millimetres."""


def plot_magnetometer(result: MagnetometerCalibration) -> Figure:
    """Return how far a heading is off, by heading of a level sensor, before and after.

    Of several hard irons that counts which is taken off for longest.
    """
    known = result.field.known
    raw, after = (
        np.degrees(result.heading_error(before, result.taken_off)) if known else np.zeros(36)
        for before in (True, False)
    )
    means = [significant(float(np.sqrt(np.mean(one**2)))) for one in (raw, after)]
    answer = f"As it was {means[0]} deg"
    answer += f", iron taken off {means[1]} deg" if result.applied else "; nothing is taken off"
    stack = Stack(
        "How far is a heading off?",
        answer if known else "The field is not identifiable.",
        "Root mean square to expect: of the iron, and of what is not known of it.",
        [_TALL],
    )
    panel = stack.add()
    head(panel, "heading error [deg]")
    panel.set_xlabel("heading of a level sensor [deg]")
    panel.set_xlim(0.0, 350.0)
    if known:
        angles = 10.0 * np.arange(36)
        panel.plot(angles, raw, color=VERMILION, ls="--", lw=0.9, label="as it was")
        if result.applied:
            panel.plot(angles, after, color=BLUE, lw=0.9, label="iron taken off")
        panel.set_ylim(0.0, 1.1 * float(raw.max()))
        names(panel, 2)
    else:
        write_in_middle(panel, "not identifiable")
    return stack.finish(result.source, 0.0, 0.0)
