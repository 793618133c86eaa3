"""Figures of a track: its path, speed, innovations and biases; the growth of errors in outages."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final

import numpy as np

from zerorate.geometry.earth import local_ned
from zerorate.navigation.outage import FILTER, POSITION_HELD, SMOOTHED, VELOCITY_HELD
from zerorate.show.scales import COLUMNS, band, parts
from zerorate.show.stack import (
    INNER,
    SIGMAS,
    Stack,
    draw_known,
    draw_scatter,
    head,
    names,
    over_time,
    room,
    shade,
)
from zerorate.show.style import (
    AXIS_COLOURS,
    BLACK,
    BLUE,
    BROWN,
    GREEN,
    ORANGE,
    PURPLE,
    SKY,
    VERMILION,
    style_decades,
    time_unit,
    write_in_middle,
)

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from zerorate.navigation.outage import OutageErrors, Outages
    from zerorate.navigation.track import Track
    from zerorate.tasks.navigate import Navigation
    from zerorate.types import Floats, Integers

# Millimetres.
_PATH, _PANEL = 58.0, 14.0
_UNDER_PATH: Final = 6.5
_GROWTH, _NAME_LINE = 30.0, 2.8
_NAMED: Final = 4
"""Curves whose names stand in a line."""
_FIX, _STROKE = 2.0, 0.8

_QUESTION: Final = "Where was it, and how far is that to be trusted?"
_POINTS: Final = 4000
"""Of a path: more than there are pixels."""

_ELLIPSES: Final = 12
_ROUND: Final = np.linspace(0.0, 2.0 * math.pi, 49)
_AXES: Final = (*zip("xyz", AXIS_COLOURS, strict=True),)
_USUAL: Final = 3.0
"""Mean of a normalised innovation squared of three axes."""

_COLOURS: Final = {
    POSITION_HELD: BLACK,
    VELOCITY_HELD: ORANGE,
    FILTER: BLUE,
    SMOOTHED: GREEN,
}
_OTHERS: Final = (BROWN, SKY, VERMILION, PURPLE)


def plot_navigation(found: Navigation, everything: bool = False) -> Figure:
    """Return the figure of a navigation: its track, with the longest outages marked."""
    return plot_track(found.track, found.outages, found.nis, everything)


def plot_track(
    track: Track,
    outages: Outages | None = None,
    nis: Floats | None = None,
    everything: bool = False,
) -> Figure:
    """Return the figure of a track, a column of a page wide.

    The path in metres, with fixes and ellipses of two standard deviations; over one time axis
    speed, standard deviations of position and of orientation, and the biases with bands of two
    standard deviations.

    `outages`: of ``zerorate.navigation.outages``: the longest are marked, with what the filter did
    in them. `nis`: what `Track.nis` returned; where everything is shown of a track that is not
    smoothed, it is asked. `everything`: also the normalised innovations squared.
    """
    longest = None if outages is None else max(outages.lengths, key=lambda one: one.seconds)
    panels: list[Callable[[Axes, Track, Floats], None]] = [
        _draw_speed,
        _draw_position_sigma,
        _draw_angle_sigma,
        _draw_gyro_bias,
        _draw_accel_bias,
    ]
    if everything and nis is None and not track.smoothed:
        nis = track.nis()
    shown = everything and nis is not None and bool(np.isfinite(nis).any())
    if shown and nis is not None:
        values = nis
        panels.append(lambda panel, track, times: _draw_nis(panel, track, values))
    heights = [_PATH, *[_PANEL] * len(panels)]
    caption = _caption(track, longest, shown)
    stack = Stack(_QUESTION, _answer(track), caption, heights, _UNDER_PATH)
    path = stack.add()
    _draw_path(path, track, longest)
    stack.skip(_UNDER_PATH)
    span = float(np.ptp(track.time)) if track.n else 0.0
    unit, length = time_unit(span)
    times: Floats = (track.time - track.time[0]) / length if track.n else track.time
    for draw in panels:
        panel = stack.add()
        if longest is not None:
            shade(panel, *((longest.spans - track.time[0]) / length).T)
        draw(panel, track, times)
    over_time(stack.panels[1:], 0.0, span / length, unit)
    rate = (track.n - 1) / span if span > 0.0 else 0.0
    figure = stack.finish(track.source, rate, span)
    for panel in stack.panels[1:]:
        if panel.get_yscale() == "log":
            style_decades(panel, 2)
    return figure


def plot_outages(
    outages: Outages, others: Mapping[str, Outages] | None = None, seconds: float | None = None
) -> Figure:
    """Return the figure of how errors grow in outages, 180 mm wide.

    Over the time since the last fix, the root mean square over all outages: position held, velocity
    held, the filter, and its smoother if there is one; on the left, the same of each outage of the
    filter.

    `others`: other filters by name, on the same fixes; each is shown beside the first. `seconds`:
    which length; by default the longest.

    KeyError if there is no such length.
    """
    length = max(one.seconds for one in outages.lengths) if seconds is None else seconds
    chosen = outages[length]
    question = f"How far off after {length:g} s without fixes?"
    said = (
        f"{chosen.n} outage{'s' if chosen.n > 1 else ''}; horizontal errors against the fixes that "
        "were withheld, whose own errors are the floor."
    )
    answer = ", ".join(f"{name} {chosen.rms(name):.3g} m" for name in chosen.errors)
    curves = len(chosen.errors) + sum(
        1 + (SMOOTHED in other[length].errors) for other in (others or {}).values()
    )
    # In two rows they need not be spread over the whole width, where the head stands.
    across = curves if curves <= _NAMED else _NAMED - 1
    lines = _NAME_LINE * (math.ceil(curves / across) - 1)
    stack = Stack(question, f"RMS: {answer}.", said, [_GROWTH, _GROWTH], lines)
    stack.skip(lines)
    mean, each = stack.add(), stack.add()
    for name in chosen.errors:
        _draw_growth(mean, chosen, name, name, _COLOURS[name])
    for (name, other), colour in zip((others or {}).items(), _OTHERS, strict=False):
        _draw_growth(mean, other[length], FILTER, name, colour)
        if SMOOTHED in other[length].errors:
            _draw_growth(mean, other[length], SMOOTHED, f"{name}, smoothed", colour, "--")
    _draw_each(each, chosen)
    for axes in (mean, each):
        axes.set_yscale("log")
    over_time(stack.panels, 0.0, length, "s")
    each.set_xlabel("time since the last fix [s]")
    head(mean, "RMS [m]")
    head(each, "each outage [m]")
    names(mean, across)
    names(each, 2)
    figure = stack.finish(outages.source, 0.0, 0.0)
    for axes in (mean, each):
        style_decades(axes)
    return figure


def _answer(track: Track) -> str:
    """Return how far the end of the track is known."""
    there = np.flatnonzero(track.navigating)
    if not there.size:
        return "Unknown: the filter did not begin."
    sigma = SIGMAS * track.sigma[there[-1]]
    return (
        f"At the end within {np.hypot(*sigma[:2]):.2g} m, {np.hypot(*sigma[3:5]):.2g} m/s and "
        f"{np.degrees(sigma[8]):.2g} deg of heading (2σ)."
    )


def _caption(track: Track, longest: OutageErrors | None, nis: bool) -> str:
    said = "Ellipses and bands: ± 2σ."
    if track.smoothed:
        said = f"Smoothed: each moment in the light of all fixes. {said}"
    if nis:
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


def _draw_path(axes: Axes, track: Track, longest: OutageErrors | None) -> None:
    axes.set_xlabel("east [m]")
    head(axes, "north [m]")
    there = np.flatnonzero(track.navigating)
    if not there.size:
        write_in_middle(axes, "the filter did not begin")
        return
    origin = track.position[there[0]]
    way = local_ned(track.position, origin)
    few = parts(track.n, _POINTS)
    inside = (track.fixes[:, 0] >= track.time[there[0]]) & (
        track.fixes[:, 0] <= track.time[there[-1]]
    )
    fixes = _level(track.fixes[inside, 1:4], origin)
    axes.plot(fixes[:, 1], fixes[:, 0], ".", color=BLACK, ms=_FIX, mew=0.0, label="fixes")
    axes.plot(way[few, 1], way[few, 0], color=BLUE, linewidth=_STROKE, label="track")
    for k in _moments(way, there):
        _draw_ellipse(axes, way[k], track.sigma[k], BLUE)
    begin, end = way[there[0]], way[there[-1]]
    axes.plot(begin[1], begin[0], "o", color=BLACK, markersize=3.0, label="begin")
    axes.plot(end[1], end[0], "s", color=BLACK, markersize=3.0, label="end")
    if longest is not None:
        _draw_silences(axes, longest, origin)
    _fit(axes, way[there, :2])
    names(axes, 5)


def _fit(axes: Axes, way: Floats) -> None:
    """Show all of a way, a metre north as long as one east."""
    low, high = way.min(axis=0), way.max(axis=0)
    middle = 0.5 * (low + high)
    wide = INNER / _PATH
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


def _draw_ellipse(axes: Axes, place: Floats, sigma: Floats, colour: str) -> None:
    north = place[0] + SIGMAS * sigma[0] * np.sin(_ROUND)
    east = place[1] + SIGMAS * sigma[1] * np.cos(_ROUND)
    axes.plot(east, north, color=colour, linewidth=0.5)


def _draw_silences(axes: Axes, longest: OutageErrors, origin: Floats) -> None:
    """Draw what the filter made of the way in each outage."""
    truth = _level(longest.position, origin)
    guessed = truth + longest.errors[FILTER]
    for k in range(longest.n):
        own = longest.outage == k
        name = "" if k else f"outages of {longest.seconds:g} s"
        axes.plot(guessed[own, 1], guessed[own, 0], color=VERMILION, lw=0.8, label=name)
        for ends in (guessed[own][-1], truth[own][-1]):
            axes.plot(ends[1], ends[0], "x", color=VERMILION, markersize=2.5, markeredgewidth=0.6)
        _draw_ellipse(axes, guessed[own][-1], longest.sigma[own][-1], VERMILION)


def _draw_speed(panel: Axes, track: Track, times: Floats) -> None:
    few = parts(track.n, COLUMNS)
    speed = np.hypot(*track.velocity[few, :2].T)
    sigma = np.hypot(*track.sigma[few, 3:5].T)
    draw_known(panel, times[few], speed, sigma, BLUE, "± 2σ")
    panel.set_ylim(bottom=0.0)
    head(panel, "speed [m/s]")


def _draw_position_sigma(panel: Axes, track: Track, times: Floats) -> None:
    few = parts(track.n, COLUMNS)
    level = SIGMAS * np.hypot(*track.sigma[few, :2].T)
    up = SIGMAS * track.sigma[few, 2]
    panel.plot(times[few], level, color=BLUE, lw=_STROKE, label="level")
    panel.plot(times[few], up, "--", color=VERMILION, lw=_STROKE, label="height")
    _logarithmic(panel)
    head(panel, "position, 2σ [m]")
    names(panel)


def _draw_angle_sigma(panel: Axes, track: Track, times: Floats) -> None:
    few = parts(track.n, COLUMNS)
    sigma = SIGMAS * np.degrees(track.sigma[few, 6:9])
    panel.plot(times[few], sigma[:, 2], color=BLUE, lw=_STROKE, label="heading")
    tilt = np.hypot(*sigma[:, :2].T)
    panel.plot(times[few], tilt, "--", color=VERMILION, lw=_STROKE, label="tilt")
    _logarithmic(panel)
    head(panel, "orientation, 2σ [deg]")
    names(panel)


def _logarithmic(panel: Axes) -> None:
    """Make a scale logarithmic, a decade at least, where what is drawn has a place on it."""
    drawn = np.concatenate([np.asarray(line.get_ydata(), np.float64) for line in panel.lines])
    drawn = drawn[np.isfinite(drawn) & (drawn > 0.0)]
    if drawn.size:
        low, high = drawn.min() / 1.3, drawn.max() * 1.3
        wider = max(10.0 * low / high, 1.0) ** 0.5
        panel.set_yscale("log")
        panel.set_ylim(low / wider, high * wider)


def _draw_nis(panel: Axes, track: Track, nis: Floats) -> None:
    _, length = time_unit(float(np.ptp(track.time)))
    times = (track.fixes[:, 0] - track.time[0]) / length
    own = (("position", BLUE), ("velocity", VERMILION))
    lows, highs = [], []
    for values, (name, colour) in zip(nis.T, own, strict=True):
        there = np.isfinite(values) & (values > 0.0)
        if not there.any():
            continue
        drawn = band(values[there], COLUMNS // 4)
        at = np.interp(drawn.middle, np.arange(int(there.sum())), times[there])
        draw_scatter(panel, at, drawn, colour, name)
        lows.append(drawn.low.min())
        highs.append(drawn.high.max())
    panel.axhline(_USUAL, color=BLACK, linewidth=0.6)
    panel.set_yscale("log")
    panel.set_ylim(min(lows) / 1.3, max(highs) * 1.3)
    head(panel, "NIS")
    names(panel)


def _draw_gyro_bias(panel: Axes, track: Track, times: Floats) -> None:
    values, sigma = np.degrees(track.gyro_bias), np.degrees(track.sigma[:, 9:12])
    _draw_bias(panel, track, times, values, sigma)
    head(panel, "gyro's bias [deg/s]")
    names(panel)


def _draw_accel_bias(panel: Axes, track: Track, times: Floats) -> None:
    _draw_bias(panel, track, times, track.accel_bias, track.sigma[:, 12:15])
    head(panel, "accelerometer's bias [m/s²]")
    names(panel)


def _draw_bias(panel: Axes, track: Track, times: Floats, values: Floats, sigma: Floats) -> None:
    few = parts(track.n, COLUMNS)
    for i, (name, colour) in enumerate(_AXES):
        draw_known(panel, times[few], values[few, i], sigma[few, i], colour, name)
    there = np.flatnonzero(track.navigating)
    if there.size:
        # Scaled to what is known after the first tenth.
        late = few[few >= there[there.size // 10]]
        if late.size:
            low = float(np.nanmin((values - SIGMAS * sigma)[late]))
            high = float(np.nanmax((values + SIGMAS * sigma)[late]))
            panel.set_ylim(*room(low, high))


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
