"""Figure of a foot's track: path, height, and the speed bound with its stances."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final

import numpy as np

from zerorate.numerals import shorten
from zerorate.show.scales import MAX_COLUMNS, split_into_parts
from zerorate.show.stack import (
    BAND_SIGMAS,
    INNER_WIDTH_MM,
    Stack,
    draw_with_sigma,
    share_time_axis,
    write_head,
    write_names,
)
from zerorate.show.style import BLACK, BLUE, VERMILION, style_decades, time_unit

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from zerorate.foot.foot import FootTrack
    from zerorate.types import Floats

# Sizes in mm.
_PATH, _PANEL, _UNDER_PATH = 58.0, 16.0, 6.5
_MAX_POINTS: Final = 4000
_CIRCLE_ANGLES: Final = np.linspace(0.0, 2.0 * math.pi, 49)


def plot_foot(track: FootTrack) -> Figure:
    """Return the figure of a foot's track, as wide as a page column.

    The top panel is the path with its stances. An ellipse of two standard deviations marks the end.
    The other panels are the speed bound and the height over time.
    """
    caption = "Dots: stances. Ellipse and band: ± 2σ. Stances are minima of the speed bound."
    heights = [_PATH, _PANEL, _PANEL]
    stack = Stack("Where did it walk?", _describe_end(track), caption, heights, _UNDER_PATH)
    _draw_path(stack.add(), track)
    stack.skip(_UNDER_PATH)
    span = float(np.ptp(track.time))
    unit, length = time_unit(span)
    times: Floats = (track.time - track.time[0]) / length
    bound = stack.add()
    rows = split_into_parts(track.n, _MAX_POINTS)
    bound.plot(times[rows], track.bound[rows], color=BLUE, linewidth=0.4, label="bound")
    low = track.lowest
    bound.plot(times[low], track.bound[low], ".", color=VERMILION, ms=2.5, mew=0.0, label="stances")
    bound.set_yscale("log")
    write_head(bound, "speed bound [m/s]")
    write_names(bound)
    height = stack.add()
    rows = split_into_parts(track.n, MAX_COLUMNS)
    draw_with_sigma(
        height, times[rows], track.position[rows, 2], track.sigma[rows, 2], BLUE, "± 2σ"
    )
    write_head(height, "height [m]")
    share_time_axis(stack.panels[1:], 0.0, span / length, unit)
    figure = stack.finish(track.source, (track.n - 1) / span, span)
    style_decades(bound, 3)
    return figure


def _describe_end(track: FootTrack) -> str:
    navigating = np.flatnonzero(track.navigating)
    if not navigating.size:
        return "Unknown."
    sigma = BAND_SIGMAS * track.sigma[navigating[-1]]
    return (
        f"{track.distance:.1f} m; at the end within {shorten(np.hypot(*sigma[:2]))} m and "
        f"{shorten(np.degrees(sigma[8]))} deg of heading (2σ)."
    )


def _draw_path(axes: Axes, track: FootTrack) -> None:
    axes.set_xlabel("left to right [m]")
    write_head(axes, "ahead [m]")
    navigating = np.flatnonzero(track.navigating)
    if not navigating.size:
        return
    ahead, right = track.position[:, 0], -track.position[:, 1]
    rows = split_into_parts(track.n, _MAX_POINTS)
    axes.plot(right[rows], ahead[rows], color=BLUE, linewidth=0.6, label="track")
    low = track.lowest
    axes.plot(right[low], ahead[low], ".", color=VERMILION, ms=2.5, mew=0.0, label="stances")
    begin, end = navigating[0], navigating[-1]
    axes.plot(right[begin], ahead[begin], "o", color=BLACK, markersize=3.0, label="begin")
    axes.plot(right[end], ahead[end], "s", color=BLACK, markersize=3.0, label="end")
    sigma = BAND_SIGMAS * track.sigma[end]
    x, y = (
        right[end] + sigma[1] * np.cos(_CIRCLE_ANGLES),
        ahead[end] + sigma[0] * np.sin(_CIRCLE_ANGLES),
    )
    axes.plot(x, y, color=BLUE, linewidth=0.5)
    shown = np.column_stack([np.append(ahead[navigating], y), np.append(right[navigating], x)])
    lows, highs = shown.min(axis=0), shown.max(axis=0)
    middle, aspect = 0.5 * (lows + highs), INNER_WIDTH_MM / _PATH
    half = 0.56 * max(highs[0] - lows[0], (highs[1] - lows[1]) / aspect, 1.0)
    axes.set_ylim(middle[0] - half, middle[0] + half)
    axes.set_xlim(middle[1] - half * aspect, middle[1] + half * aspect)
    # This is valid for axes of another shape, too.
    axes.set_aspect("equal", adjustable="datalim")
    write_names(axes, 4)
