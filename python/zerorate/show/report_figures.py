"""The figures of a report: samples over time as least and largest of columns, spans marked."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from html import escape
from typing import TYPE_CHECKING, Final

import numpy as np

from zerorate.findings.imus import BLOCK_S, Imu, Sensor, find_imus
from zerorate.numerals import to_digits

if TYPE_CHECKING:
    from zerorate.findings.report import Report
    from zerorate.types import Floats

_VIEW_WIDTH, _VIEW_HEIGHT = 1000.0, 200.0
"""Size of a figure, in its own units."""
_COLUMN_COUNT: Final = 1000
"""Columns of a figure, each with the least and the largest sample in it."""
_MAX_MARKS: Final = 200
"""Spans that are marked in a figure."""


def longest_duration(imu_list: tuple[Imu, ...]) -> float:
    """Return the duration of the longest log of a recording, s."""
    sensors = [sensor for imu in imu_list for sensor in imu.sensors]
    return max(1e-9, *(float(sensor.log.sampled[-1]) - sensor.start for sensor in sensors))


def log_figures(reports: Sequence[tuple[str, Report]], seconds: float) -> Iterator[str]:
    """Yield the figures of reports, side by side, whose anchors begin with a prefix."""
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
        '<p class="about">All share one time axis, in seconds since the log began. Grey: rests; '
        "coloured: spans of findings.</p>"
    )
    yield f'<div class="bar" hidden role="group" aria-label="Time axis">{"".join(buttons)}</div>'
    yield '<div class="sides">'
    for prefix, report in reports:
        yield "<div>"
        for imu in find_imus(report.recording):
            for sensor in imu.sensors:
                yield _draw_sensor(report, imu, sensor, seconds, prefix)
        yield "</div>"
    yield "</div>\n</section>"


def _draw_sensor(report: Report, imu: Imu, sensor: Sensor, seconds: float, prefix: str) -> str:
    unit = "deg/s" if sensor.name.startswith("gyro") else "m/s²"
    factor = sensor.factor if sensor.factor is not None else 1.0
    factor = math.degrees(factor) if unit == "deg/s" and sensor.factor is not None else factor
    unit = unit if sensor.factor is not None else sensor.log.unit
    times, lows, highs = _column_extremes(sensor, factor)
    finite = np.isfinite(lows)
    low, high = (
        (float(lows[finite].min()), float(highs[finite].max())) if finite.any() else (0.0, 1.0)
    )
    margin = 0.03 * (high - low) or 1.0
    low, high = low - margin, high + margin
    positions = _VIEW_WIDTH * times / seconds
    paths = "".join(
        f'<path class="{axis}" d="{_make_path(positions, *curves)}"/>'
        for axis, *curves in zip(
            "xyz", _to_view_y(lows, low, high).T, _to_view_y(highs, low, high).T, strict=True
        )
    )
    marks = "".join(_make_marks(report, imu, sensor, seconds))
    name = f"{prefix.replace('-', ' ')}{sensor.name}"
    label = (
        f"{name} over {to_digits(seconds, 4)} s, from {to_digits(low)} to {to_digits(high)} "
        f"{unit}, x, y and z"
    )
    keys = " ".join(f'<span class="key {axis}">{axis}</span>' for axis in "xyz")
    return (
        f'<figure id="{prefix}{sensor.figure}">\n<figcaption>{escape(name)}, {escape(unit)}, '
        f"{to_digits(low, 4)} to {to_digits(high, 4)} {keys}</figcaption>\n"
        f'<svg class="plot" role="img" aria-label="{escape(label)}" data-seconds="{seconds:.6f}" '
        f'viewBox="0 0 {_VIEW_WIDTH:g} {_VIEW_HEIGHT:g}" '
        f'preserveAspectRatio="none">{marks}{paths}</svg>\n'
        '<div class="scale"><span class="from">0 s</span>'
        f'<span class="to">{seconds:.2f} s</span></div>'
        "\n</figure>"
    )


def _column_extremes(sensor: Sensor, factor: float) -> tuple[Floats, Floats, Floats]:
    """Return times since the beginning, and the least and largest samples of each column."""
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
    """Return a line through the least and the largest of each column, broken where none is."""
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
        (f, span) for f in report.urgent_findings if f.figure == sensor.figure for span in f.spans
    ]
    for finding, (begin, end) in spans[:_MAX_MARKS]:
        yield _make_rectangle(begin, end, seconds, finding.severity)


def _make_rectangle(begin: float, end: float, seconds: float, kind: str) -> str:
    left, width = _VIEW_WIDTH * begin / seconds, max(1.0, _VIEW_WIDTH * (end - begin) / seconds)
    return (
        f'<rect class="{kind}" x="{left:.1f}" y="0" width="{width:.1f}" height="{_VIEW_HEIGHT:g}"/>'
    )
