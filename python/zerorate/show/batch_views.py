"""Tables of a batch: the status of each log, and outliers among them."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import islice
from typing import TYPE_CHECKING, Final

from zerorate.faults import render_text
from zerorate.numerals import format_significant
from zerorate.show.overview_page import summarise_logs, summary_line
from zerorate.show.style import (
    ORANGE,
    add_panel,
    new_figure,
    style_panels,
    write_in_middle,
    write_title,
)
from zerorate.show.tables import GAP, Table, as_text, wrap_prose
from zerorate.tasks.batch.fleet import MIN_LOGS

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from zerorate.tasks.batch.fleet import Outlier
    from zerorate.tasks.batch.run import BatchResult

_MAX_ROWS: Final = 20
"""Largest number of rows and notes shown; the summary file has all."""
_MAX_BARS: Final = 12


def format_batch(result: BatchResult) -> str:
    """Return the counts of logs by status, the errors of failed logs, and the findings."""
    parts = (
        (_format_counts, _format_reports)
        if result.command == "report"
        else (_format_counts, _format_fleet, _format_notes)
    )
    return "\n".join(line for part in parts for line in part(result))


def _format_counts(result: BatchResult) -> Iterator[str]:
    counts = result.counts
    yield _wrap_line(
        f"{counts['done']} logs done in {result.seconds:.1f} s, "
        f"{counts['skipped']} skipped, {counts['failed']} failed"
    )
    if result.earlier:
        yield _wrap_line(f"the summary has {len(result.earlier)} logs of earlier runs, too")
    for alarm in result.alarms:
        yield _wrap_line(f"failed: {render_text(alarm)}")
    if result.left_out:
        count = len(result.left_out)
        yield _wrap_line(f"left out: {count} file{'s' if count > 1 else ''} written by zerorate")


def _format_reports(result: BatchResult) -> Iterator[str]:
    """Yield a row for each log with urgent findings, the most urgent first."""
    logs = summarise_logs(result.outcomes)
    urgent = [log for log in logs if log.act or log.look]
    yield _wrap_line(summary_line(logs))
    for log in urgent[:_MAX_ROWS]:
        yield _wrap_line(
            f"{log.outcome.name}: {log.act} to act on, {log.look} to look at. {log.first}"
        )
    if len(urgent) > _MAX_ROWS:
        yield f"{len(urgent) - _MAX_ROWS} more are in the overview"


def _format_notes(result: BatchResult) -> Iterator[str]:
    notes = result.notes
    for note in islice(notes, _MAX_ROWS):
        yield _wrap_line(f"note: {render_text(note)}")
    if len(notes) > _MAX_ROWS:
        yield f"{len(notes) - _MAX_ROWS} more notes are in the summary"


def _format_fleet(result: BatchResult) -> Iterator[str]:
    """Yield the outliers among the logs, and the number of logs that could not be compared."""
    fleet, compared = result.fleet, [item for item in result.in_summary if item.rows]
    unjudged = {log for log, _ in fleet.untested_axes}
    if unjudged:
        yield _wrap_line(
            f"not compared with each other: {len(unjudged)} of {len(compared)} logs; "
            f"it takes {MIN_LOGS} with the same axis and unit"
        )
    if not fleet.outliers:
        if len(unjudged) < len(compared):
            yield "no log stands out from the others"
        return
    head = ("log", "axis", "quantity", "value", "median", "times", "unit")
    rows = tuple(_format_row(item) for item in fleet.outliers[:_MAX_ROWS])
    more = len(fleet.outliers) - _MAX_ROWS
    note = f"{more} more are in the summary" if more > 0 else ""
    yield as_text(Table("these stand out from the others:", head, rows, words=3, note=note))


def _format_row(outlier: Outlier) -> tuple[str, ...]:
    times = "-" if outlier.times is None else format_significant(outlier.times, 2)
    numbers = (format_significant(outlier.value), format_significant(outlier.median), times)
    return (outlier.log, outlier.axis, outlier.quantity, *numbers, outlier.unit)


def _wrap_line(sentence: str) -> str:
    return wrap_prose(sentence, hang=GAP)


def plot_batch(result: BatchResult) -> Figure:
    """Return bars of the outliers: distance of a log's quantity in spreads of all logs."""
    outliers = result.fleet.outliers[:_MAX_BARS]
    height = 5.0 * max(1, len(outliers)) + 2.0
    figure = new_figure(130.0, height + 18.0)
    axes = add_panel(figure, 58.0, 10.0, 67.0, height)
    rows = range(len(outliers))
    axes.barh(rows, [outlier.deviations for outlier in reversed(outliers)], 0.6, color=ORANGE)
    axes.set_xlabel("distance from the median, in spreads of all logs")
    style_panels([axes])
    if not outliers:
        axes.xaxis.set_visible(False)
        write_in_middle(axes, f"No log of {len(result.in_summary)} stands out from the others.")
    axes.set_yticks(rows, [f"{outlier.log}, {outlier.quantity}" for outlier in reversed(outliers)])
    write_title(figure, "Which logs stand out?")
    return figure
