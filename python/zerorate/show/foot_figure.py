"""The figure of a foot's track: its path, the speed bound with its stances, height."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final

import numpy as np

from zerorate.show.scales import COLUMNS, parts
from zerorate.show.stack import INNER, SIGMAS, Stack, draw_known, head, names, over_time
from zerorate.show.style import BLACK, BLUE, VERMILION, style_decades, time_unit

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from zerorate.foot.foot import FootTrack
    from zerorate.types import Floats

# Millimetres.
_PATH, _PANEL, _UNDER_PATH = 58.0, 16.0, 6.5
_POINTS: Final = 4000
_ROUND: Final = np.linspace(0.0, 2.0 * math.pi, 49)


def plot_foot(track: FootTrack) -> Figure:
    """Return the figure of a foot's track, a column of a page wide.

    The path with its stances and an ellipse of two standard deviations at the end; over time the
    speed bound and the height.
    """
    said = "Dots: stances. Ellipse and band: ± 2σ. Speed bound: its valleys are the stances."
    heights = [_PATH, _PANEL, _PANEL]
    stack = Stack("Where did it walk?", _answer(track), said, heights, _UNDER_PATH)
    _draw_path(stack.add(), track)
    stack.skip(_UNDER_PATH)
    span = float(np.ptp(track.time))
    unit, length = time_unit(span)
    times: Floats = (track.time - track.time[0]) / length
    bound = stack.add()
    few = parts(track.n, _POINTS)
    bound.plot(times[few], track.bound[few], color=BLUE, linewidth=0.4, label="bound")
    low = track.lowest
    bound.plot(times[low], track.bound[low], ".", color=VERMILION, ms=2.5, mew=0.0, label="stances")
    bound.set_yscale("log")
    head(bound, "speed bound [m/s]")
    names(bound)
    height = stack.add()
    few = parts(track.n, COLUMNS)
    draw_known(height, times[few], track.position[few, 2], track.sigma[few, 2], BLUE, "± 2σ")
    head(height, "height [m]")
    over_time(stack.panels[1:], 0.0, span / length, unit)
    figure = stack.finish(track.source, (track.n - 1) / span, span)
    style_decades(bound, 3)
    return figure


def _answer(track: FootTrack) -> str:
    there = np.flatnonzero(track.navigating)
    if not there.size:
        return "Unknown."
    sigma = SIGMAS * track.sigma[there[-1]]
    return (
        f"{track.distance:.1f} m; at the end within {np.hypot(*sigma[:2]):.2g} m and "
        f"{np.degrees(sigma[8]):.2g} deg of heading (2σ)."
    )


def _draw_path(axes: Axes, track: FootTrack) -> None:
    axes.set_xlabel("left to right [m]")
    head(axes, "ahead [m]")
    there = np.flatnonzero(track.navigating)
    if not there.size:
        return
    ahead, right = track.position[:, 0], -track.position[:, 1]
    few = parts(track.n, _POINTS)
    axes.plot(right[few], ahead[few], color=BLUE, linewidth=0.6, label="track")
    low = track.lowest
    axes.plot(right[low], ahead[low], ".", color=VERMILION, ms=2.5, mew=0.0, label="stances")
    begin, end = there[0], there[-1]
    axes.plot(right[begin], ahead[begin], "o", color=BLACK, markersize=3.0, label="begin")
    axes.plot(right[end], ahead[end], "s", color=BLACK, markersize=3.0, label="end")
    sigma = SIGMAS * track.sigma[end]
    x, y = right[end] + sigma[1] * np.cos(_ROUND), ahead[end] + sigma[0] * np.sin(_ROUND)
    axes.plot(x, y, color=BLUE, linewidth=0.5)
    shown = np.column_stack([np.append(ahead[there], y), np.append(right[there], x)])
    lows, highs = shown.min(axis=0), shown.max(axis=0)
    middle, wide = 0.5 * (lows + highs), INNER / _PATH
    half = 0.56 * max(highs[0] - lows[0], (highs[1] - lows[1]) / wide, 1.0)
    axes.set_ylim(middle[0] - half, middle[0] + half)
    axes.set_xlim(middle[1] - half * wide, middle[1] + half * wide)
    names(axes, 4)
