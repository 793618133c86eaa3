"""Panels on an attitude filter: learning, a magnet, and errors over the scale error."""

from __future__ import annotations

import textwrap
from collections.abc import Mapping
from typing import TYPE_CHECKING, Final

import numpy as np

from zerorate.show.attitude_figure import heading_and_tilt_errors
from zerorate.show.scales import split_into_parts
from zerorate.show.stack import find_spans, shade
from zerorate.show.style import (
    AXIS_COLOURS,
    BLACK,
    BLUE,
    GREEN,
    GREY,
    ORANGE,
    PURPLE,
    ROSE,
    SKY,
    VERMILION,
    new_figure,
    style_decades,
    style_panels,
    write_caption,
    write_legend,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from zerorate.attitude.estimate import AttitudeEstimate
    from zerorate.types import Booleans, Floats, Integers

__all__ = ["draw_heading_errors", "draw_magnet", "draw_scale_errors", "plot_attitude_study"]

# Sizes in mm.
_WIDTH, _HEIGHT = 180.0, 116.0
_PLACES: Final = {"left": 0.08, "right": 0.985, "top": 0.955, "bottom": 0.15}
_COLOURS: Final = (BLUE, VERMILION, GREEN, BLACK)
_MOST: Final = 4000
"""Largest number of points of a curve; more exceed the pixels."""


def draw_heading_errors(axes: Axes, curves: Mapping[str, AttitudeEstimate]) -> None:
    """Draw the heading errors of estimates relative to their recording's reference, by name."""
    for (name, estimate), colour in zip(curves.items(), _COLOURS, strict=False):
        heading, _ = _errors(estimate)
        few = _few(estimate)
        seconds = estimate.time[few] - estimate.time[0]
        axes.plot(seconds, np.degrees(heading[few]), color=colour, linewidth=0.7, label=name)
        axes.set_xlim(0.0, seconds[-1])
    axes.axhline(0.0, color=BLACK, linewidth=0.3)
    axes.set_xlabel("time [s]")
    axes.set_ylabel("heading error [deg]")
    _make_room(axes)
    write_legend(axes, "lower left", 3)


def _make_room(axes: Axes) -> None:
    """Leave room for a line of a legend at the bottom."""
    low, high = axes.get_ylim()
    axes.set_ylim(low - 0.12 * (high - low), high)


def draw_magnet(axes: Axes, curves: Mapping[str, AttitudeEstimate]) -> None:
    """Draw heading errors, and inclination errors of the first curve, near a magnet."""
    first = next(iter(curves.values()))
    seconds = first.time - first.time[0]
    _shade(axes, seconds, first.disturbed, ROSE)
    few = _few(first)
    for (name, estimate), colour in zip(curves.items(), (BLUE, GREEN), strict=False):
        heading = np.degrees(_errors(estimate)[0][few])
        label = f"heading, {name}"
        axes.plot(seconds[few], heading, color=colour, linewidth=0.7, label=label)
    inclination = np.degrees(_errors(first)[1][few])
    axes.plot(seconds[few], inclination, color=VERMILION, linewidth=0.7, label="inclination")
    axes.axhline(0.0, color=BLACK, linewidth=0.3)
    axes.set_xlim(0.0, seconds[-1])
    axes.set_xlabel("time [s]")
    axes.set_ylabel("error [deg]")
    write_legend(axes, "lower left", 1)


def _few(estimate: AttitudeEstimate) -> Integers:
    return split_into_parts(estimate.n, _MOST)


def _shade(axes: Axes, times: Floats, there: Booleans, colour: str) -> None:
    begins, ends = (
        times[edges.astype(int).clip(max=times.size - 1)] for edges in find_spans(there)
    )
    shade(axes, begins, ends, colour)


def draw_matrix(axes: Axes, estimate: AttitudeEstimate) -> None:
    """Draw the learned scale and misalignment of the gyro over time."""
    seconds = estimate.time - estimate.time[0]
    _shade(axes, seconds, estimate.at_rest, GREY)
    times = seconds[estimate.moments]
    error = 100.0 * (estimate.gyro_matrices - np.eye(3))
    sigma = 100.0 * estimate.gyro_matrix_sigmas
    for i, (name, colour) in enumerate(zip("xyz", AXIS_COLOURS, strict=True)):
        values, band = error[:, i, i], 2.0 * sigma[:, i, i]
        axes.plot(times, values, color=colour, linewidth=0.8, label=f"scale {name}")
        for edge in (values - band, values + band):
            axes.plot(times, edge, "--", color=colour, linewidth=0.5)
    for i, (row, column) in enumerate(((0, 1), (0, 2), (1, 2), (1, 0), (2, 0), (2, 1))):
        name, style = f"{'xyz'[row]}{'xyz'[column]}", "--" if i < 3 else ":"
        colour = (ORANGE, PURPLE, SKY)[i % 3]
        axes.plot(times, error[:, row, column], style, color=colour, lw=0.6, label=name)
    late = slice(len(error) // 10, None)
    low, high = (error - 2.0 * sigma)[late].min(), (error + 2.0 * sigma)[late].max()
    room = max(high - low, 1e-9)
    axes.set_ylim(low - 0.05 * room, high + 0.25 * room)
    axes.set_xlim(times[0], times[-1])
    axes.set_ylabel("M - 1 [%]")


def draw_scale_errors(axes: Axes, scales: Floats, errors: Mapping[str, Floats]) -> None:
    """Draw errors over the scale error of the gyro, by the names of filters.

    Parameters
    ----------
    axes : Axes
        Panel to draw into.
    scales : ndarray, shape (m,)
        Scale errors; 0.01 is 1 %.
    errors : mapping of str to ndarray of shape (m,)
        Errors, rad.
    """
    for (name, values), colour in zip(errors.items(), _COLOURS, strict=False):
        axes.plot(
            100.0 * scales, np.degrees(values), "o-", color=colour, lw=0.8, ms=2.5, label=name
        )
    axes.set_yscale("log")
    axes.set_ylim(bottom=0.6 * float(np.degrees(min(one.min() for one in errors.values()))))
    axes.set_xlabel("scale error of the gyro [%]")
    axes.set_ylabel("heading error, RMS [deg]")
    write_legend(axes, "lower left", 3)


def plot_attitude_study(
    drift: Mapping[str, AttitudeEstimate],
    magnet: Mapping[str, AttitudeEstimate],
    matrix: Floats,
    scales: Floats,
    errors: Mapping[str, Floats],
) -> Figure:
    """Return a figure of four panels, 180 mm wide.

    Parameters
    ----------
    drift : mapping of str to AttitudeEstimate
        Estimates from six axes of one recording with a scale error. The first estimate has learned
        it.
    magnet : mapping of str to AttitudeEstimate
        Estimates from nine axes. The first panel is shaded where its filter sees a disturbed field.
    matrix : ndarray, shape (3, 3)
        The true M of the first estimate of `drift`.
    scales, errors
        As in `draw_scale_errors`.

    Returns
    -------
    matplotlib.figure.Figure
        Figure with the drift of the heading, the learned elements of M (true values dotted), the
        effect of a magnet, and errors over the scale error.
    """
    figure = new_figure(_WIDTH, _HEIGHT)
    grid = figure.subplots(2, 2, gridspec_kw={**_PLACES, "wspace": 0.2, "hspace": 0.42})
    draw_heading_errors(grid[0, 0], drift)
    learned = next(iter(drift.values()))
    draw_matrix(grid[0, 1], learned)
    for i, colour in enumerate(AXIS_COLOURS):
        grid[0, 1].axhline(100.0 * (matrix[i, i] - 1.0), color=colour, linewidth=0.8, linestyle=":")
    grid[0, 1].set_xlabel("time [s]")
    low, high = grid[0, 1].get_ylim()
    grid[0, 1].set_ylim(low, high + 0.2 * (high - low))
    write_legend(grid[0, 1], "upper right", 5)
    draw_magnet(grid[1, 0], magnet)
    draw_scale_errors(grid[1, 1], scales, errors)
    titles = (
        "Six axes: drift of the heading",
        "Scale and misalignment, learned from gravity",
        "Nine axes: a magnet comes near",
        "Six axes: heading over the scale error",
    )
    for axes, title in zip(grid.ravel(), titles, strict=True):
        axes.set_title(title)
    style_panels(list(grid.ravel()))
    style_decades(grid[1, 1], 2)
    write_caption(figure, textwrap.fill(_CAPTION, 150))
    return figure


_CAPTION: Final = (
    "Simulated motions of a hand; the first 5 s are at rest (grey). Dashed: two standard "
    "deviations; dotted: the true scale. Rose: where the filter sees another field and leaves it "
    "out."
)


def _errors(estimate: AttitudeEstimate) -> tuple[Floats, Floats]:
    if estimate.reference is None:
        raise ValueError("an estimate without a reference has no errors to draw")
    return heading_and_tilt_errors(
        estimate.quaternion, estimate.reference, relative=not estimate.mag
    )
