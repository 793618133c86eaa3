"""Figures of a track: path, speed, innovations and biases; growth of errors in outages."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final

import numpy as np

from zerorate.geometry.earth import local_ned
from zerorate.navigation.aids import OUTPUTS
from zerorate.navigation.outage import (
    ELLIPSE_SIGMAS,
    FILTER,
    POSITION_HELD,
    SMOOTHED,
    VELOCITY_HELD,
)
from zerorate.numerals import shorten
from zerorate.show.scales import MAX_COLUMNS, column_quantiles, split_into_parts
from zerorate.show.stack import (
    BAND_SIGMAS,
    INNER_WIDTH_MM,
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

# Sizes in mm.
_PATH, _PANEL = 58.0, 14.0
_UNDER_PATH: Final = 6.5
_GROWTH, _NAME_LINE = 30.0, 2.8
_MAX_NAMES_IN_ROW: Final = 4
"""Largest number of curve names in a line."""
_FIX, _STROKE = 2.0, 0.8

_QUESTION: Final = "Where was it, and how certain is that?"
_MAX_POINTS: Final = 4000
"""Largest number of points of a path; more exceed the pixels."""

_ELLIPSE_COUNT: Final = 12
_CIRCLE_ANGLES: Final = np.linspace(0.0, 2.0 * math.pi, 49)
_AXES: Final = (*zip("xyz", AXIS_COLOURS, strict=True),)
_MARK_HEIGHT: Final = 0.05
"""Height of a mark for an output that is not usable, relative to the panel."""
_EXPECTED_NIS: Final = 3.0
"""Mean normalised innovation squared of three axes."""

_COLOURS: Final = {
    POSITION_HELD: BLACK,
    VELOCITY_HELD: ORANGE,
    FILTER: BLUE,
    SMOOTHED: GREEN,
}
_OTHER_COLOURS: Final = (BROWN, SKY, VERMILION, PURPLE)


def plot_navigation(navigation: Navigation, everything: bool = False) -> Figure:
    """Return the figure of a navigation: its track, with the longest outages marked."""
    return plot_track(navigation.track, navigation.outages, navigation.nis, everything)


def plot_track(
    track: Track,
    outages: Outages | None = None,
    nis: Floats | None = None,
    everything: bool = False,
) -> Figure:
    """Return the figure of a track, as wide as a page column.

    The top panel is the path in metres, with fixes and ellipses for 95 % of the errors. The other
    panels have one time axis: speed, 2 σ of position and of orientation, and the biases with a band
    of ±2 σ.

    `outages`: result of ``zerorate.navigation.outages``. The longest outages are marked, with the
    filter's track in them. `nis`: result of `Track.nis`. `everything`: also show the normalised
    innovations squared; they are computed if the track is not smoothed.
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
    has_nis = everything and nis is not None and bool(np.isfinite(nis).any())
    if has_nis and nis is not None:
        values = nis
        panels.append(lambda panel, track, times: _draw_nis(panel, track, values))
    heights = [_PATH, *[_PANEL] * len(panels)]
    caption = _make_caption(track, longest, has_nis)
    stack = Stack(_QUESTION, _describe_end(track), caption, heights, _UNDER_PATH)
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
    share_time_axis(stack.panels[1:], 0.0, span / length, unit)
    rate = (track.n - 1) / span if span > 0.0 else 0.0
    figure = stack.finish(track.source, rate, span)
    for panel in stack.panels[1:]:
        if panel.get_yscale() == "log":
            style_decades(panel, 2)
    return figure


def plot_outages(
    outages: Outages, others: Mapping[str, Outages] | None = None, seconds: float | None = None
) -> Figure:
    """Return a figure of the growth of errors in outages, 180 mm wide.

    The time axis of both panels is the time since the last fix. The upper panel is the RMS error
    over all outages. It compares a held position, a held velocity, the filter, and, if requested,
    the smoother. The lower panel is the error of the filter in each outage.

    `others`: outages of further filters by name, with the same fixes. `seconds`: length of the
    outages; default the longest.

    Raises KeyError if there are no outages of this length.
    """
    length = (
        max(length_errors.seconds for length_errors in outages.lengths)
        if seconds is None
        else seconds
    )
    outage = outages[length]
    question = f"How far off after {length:g} s without fixes?"
    caption = (
        f"{outage.n} outage{'s' if outage.n > 1 else ''}; horizontal differences from the "
        f"withheld fixes, whose own errors are included. The filter's at the end are "
        f"{shorten(outage.error_over_sigma())} times their standard deviation (1 is right)."
    )
    answer = ", ".join(f"{name} {shorten(outage.rms(name), 3)} m" for name in outage.errors)
    curves = len(outage.errors) + sum(
        1 + (SMOOTHED in other[length].errors) for other in (others or {}).values()
    )
    # With two rows of names, leave room for the panel's heading.
    columns = curves if curves <= _MAX_NAMES_IN_ROW else _MAX_NAMES_IN_ROW - 1
    lines = _NAME_LINE * (math.ceil(curves / columns) - 1)
    stack = Stack(question, f"RMS: {answer}.", caption, [_GROWTH, _GROWTH], lines)
    stack.skip(lines)
    mean, each_panel = stack.add(), stack.add()
    for name in outage.errors:
        _draw_growth(mean, outage, name, name, _COLOURS[name])
    for (name, other), colour in zip((others or {}).items(), _OTHER_COLOURS, strict=False):
        _draw_growth(mean, other[length], FILTER, name, colour)
        if SMOOTHED in other[length].errors:
            _draw_growth(mean, other[length], SMOOTHED, f"{name}, smoothed", colour, "--")
    _draw_each_outage(each_panel, outage)
    for axes in (mean, each_panel):
        axes.set_yscale("log")
    share_time_axis(stack.panels, 0.0, length, "s")
    each_panel.set_xlabel("time since the last fix [s]")
    write_head(mean, "RMS [m]")
    write_head(each_panel, "each outage [m]")
    write_names(mean, columns)
    write_names(each_panel, 2)
    figure = stack.finish(outages.source, 0.0, 0.0)
    for axes in (mean, each_panel):
        style_decades(axes)
    return figure


def _describe_end(track: Track) -> str:
    """Return the standard deviation at the end of the track."""
    navigating = np.flatnonzero(track.navigating)
    if not navigating.size:
        return "Unknown: the filter did not start."
    sigma = BAND_SIGMAS * track.sigma[navigating[-1]]
    return (
        f"At the end within {shorten(np.hypot(*sigma[:2]))} m, "
        f"{shorten(np.hypot(*sigma[3:5]))} m/s and {shorten(np.degrees(sigma[8]))} deg of heading "
        "(2σ)."
    )


def _make_caption(track: Track, longest: OutageErrors | None, nis: bool) -> str:
    caption = "Ellipses: 95 %. Bands: ± 2σ."
    if track.usable.size and not track.usable[track.navigating].all():
        caption += " Bars at the foot of a panel: that output is not usable."
    if track.smoothed:
        caption = f"Smoothed: each position from all fixes. {caption}"
    if nis:
        caption += (
            f" NIS: normalised innovation squared of a fix, {_EXPECTED_NIS:g} on average (line) "
            f"if all standard deviations are right."
        )
    if longest is not None:
        caption += (
            f" Grey: outages of {longest.seconds:g} s, each run separately; paths begin at the "
            f"last fix and end, with an ellipse, at the last withheld fix. The error there is "
            f"{shorten(longest.error_over_sigma())} times its standard deviation (1 is right), and "
            f"{longest.share_inside():.0%} of the ellipses contain the truth."
        )
    return caption


def _draw_path(axes: Axes, track: Track, longest: OutageErrors | None) -> None:
    axes.set_xlabel("east [m]")
    write_head(axes, "north [m]")
    navigating = np.flatnonzero(track.navigating)
    if not navigating.size:
        write_in_middle(axes, "the filter did not start")
        return
    origin = track.position[navigating[0]]
    track_ned = local_ned(track.position, origin)
    rows = split_into_parts(track.n, _MAX_POINTS)
    inside = (track.fixes[:, 0] >= track.time[navigating[0]]) & (
        track.fixes[:, 0] <= track.time[navigating[-1]]
    )
    fixes = _horizontal_ned(track.fixes[inside, 1:4], origin)
    axes.plot(fixes[:, 1], fixes[:, 0], ".", color=BLACK, ms=_FIX, mew=0.0, label="fixes")
    axes.plot(track_ned[rows, 1], track_ned[rows, 0], color=BLUE, linewidth=_STROKE, label="track")
    for k in _rows_along_way(track_ned, navigating):
        _draw_ellipse(axes, track_ned[k], track.sigma[k], BLUE)
    begin, end = track_ned[navigating[0]], track_ned[navigating[-1]]
    axes.plot(begin[1], begin[0], "o", color=BLACK, markersize=3.0, label="begin")
    axes.plot(end[1], end[0], "s", color=BLACK, markersize=3.0, label="end")
    if longest is not None:
        _draw_outages(axes, longest, origin)
    _fit_scale(axes, track_ned[navigating, :2])
    write_names(axes, 5)


def _fit_scale(axes: Axes, track_ned: Floats) -> None:
    """Set limits that show the whole path, with equal scales north and east."""
    low, high = track_ned.min(axis=0), track_ned.max(axis=0)
    middle = 0.5 * (low + high)
    wide = INNER_WIDTH_MM / _PATH
    half = 0.56 * max(high[0] - low[0], (high[1] - low[1]) / wide, 10.0)
    axes.set_ylim(middle[0] - half, middle[0] + half)
    axes.set_xlim(middle[1] - half * wide, middle[1] + half * wide)
    # This is valid for axes of another shape, too.
    axes.set_aspect("equal", adjustable="datalim")


def _horizontal_ned(position: Floats, origin: Floats) -> Floats:
    """Return metres north and east from an origin; heights may be missing."""
    return local_ned(position, origin)[:, :2]


def _rows_along_way(track_ned: Floats, navigating: Integers) -> Integers:
    """Return samples at equal distances along the path."""
    known = track_ned[navigating, :2]
    driven = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(known, axis=0).T))])
    marks = np.linspace(0.0, driven[-1], _ELLIPSE_COUNT)
    rows: Integers = navigating[
        np.unique(np.clip(np.searchsorted(driven, marks), 0, navigating.size - 1))
    ]
    return rows


def _draw_ellipse(axes: Axes, centre: Floats, sigma: Floats, colour: str) -> None:
    north = centre[0] + ELLIPSE_SIGMAS * sigma[0] * np.sin(_CIRCLE_ANGLES)
    east = centre[1] + ELLIPSE_SIGMAS * sigma[1] * np.cos(_CIRCLE_ANGLES)
    axes.plot(east, north, color=colour, linewidth=0.5)


def _draw_outages(axes: Axes, longest: OutageErrors, origin: Floats) -> None:
    """Draw the filter's track in each outage."""
    truth = _horizontal_ned(longest.position, origin)
    estimate = truth + longest.errors[FILTER]
    for k in range(longest.n):
        in_outage = longest.outage == k
        name = "" if k else f"outages of {longest.seconds:g} s"
        axes.plot(
            estimate[in_outage, 1], estimate[in_outage, 0], color=VERMILION, lw=0.8, label=name
        )
        for ends in (estimate[in_outage][-1], truth[in_outage][-1]):
            axes.plot(ends[1], ends[0], "x", color=VERMILION, markersize=2.5, markeredgewidth=0.6)
        _draw_ellipse(axes, estimate[in_outage][-1], longest.sigma[in_outage][-1], VERMILION)


def _draw_speed(panel: Axes, track: Track, times: Floats) -> None:
    rows = split_into_parts(track.n, MAX_COLUMNS)
    speed = np.hypot(*track.velocity[rows, :2].T)
    sigma = np.hypot(*track.sigma[rows, 3:5].T)
    draw_with_sigma(panel, times[rows], speed, sigma, BLUE, "± 2σ")
    panel.set_ylim(bottom=0.0)
    _mark_not_usable(panel, track, times, {"velocity": BLUE})
    write_head(panel, "speed [m/s]")


def _draw_position_sigma(panel: Axes, track: Track, times: Floats) -> None:
    rows = split_into_parts(track.n, MAX_COLUMNS)
    level = BAND_SIGMAS * np.hypot(*track.sigma[rows, :2].T)
    up = BAND_SIGMAS * track.sigma[rows, 2]
    panel.plot(times[rows], level, color=BLUE, lw=_STROKE, label="level")
    panel.plot(times[rows], up, "--", color=VERMILION, lw=_STROKE, label="height")
    _set_log_scale(panel)
    _mark_not_usable(panel, track, times, {"position": BLUE, "height": VERMILION})
    write_head(panel, "position, 2σ [m]")
    write_names(panel)


def _draw_angle_sigma(panel: Axes, track: Track, times: Floats) -> None:
    rows = split_into_parts(track.n, MAX_COLUMNS)
    sigma = BAND_SIGMAS * np.degrees(track.sigma[rows, 6:9])
    panel.plot(times[rows], sigma[:, 2], color=BLUE, lw=_STROKE, label="heading")
    tilt = np.hypot(*sigma[:, :2].T)
    panel.plot(times[rows], tilt, "--", color=VERMILION, lw=_STROKE, label="tilt")
    _set_log_scale(panel)
    _mark_not_usable(panel, track, times, {"heading": BLUE, "attitude": VERMILION})
    write_head(panel, "orientation, 2σ [deg]")
    write_names(panel)


def _mark_not_usable(panel: Axes, track: Track, times: Floats, colours: Mapping[str, str]) -> None:
    """Mark unusable outputs at the bottom of a panel, with a bar for each output."""
    if len(track.usable) != track.n:
        return
    for k, (output, colour) in enumerate(colours.items()):
        begins, ends = find_spans(track.navigating & ~track.usable[:, OUTPUTS.index(output)])
        seconds = np.interp([begins, ends], np.arange(track.n), times)
        panel.broken_barh(
            list(zip(seconds[0], seconds[1] - seconds[0], strict=True)),
            (k * _MARK_HEIGHT, _MARK_HEIGHT),
            transform=panel.get_xaxis_transform(),
            color=colour,
            lw=0.0,
        )


def _set_log_scale(panel: Axes) -> None:
    """Use a logarithmic scale of at least a decade if the drawn values are positive."""
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
    series = (("position", BLUE), ("velocity", VERMILION))
    lows, highs = [], []
    for values, (name, colour) in zip(nis.T, series, strict=True):
        positive = np.isfinite(values) & (values > 0.0)
        if not positive.any():
            continue
        drawn = column_quantiles(values[positive], MAX_COLUMNS // 4)
        at = np.interp(drawn.middle, np.arange(int(positive.sum())), times[positive])
        draw_band(panel, at, drawn, colour, name)
        lows.append(drawn.low.min())
        highs.append(drawn.high.max())
    panel.axhline(_EXPECTED_NIS, color=BLACK, linewidth=0.6)
    panel.set_yscale("log")
    panel.set_ylim(min(lows) / 1.3, max(highs) * 1.3)
    write_head(panel, "NIS")
    write_names(panel)


def _draw_gyro_bias(panel: Axes, track: Track, times: Floats) -> None:
    values, sigma = np.degrees(track.gyro_bias), np.degrees(track.sigma[:, 9:12])
    _draw_bias(panel, track, times, values, sigma)
    write_head(panel, "gyro's bias [deg/s]")
    write_names(panel)


def _draw_accel_bias(panel: Axes, track: Track, times: Floats) -> None:
    _draw_bias(panel, track, times, track.accel_bias, track.sigma[:, 12:15])
    write_head(panel, "accelerometer's bias [m/s²]")
    write_names(panel)


def _draw_bias(panel: Axes, track: Track, times: Floats, values: Floats, sigma: Floats) -> None:
    rows = split_into_parts(track.n, MAX_COLUMNS)
    for i, (name, colour) in enumerate(_AXES):
        draw_with_sigma(panel, times[rows], values[rows, i], sigma[rows, i], colour, name)
    navigating = np.flatnonzero(track.navigating)
    if navigating.size:
        # Scale to the estimates after the first tenth.
        late = rows[rows >= navigating[navigating.size // 10]]
        if late.size:
            low = float(np.nanmin((values - BAND_SIGMAS * sigma)[late]))
            high = float(np.nanmax((values + BAND_SIGMAS * sigma)[late]))
            panel.set_ylim(*add_margin(low, high))


def _draw_each_outage(axes: Axes, outage: OutageErrors) -> None:
    for name in (VELOCITY_HELD, FILTER):
        distance = np.hypot(*outage.errors[name].T)
        for k in range(outage.n):
            in_outage = outage.outage == k
            since = outage.time[in_outage] - outage.spans[k, 0]
            label = "" if k else name
            axes.plot(since, distance[in_outage], color=_COLOURS[name], linewidth=0.5, label=label)


def _draw_growth(
    axes: Axes, outage: OutageErrors, name: str, label: str, colour: str, style: str = "-"
) -> None:
    since = outage.time - outage.spans[outage.outage, 0]
    moments, moment_index = np.unique(np.round(since, 2), return_inverse=True)
    counts = np.bincount(moment_index)
    squares = np.bincount(moment_index, weights=(outage.errors[name] ** 2).sum(axis=1))
    complete = counts == outage.n
    if not complete.any():  # the outages have their fixes at different times
        edges = np.linspace(0.0, outage.seconds, 21)
        moments = 0.5 * (edges[1:] + edges[:-1])
        moment_index = np.clip(np.digitize(since, edges) - 1, 0, len(moments) - 1)
        counts = np.bincount(moment_index, minlength=len(moments))
        squares = np.bincount(
            moment_index, weights=(outage.errors[name] ** 2).sum(axis=1), minlength=len(moments)
        )
        complete = counts > 0
    rms = np.sqrt(squares[complete] / counts[complete])
    axes.plot(moments[complete], rms, style, color=colour, linewidth=0.9, label=label)
