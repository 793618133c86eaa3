"""Figure of a magnetometer calibration: expected heading error by heading."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np

from zerorate.numerals import format_significant
from zerorate.show.stack import Stack, write_head, write_names
from zerorate.show.style import BLUE, GREY, VERMILION, write_in_middle

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from zerorate.calibration.magnetometer import MagnetometerCalibration

_PANEL_HEIGHT_MM: Final = 38.0
_RESIDUAL_HEIGHT_MM: Final = 24.0
_AXIS_HEIGHT_MM: Final = 8.0
"""Height of the axis, mm."""


def plot_magnetometer(result: MagnetometerCalibration) -> Figure:
    """Return a figure of a level sensor's heading error by heading, before and after.

    Of several hard irons, the figure uses the hard iron with the longest duration. The lower panel
    is the residual field of each second. It shows disturbed places and unexplained magnets.
    """
    is_known = result.field.known and result.dip.known
    raw, after = (
        np.degrees(result.heading_error(before, result.longest_applied))
        if is_known
        else np.zeros(36)
        for before in (True, False)
    )
    has_residual = bool(np.isfinite(result.residual).any())
    means = [format_significant(float(np.sqrt(np.mean(errors**2)))) for errors in (raw, after)]
    answer = f"As it was {means[0]} deg"
    answer += f", corrected {means[1]} deg" if result.applied else "; nothing is corrected"
    stack = Stack(
        "How large is the heading error?",
        answer if is_known else "Not identifiable: field or dip are not known.",
        "Expected RMS: from the iron, and from its uncertainty."
        + (
            " Below: field error after the correction; grey: no iron explains it."
            if has_residual
            else ""
        ),
        [_PANEL_HEIGHT_MM, _RESIDUAL_HEIGHT_MM] if has_residual else [_PANEL_HEIGHT_MM],
        _AXIS_HEIGHT_MM if has_residual else 0.0,
    )
    panel = stack.add()
    write_head(panel, "heading error [deg]")
    panel.set_xlabel("heading of a level sensor [deg]")
    panel.set_xlim(0.0, 350.0)
    if is_known:
        angles = 10.0 * np.arange(36)
        panel.plot(angles, raw, color=VERMILION, ls="--", lw=0.9, label="as it was")
        if result.applied:
            panel.plot(angles, after, color=BLUE, lw=0.9, label="corrected")
        panel.set_ylim(0.0, 1.1 * float(raw.max()))
        write_names(panel, 2)
    else:
        write_in_middle(panel, "not identifiable")
    if has_residual:
        stack.skip(_AXIS_HEIGHT_MM)
        _draw_disturbances(stack, result)
    return stack.finish(result.source, 0.0, 0.0)


def _draw_disturbances(stack: Stack, result: MagnetometerCalibration) -> None:
    panel = stack.add()
    write_head(panel, f"field error [{result.unit}]")
    begin = result.spans[0].start
    seconds = begin + 0.5 + np.arange(len(result.residual))
    for span in result.spans:
        if span.kind == "disturbed":
            panel.axvspan(span.start, span.stop, color=GREY, alpha=0.25, lw=0.0)
    panel.plot(seconds, result.residual, color=BLUE, lw=0.9)
    panel.set_xlim(begin, begin + len(result.residual))
    panel.set_ylim(0.0, 1.1 * float(np.nanmax(result.residual)) or 1.0)
    panel.set_xlabel("time [s]")
