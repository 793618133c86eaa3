"""Figures of a report: minimum and maximum of the samples over time, with marked spans."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from html import escape
from typing import TYPE_CHECKING, Final, NamedTuple

import numpy as np

from zerorate.findings.imus import BLOCK_S, Imu, Sensor, find_imus

if TYPE_CHECKING:
    from zerorate.findings.report import Report
    from zerorate.types import Floats

_VIEW_WIDTH, _VIEW_HEIGHT = 1000.0, 200.0
"""Width and height of a figure, in its own units."""
_COLUMN_COUNT: Final = 1000
"""Number of columns in a figure; each shows its smallest and its largest sample."""
_ROW_TICKS, _COLUMN_TICKS = 4, 6
"""Approximate number of ticks on both axes, the same as in the page's script."""
_MAX_MARKS: Final = 200
"""Largest number of marked spans in a figure."""
_MAX_MARKED_SHARE: Final = 0.9
"""Share of the time above which spans are not marked."""


def longest_duration(imu_list: tuple[Imu, ...]) -> float:
    """Return the duration of a recording's longest log, s."""
    sensors = [sensor for imu in imu_list for sensor in imu.sensors]
    return max(1e-9, *(float(sensor.log.sampled[-1]) - sensor.start for sensor in sensors))


def log_figures(reports: Sequence[tuple[str, Report]], seconds: float) -> Iterator[str]:
    """Yield the figures of reports next to each other; their anchors have a prefix."""
    steps = {
        "closer": "Closer",
        "wider": "Wider",
        "left": "Earlier",
        "right": "Later",
        "all": "All",
    }
    buttons = (f'<button type="button" data-step="{k}">{v}</button>' for k, v in steps.items())
    yield '<section id="figures">\n<h2>Figures</h2>'
    yield (
        '<p class="about">Time [s] since the start of the log, the same for all figures. Sensors '
        "of one quantity share a scale. Grey: static intervals. Coloured: times of a finding, "
        "unless these are nearly all the time.</p>"
    )
    yield f'<div class="bar" hidden role="group" aria-label="Time axis">{"".join(buttons)}</div>'
    yield '<div class="sides">'
    for prefix, report in reports:
        yield "<div>"
        imus = find_imus(report.recording)
        drawn = {sensor.name: _curves_of(sensor) for imu in imus for sensor in imu.sensors}
        for imu in imus:
            for sensor in imu.sensors:
                curves = drawn[sensor.name]
                limits = _common_range(one for one in drawn.values() if one.unit == curves.unit)
                yield _draw_sensor(report, imu, sensor, seconds, prefix, curves, limits)
        yield "</div>"
    yield "</div>\n</section>"


class _Curves(NamedTuple):
    """Smallest and largest samples of each column of a figure, with their unit."""

    times: Floats
    lows: Floats
    highs: Floats
    unit: str


def _curves_of(sensor: Sensor) -> _Curves:
    """Return the curves of a sensor in deg/s or m/s², or in its own unit if it is unknown."""
    unit = "deg/s" if sensor.name.startswith("gyro") else "m/s²"
    if sensor.factor is None:
        return _Curves(*_column_extremes(sensor, 1.0), sensor.log.unit)
    factor = math.degrees(sensor.factor) if unit == "deg/s" else sensor.factor
    return _Curves(*_column_extremes(sensor, factor), unit)


def _common_range(curves: Iterable[_Curves]) -> tuple[float, float]:
    """Return the common range of all sensors of one quantity, with a margin."""
    bounds = [
        (float(one.lows[finite].min()), float(one.highs[finite].max()))
        for one in curves
        if (finite := np.isfinite(one.lows)).any()
    ]
    low, high = min((a for a, _ in bounds), default=0.0), max((b for _, b in bounds), default=1.0)
    margin = 0.03 * (high - low) or 1.0
    return low - margin, high + margin


def _draw_sensor(
    report: Report,
    imu: Imu,
    sensor: Sensor,
    seconds: float,
    prefix: str,
    curves: _Curves,
    limits: tuple[float, float],
) -> str:
    (low, high), unit = limits, curves.unit
    lows, highs = curves.lows, curves.highs
    positions = _VIEW_WIDTH * curves.times / seconds
    paths = "".join(
        f'<path class="{axis}" d="{_make_path(positions, *pair)}"/>'
        for axis, *pair in zip(
            "xyz", _to_view_y(lows, low, high).T, _to_view_y(highs, low, high).T, strict=True
        )
    )
    marks = "".join(_make_marks(report, imu, sensor, seconds))
    name = f"{prefix.replace('-', ' ')}{sensor.label}"
    label = f"{name} over {seconds:.4g} s, from {low:.3g} to {high:.3g} {unit}, x, y and z"
    keys = " ".join(f'<span class="key {axis}">{axis}</span>' for axis in "xyz")
    ticks = nice_ticks(low, high, _ROW_TICKS)
    heights = _to_view_y(np.array(ticks), low, high).tolist()
    lines = "".join(f'<path class="grid" d="M0 {y:.1f}H{_VIEW_WIDTH:g}"/>' for y in heights)
    rows = "".join(
        f'<span style="top:{100.0 * y / _VIEW_HEIGHT:.2f}%">{tick:g}</span>'
        for tick, y in zip(ticks, heights, strict=True)
    )
    columns = "".join(
        f'<span style="left:{100.0 * tick / seconds:.2f}%">{tick:g}</span>'
        for tick in nice_ticks(0.0, seconds, _COLUMN_TICKS)
    )
    return (
        f'<figure id="{prefix}{sensor.figure}">\n'
        f"<figcaption>{escape(name)} [{escape(unit)}] {keys}</figcaption>\n"
        f'<div class="frame"><div class="rows">{rows}</div>\n'
        f'<svg class="plot" role="img" aria-label="{escape(label)}" data-seconds="{seconds:.6f}" '
        f'viewBox="0 0 {_VIEW_WIDTH:g} {_VIEW_HEIGHT:g}" '
        f'preserveAspectRatio="none">{marks}{lines}{paths}</svg>\n'
        f'<div class="columns">{columns}</div></div>\n</figure>'
    )


def nice_ticks(low: float, high: float, count: int) -> list[float]:
    """Return multiples of 1, 2 or 5 times a power of ten in a range, at most about `count`.

    Examples
    --------
    >>> nice_ticks(-0.7, 1.3, 5)
    [-0.5, 0.0, 0.5, 1.0]
    """
    rough = (high - low) / count
    power = 10.0 ** math.floor(math.log10(rough))
    step = power * next(k for k in (1, 2, 5, 10) if k * power >= 0.999 * rough)
    digits = max(0, -math.floor(math.log10(step)))
    first, last = math.ceil(low / step), math.floor(high / step)
    return [round(k * step, digits) + 0.0 for k in range(first, last + 1)]


def _column_extremes(sensor: Sensor, factor: float) -> tuple[Floats, Floats, Floats]:
    """Return times since the start, and the smallest and largest sample of each column."""
    log = sensor.log
    if log.n <= _COLUMN_COUNT:
        values = factor * log.data
        return log.sampled - sensor.start, values, values
    starts = np.unique(np.linspace(0, log.n, _COLUMN_COUNT + 1).astype(np.int64)[:-1])
    lows = np.stack([np.fmin.reduceat(column, starts) for column in log.data.T], axis=1)
    highs = np.stack([np.fmax.reduceat(column, starts) for column in log.data.T], axis=1)
    return log.sampled[starts] - sensor.start, factor * lows, factor * highs


def _to_view_y(values: Floats, low: float, high: float) -> Floats:
    return np.asarray(_VIEW_HEIGHT * (high - values) / (high - low))


def _make_path(across: Floats, lows: Floats, highs: Floats) -> str:
    """Return a line through each column's minimum and maximum, with gaps for empty columns."""
    parts, in_line = [], False
    for x, a, b in zip(across.tolist(), lows.tolist(), highs.tolist(), strict=True):
        if not (math.isfinite(a) and math.isfinite(b)):
            in_line = False
            continue
        parts.append(f"{'L' if in_line else 'M'}{x:.1f} {a:.1f}" + (f"V{b:.1f}" if a != b else ""))
        in_line = True
    return "".join(parts)


def _make_marks(report: Report, imu: Imu, sensor: Sensor, seconds: float) -> Iterator[str]:
    for rest in imu.rests[:_MAX_MARKS]:
        yield _make_rectangle(BLOCK_S * rest.first, BLOCK_S * rest.last, seconds, "rest")
    spans = [
        (f, span)
        for f in report.urgent_findings
        if f.figure == sensor.figure
        and sum(end - begin for begin, end in f.spans) < _MAX_MARKED_SHARE * seconds
        for span in f.spans
    ]
    for finding, (begin, end) in spans[:_MAX_MARKS]:
        yield _make_rectangle(begin, end, seconds, finding.severity)


def _make_rectangle(begin: float, end: float, seconds: float, kind: str) -> str:
    left, width = _VIEW_WIDTH * begin / seconds, max(1.0, _VIEW_WIDTH * (end - begin) / seconds)
    return (
        f'<rect class="{kind}" x="{left:.1f}" y="0" width="{width:.1f}" height="{_VIEW_HEIGHT:g}"/>'
    )
