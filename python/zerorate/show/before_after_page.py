"""Two reports side by side as a page that stands alone, as a paragraph, and as a figure."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from html import escape
from typing import TYPE_CHECKING, Final

from zerorate._native import __version__
from zerorate.findings.imus import imus
from zerorate.numerals import with_error
from zerorate.show.report_document import document
from zerorate.show.report_figures import log_figures, seconds_of
from zerorate.show.report_page import finding_cell, limits_section
from zerorate.show.style import GREY_TEXT, new_figure, style_panels, write_title
from zerorate.show.tables import prose

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from zerorate.findings.before_after import BeforeAfter, Change
    from zerorate.findings.report import Report

_TOLD: Final = ("new", "worse", "gone", "better", "differs")
_ABOUT: Final = (
    "It says what is seen of two logs, never the cause of a difference. Numbers differ where they "
    "are further apart than three standard errors."
)
_SHOWN: Final = 12
"""Changes that a terminal, or a figure, shows."""


def format_before_after(found: BeforeAfter) -> str:
    """Return the summary, and what is new, gone, worse, better or different."""
    lines = [prose(f"{_name(found.before)} and {_name(found.after)}: {found.summary}")]
    told = [one for one in found.changes if one.verdict in _TOLD]
    lines.extend(prose(_line(one), hang="      ") for one in told[:_SHOWN])
    if len(told) > _SHOWN:
        lines.append(f"{len(told) - _SHOWN} more are on the page.")
    return "\n".join(lines)


def _name(report: Report) -> str:
    return report.source.rpartition("/")[2]


def _line(one: Change) -> str:
    text = one.one.text
    if one.before is not None and one.after is not None:
        text = f"{one.before.text} Then: {text}"
    return f"{one.verdict}: {text}"


def plot_before_after(found: BeforeAfter) -> Figure:
    """Return the differences that have standard errors, in units of these."""
    known = [(one, one.difference) for one in found.changes if one.difference is not None]
    shown = [(one, part) for one, part in known if part is not None and part[1] > 0.0][:_SHOWN]
    figure = new_figure(85.0, 22.0 + 5.0 * max(1, len(shown)))
    axes = figure.add_axes((0.4, 0.2, 0.56, 0.6))
    rows = range(len(shown))
    names = [f"{one.one.kind}, {one.one.figure.partition('-')[2]}" for one, _ in reversed(shown)]
    values = [part[0] / part[1] for _, part in reversed(shown)]
    axes.axvline(0.0, color=GREY_TEXT, linewidth=0.6)
    axes.errorbar(values, rows, xerr=1.0, fmt="o", markersize=3.0)
    axes.set_xlabel("after less before, in standard errors")
    style_panels([axes])
    axes.set_yticks(rows, names)
    write_title(figure, "What differs")
    return figure


def before_after_page(found: BeforeAfter) -> str:
    """Return the page as HTML, with figures of both logs in it, no other file and no network."""
    title = f"{_name(found.before)} and {_name(found.after)}: before and after"
    return document(title, _body(found))


def _body(found: BeforeAfter) -> Iterator[str]:
    yield f'<p class="summary">{escape(found.summary)}</p>'
    yield f'<p class="about">{escape(_ABOUT)} zerorate {__version__}.</p>'
    told = [one for one in found.changes if one.verdict != "alike"]
    alike = [one for one in found.changes if one.verdict == "alike"]
    if told:
        yield f'<section id="changes">\n<h2>What changed</h2>\n{_table(found, told)}\n</section>'
    if alike:
        yield (
            f'<section id="alike">\n<h2>What is alike</h2>\n<details><summary>{len(alike)} findings'
            f"</summary>{_table(found, alike)}</details>\n</section>"
        )
    sides = (("before", found.before), ("after", found.after))
    seconds = max(seconds_of(imus(report.recording)) for _, report in sides)
    yield from log_figures([(f"{side}-", report) for side, report in sides], seconds)
    yield limits_section()


def _table(found: BeforeAfter, changes: Sequence[Change]) -> str:
    heads = ("", f"before: {_name(found.before)}", f"after: {_name(found.after)}", "difference")
    head = "".join(f'<th scope="col">{escape(one)}</th>' for one in heads)
    rows = "\n".join(map(_row, changes))
    return (
        '<div class="wide" tabindex="0" role="region" aria-label="Changes"><table class="changes">'
        f"<thead><tr>{head}</tr></thead><tbody>{rows}</tbody></table></div>"
    )


def _row(one: Change) -> str:
    cells = (
        "–" if part is None else finding_cell(part, f"{side}-")
        for side, part in (("before", one.before), ("after", one.after))
    )
    known = one.difference
    apart = "" if known is None else with_error(*known)
    unit = f" {escape(one.one.unit)}" if apart and one.one.unit else ""
    return (
        f'<tr><th scope="row">{one.verdict}: {escape(one.one.kind)}</th>'
        f"{''.join(f'<td>{cell}</td>' for cell in cells)}<td>{apart}{unit}</td></tr>"
    )
