"""The overview of reports on many logs: what needs a person first, and trends of each device."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from datetime import UTC, datetime
from html import escape
from pathlib import Path, PurePosixPath
from typing import TYPE_CHECKING, Final, NamedTuple
from urllib.parse import quote

from zerorate._native import __version__
from zerorate.faults import told
from zerorate.findings.limits import LIMITS
from zerorate.numerals import significant, with_error
from zerorate.show.report_document import document
from zerorate.tasks.batch.task import COMMANDS

if TYPE_CHECKING:
    from zerorate.tasks.batch.command import Row
    from zerorate.tasks.batch.run import BatchResult
    from zerorate.tasks.batch.task import Outcome

TRENDS: Final = (
    "gyro bias", "gravity", "gyro noise", "accel noise", "scale x", "scale y", "scale z",
    "vibration",
)  # fmt: skip
"""Kinds of findings whose numbers are drawn over the logs of a device."""
_WIDE, _TALL = 600.0, 120.0
_LINES: Final = "xyz"
"""Colours of the sensors of a device, in their order."""
_ABOUT: Final = (
    "A row a log, what needs a person first. A device is the board whose number the log holds, "
    "else the folder of the log. Logs of a device are in the order of their dates where all have "
    "one, else of their names."
)


class Judged(NamedTuple):
    """A log with how many of its findings are of which severity."""

    outcome: Outcome
    act: int
    look: int
    first: str
    """The sentence to read first."""

    @property
    def device(self) -> str:
        """The number of its board, or its folder."""
        known = next((str(r["device"]) for r in self.outcome.rows if r.get("device")), "")
        folder = PurePosixPath(self.outcome.name).parent.as_posix()
        return known or ("this folder" if folder == "." else folder)

    @property
    def began(self) -> float | None:
        """Unix time at which it begins, s."""
        found = next((r["began"] for r in self.outcome.rows if r.get("began") is not None), None)
        return found if isinstance(found, float) else None


def judged(outcomes: Iterable[Outcome]) -> list[Judged]:
    """Return the logs, what needs a person first: unread ones, then most to act on."""
    found = [_judged(one) for one in outcomes]
    found.sort(key=lambda one: (one.outcome.error is None, -one.act, -one.look, one.outcome.name))
    return found


def _judged(outcome: Outcome) -> Judged:
    counts = {how: [r for r in outcome.rows if r["severity"] == how] for how in ("act", "look")}
    urgent = [*counts["act"], *counts["look"]]
    first = str(urgent[0]["text"]) if urgent else "Nothing in this log passes a limit."
    return Judged(outcome, len(counts["act"]), len(counts["look"]), told(outcome.error or first))


def overview_page(result: BatchResult) -> str:
    """Return the page on a batch of reports as HTML: it stands alone but for links to its logs."""
    return document(f"Reports on {len(result.outcomes)} logs", _body(judged(result.outcomes)))


def summary(logs: Sequence[Judged]) -> str:
    """Return one line on all logs."""
    failed = sum(one.outcome.error is not None for one in logs)
    act = sum(bool(one.act) for one in logs)
    look = sum(bool(one.look) and not one.act for one in logs)
    unread = f"{failed} could not be read; " if failed else ""
    rest = len(logs) - failed - act - look
    return f"{unread}{act} with something to act on, {look} to look at, {rest} within all limits."


def _body(logs: Sequence[Judged]) -> Iterator[str]:
    yield f'<p class="summary">{escape(summary(logs))}</p>'
    yield f'<p class="about">{escape(_ABOUT)} zerorate {__version__}.</p>'
    head = "".join(
        f'<th scope="col">{name}</th>' for name in ("log", "act", "look", "read first", "device")
    )
    rows = "\n".join(map(_row, logs))
    yield (
        '<section id="logs">\n<h2>Logs</h2>\n<div class="wide" tabindex="0" role="region" '
        f'aria-label="Logs"><table class="logs"><thead><tr>{head}</tr></thead><tbody>{rows}</tbody>'
        "</table></div>\n</section>"
    )
    yield from _trends(logs)


def _row(one: Judged) -> str:
    how = "act" if one.act or one.outcome.error else "look" if one.look else "good"
    word = "unread" if one.outcome.error else how
    name = escape(one.outcome.name)
    if one.outcome.error is None:
        page, _ = COMMANDS["report"].paths(Path(one.outcome.name), "")
        name = f'<a href="{quote(page.as_posix())}">{name}</a>'
    dated = "" if one.began is None else f", {_day(one.began)}"
    return (
        f'<tr class="{how}"><th scope="row">{name}</th><td>{one.act}</td><td>{one.look}</td>'
        f'<td><b class="{how}">{word}</b> {escape(one.first)}</td>'
        f"<td>{escape(one.device)}{dated}</td></tr>"
    )


def _day(seconds: float) -> str:
    return datetime.fromtimestamp(seconds, UTC).strftime("%Y-%m-%d")


def _trends(logs: Sequence[Judged]) -> Iterator[str]:
    devices: dict[str, list[Judged]] = {}
    for one in logs:
        if one.outcome.rows:
            devices.setdefault(one.device, []).append(one)
    parts = [part for name, of in sorted(devices.items()) for part in _of_device(name, of)]
    if parts:
        yield '<section id="trends">\n<h2>Trends</h2>'
        yield from parts
        yield "</section>"


def _of_device(name: str, logs: Sequence[Judged]) -> Iterator[str]:
    ordered = sorted(logs, key=lambda one: one.outcome.name)
    if all(one.began is not None for one in logs):
        ordered.sort(key=lambda one: one.began or 0.0)
    drawn = [part for kind in TRENDS if (part := _trend(kind, ordered))]
    if drawn:
        yield f"<h3>{escape(name)}: {len(logs)} logs</h3>"
        yield from drawn


class _Point(NamedTuple):
    place: int
    value: float
    sigma: float


def _trend(kind: str, logs: Sequence[Judged]) -> str:
    """Return the numbers of one kind over the logs of a device, empty where there are not two."""
    lines: dict[str, list[_Point]] = {}
    unit = ""
    for place, log in enumerate(logs):
        for row in log.outcome.rows:
            point = _point(place, row)
            if row["kind"] == kind and point is not None:
                unit = str(row["unit"])
                lines.setdefault(str(row["axis"]), []).append(point)
    lines = {sensor: points for sensor, points in lines.items() if len(points) > 1}
    if not lines:
        return ""
    return _figure(kind, unit, lines, len(logs))


def _point(place: int, row: Row) -> _Point | None:
    value, sigma = row.get("value"), row.get("sigma")
    if not isinstance(value, float) or not math.isfinite(value):
        return None
    return _Point(place, value, sigma if isinstance(sigma, float) else 0.0)


def _figure(kind: str, unit: str, lines: dict[str, list[_Point]], count: int) -> str:
    points = [one for of in lines.values() for one in of]
    low = min(one.value - one.sigma for one in points)
    high = max(one.value + one.sigma for one in points)
    room = 0.08 * (high - low) or abs(high) or 1.0
    low, high = low - room, high + room
    across = _WIDE / max(1, count - 1)

    def up(value: float) -> float:
        return _TALL * (high - value) / (high - low)

    drawn = []
    limit = LIMITS.get(kind)
    for level in () if limit is None else ("look", "act"):
        value = getattr(limit, level)
        if low < value < high:
            drawn.append(f'<path class="{level}" d="M0 {up(value):.1f}H{_WIDE:g}"/>')
    for colour, of in zip(_colours(), lines.values(), strict=False):
        line = "".join(
            f"{'M' if i == 0 else 'L'}{across * one.place:.1f} {up(one.value):.1f}"
            for i, one in enumerate(of)
        )
        bars = "".join(
            f"M{across * one.place:.1f} {up(one.value - one.sigma):.1f}"
            f"V{up(one.value + one.sigma):.1f}"
            for one in of
            if one.sigma
        )
        drawn.append(f'<path class="{colour}" d="{line}{bars}"/>')
    told = "; ".join(_told(sensor, of, unit) for sensor, of in lines.items())
    keys = " ".join(
        f'<span class="key {colour}">{escape(sensor or kind)}</span>'
        for colour, sensor in zip(_colours(), lines, strict=False)
    )
    what = kind if limit is None else limit.what
    text = f"{what}{', ' + unit if unit else ''}"
    return (
        f'<figure class="trend"><figcaption>{escape(text)} {keys}<br>{escape(told)}</figcaption>'
        f'<svg role="img" aria-label="{escape(f"{kind} over {count} logs: {told}")}" '
        f'viewBox="0 0 {_WIDE:g} {_TALL:g}" preserveAspectRatio="none">{"".join(drawn)}</svg>'
        f'<div class="scale"><span>{low:.3g} to {high:.3g}</span></div></figure>'
    )


def _colours() -> Iterator[str]:
    while True:
        yield from _LINES


def _told(sensor: str, points: Sequence[_Point], unit: str) -> str:
    first, last = points[0], points[-1]
    return f"{sensor}: {_number(first)}, at last {_number(last)}{' ' + unit if unit else ''}"


def _number(one: _Point) -> str:
    return with_error(one.value, one.sigma) if one.sigma else significant(one.value)
