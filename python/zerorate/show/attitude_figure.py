"""Figure of an attitude: angles, standard deviations, and gyro errors."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final, TypeAlias

import numpy as np

from zerorate.attitude.events import KINDS, event_mask
from zerorate.geometry.rotations import inverse, product, unit
from zerorate.numerals import shorten
from zerorate.show.attitude_table import attitude_title
from zerorate.show.scales import MAX_COLUMNS, column_quantiles, split_into_parts
from zerorate.show.stack import (
    BAND_SIGMAS,
    Stack,
    add_margin,
    draw_band,
    draw_with_sigma,
    find_spans,
    shade,
    share_time_axis,
    write_head,
    write_names,
)
from zerorate.show.style import (
    AXIS_COLOURS,
    BLACK,
    BLUE,
    GREY,
    ORANGE,
    ROSE,
    SMALL_FONT_PT,
    VERMILION,
    time_unit,
)

if TYPE_CHECKING:
    from collections.abc import Callable

    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from zerorate.attitude.estimate import AttitudeEstimate
    from zerorate.types import Booleans, Floats, Integers

# Sizes in mm.
_ANGLES_HEIGHT_MM, _PANEL_HEIGHT_MM, _EVENT_HEIGHT_MM = 22.0, 16.0, 2.6
_NAMES: Final = ("x", "y", "z")
_Elements: TypeAlias = tuple[tuple[int, int], ...]
_SCALE_ELEMENTS: Final[_Elements] = ((0, 0), (1, 1), (2, 2))
_CROSS_ELEMENTS: Final[_Elements] = ((0, 1), (0, 2), (1, 2), (1, 0), (2, 0), (2, 1))
_LINE_STYLES: Final = ("-", "--", ":")
_QUESTION: Final = "Which way does it point, and how certain is that?"
_WRAP_STEP_DEG: Final = 300.0
"""Smallest step between neighbours that counts as a wrap of the angle, deg."""
_MIN_MARK_SHARE: Final = 0.006
"""Smallest visible width of a mark, as a share of the time axis."""


def plot_attitude(estimate: AttitudeEstimate) -> Figure:
    """Return the figure of an attitude, as wide as a page column.

    The panels have one time axis:

    - Euler angles
    - ±2 σ of heading and of inclination, and their errors if there is a reference
    - bias and, if known, scale error of the gyro
    - significant elements of the gyro's misalignment
    - events of the filter, a row for each kind

    Rest is grey, and a disturbed field is rose.
    """
    panels: list[Callable[[Axes, _Course], None]] = [_draw_angles]
    course = _Course(estimate)
    if estimate.reference is not None or course.has_sigmas:
        panels += [_draw_heading, _draw_inclination]
    if np.isfinite(estimate.bias_sigma[-1]).all():
        panels.append(_draw_bias)
    if np.isfinite(estimate.gyro_matrix_sigma).all():
        panels += [_draw_scale, *([_draw_misalignment] if _significant_elements(estimate) else [])]
    heights = [_ANGLES_HEIGHT_MM, *[_PANEL_HEIGHT_MM] * (len(panels) - 1)]
    if count := len(course.events):
        panels.append(_draw_events)
        heights.append(_EVENT_HEIGHT_MM * count)
    stack = Stack(_QUESTION, _describe_end(course), _make_caption(estimate), heights)
    for draw in panels:
        panel = stack.add()
        _shade_states(panel, course)
        draw(panel, course)
    share_time_axis(stack.panels, course.times[0], course.times[-1], course.unit)
    figure = stack.finish(estimate.source, estimate.rate, estimate.n / estimate.rate)
    stack.panels[0].set_yticks([-180.0, -90.0, 0.0, 90.0, 180.0])
    if names := [name for name, _ in course.events]:
        stack.panels[-1].set_yticks(range(len(names)), names[::-1])
        stack.panels[-1].tick_params(axis="y", length=0.0, pad=1.0, labelsize=SMALL_FONT_PT)
    return figure


class _Course:
    """Sparse times of an estimate for all panels, in the unit of the time axis.

    Parameters
    ----------
    estimate : AttitudeEstimate
        Estimate of the figure.
    """

    def __init__(self, estimate: AttitudeEstimate) -> None:
        self.estimate = estimate
        self.unit, length = time_unit(estimate.n / estimate.rate)
        self.times: Floats = (estimate.time - estimate.time[0]) / length
        self.rows: Integers = split_into_parts(estimate.n, MAX_COLUMNS)
        self.errors = _reference_errors(estimate)
        masks = [(kind, event_mask(estimate.events, kind.event)) for kind in KINDS]
        self.events = tuple((kind.name, mask) for kind, mask in masks if mask.any())

    @property
    def has_sigmas(self) -> bool:
        """True if the method estimates standard deviations of its angles."""
        return bool(np.isfinite(self.estimate.heading_sigma).all())

    def at(self, indices: Floats) -> Floats:
        """Return the times at sample indices, which may be half numbers."""
        return np.interp(indices, np.arange(self.times.size), self.times)


def _describe_end(course: _Course) -> str:
    """Return the orientation at the end, with its standard deviations if known."""
    estimate = course.estimate
    roll, pitch, yaw = np.degrees(estimate.euler[-1])
    tilt, heading = np.degrees((estimate.tilt_sigma[-1], estimate.heading_sigma[-1]))
    known = f" ± {shorten(BAND_SIGMAS * heading)}" if course.has_sigmas else ""
    level = f" ± {shorten(BAND_SIGMAS * tilt)}" if course.has_sigmas else ""
    sentence = (
        f"At the end: yaw {yaw:.1f}{known}, pitch {pitch:.1f}{level}, roll {roll:.1f}{level} deg."
    )
    if not np.isfinite(course.errors).any():
        return sentence
    squares = np.nanmean(course.errors**2, axis=0)
    heading, tilt = np.sqrt((squares[0], squares[1] + squares[2]))
    return f"{sentence} Off by {shorten(heading)} in heading, {shorten(tilt)} in inclination (RMS)."


def _make_caption(estimate: AttitudeEstimate) -> str:
    method = attitude_title(estimate).rpartition(": ")[2]
    sentences = [f"{method[0].upper()}{method[1:]}. Bands: ± 2σ."]
    if estimate.at_rest.any():
        sentences.append("Grey: at rest.")
    if estimate.mag and estimate.disturbed.any():
        sentences.append("Rose: disturbed magnetic field, not used.")
    if not estimate.mag:
        sentences.append("Without a magnetometer the heading is relative to the start.")
    if np.isfinite(estimate.gyro_matrix_sigma).all() and not _significant_elements(estimate):
        sentences.append("No misalignment of the gyro is significant.")
    if estimate.reference is not None:
        sentences.append("Errors: relative to the recording's reference.")
    return " ".join(sentences)


def _shade_states(panel: Axes, course: _Course) -> None:
    estimate = course.estimate
    _shade_where(panel, course, estimate.at_rest, GREY)
    if estimate.mag:
        _shade_where(panel, course, estimate.disturbed, ROSE)


def _shade_where(panel: Axes, course: _Course, mask: Booleans, colour: str) -> None:
    begins, ends = find_spans(mask)
    shade(panel, course.at(begins), course.at(ends), colour)


def _draw_events(panel: Axes, course: _Course) -> None:
    """Draw a row of marks for each kind of event; the first kind is on top."""
    shortest = _MIN_MARK_SHARE * (course.times[-1] - course.times[0])
    for row, (_, mask) in enumerate(reversed(course.events)):
        begins, ends = (course.at(edges) for edges in find_spans(mask))
        half = np.maximum(shortest - (ends - begins), 0.0) / 2.0
        marks = list(zip(begins - half, ends - begins + 2.0 * half, strict=True))
        panel.broken_barh(marks, (row - 0.32, 0.64), color=BLUE, lw=0.0)
    panel.set_ylim(-0.5, len(course.events) - 0.5)
    write_head(panel, "events")


def _draw_angles(panel: Axes, course: _Course) -> None:
    angles = np.degrees(course.estimate.euler)
    for values, name, colour in zip(angles.T, ("roll", "pitch", "yaw"), AXIS_COLOURS, strict=True):
        # Unwrap first: the median over a jump from 180 to -180 would be meaningless.
        quantiles = column_quantiles(np.unwrap(values, period=360.0))
        turns = 360.0 * np.round(quantiles.median / 360.0)
        low, median, high = (
            curve - turns for curve in (quantiles.low, quantiles.median, quantiles.high)
        )
        broken = np.abs(np.diff(median, append=median[-1:])) > _WRAP_STEP_DEG
        median = np.where(broken, np.nan, median)
        draw_band(
            panel,
            course.at(quantiles.middle),
            quantiles._replace(low=low, median=median, high=high),
            colour,
            name,
        )
    panel.set_ylim(-190.0, 190.0)
    write_head(panel, "angle [deg]")
    write_names(panel, 3)


def _draw_heading(panel: Axes, course: _Course) -> None:
    errors = course.errors[:, :1]
    _draw_uncertainty(panel, course, course.estimate.heading_sigma, errors, ("error",))
    write_head(panel, "error of heading [deg]" if errors.size else "σ of heading [deg]")


def _draw_inclination(panel: Axes, course: _Course) -> None:
    errors = course.errors[:, 1:]
    _draw_uncertainty(panel, course, course.estimate.tilt_sigma, errors, ("about x", "about y"))
    write_head(panel, "error of inclination [deg]" if errors.size else "σ of inclination [deg]")


def _reference_errors(estimate: AttitudeEstimate) -> Floats:
    """Return the errors of heading and of inclination about two level axes, deg, (n, 3) or (0, 3).

    Without a magnetometer the heading error starts at zero.
    """
    if estimate.reference is None:
        return np.empty((0, 3))
    return np.degrees(
        signed_errors(estimate.quaternion, estimate.reference, relative=not estimate.mag)
    )


def _draw_uncertainty(
    panel: Axes, course: _Course, sigma: Floats, errors: Floats, error_names: tuple[str, ...]
) -> None:
    """Draw plus and minus two standard deviations, and the errors."""
    times, largest = course.times[course.rows], 0.0
    if course.has_sigmas:
        half = BAND_SIGMAS * np.degrees(sigma[course.rows])
        panel.fill_between(times, -half, half, color=ORANGE, alpha=0.35, lw=0.0, label="± 2σ")
        largest = float(np.median(half))
    panel.axhline(0.0, color=BLACK, lw=0.3)
    curves = errors.T if errors.size else ()
    for values, name, colour in zip(curves, error_names, (BLUE, VERMILION), strict=False):
        quantiles = column_quantiles(values)
        draw_band(panel, course.at(quantiles.middle), quantiles, colour, name)
        extremes = np.concatenate((quantiles.low, quantiles.high))
        if np.isfinite(extremes).any():
            largest = max(largest, float(np.nanquantile(np.abs(extremes), 0.99)))
    panel.set_ylim(-1.3 * (largest or 1.0), 1.3 * (largest or 1.0))
    write_names(panel, 3)


def heading_and_tilt_errors(
    quaternions: Floats, reference: Floats, *, relative: bool = False
) -> tuple[Floats, Floats]:
    """Return the signed heading error and the inclination error, shape (n,), rad.

    Both are NaN if the reference is NaN. A relative heading starts with zero error.
    """
    errors = signed_errors(quaternions, reference, relative=relative)
    tilt: Floats = np.hypot(errors[:, 1], errors[:, 2])
    return errors[:, 0], tilt


def signed_errors(quaternions: Floats, reference: Floats, *, relative: bool = False) -> Floats:
    """Return the errors of heading and of inclination about two level axes, shape (n, 3), rad.

    The error is a rotation about the vertical, followed by a rotation about a level axis. The last
    two columns are the components of the second rotation along the earth's x and y. All are NaN if
    the reference is NaN. A relative heading starts with zero error.
    """
    error = product(unit(quaternions), inverse(unit(reference)))
    w, x, y, z = error.T
    heading = 2.0 * np.arctan2(z, w)
    vertical = np.hypot(w, z)
    tilt = 2.0 * np.arctan2(np.hypot(x, y), vertical)
    # Level axis, before the rotation about the vertical.
    level = np.stack((w * x - y * z, w * y + x * z), axis=1)
    size = np.linalg.norm(level, axis=1)
    with np.errstate(divide="ignore", invalid="ignore"):
        level = np.where(size[:, np.newaxis] > 0.0, level / size[:, np.newaxis], 0.0)
    finite = np.flatnonzero(np.isfinite(heading))
    if relative and finite.size:
        heading = heading - heading[finite[0]]
    wrapped = np.remainder(heading + np.pi, 2.0 * np.pi) - np.pi
    return np.column_stack((wrapped, tilt[:, np.newaxis] * level))


def _draw_bias(panel: Axes, course: _Course) -> None:
    few = course.rows
    bias = np.degrees(course.estimate.bias[few])
    sigma = np.degrees(course.estimate.bias_sigma[few])
    for i, name in enumerate(_NAMES):
        draw_with_sigma(panel, course.times[few], bias[:, i], sigma[:, i], AXIS_COLOURS[i], name)
    _fit_scale(panel, bias, sigma)
    write_head(panel, "gyro's bias [deg/s]")
    write_names(panel, 3)


def _draw_scale(panel: Axes, course: _Course) -> None:
    _draw_elements(panel, course, _SCALE_ELEMENTS, drawn=_SCALE_ELEMENTS)
    write_head(panel, "correction of the gyro's scale [%]")
    write_names(panel, 4)


def _draw_misalignment(panel: Axes, course: _Course) -> None:
    """Draw the elements that are significant at the end; all six would overlap."""
    _draw_elements(panel, course, _CROSS_ELEMENTS, _significant_elements(course.estimate))
    write_head(panel, "misalignment [%]")
    write_names(panel, 7)


def _significant_elements(estimate: AttitudeEstimate) -> _Elements:
    """Return the off-diagonal elements that are significant at the end."""
    sizes = np.abs(estimate.gyro_matrix) / estimate.gyro_matrix_sigma
    return tuple(at for at in _CROSS_ELEMENTS if sizes[at] > BAND_SIGMAS)


def _draw_elements(panel: Axes, course: _Course, elements: _Elements, drawn: _Elements) -> None:
    """Draw elements of M - 1, and plus and minus the largest standard deviation."""
    estimate = course.estimate
    times = course.times[estimate.moments]
    error = 100.0 * (estimate.gyro_matrices - np.eye(3))
    rows, columns = np.array(elements).T
    half = BAND_SIGMAS * 100.0 * estimate.gyro_matrix_sigmas[:, rows, columns].max(axis=1)
    panel.fill_between(times, -half, half, color=ORANGE, alpha=0.35, lw=0.0, label="± 2σ")
    for row, column in drawn:
        name = _NAMES[row] + (_NAMES[column] if row != column else "")
        style = "-" if row == column else _LINE_STYLES[column]
        panel.plot(times, error[:, row, column], style, color=AXIS_COLOURS[row], lw=0.8, label=name)
    _fit_scale(panel, error[:, rows, columns], half[:, np.newaxis] / BAND_SIGMAS)


def _fit_scale(panel: Axes, values: Floats, sigmas: Floats) -> None:
    """Scale a panel to the estimates after the first tenth of the record."""
    late = slice(len(values) // 10, None)
    low = float(np.nanmin((values - BAND_SIGMAS * sigmas)[late]))
    high = float(np.nanmax((values + BAND_SIGMAS * sigmas)[late]))
    panel.set_ylim(*add_margin(low, high))
