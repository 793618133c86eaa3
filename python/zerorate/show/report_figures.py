"""The figures of a report: samples over time as least and largest of columns, spans marked."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from html import escape
from typing import TYPE_CHECKING, Final

import numpy as np

from zerorate.findings.imus import BLOCK, Imu, Sensor, imus

if TYPE_CHECKING:
    from zerorate.findings.report import Report
    from zerorate.types import Floats

_WIDE, _TALL = 1000.0, 200.0
"""Size of a figure, in its own units."""
_COLUMNS: Final = 1000
"""Columns of a figure, each with the least and the largest sample in it."""
_MARKS: Final = 200
"""Spans that are marked in a figure."""


def seconds_of(found: tuple[Imu, ...]) -> float:
    """Return how long the longest log of a recording is, s."""
    sensors = [one for imu in found for one in imu.sensors]
    return max(1e-9, *(float(one.log.sampled[-1]) - one.start for one in sensors))


def log_figures(reports: Sequence[tuple[str, Report]], seconds: float) -> Iterator[str]:
    """Yield the figures of reports, side by side, whose anchors begin as is told."""
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
        for imu in imus(report.recording):
            for one in imu.sensors:
                yield _figure(report, imu, one, seconds, prefix)
        yield "</div>"
    yield "</div>\n</section>"


def _figure(report: Report, imu: Imu, one: Sensor, seconds: float, prefix: str) -> str:
    unit = "deg/s" if one.name.startswith("gyro") else "m/s²"
    factor = one.factor if one.factor is not None else 1.0
    factor = math.degrees(factor) if unit == "deg/s" and one.factor is not None else factor
    unit = unit if one.factor is not None else one.log.unit
    times, lows, highs = _envelope(one, factor)
    known = np.isfinite(lows)
    low, high = (float(lows[known].min()), float(highs[known].max())) if known.any() else (0.0, 1.0)
    room = 0.03 * (high - low) or 1.0
    low, high = low - room, high + room
    across = _WIDE * times / seconds
    paths = "".join(
        f'<path class="{axis}" d="{_path(across, *curves)}"/>'
        for axis, *curves in zip(
            "xyz", _up(lows, low, high).T, _up(highs, low, high).T, strict=True
        )
    )
    marks = "".join(_marks(report, imu, one, seconds))
    name = f"{prefix.replace('-', ' ')}{one.name}"
    label = f"{name} over {seconds:.4g} s, from {low:.3g} to {high:.3g} {unit}, x, y and z"
    keys = " ".join(f'<span class="key {axis}">{axis}</span>' for axis in "xyz")
    return (
        f'<figure id="{prefix}{one.figure}">\n<figcaption>{escape(name)}, {escape(unit)}, '
        f"{low:.4g} to {high:.4g} {keys}</figcaption>\n"
        f'<svg class="plot" role="img" aria-label="{escape(label)}" data-seconds="{seconds:.6f}" '
        f'viewBox="0 0 {_WIDE:g} {_TALL:g}" preserveAspectRatio="none">{marks}{paths}</svg>\n'
        '<div class="scale"><span class="from">0 s</span>'
        f'<span class="to">{seconds:.2f} s</span></div>'
        "\n</figure>"
    )


def _envelope(one: Sensor, factor: float) -> tuple[Floats, Floats, Floats]:
    """Return times since the beginning, and the least and largest samples of each column."""
    log = one.log
    if log.n <= _COLUMNS:
        values = factor * log.data
        return log.sampled - one.start, values, values
    starts = np.unique(np.linspace(0, log.n, _COLUMNS + 1).astype(np.int64)[:-1])
    lows = np.stack([np.fmin.reduceat(column, starts) for column in log.data.T], axis=1)
    highs = np.stack([np.fmax.reduceat(column, starts) for column in log.data.T], axis=1)
    return log.sampled[starts] - one.start, factor * lows, factor * highs


def _up(values: Floats, low: float, high: float) -> Floats:
    return np.asarray(_TALL * (high - values) / (high - low))


def _path(across: Floats, lows: Floats, highs: Floats) -> str:
    """Return a line through the least and the largest of each column, broken where none is."""
    parts, on = [], False
    for x, a, b in zip(across.tolist(), lows.tolist(), highs.tolist(), strict=True):
        if not (math.isfinite(a) and math.isfinite(b)):
            on = False
            continue
        parts.append(f"{'L' if on else 'M'}{x:.1f} {a:.1f}" + (f"V{b:.1f}" if a != b else ""))
        on = True
    return "".join(parts)


def _marks(report: Report, imu: Imu, one: Sensor, seconds: float) -> Iterator[str]:
    for rest in imu.rests[:_MARKS]:
        yield _rectangle(BLOCK * rest.first, BLOCK * rest.last, seconds, "rest")
    spans = [(f, span) for f in report.urgent if f.figure == one.figure for span in f.spans]
    for finding, (begin, end) in spans[:_MARKS]:
        yield _rectangle(begin, end, seconds, finding.severity)


def _rectangle(begin: float, end: float, seconds: float, kind: str) -> str:
    left, width = _WIDE * begin / seconds, max(1.0, _WIDE * (end - begin) / seconds)
    return f'<rect class="{kind}" x="{left:.1f}" y="0" width="{width:.1f}" height="{_TALL:g}"/>'
