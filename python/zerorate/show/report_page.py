"""A report as a page that stands alone, as a paragraph, and as a figure."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator
from html import escape
from typing import TYPE_CHECKING, Final

from zerorate._native import __version__
from zerorate.findings.enter import SECTION as ENTER
from zerorate.findings.imus import imus
from zerorate.findings.limits import LIMITS
from zerorate.findings.record import SECTION as RECORD
from zerorate.show.report_document import document
from zerorate.show.report_figures import log_figures, seconds_of
from zerorate.show.style import (
    GREEN,
    ORANGE,
    VERMILION,
    add_panel,
    new_figure,
    style_panels,
    write_in_middle,
    write_title,
)
from zerorate.show.tables import prose

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from zerorate.findings.finding import Finding
    from zerorate.findings.limits import Limit
    from zerorate.findings.report import Report

_CODE: Final = re.compile("`([^`]*)`")
_ALIKE: Final = 2
"""Findings of one kind that are good, beyond which they are folded into one line."""
_NOTES: Final = (ENTER, RECORD)
"""Sections whose lines are judged by no limit."""
_OWN_LINES: Final = ("reading", "not identifiable")
"""Kinds whose sentences say different things."""
_SHOWN: Final = 12
"""Findings that a terminal shows."""
_TERMINAL_SPANS: Final = 3
_COLOURS: Final = {"act": VERMILION, "look": ORANGE, "good": GREEN}
_ABOUT: Final = (
    "It says what is seen, never the cause. The limits, with their sources, stand at the end. "
    "Not looked at: vibration that is too fast for the log."
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
    tall = 5.0 * max(1, len(found)) + 2.0
    figure = new_figure(110.0, tall + 18.0)
    axes = add_panel(figure, 38.0, 10.0, 67.0, tall)
    for row, one in enumerate(reversed(found)):
        bars = [(begin, end - begin) for begin, end in one.spans]
        axes.broken_barh(bars, (row - 0.3, 0.6), color=_COLOURS[one.severity])
    axes.set_xlabel("time, s")
    style_panels([axes])
    if not found:
        axes.xaxis.set_visible(False)
        write_in_middle(axes, report.summary)
    axes.set_yticks(range(len(found)), [f"{one.severity}: {one.kind}" for one in reversed(found)])
    write_title(figure, "When it is seen")
    return figure


def report_page(report: Report) -> str:
    """Return the page as HTML, with figures in it, no other file and no network."""
    title = f"{report.source.rpartition('/')[2]}: report of the IMU"
    return document(title, _body(report))


def _body(report: Report) -> Iterator[str]:
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
    yield from log_figures([("", report)], seconds_of(imus(report.recording)))
    yield limits_section()


def _anchor(name: str) -> str:
    return "section-" + "-".join(name.lower().split())


def _listed(found: tuple[Finding, ...]) -> str:
    """Return findings as a list, those of one kind and severity folded where they are many."""
    groups: dict[object, list[Finding]] = {}
    for place, one in enumerate(found):
        alike = one.kind not in _OWN_LINES
        key = (one.kind, one.unit, one.severity) if alike else place
        groups.setdefault(key, []).append(one)
    lines = "".join(map(_of_kind, groups.values()))
    return f'<ul class="findings">\n{lines}</ul>'


def _of_kind(found: list[Finding]) -> str:
    return _folded(found) if len(found) > _ALIKE else "".join(map(_finding, found))


def _folded(found: list[Finding]) -> str:
    """Return findings of one kind as a line that opens, the first urgent one before it."""
    first = "" if found[0].severity == "good" else _finding(found[0])
    others = found[bool(first) :]
    kind, unit, how = others[0].kind, others[0].unit, others[0].severity
    values = [one.value for one in others if one.value is not None and unit]
    told = f", {_range(values)} {unit}" if values else ""
    count = f"{len(others)} more" if first else f"{len(others)} alike"
    return (
        f'{first}<li class="{how}"><details><summary><b class="{how}">{how}</b> {escape(kind)}: '
        f'{count}{escape(told)}</summary><ul class="findings">{"".join(map(_finding, others))}</ul>'
        "</details></li>\n"
    )


def _range(values: list[float]) -> str:
    low, high = f"{min(values):.4g}", f"{max(values):.4g}"
    return low if low == high else f"{low} to {high}"


def _first(report: Report) -> str:
    """Return the first finding of each kind that is urgent, and how many others there are."""
    found = "".join(_finding(one, len(others)) for one, *others in _by_kind(report))
    return f'<ul class="findings">\n{found}</ul>'


def _finding(one: Finding, others: int = 0) -> str:
    is_note = one.section in _NOTES
    badge = "" if is_note else f'<b class="{one.severity}">{one.severity}</b> '
    parts = [f"{badge}{escape(one.text)}"]
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
    return f'<li class="{"note" if is_note else one.severity}">{"".join(parts)}</li>\n'


def finding_cell(one: Finding, prefix: str) -> str:
    """Return a finding in short: severity, sentence, and the link to its figure."""
    link = f" {_link(one, prefix)}" if one.figure else ""
    return f'<b class="{one.severity}">{one.severity}</b> {escape(one.text)}{link}'


def _link(one: Finding, prefix: str = "") -> str:
    """Return a link to the figure of a finding, which then shows its first span."""
    place = f"#{prefix}{one.figure}"
    if not one.spans:
        return f'<a href="{place}">Figure of {escape(one.figure.partition("-")[2])}</a>.'
    begin, end = one.spans[0]
    at = f'data-from="{begin:.3f}" data-to="{end:.3f}"'
    return f'<a href="{place}" {at}>Seen at {_times(one, 4)}</a>.'


def _times(one: Finding, most: int) -> str:
    listed = ", ".join(f"{a:.2f}-{b:.2f}" for a, b in one.spans[:most])
    more = len(one.spans) - most
    return f"{listed} s and {more} more times" if more > 0 else f"{listed} s"


def limits_section() -> str:
    """Return the table of limits."""
    rows = "".join(map(_limit, LIMITS.values()))
    names = ("finding", "look", "act", "unit", "source")
    head = "".join(f'<th scope="col">{name}</th>' for name in names)
    return (
        '<section id="limits">\n<h2>Limits</h2>\n<div class="wide" tabindex="0" role="region" '
        f'aria-label="Limits"><table><thead><tr>{head}</tr></thead><tbody>{rows}</tbody></table></div>\n</section>'
    )


def _limit(one: Limit) -> str:
    cells = (one.what, limit_text(one.look), limit_text(one.act), one.unit, one.source)
    return f"<tr>{''.join(f'<td>{escape(cell)}</td>' for cell in cells)}</tr>"


def limit_text(value: float) -> str:
    """Return a limit as a table shows it, a dash where there is none."""
    return f"{value:.3g}" if math.isfinite(value) else "–"
