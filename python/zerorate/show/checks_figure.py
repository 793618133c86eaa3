"""Figure of a check: when each sensor is confirmed, and when it is wrong."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from zerorate.show.style import (
    BLUE,
    FONT_PT,
    GREY_TEXT,
    VERMILION,
    add_panel,
    new_figure,
    style_panels,
    write_caption,
    write_title,
)

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from zerorate.checks.result import Checks

# Sizes in mm.
_WIDTH, _HEIGHT = 120.0, 42.0
_ROWS: Final = ("magnetometer", "gyro")


def plot_checks(checks: Checks) -> Figure:
    """Return a figure with a bar for each span in which a sensor is confirmed or wrong."""
    figure = new_figure(_WIDTH, _HEIGHT)
    axes = add_panel(figure, 0.2 * _WIDTH, 0.34 * _HEIGHT, 0.76 * _WIDTH, 0.46 * _HEIGHT)
    for row, finding in enumerate((checks.magnetometer, checks.gyro)):
        bars = [(begin, end - begin) for begin, end in finding.spans]
        axes.broken_barh(bars, (row - 0.3, 0.6), color=VERMILION if finding.alarm else BLUE)
        position, frame = (0.01, row + 0.38), axes.get_yaxis_transform()
        axes.text(*position, finding.status, transform=frame, color=GREY_TEXT, size=FONT_PT)
    axes.set_ylim(-0.5, 1.7)
    axes.set_xlabel("time [s]")
    style_panels([axes])
    axes.set_yticks(range(2), _ROWS)
    write_title(figure, f"What does motion show of {checks.source}?")
    write_caption(figure, "Bars: spans with evidence; red: the log's unit or axes are wrong.")
    return figure
