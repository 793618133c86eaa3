"""Overview of reports on many logs: urgent logs first, and trends of each device."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from datetime import UTC, datetime
from html import escape
from pathlib import Path, PurePosixPath
from typing import TYPE_CHECKING, Final, NamedTuple
from urllib.parse import quote

from zerorate._native import __version__
from zerorate.faults import render_text
from zerorate.findings.limits import LIMITS
from zerorate.numerals import format_significant, format_with_error, shorten
from zerorate.show.report_document import document
from zerorate.tasks.batch.task import COMMANDS

if TYPE_CHECKING:
    from zerorate.tasks.batch.command import Row
    from zerorate.tasks.batch.run import BatchResult
    from zerorate.tasks.batch.task import Outcome

TREND_KINDS: Final = (
    "gyro bias", "gravity", "gyro noise", "accel noise", "scale x", "scale y", "scale z",
    "vibration",
)  # fmt: skip
"""Kinds of findings with a curve over the logs of a device."""
_WIDE, _TALL = 600.0, 120.0
_LINE_CLASSES: Final = "xyz"
"""Colour classes of the sensors of a device, in order."""
_ABOUT_TEXT: Final = (
    "One row for each log, the most urgent first. A device is identified by the board number in "
    "the log, else by the log's folder. Logs of a device are in order of date if all have one, "
    "else of name."
)


class LogSummary(NamedTuple):
    """A log with its number of findings by severity."""

    outcome: Outcome
    act: int
    look: int
    first: str
    """Sentence to read first."""

    @property
    def device(self) -> str:
        """Serial number of the board, or the folder of the log."""
        known = next((str(r["device"]) for r in self.outcome.rows if r.get("device")), "")
        folder = PurePosixPath(self.outcome.name).parent.as_posix()
        return known or ("this folder" if folder == "." else folder)

    @property
    def began(self) -> float | None:
        """Unix time at the start of the log, s."""
        start = next((r["began"] for r in self.outcome.rows if r.get("began") is not None), None)
        return start if isinstance(start, float) else None


def summarise_logs(outcomes: Iterable[Outcome]) -> list[LogSummary]:
    """Return the logs: first unreadable logs, then logs with the most urgent findings."""
    logs = [_summarise_log(one) for one in outcomes]
    logs.sort(key=lambda one: (one.outcome.error is None, -one.act, -one.look, one.outcome.name))
    return logs


def _summarise_log(outcome: Outcome) -> LogSummary:
    counts = {
        severity: [r for r in outcome.rows if r["severity"] == severity]
        for severity in ("act", "look")
    }
    urgent = [*counts["act"], *counts["look"]]
    first = str(urgent[0]["text"]) if urgent else "No number of this log exceeds a limit."
    return LogSummary(
        outcome, len(counts["act"]), len(counts["look"]), render_text(outcome.error or first)
    )


def overview_page(result: BatchResult) -> str:
    """Return an HTML page on a batch of reports, with links to its logs."""
    return document(
        f"Reports on {len(result.in_summary)} logs", _make_body(summarise_logs(result.in_summary))
    )


def summary_line(logs: Sequence[LogSummary]) -> str:
    """Return a line that summarises all logs."""
    failed = sum(log.outcome.error is not None for log in logs)
    act = sum(bool(log.act) for log in logs)
    look = sum(bool(log.look) and not log.act for log in logs)
    unread = f"{failed} could not be read; " if failed else ""
    good = len(logs) - failed - act - look
    return f"{unread}{act} with something to act on, {look} to look at, {good} within all limits."


def _make_body(logs: Sequence[LogSummary]) -> Iterator[str]:
    yield f'<p class="summary">{escape(summary_line(logs))}</p>'
    yield f'<p class="about">{escape(_ABOUT_TEXT)} zerorate {__version__}.</p>'
    head = "".join(
        f'<th scope="col">{name}</th>' for name in ("log", "act", "look", "read first", "device")
    )
    rows = "\n".join(map(_make_row, logs))
    yield (
        '<section id="logs">\n<h2>Logs</h2>\n<div class="wide" tabindex="0" role="region" '
        f'aria-label="Logs"><table class="logs"><thead><tr>{head}</tr></thead><tbody>{rows}</tbody>'
        "</table></div>\n</section>"
    )
    yield from _make_trends(logs)


def _make_row(log: LogSummary) -> str:
    severity = "act" if log.act or log.outcome.error else "look" if log.look else "good"
    word = "unread" if log.outcome.error else severity
    name = escape(log.outcome.name)
    if log.outcome.error is None:
        page, _ = COMMANDS["report"].paths(Path(log.outcome.name), "")
        name = f'<a href="{quote(page.as_posix())}">{name}</a>'
    date_text = "" if log.began is None else f", {_format_day(log.began)}"
    return (
        f'<tr class="{severity}"><th scope="row">{name}</th><td>{log.act}</td><td>{log.look}</td>'
        f'<td><b class="{severity}">{word}</b> {escape(log.first)}</td>'
        f"<td>{escape(log.device)}{date_text}</td></tr>"
    )


def _format_day(seconds: float) -> str:
    return datetime.fromtimestamp(seconds, UTC).strftime("%Y-%m-%d")


def _make_trends(logs: Sequence[LogSummary]) -> Iterator[str]:
    devices: dict[str, list[LogSummary]] = {}
    for log in logs:
        if log.outcome.rows:
            devices.setdefault(log.device, []).append(log)
    parts = [
        part
        for name, device_logs in sorted(devices.items())
        for part in _device_trends(name, device_logs)
    ]
    if parts:
        yield '<section id="trends">\n<h2>Trends</h2>'
        yield from parts
        yield "</section>"


def _device_trends(name: str, logs: Sequence[LogSummary]) -> Iterator[str]:
    ordered = sorted(logs, key=lambda one: one.outcome.name)
    if all(one.began is not None for one in logs):
        ordered.sort(key=lambda one: one.began or 0.0)
    figures = [part for kind in TREND_KINDS if (part := _make_trend(kind, ordered))]
    if figures:
        yield f"<h3>{escape(name)}: {len(logs)} logs</h3>"
        yield from figures


class _Point(NamedTuple):
    log_index: int
    value: float
    sigma: float


def _make_trend(kind: str, logs: Sequence[LogSummary]) -> str:
    """Return the curve of a kind of finding over a device's logs; empty with fewer than two."""
    lines: dict[str, list[_Point]] = {}
    unit = ""
    for index, log in enumerate(logs):
        for row in log.outcome.rows:
            point = _make_point(index, row)
            if row["kind"] == kind and point is not None:
                unit = str(row["unit"])
                lines.setdefault(str(row["axis"]), []).append(point)
    lines = {sensor: points for sensor, points in lines.items() if len(points) > 1}
    if not lines:
        return ""
    return _draw_trend(kind, unit, lines, len(logs))


def _make_point(index: int, row: Row) -> _Point | None:
    value, sigma = row.get("value"), row.get("sigma")
    if not isinstance(value, float) or not math.isfinite(value):
        return None
    return _Point(index, value, sigma if isinstance(sigma, float) else 0.0)


def _draw_trend(kind: str, unit: str, lines: dict[str, list[_Point]], count: int) -> str:
    points = [point for line_points in lines.values() for point in line_points]
    low = min(point.value - point.sigma for point in points)
    high = max(point.value + point.sigma for point in points)
    room = 0.08 * (high - low) or abs(high) or 1.0
    low, high = low - room, high + room
    across = _WIDE / max(1, count - 1)

    def up(value: float) -> float:
        return _TALL * (high - value) / (high - low)

    paths = []
    limit = LIMITS.get(kind)
    for level in () if limit is None else ("look", "act"):
        value = getattr(limit, level)
        if low < value < high:
            paths.append(f'<path class="{level}" d="M0 {up(value):.1f}H{_WIDE:g}"/>')
    for colour, line_points in zip(_cycle_colours(), lines.values(), strict=False):
        line = "".join(
            f"{'M' if i == 0 else 'L'}{across * point.log_index:.1f} {up(point.value):.1f}"
            for i, point in enumerate(line_points)
        )
        bars = "".join(
            f"M{across * point.log_index:.1f} {up(point.value - point.sigma):.1f}"
            f"V{up(point.value + point.sigma):.1f}"
            for point in line_points
            if point.sigma
        )
        paths.append(f'<path class="{colour}" d="{line}{bars}"/>')
    description = "; ".join(
        _describe_trend(sensor, line_points, unit) for sensor, line_points in lines.items()
    )
    keys = " ".join(
        f'<span class="key {colour}">{escape(sensor or kind)}</span>'
        for colour, sensor in zip(_cycle_colours(), lines, strict=False)
    )
    what = kind if limit is None else limit.what
    text = f"{what}{', ' + unit if unit else ''}"
    return (
        f'<figure class="trend"><figcaption>{escape(text)} '
        f"{keys}<br>{escape(description)}</figcaption>"
        f'<svg role="img" aria-label="{escape(f"{kind} over {count} logs: {description}")}" '
        f'viewBox="0 0 {_WIDE:g} {_TALL:g}" preserveAspectRatio="none">{"".join(paths)}</svg>'
        f'<div class="scale"><span>{shorten(low, 3)} to {shorten(high, 3)}</span></div></figure>'
    )


def _cycle_colours() -> Iterator[str]:
    while True:
        yield from _LINE_CLASSES


def _describe_trend(sensor: str, points: Sequence[_Point], unit: str) -> str:
    first, last = points[0], points[-1]
    return (
        f"{sensor}: {_format_point(first)}, at last "
        f"{_format_point(last)}{' ' + unit if unit else ''}"
    )


def _format_point(point: _Point) -> str:
    return (
        format_with_error(point.value, point.sigma)
        if point.sigma
        else format_significant(point.value)
    )
