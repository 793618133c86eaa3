"""A report as a page that stands alone, as a paragraph, and as a figure."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator
from html import escape
from typing import TYPE_CHECKING, Final

import numpy as np

from zerorate._native import __version__
from zerorate.findings.imus import BLOCK, Imu, Sensor, imus
from zerorate.findings.limits import LIMITS
from zerorate.show.report_document import document
from zerorate.show.style import (
    GREEN,
    GREY_TEXT,
    ORANGE,
    VERMILION,
    new_figure,
    style_panels,
    write_title,
)
from zerorate.show.tables import prose

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from zerorate.findings.finding import Finding
    from zerorate.findings.limits import Limit
    from zerorate.findings.report import Report
    from zerorate.types import Floats

_WIDE, _TALL = 1000.0, 200.0
"""Size of a figure, in its own units."""
_CODE: Final = re.compile("`([^`]*)`")
_COLUMNS: Final = 1000
"""Columns of a figure, each with the least and the largest sample in it."""
_MARKS: Final = 200
"""Spans that are marked in a figure."""
_SHOWN: Final = 12
"""Findings that a terminal shows."""
_TERMINAL_SPANS: Final = 3
_COLOURS: Final = {"act": VERMILION, "look": ORANGE, "good": GREEN}
_ABOUT: Final = (
    "It says what is seen, never the cause. The limits, with their sources, stand at the end. "
    "Not looked at: folded peaks, limits that are not flat."
)


def format_report(report: Report) -> str:
    """Return the summary, and what to act on and look at, one sentence each."""
    lines = [prose(f"{report.source.rpartition('/')[2]}: {report.summary}")]
    lines.extend(prose(_line(of_kind), hang="      ") for of_kind in _by_kind(report))
    if report.empty:
        lines.append(prose(f"No data for: {', '.join(report.empty)}."))
    return "\n".join(lines)


def _by_kind(report: Report) -> list[list[Finding]]:
    """Return what is to act on and to look at, those of one kind together."""
    kinds: dict[tuple[str, str], list[Finding]] = {}
    for one in report.urgent:
        kinds.setdefault((one.severity, one.kind), []).append(one)
    return list(kinds.values())


def _line(of_kind: list[Finding]) -> str:
    """Return the first finding of a kind, when it is seen, and how many others there are."""
    one, more = of_kind[0], len(of_kind) - 1
    when = f" [{_times(one, _TERMINAL_SPANS)}]" if one.spans else ""
    others = f" {more} more of this kind, on the page." if more else ""
    return f"{one.severity}: {one.text}{when}{others}"


def plot_report(report: Report) -> Figure:
    """Return a bar for each span that a finding rests on, those to act on above."""
    found = [one for one in report.urgent if one.spans][:_SHOWN]
    figure = new_figure(85.0, 22.0 + 5.0 * max(1, len(found)))
    axes = figure.add_axes((0.34, 0.2, 0.62, 0.6))
    for row, one in enumerate(reversed(found)):
        bars = [(begin, end - begin) for begin, end in one.spans]
        axes.broken_barh(bars, (row - 0.3, 0.6), color=_COLOURS[one.severity])
    axes.set_yticks(range(len(found)), [f"{one.severity}: {one.kind}" for one in reversed(found)])
    axes.set_xlabel("time, s")
    if not found:
        axes.text(0.5, 0.5, report.summary, ha="center", color=GREY_TEXT, transform=axes.transAxes)
    style_panels([axes])
    axes.set_yticks(range(len(found)), [f"{one.severity}: {one.kind}" for one in reversed(found)])
    write_title(figure, "When it is seen")
    return figure


def report_page(report: Report) -> str:
    """Return the page as HTML, with figures in it, no other file and no network."""
    title = f"{report.source.rpartition('/')[2]}: report of the IMU"
    return document(title, _body(report))


def _body(report: Report) -> Iterator[str]:
    found = imus(report.recording)
    yield f'<p class="summary">{escape(report.summary)}</p>'
    yield f'<p class="about">{escape(_ABOUT)} zerorate {__version__}.</p>'
    if report.urgent:
        yield f'<h2 id="first">What to see first</h2>\n{_first(report)}'
    named = {one.section: None for one in report.findings}
    links = (f'<a href="#{_anchor(name)}">{escape(name)}</a>' for name in named)
    yield f'<nav aria-label="Sections">{"".join(links)}<a href="#figures">Figures</a></nav>'
    for name in named:
        of_it = tuple(one for one in report.findings if one.section == name)
        yield f'<section id="{_anchor(name)}">\n<h2>{escape(name)}</h2>'
        yield f"{_listed(of_it)}\n</section>"
    if report.empty:
        yield f'<p class="about">No data for: {escape(", ".join(report.empty))}.</p>'
    yield from _figures(report, found)
    yield _limits()


def _anchor(name: str) -> str:
    return "section-" + "-".join(name.lower().split())


def _listed(found: tuple[Finding, ...]) -> str:
    return f'<ul class="findings">\n{"".join(map(_finding, found))}</ul>'


def _first(report: Report) -> str:
    """Return the first finding of each kind that is urgent, and how many others there are."""
    found = "".join(_finding(one, len(others)) for one, *others in _by_kind(report))
    return f'<ul class="findings">\n{found}</ul>'


def _finding(one: Finding, others: int = 0) -> str:
    parts = [f'<b class="{one.severity}">{one.severity}</b> {escape(one.text)}']
    told = [_link(one)] if one.figure else []
    if one.spans and not one.figure:
        told.append(f"Seen at {_times(one, 4)}.")
    if one.advice and one.severity != "good":
        told.append(_CODE.sub(r"<code>\1</code>", escape(one.advice)))
    if others:
        told.append(f'<a href="#{_anchor(one.section)}">{others} more of this kind</a>.')
    if told:
        parts.append(f'<div class="more">{" ".join(told)}</div>')
    if one.code:
        parts.append(
            f"<details><summary>The lines for {escape(one.kind)}</summary>"
            f'<pre tabindex="0">{escape(one.code)}</pre></details>'
        )
    return f'<li class="{one.severity}">{"".join(parts)}</li>\n'


def _link(one: Finding) -> str:
    """Return a link to the figure of a finding, which then shows its first span."""
    if not one.spans:
        return f'<a href="#{one.figure}">Figure of {escape(one.figure.partition("-")[2])}</a>.'
    begin, end = one.spans[0]
    at = f'data-from="{begin:.3f}" data-to="{end:.3f}"'
    return f'<a href="#{one.figure}" {at}>Seen at {_times(one, 4)}</a>.'


def _times(one: Finding, most: int) -> str:
    listed = ", ".join(f"{a:.2f}-{b:.2f}" for a, b in one.spans[:most])
    more = len(one.spans) - most
    return f"{listed} s and {more} more times" if more > 0 else f"{listed} s"


def _figures(report: Report, found: tuple[Imu, ...]) -> Iterator[str]:
    sensors = [(imu, one) for imu in found for one in imu.sensors]
    seconds = max(float(one.log.sampled[-1]) - one.start for _, one in sensors)
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
    for imu, one in sensors:
        yield _figure(report, imu, one, max(seconds, 1e-9))
    yield "</section>"


def _figure(report: Report, imu: Imu, one: Sensor, seconds: float) -> str:
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
    label = f"{one.name} over {seconds:.4g} s, from {low:.3g} to {high:.3g} {unit}, x, y and z"
    keys = " ".join(f'<span class="key {axis}">{axis}</span>' for axis in "xyz")
    return (
        f'<figure id="{one.figure}">\n<figcaption>{escape(one.name)}, {escape(unit)}, '
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


def _limits() -> str:
    rows = "".join(map(_limit, LIMITS.values()))
    head = "<tr><th>finding</th><th>look</th><th>act</th><th>unit</th><th>source</th></tr>"
    return (
        '<section id="limits">\n<h2>Limits</h2>\n<div class="wide" tabindex="0" role="region" '
        f'aria-label="Limits"><table><thead>{head}</thead><tbody>{rows}</tbody></table></div>\n</section>'
    )


def _limit(one: Limit) -> str:
    cells = (one.what, limit_text(one.look), limit_text(one.act), one.unit, one.source)
    return f"<tr>{''.join(f'<td>{escape(cell)}</td>' for cell in cells)}</tr>"


def limit_text(value: float) -> str:
    """Return a limit as a table shows it, a dash where there is none."""
    return f"{value:.3g}" if math.isfinite(value) else "–"
