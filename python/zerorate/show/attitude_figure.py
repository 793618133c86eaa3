"""The figure of an attitude: angles and their errors, rest, disturbance, what was learned."""

from __future__ import annotations

import textwrap
from typing import TYPE_CHECKING, Final

import numpy as np

from zerorate.geometry.rotations import inverse, product, unit
from zerorate.show.attitude_table import attitude_title
from zerorate.show.style import (
    BLACK,
    BLUE,
    GREEN,
    GREY,
    ORANGE,
    PURPLE,
    ROSE,
    SKY,
    VERMILION,
    add_panel,
    new_figure,
    style_panels,
    time_unit,
    write_caption,
    write_legend,
    write_title,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from zerorate.attitude.estimate import AttitudeEstimate
    from zerorate.types import Booleans, Floats

# Millimetres.
_WIDTH: Final = 180.0
_LEFT, _RIGHT, _TOP, _BOTTOM, _BETWEEN = 15.0, 4.0, 8.0, 14.0, 3.0
_PANEL: Final = 26.0

_MOST: Final = 4000
"""Points of a curve: more than there are pixels."""
_ANGLES: Final = (("roll", VERMILION), ("pitch", GREEN), ("yaw", BLUE))
_AXES: Final = (("x", VERMILION), ("y", GREEN), ("z", BLUE))
_DIAGONAL: Final = (VERMILION, GREEN, BLUE)
_OTHERS: Final = (ORANGE, PURPLE, SKY)


def plot_attitude(estimate: AttitudeEstimate) -> Figure:
    """Return the figure of an attitude, 180 mm wide.

    Parameters
    ----------
    estimate : AttitudeEstimate
        What to show.

    Returns
    -------
    matplotlib.figure.Figure
        Over time: Euler angles with bands of two standard deviations; the standard deviations, and
        the errors of heading and inclination where there is a reference; the gyro's bias; and its
        scale and misalignment. Rest is grey, a disturbed field rose. No global state of matplotlib
        is used.
    """
    panels = [_draw_angles]
    if estimate.reference is not None or _trusted(estimate):
        panels.append(_draw_trust)
    if np.isfinite(estimate.bias_sigma[-1]).all():
        panels.append(_draw_bias)
    if np.isfinite(estimate.gyro_matrix_sigma).all():
        panels.append(draw_matrix)
    height = _TOP + _BOTTOM + len(panels) * _PANEL + (len(panels) - 1) * _BETWEEN
    figure = new_figure(_WIDTH, height)
    column: list[Axes] = []
    for i, draw in enumerate(panels):
        column.append(_panel(figure, height, i))
        draw(column[-1], estimate)
    shown, _ = time_unit(estimate.n / estimate.rate)
    for axes in column[:-1]:
        axes.tick_params(labelbottom=False)
    column[-1].set_xlabel(f"time [{shown}]")
    style_panels(column)
    column[0].set_yticks([-180.0, -90.0, 0.0, 90.0, 180.0])
    figure.align_ylabels(column)
    write_title(figure, attitude_title(estimate))
    write_caption(figure, textwrap.fill(_caption(estimate), 150))
    return figure


def _panel(figure: Figure, height: float, i: int) -> Axes:
    top = height - _TOP - i * (_PANEL + _BETWEEN)
    return add_panel(figure, _LEFT, top - _PANEL, _WIDTH - _LEFT - _RIGHT, _PANEL)


def _caption(estimate: AttitudeEstimate) -> str:
    said = "Bands and dashed lines: two standard deviations. Grey: at rest."
    if estimate.mag and estimate.disturbed.any():
        said += " Rose: the magnetic field is another than the one known, so it is not used."
    if not estimate.mag:
        said += " Without a magnetometer the heading is against the start."
    if estimate.reference is not None:
        said += " Errors are against the recording's reference."
    return said


def thinned(n: int) -> slice:
    """Return so many samples of a long series that a curve of them looks the same."""
    return slice(None, None, max(1, n // _MOST))


def _times(estimate: AttitudeEstimate) -> Floats:
    _, length = time_unit(estimate.n / estimate.rate)
    seconds: Floats = (estimate.time - estimate.time[0]) / length
    return seconds


def shade(axes: Axes, times: Floats, there: Booleans, colour: str) -> None:
    """Shade a panel where something is so."""
    edges = np.flatnonzero(np.diff(there, prepend=False, append=False))
    spans = edges.reshape(-1, 2)
    left = times[spans[:, 0]]
    right = times[np.minimum(spans[:, 1], times.size - 1)]
    axes.broken_barh(
        list(zip(left, right - left, strict=True)),
        (0.0, 1.0),
        transform=axes.get_xaxis_transform(),
        facecolor=colour,
        edgecolor="none",
        alpha=0.7,
        zorder=0,
    )


def _ready(axes: Axes, estimate: AttitudeEstimate) -> Floats:
    """Shade a panel, set its length, and return the times of its curves."""
    times = _times(estimate)
    shade(axes, times, estimate.at_rest, GREY)
    if estimate.mag:
        shade(axes, times, estimate.disturbed, ROSE)
    axes.set_xlim(times[0], times[-1])
    return times


def _draw_angles(axes: Axes, estimate: AttitudeEstimate) -> None:
    times, few = _ready(axes, estimate), thinned(estimate.n)
    angles = np.degrees(estimate.euler)
    sigmas = (estimate.tilt_sigma, estimate.tilt_sigma, estimate.heading_sigma)
    for values, sigma, (name, colour) in zip(angles.T, sigmas, _ANGLES, strict=True):
        x, y, band = times[few], _broken(values[few]), 2.0 * np.degrees(sigma[few])
        axes.fill_between(x, y - band, y + band, color=colour, alpha=0.2, linewidth=0.0)
        axes.plot(x, y, color=colour, linewidth=0.6, label=name)
    axes.set_ylim(-190.0, 190.0)
    axes.set_ylabel("angle [deg]")
    write_legend(axes, "upper right", 3)


def _broken(angles: Floats) -> Floats:
    """Return a curve of angles that does not cross the panel where they wrap."""
    jumps = np.abs(np.diff(angles, append=angles[-1])) > 180.0
    return np.where(jumps, np.nan, angles)


def heading_and_tilt_errors(
    quaternions: Floats, reference: Floats, *, relative: bool = False
) -> tuple[Floats, Floats]:
    """Return the errors of heading, signed, and of inclination, of shape (n,), rad.

    Both are NaN where the reference is; a relative heading begins with no error.
    """
    error = product(unit(quaternions), inverse(unit(reference)))
    w, x, y, z = error.T
    heading = 2.0 * np.arctan2(z, w)
    there = np.flatnonzero(np.isfinite(heading))
    if relative and there.size:
        heading = heading - heading[there[0]]
    wrapped: Floats = np.remainder(heading + np.pi, 2.0 * np.pi) - np.pi
    tilt: Floats = 2.0 * np.arctan2(np.hypot(x, y), np.hypot(w, z))
    return wrapped, tilt


def _trusted(estimate: AttitudeEstimate) -> bool:
    """Return whether the method knows how far its angles are to be trusted."""
    return bool(np.isfinite(estimate.heading_sigma).all())


def _draw_trust(axes: Axes, estimate: AttitudeEstimate) -> None:
    times, few = _ready(axes, estimate), thinned(estimate.n)
    curves = (("heading", estimate.heading_sigma, BLUE), ("tilt", estimate.tilt_sigma, VERMILION))
    for name, sigma, colour in curves if _trusted(estimate) else ():
        band = 2.0 * np.degrees(sigma[few])
        axes.plot(times[few], band, "--", color=colour, linewidth=0.5, label=f"{name}, 2σ")
        if name == "heading":
            axes.plot(times[few], -band, "--", color=colour, linewidth=0.5)
    largest = 2.0 * float(np.degrees(np.median(estimate.heading_sigma)))
    largest = largest if _trusted(estimate) else 0.0
    if estimate.reference is not None:
        heading, tilt = heading_and_tilt_errors(
            estimate.quaternion, estimate.reference, relative=not estimate.mag
        )
        errors = (("heading", heading, BLUE), ("inclination", tilt, VERMILION))
        for name, error, colour in errors:
            values = np.degrees(error[few])
            axes.plot(times[few], values, color=colour, linewidth=0.6, label=f"error of {name}")
            largest = max(largest, float(np.nanpercentile(np.abs(values), 99.0)))
        axes.axhline(0.0, color=BLACK, linewidth=0.3)
    if largest > 0.0:
        axes.set_ylim(-1.6 * largest, 1.9 * largest)
    axes.set_ylabel("error [deg]" if estimate.reference is not None else "±2σ [deg]")
    write_legend(axes, "upper right", 4, 1.6)


def _draw_bias(axes: Axes, estimate: AttitudeEstimate) -> None:
    times, few = _ready(axes, estimate), thinned(estimate.n)
    bias, sigma = np.degrees(estimate.bias[few]), np.degrees(estimate.bias_sigma[few])
    for values, band, (name, colour) in zip(bias.T, 2.0 * sigma.T, _AXES, strict=True):
        axes.fill_between(times[few], values - band, values + band, color=colour, alpha=0.2, lw=0.0)
        axes.plot(times[few], values, color=colour, linewidth=0.6, label=name)
    _fit(axes, bias, sigma)
    axes.set_ylabel("gyro's bias [deg/s]")
    write_legend(axes, "upper right", 3)


def draw_matrix(axes: Axes, estimate: AttitudeEstimate) -> None:
    """Draw how scale and misalignment of the gyro are learned."""
    times = _ready(axes, estimate)[estimate.moments]
    error = 100.0 * (estimate.gyro_matrices - np.eye(3))
    sigma = 100.0 * estimate.gyro_matrix_sigmas
    for i, (name, _) in enumerate(_AXES):
        values, band = error[:, i, i], 2.0 * sigma[:, i, i]
        colour = _DIAGONAL[i]
        axes.plot(times, values, color=colour, linewidth=0.8, label=f"scale {name}")
        for edge in (values - band, values + band):
            axes.plot(times, edge, "--", color=colour, linewidth=0.5)
    for i, (row, column) in enumerate(((0, 1), (0, 2), (1, 2), (1, 0), (2, 0), (2, 1))):
        name = f"{'xyz'[row]}{'xyz'[column]}"
        style = "-" if i < 3 else ":"
        axes.plot(times, error[:, row, column], style, color=_OTHERS[i % 3], lw=0.6, label=name)
    _fit(axes, error.reshape(len(error), 9), sigma.reshape(len(sigma), 9))
    axes.set_ylabel("M - 1 [%]")
    write_legend(axes, "upper right", 9)


def _fit(axes: Axes, values: Floats, sigmas: Floats) -> None:
    """Scale a panel to what is known after the first tenth, with room for its legend."""
    late = slice(len(values) // 10, None)
    low = float(np.nanmin((values - 2.0 * sigmas)[late]))
    high = float(np.nanmax((values + 2.0 * sigmas)[late]))
    room = max(high - low, 1e-9)
    axes.set_ylim(low - 0.05 * room, high + 0.25 * room)
