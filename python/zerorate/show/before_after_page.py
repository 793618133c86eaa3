"""Comparison of two reports as a self-contained page, as a paragraph, and as a figure."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from html import escape
from typing import TYPE_CHECKING, Final

from zerorate._native import __version__
from zerorate.findings.imus import find_imus
from zerorate.numerals import format_with_error
from zerorate.show.report_document import document
from zerorate.show.report_figures import log_figures, longest_duration
from zerorate.show.report_page import finding_cell, limits_section
from zerorate.show.style import GREY_TEXT, add_panel, new_figure, style_panels, write_title
from zerorate.show.tables import wrap_prose

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from zerorate.findings.before_after import BeforeAfter, Change
    from zerorate.findings.report import Report

_SHOWN_VERDICTS: Final = ("new", "worse", "gone", "better", "differs")
_ABOUT_TEXT: Final = (
    "The page states differences between two logs, not their causes. Numbers differ if their "
    "difference exceeds three standard errors."
)
_MAX_CHANGES: Final = 12
"""Largest number of changes in a terminal or a figure."""


def format_before_after(comparison: BeforeAfter) -> str:
    """Return the summary, and the findings that are new, gone, worse, better or different."""
    lines = [
        wrap_prose(
            f"{_log_name(comparison.before)} and {_log_name(comparison.after)}: "
            f"{comparison.summary}"
        )
    ]
    changes = [change for change in comparison.changes if change.verdict in _SHOWN_VERDICTS]
    lines.extend(
        wrap_prose(_format_change(change), hang="      ") for change in changes[:_MAX_CHANGES]
    )
    if len(changes) > _MAX_CHANGES:
        lines.append(f"{len(changes) - _MAX_CHANGES} more are on the page.")
    return "\n".join(lines)


def _log_name(report: Report) -> str:
    return report.source.rpartition("/")[2]


def _format_change(change: Change) -> str:
    text = change.finding.text
    if change.before is not None and change.after is not None:
        text = f"{change.before.text} Then: {text}"
    return f"{change.verdict}: {text}"


def plot_before_after(comparison: BeforeAfter) -> Figure:
    """Return a figure of the differences in units of their standard errors."""
    differences = [
        (change, change.difference)
        for change in comparison.changes
        if change.difference is not None
    ]
    drawn = [(change, part) for change, part in differences if part is not None and part[1] > 0.0][
        :_MAX_CHANGES
    ]
    height = 22.0 + 5.0 * max(1, len(drawn))
    figure = new_figure(85.0, height)
    axes = add_panel(figure, 34.0, 0.2 * height, 47.6, 0.6 * height)
    rows = range(len(drawn))
    names = [
        f"{change.finding.kind}, {change.finding.figure.partition('-')[2]}"
        for change, _ in reversed(drawn)
    ]
    values = [part[0] / part[1] for _, part in reversed(drawn)]
    axes.axvline(0.0, color=GREY_TEXT, linewidth=0.6)
    axes.errorbar(values, rows, xerr=1.0, fmt="o", markersize=3.0)
    axes.set_xlabel("after minus before [standard errors]")
    style_panels([axes])
    axes.set_yticks(rows, names)
    write_title(figure, "What differs between the logs?")
    return figure


def before_after_page(comparison: BeforeAfter) -> str:
    """Return the page as HTML with figures of both logs; it needs no other file and no network."""
    title = f"{_log_name(comparison.before)} and {_log_name(comparison.after)}: before and after"
    return document(title, _make_body(comparison))


def _make_body(comparison: BeforeAfter) -> Iterator[str]:
    yield f'<p class="summary">{escape(comparison.summary)}</p>'
    yield f'<p class="about">{escape(_ABOUT_TEXT)} zerorate {__version__}.</p>'
    changed = [change for change in comparison.changes if change.verdict != "unchanged"]
    unchanged = [change for change in comparison.changes if change.verdict == "unchanged"]
    if changed:
        yield (
            '<section id="changes">\n<h2>What '
            f"changed</h2>\n{_make_table(comparison, changed)}\n</section>"
        )
    if unchanged:
        yield (
            '<section id="unchanged">\n<h2>What is '
            f"unchanged</h2>\n<details><summary>{len(unchanged)} findings"
            f"</summary>{_make_table(comparison, unchanged)}</details>\n</section>"
        )
    sides = (("before", comparison.before), ("after", comparison.after))
    seconds = max(longest_duration(find_imus(report.recording)) for _, report in sides)
    yield from log_figures([(f"{side}-", report) for side, report in sides], seconds)
    yield limits_section()


def _make_table(comparison: BeforeAfter, changes: Sequence[Change]) -> str:
    heads = (
        "",
        f"before: {_log_name(comparison.before)}",
        f"after: {_log_name(comparison.after)}",
        "difference",
    )
    head = "".join(f'<th scope="col">{escape(text)}</th>' for text in heads)
    rows = "\n".join(map(_make_row, changes))
    return (
        '<div class="wide" tabindex="0" role="region" aria-label="Changes"><table class="changes">'
        f"<thead><tr>{head}</tr></thead><tbody>{rows}</tbody></table></div>"
    )


def _make_row(change: Change) -> str:
    cells = (
        "–" if part is None else finding_cell(part, f"{side}-")
        for side, part in (("before", change.before), ("after", change.after))
    )
    difference = change.difference
    difference_text = "" if difference is None else format_with_error(*difference)
    unit = f" {escape(change.finding.unit)}" if difference_text and change.finding.unit else ""
    return (
        f'<tr><th scope="row">{change.verdict}: {escape(change.finding.kind)}</th>'
        f"{''.join(f'<td>{cell}</td>' for cell in cells)}<td>{difference_text}{unit}</td></tr>"
    )
