"""Figure of a calibration: its data, its improvement, and its errors."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np

from zerorate.numerals import shorten
from zerorate.show.calibration_panels import (
    draw_deviations,
    draw_log,
    draw_norm,
    draw_parameter_errors,
    draw_poses,
    draw_turn_error,
    name_elements,
    name_groups,
)
from zerorate.show.calibration_table import describe_verdict
from zerorate.show.stack import INNER_WIDTH_MM, LEFT_MM, Stack, share_time_axis
from zerorate.show.style import GREY_TEXT, VERMILION_TEXT, style_decades, time_unit

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from zerorate.calibration.calibration import Calibration
    from zerorate.record import Recording

# Sizes in mm.
_LOG, _POSES, _SIZES, _PARAMETERS, _KNOWN = 15.0, 38.0, 19.0, 22.0, 17.0
_UNDER, _TICKS, _BETWEEN = 6.5, 2.8, 9.0
_NO_HEAD_MM: Final = 3.0
_QUESTION: Final = "How far off are the sensors, before and after?"


def plot_calibration(
    calibration: Calibration, recording: Recording | None = None, everything: bool = False
) -> Figure:
    """Return the figure of a calibration, as wide as a page column.

    It has these panels:

    - raw accelerometer log with the rests
    - poses on the sphere, with gaps shaded
    - error of gravity at each rest and after each rotation, before and after the calibration
    - scale error and misalignment with their standard errors
    - information of the record about each parameter

    `recording`: the calibrated recording. Its log and its rests become the top panel. `everything`:
    also show the raw log of the gyro.
    """
    kinds = ("accel", "gyro") if everything else ("accel",)
    logs = [] if recording is None else [recording[kind] for kind in kinds if kind in recording]
    heights = [*[_LOG] * len(logs), _POSES, _SIZES, _PARAMETERS, _KNOWN]
    between = (2.0 if logs else 1.0) * _UNDER + _TICKS - _NO_HEAD_MM
    stack = Stack(
        _QUESTION,
        _describe_result(calibration),
        _make_caption(bool(logs)),
        heights,
        between,
        GREY_TEXT if calibration.valid else VERMILION_TEXT,
    )
    if logs:
        for log in logs:
            draw_log(stack.add(), calibration, log)
        unit, seconds = time_unit(logs[0].duration)
        first = logs[0].time[0]
        share_time_axis(stack.panels, first / seconds, (first + logs[0].duration) / seconds, unit)
        stack.skip(_UNDER)
    # The panel of poses has its names inside, so it needs no heading.
    stack.skip(-_NO_HEAD_MM)
    draw_poses(stack.add(), calibration)
    half = 0.5 * (INNER_WIDTH_MM - _BETWEEN)
    sizes = stack.add(LEFT_MM, half, last=False), stack.add(LEFT_MM + half + _BETWEEN, half)
    draw_norm(sizes[0], calibration)
    draw_turn_error(sizes[1], calibration)
    stack.skip(_UNDER)
    deviations = stack.add()
    draw_deviations(deviations, calibration)
    stack.skip(_TICKS)
    known = stack.add()
    draw_parameter_errors(known, calibration)
    source = calibration.origin.source or ("calibration" if recording is None else recording.source)
    span = logs[0].duration if logs else 0.0
    figure = stack.finish(source, calibration.rate, span)
    for axes in (*sizes, known):
        if axes.get_yscale() == "log":
            style_decades(axes)
    name_elements(deviations)
    name_groups(known)
    return figure


def _describe_result(calibration: Calibration) -> str:
    """Return the verdict on validity, and the errors of gravity before and after."""
    before, after = 1e3 * calibration.norm_error_raw, 1e3 * calibration.norm_error
    sentence = describe_verdict(calibration)
    sentence = f"{sentence[0].upper()}{sentence[1:]}"
    if not (np.isfinite(before) and np.isfinite(after)):
        return f"{sentence}."
    return (
        f"{sentence}: gravity at rest within {shorten(before, 3)} mg before, "
        f"{shorten(after, 3)} mg after (RMS)."
    )


def _make_caption(with_log: bool) -> str:
    sentence = (
        "Orange: before, blue: after. Poses: direction of the body that was up; rose: more than "
        "40° from all used poses. Hollow: not used, or not identifiable. Bars: ± 2σ. Parameters "
        "above the dashed line are not identifiable."
    )
    if not with_log:
        return sentence
    return f"Above: the middle 90 % of the samples in each column; light blue: rests. {sentence}"
