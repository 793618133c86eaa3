"""Figures of a track: its path, speed, innovations and biases; the growth of errors in outages."""

from __future__ import annotations

import math
import textwrap
from typing import TYPE_CHECKING, Final

import numpy as np

from zerorate.geometry.earth import local_ned
from zerorate.navigation.outage import FILTER, POSITION_HELD, SMOOTHED, VELOCITY_HELD
from zerorate.show.attitude_figure import thinned
from zerorate.show.navigation_table import track_title
from zerorate.show.style import (
    BLACK,
    BLUE,
    GREEN,
    GREY,
    GREY_TEXT,
    ORANGE,
    PURPLE,
    SKY,
    VERMILION,
    add_panel,
    new_figure,
    style_panels,
    time_unit,
    write_caption,
    write_in_middle,
    write_legend,
    write_title,
)

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from zerorate.navigation.outage import OutageErrors, Outages
    from zerorate.navigation.track import Track
    from zerorate.types import Floats, Integers

# Millimetres.
_WIDTH: Final = 180.0
_LEFT, _RIGHT, _TOP, _BOTTOM, _BETWEEN = 15.0, 4.0, 8.0, 14.0, 3.0
_PATH: Final = 80.0
_PANEL: Final = 24.0
_GAP: Final = 9.0

_ELLIPSES: Final = 12
_ROUND: Final = np.linspace(0.0, 2.0 * math.pi, 49)
_AXES: Final = (("x", VERMILION), ("y", GREEN), ("z", BLUE))
_USUAL: Final = 3.0
"""Mean of a normalised innovation squared of three axes."""

_COLOURS: Final = {
    POSITION_HELD: GREY_TEXT,
    VELOCITY_HELD: ORANGE,
    FILTER: BLUE,
    SMOOTHED: GREEN,
}
_OTHERS: Final = (VERMILION, PURPLE, SKY, BLACK)


def plot_track(track: Track, outages: Outages | None = None, nis: Floats | None = None) -> Figure:
    """Return the figure of a track, 180 mm wide.

    Parameters
    ----------
    track : Track
        What to show.
    outages : Outages, optional
        Of ``zerorate.navigation.outages``: the longest are marked, with what the filter did in
        them.
    nis : ndarray, shape (m, 2), optional
        What `Track.nis` returned; by default it is asked, of a track that is not smoothed.

    Returns
    -------
    matplotlib.figure.Figure
        The path in metres, with fixes and ellipses of three standard deviations; over time the
        speed, the standard deviations of position and heading, the normalised innovations squared,
        and the biases with bands of three standard deviations. No global state of matplotlib is
        used.
    """
    longest = None if outages is None else max(outages.lengths, key=lambda one: one.seconds)
    if nis is None and not track.smoothed:
        nis = track.nis()
    panels: list[Callable[[Axes, Track, Floats], None]] = [_draw_speed, _draw_sigma]
    if nis is not None and np.isfinite(nis).any():
        values = nis
        panels.append(lambda axes, track, times: _draw_nis(axes, track, values))
    panels += [_draw_gyro_bias, _draw_accel_bias]
    height = _TOP + _PATH + _GAP + len(panels) * _PANEL + (len(panels) - 1) * _BETWEEN + _BOTTOM
    figure = new_figure(_WIDTH, height)
    path = _axes(figure, height, _TOP, _PATH)
    _draw_path(path, track, longest)
    shown, length = time_unit(float(np.ptp(track.time)) if track.n else 0.0)
    times: Floats = (track.time - track.time[0]) / length if track.n else track.time
    column = []
    for i, draw in enumerate(panels):
        axes = _axes(figure, height, _TOP + _PATH + _GAP + i * (_PANEL + _BETWEEN), _PANEL)
        if longest is not None:
            _shade(axes, (longest.spans - track.time[0]) / length)
        draw(axes, track, times)
        if track.n > 1:
            axes.set_xlim(times[0], times[-1])
        column.append(axes)
    for axes in column[:-1]:
        axes.tick_params(labelbottom=False)
    column[-1].set_xlabel(f"time [{shown}]")
    style_panels([path, *column])
    figure.align_ylabels(column)
    write_title(figure, f"Track of {track_title(track)}")
    write_caption(figure, textwrap.fill(_caption(longest, nis), 150))
    return figure


def plot_outages(
    outages: Outages, others: Mapping[str, Outages] | None = None, seconds: float | None = None
) -> Figure:
    """Return the figure of how errors grow in outages, 180 mm wide.

    Parameters
    ----------
    outages : Outages
        Of ``zerorate.navigation.outages``.
    others : mapping of str to Outages, optional
        Other filters by name, on the same fixes; each is shown beside the first.
    seconds : float, optional
        Which length; by default the longest.

    Returns
    -------
    matplotlib.figure.Figure
        Over the time since the last fix, the root mean square over all outages: position held,
        velocity held, the filter, and its smoother if there is one; on the left, the same of each
        outage of the filter. No global state of matplotlib is used.

    Raises
    ------
    KeyError
        If there is no such length.
    """
    length = max(one.seconds for one in outages.lengths) if seconds is None else seconds
    chosen = outages[length]
    height = 70.0
    figure = new_figure(_WIDTH, height)
    half = (_WIDTH - 2.0 * _LEFT - 2.0 * _RIGHT) / 2.0
    each = add_panel(figure, _LEFT, 15.0, half, 46.0)
    left = 2.0 * _LEFT + _RIGHT + half
    mean = add_panel(figure, left, 15.0, half, 46.0)
    _draw_each(each, chosen)
    for name in chosen.errors:
        _draw_growth(mean, chosen, name, name, _COLOURS[name])
    for (name, other), colour in zip((others or {}).items(), _OTHERS, strict=False):
        _draw_growth(mean, other[length], FILTER, name, colour)
        if SMOOTHED in other[length].errors:
            _draw_growth(mean, other[length], SMOOTHED, f"{name}, smoothed", colour, "--")
    for axes in (each, mean):
        axes.set_xlabel("time since the last fix [s]")
        axes.set_yscale("log")
        axes.set_xlim(0.0, length)
    each.set_ylabel("error of each outage [m]")
    mean.set_ylabel("error, RMS [m]")
    style_panels([each, mean])
    _make_room([each, mean])
    write_legend(each, "upper right", 2)
    write_legend(mean, "upper right", 2)
    write_title(figure, f"{chosen.n} outages of {length:g} s: horizontal error")
    said = "Against the fixes that were withheld, whose own errors are the floor."
    write_caption(figure, said)
    return figure


def _axes(figure: Figure, height: float, above: float, tall: float) -> Axes:
    return add_panel(figure, _LEFT, height - above - tall, _WIDTH - _LEFT - _RIGHT, tall)


def _caption(longest: OutageErrors | None, nis: Floats | None) -> str:
    said = "Ellipses, bands and dashed lines: three standard deviations."
    if nis is not None:
        said += (
            f" NIS: normalised innovation squared of a fix, {_USUAL:g} on average (line) if all "
            "deviations are right."
        )
    if longest is not None:
        said += (
            f" Grey: outages of {longest.seconds:g} s, run apart; their paths begin at the last "
            "fix and end, with an ellipse, at the last one withheld."
        )
    return said


def _shade(axes: Axes, spans: Floats) -> None:
    axes.broken_barh(
        list(zip(spans[:, 0], np.diff(spans, axis=1)[:, 0], strict=True)),
        (0.0, 1.0),
        transform=axes.get_xaxis_transform(),
        facecolor=GREY,
        edgecolor="none",
        alpha=0.7,
        zorder=0,
    )


def _draw_path(axes: Axes, track: Track, longest: OutageErrors | None) -> None:
    axes.set_xlabel("east [m]")
    axes.set_ylabel("north [m]")
    there = np.flatnonzero(track.navigating)
    if not there.size:
        write_in_middle(axes, "the filter did not begin")
        return
    origin = track.position[there[0]]
    way = local_ned(track.position, origin)
    few = thinned(track.n)
    inside = (track.fixes[:, 0] >= track.time[there[0]]) & (
        track.fixes[:, 0] <= track.time[there[-1]]
    )
    fixes = _level(track.fixes[inside, 1:4], origin)
    axes.plot(fixes[:, 1], fixes[:, 0], ".", color=ORANGE, markersize=1.5, label="fixes")
    axes.plot(way[few, 1], way[few, 0], color=BLUE, linewidth=0.7, label="track")
    for i, k in enumerate(_moments(way, there)):
        _draw_ellipse(axes, way[k], track.sigma[k], PURPLE, "" if i else "3σ")
    begin, end = way[there[0]], way[there[-1]]
    axes.plot(begin[1], begin[0], "o", color=BLACK, markersize=3.0, label="begin")
    axes.plot(end[1], end[0], "s", color=BLACK, markersize=3.0, label="end")
    if longest is not None:
        _draw_silences(axes, longest, origin)
    _fit(axes, way[there, :2])
    write_legend(axes, "upper right", 1)


def _fit(axes: Axes, way: Floats) -> None:
    """Show all of a way, a metre north as long as one east."""
    low, high = way.min(axis=0), way.max(axis=0)
    middle = 0.5 * (low + high)
    wide = (_WIDTH - _LEFT - _RIGHT) / _PATH
    half = 0.56 * max(high[0] - low[0], (high[1] - low[1]) / wide, 10.0)
    axes.set_ylim(middle[0] - half, middle[0] + half)
    axes.set_xlim(middle[1] - half * wide, middle[1] + half * wide)


def _level(position: Floats, origin: Floats) -> Floats:
    """Return metres north and east of an origin; heights may be missing."""
    return local_ned(position, origin)[:, :2]


def _moments(way: Floats, there: Integers) -> Integers:
    """Return samples at even distances along the way."""
    known = way[there, :2]
    driven = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(known, axis=0).T))])
    marks = np.linspace(0.0, driven[-1], _ELLIPSES)
    found: Integers = there[np.unique(np.clip(np.searchsorted(driven, marks), 0, there.size - 1))]
    return found


def _draw_ellipse(axes: Axes, place: Floats, sigma: Floats, colour: str, label: str) -> None:
    north = place[0] + 3.0 * sigma[0] * np.sin(_ROUND)
    east = place[1] + 3.0 * sigma[1] * np.cos(_ROUND)
    axes.plot(east, north, color=colour, linewidth=0.6, label=label)


def _draw_silences(axes: Axes, longest: OutageErrors, origin: Floats) -> None:
    """Draw what the filter made of the way in each outage."""
    truth = _level(longest.position, origin)
    guessed = truth + longest.errors[FILTER]
    for k in range(longest.n):
        own = longest.outage == k
        name = "" if k else f"in outages of {longest.seconds:g} s"
        axes.plot(guessed[own, 1], guessed[own, 0], color=VERMILION, lw=0.8, label=name)
        for ends in (guessed[own][-1], truth[own][-1]):
            axes.plot(ends[1], ends[0], "x", color=VERMILION, markersize=2.5, markeredgewidth=0.6)
        _draw_ellipse(axes, guessed[own][-1], longest.sigma[own][-1], PURPLE, "")


def _draw_speed(axes: Axes, track: Track, times: Floats) -> None:
    few = thinned(track.n)
    east_north = track.velocity[few, :2]
    speed = np.hypot(*east_north.T)
    band = 3.0 * np.hypot(*track.sigma[few, 3:5].T)
    x = times[few]
    axes.fill_between(x, np.maximum(speed - band, 0.0), speed + band, color=BLUE, alpha=0.25, lw=0)
    axes.plot(x, speed, color=BLUE, linewidth=0.7)
    axes.set_ylabel("speed [m/s]")


def _draw_sigma(axes: Axes, track: Track, times: Floats) -> None:
    few = thinned(track.n)
    sigma = track.sigma[few]
    curves = (
        ("position [m]", 3.0 * np.hypot(*sigma[:, :2].T), BLUE),
        ("tilt [deg]", 3.0 * np.degrees(np.hypot(*sigma[:, 6:8].T)), VERMILION),
        ("heading [deg]", 3.0 * np.degrees(sigma[:, 8]), GREEN),
    )
    for name, values, colour in curves:
        axes.plot(times[few], values, "--", color=colour, linewidth=0.7, label=name)
    axes.set_yscale("log")
    axes.set_ylabel("3σ")
    _make_room([axes])
    write_legend(axes, "upper right", 3)


def _draw_nis(axes: Axes, track: Track, nis: Floats) -> None:
    _, length = time_unit(float(np.ptp(track.time)))
    times = (track.fixes[:, 0] - track.time[0]) / length
    parts = (("position", BLUE), ("velocity", VERMILION))
    for values, (name, colour) in zip(nis.T, parts, strict=True):
        there = np.isfinite(values) & (values > 0.0)
        few = thinned(int(there.sum()))
        x, y = times[there][few], values[there][few]
        axes.plot(x, y, ".", color=colour, markersize=1.2, label=name)
    axes.axhline(_USUAL, color=BLACK, linewidth=0.6)
    axes.set_yscale("log")
    axes.set_ylabel("NIS")
    low, high = np.nanpercentile(nis[nis > 0.0], [1.0, 100.0])
    axes.set_ylim(low, high)
    _make_room([axes])
    write_legend(axes, "upper right", 2)


def _draw_gyro_bias(axes: Axes, track: Track, times: Floats) -> None:
    values, sigma = np.degrees(track.gyro_bias), np.degrees(track.sigma[:, 9:12])
    _draw_bias(axes, track, times, values, sigma)
    axes.set_ylabel("gyro bias [deg/s]")


def _draw_accel_bias(axes: Axes, track: Track, times: Floats) -> None:
    _draw_bias(axes, track, times, track.accel_bias, track.sigma[:, 12:15])
    axes.set_ylabel("accel bias [m/s²]")


def _draw_bias(axes: Axes, track: Track, times: Floats, values: Floats, sigma: Floats) -> None:
    few = thinned(track.n)
    for i, (name, colour) in enumerate(_AXES):
        x, y, band = times[few], values[few, i], 3.0 * sigma[few, i]
        axes.fill_between(x, y - band, y + band, color=colour, alpha=0.2, linewidth=0.0)
        axes.plot(x, y, color=colour, linewidth=0.7, label=name)
    there = np.flatnonzero(track.navigating)
    if there.size:
        # Scaled to what is known after the first tenth.
        late = slice(int(there[there.size // 10]), None)
        low = float(np.nanmin((values - 3.0 * sigma)[late]))
        high = float(np.nanmax((values + 3.0 * sigma)[late]))
        room = max(high - low, 1e-9)
        axes.set_ylim(low - 0.05 * room, high + 0.35 * room)
    write_legend(axes, "upper right", 3)


def _make_room(panels: list[Axes]) -> None:
    """Leave the upper part of logarithmic panels for their legends."""
    for axes in panels:
        low, high = axes.get_ylim()
        axes.set_ylim(low, high * (high / low) ** 0.25)


def _draw_each(axes: Axes, chosen: OutageErrors) -> None:
    for name in (VELOCITY_HELD, FILTER):
        distance = np.hypot(*chosen.errors[name].T)
        for k in range(chosen.n):
            own = chosen.outage == k
            since = chosen.time[own] - chosen.spans[k, 0]
            label = "" if k else name
            axes.plot(since, distance[own], color=_COLOURS[name], linewidth=0.5, label=label)


def _draw_growth(
    axes: Axes, chosen: OutageErrors, name: str, label: str, colour: str, style: str = "-"
) -> None:
    since = chosen.time - chosen.spans[chosen.outage, 0]
    moments, which = np.unique(np.round(since, 2), return_inverse=True)
    counts = np.bincount(which)
    squares = np.bincount(which, weights=(chosen.errors[name] ** 2).sum(axis=1))
    whole = counts == chosen.n
    if not whole.any():  # the fixes of each outage stand elsewhere
        edges = np.linspace(0.0, chosen.seconds, 21)
        moments = 0.5 * (edges[1:] + edges[:-1])
        which = np.clip(np.digitize(since, edges) - 1, 0, len(moments) - 1)
        counts = np.bincount(which, minlength=len(moments))
        squares = np.bincount(
            which, weights=(chosen.errors[name] ** 2).sum(axis=1), minlength=len(moments)
        )
        whole = counts > 0
    rms = np.sqrt(squares[whole] / counts[whole])
    axes.plot(moments[whole], rms, style, color=colour, linewidth=0.9, label=label)
