"""What became of the logs of a batch, and which stand out from the others."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import islice
from typing import TYPE_CHECKING, Final

from zerorate.faults import told
from zerorate.numerals import significant
from zerorate.show.overview_page import judged, summary
from zerorate.show.style import (
    ORANGE,
    add_panel,
    new_figure,
    style_panels,
    write_in_middle,
    write_title,
)
from zerorate.show.tables import GAP, Table, as_text, prose
from zerorate.tasks.batch.fleet import LEAST_LOGS

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from zerorate.tasks.batch.fleet import Outlier
    from zerorate.tasks.batch.run import BatchResult

_SHOWN: Final = 20
"""Rows and notes that are shown; all stand in the summary."""
_BARS: Final = 12


def format_batch(result: BatchResult) -> str:
    """Return how many logs are done, why others failed, and what is seen in them."""
    parts = (_counts, _reports) if result.command == "report" else (_counts, _fleet, _notes)
    return "\n".join(line for part in parts for line in part(result))


def _counts(result: BatchResult) -> Iterator[str]:
    counts = result.counts
    yield _said(
        f"{counts['done']} logs done in {result.seconds:.1f} s, "
        f"{counts['skipped']} skipped, {counts['failed']} failed"
    )
    for alarm in result.alarms:
        yield _said(f"failed: {told(alarm)}")
    if result.left_out:
        count = len(result.left_out)
        yield _said(f"left out: {count} file{'s' if count > 1 else ''} that zerorate has written")


def _reports(result: BatchResult) -> Iterator[str]:
    """Yield a row for each log that needs a person, what needs one most first."""
    logs = judged(result.outcomes)
    urgent = [one for one in logs if one.act or one.look]
    yield _said(summary(logs))
    for one in urgent[:_SHOWN]:
        yield _said(f"{one.outcome.name}: {one.act} to act on, {one.look} to look at. {one.first}")
    if len(urgent) > _SHOWN:
        yield f"{len(urgent) - _SHOWN} more are in the overview"


def _notes(result: BatchResult) -> Iterator[str]:
    notes = result.notes
    for note in islice(notes, _SHOWN):
        yield _said(f"note: {told(note)}")
    if len(notes) > _SHOWN:
        yield f"{len(notes) - _SHOWN} more notes are in the summary"


def _fleet(result: BatchResult) -> Iterator[str]:
    """Yield which logs stand out, and how many could not be compared."""
    fleet, through = result.fleet, [one for one in result.outcomes if one.rows]
    alone = {log for log, _ in fleet.unjudged}
    if alone:
        yield _said(
            f"not compared with each other: {len(alone)} of {len(through)} logs; "
            f"it takes {LEAST_LOGS} with the same axis and unit"
        )
    if not fleet.outlying:
        if len(alone) < len(through):
            yield "no log stands out from the others"
        return
    head = ("log", "axis", "quantity", "value", "median", "times", "unit")
    rows = tuple(_row(one) for one in fleet.outlying[:_SHOWN])
    more = len(fleet.outlying) - _SHOWN
    note = f"{more} more are in the summary" if more > 0 else ""
    yield as_text(Table("these stand out from the others:", head, rows, words=3, note=note))


def _row(one: Outlier) -> tuple[str, ...]:
    times = "-" if one.times is None else significant(one.times, 2)
    numbers = (significant(one.value), significant(one.median), times)
    return (one.log, one.axis, one.quantity, *numbers, one.unit)


def _said(sentence: str) -> str:
    return prose(sentence, hang=GAP)


def plot_batch(result: BatchResult) -> Figure:
    """Return a bar for each quantity in which a log stands out: how far, in spreads of all logs."""
    found = result.fleet.outlying[:_BARS]
    tall = 5.0 * max(1, len(found)) + 2.0
    figure = new_figure(130.0, tall + 18.0)
    axes = add_panel(figure, 58.0, 10.0, 67.0, tall)
    rows = range(len(found))
    axes.barh(rows, [one.deviations for one in reversed(found)], 0.6, color=ORANGE)
    axes.set_xlabel("distance from the median, spreads of all logs")
    style_panels([axes])
    if not found:
        axes.xaxis.set_visible(False)
        write_in_middle(axes, f"No log of {len(result.outcomes)} stands out from the others.")
    axes.set_yticks(rows, [f"{one.log}, {one.quantity}" for one in reversed(found)])
    write_title(figure, "Which logs stand out")
    return figure
