"""Report as a self-contained page, as a paragraph, and as a figure."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator
from dataclasses import replace
from html import escape
from typing import TYPE_CHECKING, Final

from zerorate._native import __version__
from zerorate.findings.external_settings import SECTION as ENTER
from zerorate.findings.imus import find_imus
from zerorate.findings.limits import LIMITS
from zerorate.findings.next_recording import SECTION as RECORD
from zerorate.numerals import format_with_error, shorten
from zerorate.record.devices import sensor_labels
from zerorate.show.report_document import document
from zerorate.show.report_figures import log_figures, longest_duration
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
from zerorate.show.tables import wrap_prose

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from zerorate.findings.finding import Finding
    from zerorate.findings.limits import Limit
    from zerorate.findings.report import Report

_CODE_PATTERN: Final = re.compile("`([^`]*)`")
_MAX_REPEATED: Final = 2
"""Largest number of good findings of a kind that are listed one by one."""
_NOTE_SECTIONS: Final = (ENTER, RECORD)
"""Sections without a limit on the number of lines."""
_UNGROUPED_KINDS: Final = ("reading", "not identifiable")
"""Kinds that are not grouped, because each sentence is different."""
_MAX_FINDINGS: Final = 12
"""Largest number of findings in a terminal."""
_MAX_TERMINAL_SPANS: Final = 3
_SHORT_TEXT: Final = 90
"""Largest length of a sentence that is not shortened, in letters."""
_COLOURS: Final = {"act": VERMILION, "look": ORANGE, "good": GREEN}
_ABOUT_TEXT: Final = (
    "Findings state what was measured, not its cause. Limits and their sources are at the end. "
    "Not checked: vibration too fast for the log."
)


def format_report(report: Report) -> str:
    """Return the summary, and a sentence for each finding to act on or to look at."""
    lines = [wrap_prose(f"{report.source.rpartition('/')[2]}: {report.summary}")]
    lines.extend(
        wrap_prose(_format_kind(report, of_kind), hang="      ")
        for of_kind in _group_urgent(report)
    )
    if report.empty:
        lines.append(wrap_prose(f"No data for: {', '.join(report.empty)}."))
    return "\n".join(lines)


def _short_text(report: Report, finding: Finding) -> str:
    """Return the kind, the value with its limit, and the advice.

    If the finding's own sentence is short, or there is no number with a limit, return this
    sentence.
    """
    limit = LIMITS.get(finding.kind)
    if limit is None or finding.value is None or len(finding.text) <= _SHORT_TEXT:
        return finding.text
    sensor = finding.figure.partition("-")[2]
    label = sensor_labels(report.recording).get(sensor, "") or sensor
    bound = limit.act if finding.severity == "act" and math.isfinite(limit.act) else limit.look
    number = format_with_error(finding.value, finding.sigma or 0.0)
    unit = f" {finding.unit}" if finding.unit else ""
    what = f"{label}: {limit.what}" if label else f"{limit.what[0].upper()}{limit.what[1:]}"
    text = f"{what} {number}{unit}, limit {limit_text(bound)}{unit}."
    return f"{text} {finding.advice}" if finding.advice else text


def _group_urgent(report: Report) -> list[list[Finding]]:
    """Return the findings to act on and to look at, grouped by kind."""
    kinds: dict[tuple[str, str], list[Finding]] = {}
    for finding in report.urgent_findings:
        kinds.setdefault((finding.severity, finding.kind), []).append(finding)
    return list(kinds.values())


def _format_kind(report: Report, findings: list[Finding]) -> str:
    """Return the first finding of a kind, its time, and the number of further findings."""
    first, more = findings[0], len(findings) - 1
    spans_text = f" [{_format_times(first, _MAX_TERMINAL_SPANS)}]" if first.spans else ""
    others = f" {more} more of this kind, on the page." if more else ""
    return f"{first.severity}: {_short_text(report, first)}{spans_text}{others}"


def plot_report(report: Report) -> Figure:
    """Return a figure with a bar for each span of a finding; urgent findings are above."""
    findings = [finding for finding in report.urgent_findings if finding.spans][:_MAX_FINDINGS]
    height = 5.0 * max(1, len(findings)) + 2.0
    figure = new_figure(110.0, height + 18.0)
    axes = add_panel(figure, 38.0, 10.0, 67.0, height)
    for row, finding in enumerate(reversed(findings)):
        bars = [(begin, end - begin) for begin, end in finding.spans]
        axes.broken_barh(bars, (row - 0.3, 0.6), color=_COLOURS[finding.severity])
    axes.set_xlabel("time [s]")
    style_panels([axes])
    if not findings:
        axes.xaxis.set_visible(False)
        write_in_middle(axes, report.summary)
    axes.set_yticks(
        range(len(findings)),
        [f"{finding.severity}: {finding.kind}" for finding in reversed(findings)],
    )
    write_title(figure, "When are findings seen?")
    return figure


def report_page(report: Report) -> str:
    """Return the page as HTML with figures; it needs no other file and no network."""
    title = f"{report.source.rpartition('/')[2]}: report of the IMU"
    return document(title, _make_body(report))


def _make_body(report: Report) -> Iterator[str]:
    yield f'<p class="summary">{escape(report.summary)}</p>'
    yield f'<p class="about">{escape(_ABOUT_TEXT)} zerorate {__version__}.</p>'
    if report.urgent_findings:
        yield f'<h2 id="first">Most important findings</h2>\n{_list_first(report)}'
    sections = {finding.section: None for finding in report.findings}
    links = (f'<a href="#{_section_anchor(name)}">{escape(name)}</a>' for name in sections)
    yield f'<nav aria-label="Sections">{"".join(links)}<a href="#figures">Figures</a></nav>'
    for name in sections:
        section_findings = tuple(finding for finding in report.findings if finding.section == name)
        yield f'<section id="{_section_anchor(name)}">\n<h2>{escape(name)}</h2>'
        yield f"{_list_findings(section_findings)}\n</section>"
    if report.empty:
        yield f'<p class="about">No data for: {escape(", ".join(report.empty))}.</p>'
    yield from log_figures([("", report)], longest_duration(find_imus(report.recording)))
    yield limits_section()


def _section_anchor(name: str) -> str:
    return "section-" + "-".join(name.lower().split())


def _list_findings(findings: tuple[Finding, ...]) -> str:
    """Return findings as a list; many findings of one kind and severity are merged."""
    groups: dict[object, list[Finding]] = {}
    for index, finding in enumerate(findings):
        is_grouped = finding.kind not in _UNGROUPED_KINDS
        key = (finding.kind, finding.unit, finding.severity) if is_grouped else index
        groups.setdefault(key, []).append(finding)
    lines = "".join(map(_format_group, groups.values()))
    return f'<ul class="findings">\n{lines}</ul>'


def _format_group(findings: list[Finding]) -> str:
    return (
        _collapse_group(findings)
        if len(findings) > _MAX_REPEATED
        else "".join(map(_format_finding, findings))
    )


def _collapse_group(findings: list[Finding]) -> str:
    """Return findings of one kind as a line that opens, after the first urgent finding."""
    first = "" if findings[0].severity == "good" else _format_finding(findings[0])
    hidden = findings[bool(first) :]
    kind, unit, severity = hidden[0].kind, hidden[0].unit, hidden[0].severity
    values = [finding.value for finding in hidden if finding.value is not None and unit]
    range_text = f", {_format_range(values)} {unit}" if values else ""
    count = f"{len(hidden)} more" if first else f"{len(hidden)} similar"
    return (
        f'{first}<li class="{severity}"><details><summary><b '
        f'class="{severity}">{severity}</b> {escape(kind)}: '
        f"{count}{escape(range_text)}</summary><ul "
        f'class="findings">{"".join(map(_format_finding, hidden))}</ul>'
        "</details></li>\n"
    )


def _format_range(values: list[float]) -> str:
    low, high = f"{shorten(min(values), 4)}", f"{shorten(max(values), 4)}"
    return low if low == high else f"{low} to {high}"


def _shortened(report: Report, finding: Finding) -> Finding:
    """Return a finding with its short text, so that the advice below it is not repeated."""
    text = _short_text(report, finding)
    return finding if text == finding.text else replace(finding, text=text, advice="")


def _list_first(report: Report) -> str:
    """Return the first finding of each urgent kind, and the number of further findings."""
    items = "".join(
        _format_finding(_shortened(report, finding), len(others))
        for finding, *others in _group_urgent(report)
    )
    return f'<ul class="findings">\n{items}</ul>'


def _format_finding(finding: Finding, others: int = 0) -> str:
    is_note = finding.section in _NOTE_SECTIONS
    badge = "" if is_note else f'<b class="{finding.severity}">{finding.severity}</b> '
    parts = [f"{badge}{escape(finding.text)}"]
    details = [_figure_link(finding)] if finding.figure else []
    if finding.spans and not finding.figure:
        details.append(f"Seen at {_format_times(finding, 4)}.")
    if finding.advice and finding.severity != "good":
        details.append(_CODE_PATTERN.sub(r"<code>\1</code>", escape(finding.advice)))
    if others:
        details.append(
            f'<a href="#{_section_anchor(finding.section)}">{others} more of this kind</a>.'
        )
    if details:
        parts.append(f'<div class="more">{" ".join(details)}</div>')
    if finding.code:
        parts.append(
            f"<details><summary>The lines for {escape(finding.kind)}</summary>"
            f'<pre tabindex="0">{escape(finding.code)}</pre></details>'
        )
    return f'<li class="{"note" if is_note else finding.severity}">{"".join(parts)}</li>\n'


def finding_cell(finding: Finding, prefix: str) -> str:
    """Return a finding in short form: severity, sentence, and a link to its figure."""
    link = f" {_figure_link(finding, prefix)}" if finding.figure else ""
    return f'<b class="{finding.severity}">{finding.severity}</b> {escape(finding.text)}{link}'


def _figure_link(finding: Finding, prefix: str = "") -> str:
    """Return a link to a finding's figure, which then shows the finding's first span."""
    anchor = f"#{prefix}{finding.figure}"
    if not finding.spans:
        return f'<a href="{anchor}">Figure of {escape(finding.figure.partition("-")[2])}</a>.'
    begin, end = finding.spans[0]
    time_attributes = f'data-from="{begin:.3f}" data-to="{end:.3f}"'
    return f'<a href="{anchor}" {time_attributes}>Seen at {_format_times(finding, 4)}</a>.'


def _format_times(finding: Finding, max_spans: int) -> str:
    listed = ", ".join(f"{a:.2f}-{b:.2f}" for a, b in finding.spans[:max_spans])
    more = len(finding.spans) - max_spans
    return f"{listed} s and {more} more times" if more > 0 else f"{listed} s"


def limits_section() -> str:
    """Return the table of limits."""
    rows = "".join(map(_limit_row, LIMITS.values()))
    names = ("finding", "look", "act", "unit", "source")
    head = "".join(f'<th scope="col">{name}</th>' for name in names)
    return (
        '<section id="limits">\n<details><summary><h2>Limits and their sources</h2></summary>\n'
        '<div class="wide" tabindex="0" role="region" aria-label="Limits">'
        f"<table><thead><tr>{head}</tr></thead><tbody>{rows}</tbody></table></div></details>\n"
        "</section>"
    )


def _limit_row(limit: Limit) -> str:
    cells = (limit.what, limit_text(limit.look), limit_text(limit.act), limit.unit, limit.source)
    return f"<tr>{''.join(f'<td>{escape(cell)}</td>' for cell in cells)}</tr>"


def limit_text(value: float) -> str:
    """Return a limit as text; a dash if there is no limit."""
    return f"{shorten(value, 3)}" if math.isfinite(value) else "–"
