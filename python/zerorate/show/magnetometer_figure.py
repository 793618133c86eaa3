"""Figure of a magnetometer's calibration: the heading error to expect, and the scatter."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from zerorate.show.style import (
    BLUE,
    VERMILION,
    add_panel,
    new_figure,
    style_panels,
    write_caption,
    write_in_middle,
    write_title,
)

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from zerorate.calibration.magnetometer import MagnetometerCalibration


def plot_magnetometer(result: MagnetometerCalibration) -> Figure:
    """Return the figure: how far a heading is off, by heading of a level sensor."""
    figure = new_figure(85.0, 62.0)
    axes = add_panel(figure, 14.0, 14.0, 67.0, 38.0)
    axes.set_xlabel("heading of a level sensor, deg")
    axes.set_ylabel("error to expect, deg")
    if result.field.known:
        angles = 10.0 * np.arange(36)
        raw = np.degrees(result.heading_error(before=True))
        axes.plot(angles, raw, color=VERMILION, linestyle="--")
        if result.applied:
            axes.plot(angles, np.degrees(result.heading_error()), color=BLUE)
        axes.set_xlim(0.0, 350.0)
        axes.set_ylim(bottom=0.0)
    else:
        write_in_middle(axes, "not identifiable")
    style_panels((axes,))
    write_title(figure, "How far is a heading off?")
    after = "line: as corrected" if result.applied else "nothing is taken off"
    write_caption(figure, f"Dashes: raw samples; {after}. RMS of one sigma.")
    return figure
