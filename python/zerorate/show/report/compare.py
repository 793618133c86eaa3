"""A comparison as plain text: tables of all recordings of a kind, or of every axis."""

import math
from collections.abc import Iterable, Iterator, Sequence
from itertools import groupby
from pathlib import Path

from zerorate.compare.comparison import Comparison
from zerorate.compare.measures import Row
from zerorate.show.report.compare_measures import LEGENDS, NOTHING, SECTIONS, Measure, Section
from zerorate.show.report.tables import Table, as_text
from zerorate.show.report.text import bulleted

__all__ = ["format_compare"]


def format_compare(found: Sequence[Comparison], per_axis: bool = False) -> str:
    """Return the tables of each kind, at most `WIDTH` columns wide, and what must be said of them.

    Parameters
    ----------
    found : sequence of Comparison
        One a kind.
    per_axis : bool
        Whether every axis has tables of its own; by default each number is the mean over all axes
        of all recordings of the kind, and beside it stands that of the worst axis.

    Returns
    -------
    str
        Lines without an end. A dash stands where a number means nothing.
    """
    return "\n\n".join(part for one in found for part in _parts(one, per_axis))


def _parts(found: Comparison, per_axis: bool) -> Iterator[str]:
    axes = [list(rows) for _, rows in groupby(found.rows, lambda row: (row.source, row.axis))]
    for section in SECTIONS[found.kind]:
        alone = per_axis or len(axes) == 1
        tables = [_of_one(section, one) for one in axes] if alone else [_of_all(section, axes)]
        yield from (as_text(table) for table in tables if table.rows)
    yield bulleted((*LEGENDS[found.kind], *found.notes))


def _of_one(section: Section, rows: Sequence[Row]) -> Table:
    first, measures = rows[0], section.measures
    place = Path(first.source).name + (f", {first.axis}" if first.axis != "all" else "")
    lines = ((_label(row), *(one.text(one.of(row)) for one in measures)) for row in rows)
    # Of an unknown unit no more can be said.
    head = (one.head if first.angle == "rad" else one.head.partition(",")[0] for one in measures)
    return Table(f"{section.title}: {place}", ("method", *head), _telling(lines))


def _of_all(section: Section, axes: Sequence[Sequence[Row]]) -> Table:
    shared = [one for one in section.measures if not one.of_one]
    head = (text for one in shared for text in (one.head, "worst"))
    title = f"{section.title}: mean and worst of {len(axes)} {_counted(axes)}"
    lines = (
        (_label(rows[0]), *(cell for one in shared for cell in _mean_and_worst(one, rows)))
        for rows in zip(*axes, strict=True)
    )
    return Table(title, ("method", *head), _telling(lines))


def _counted(axes: Sequence[Sequence[Row]]) -> str:
    return "recordings" if axes[0][0].axis == "all" else "axes"


def _mean_and_worst(measure: Measure, rows: Sequence[Row]) -> tuple[str, str]:
    known = [value for value in map(measure.of, rows) if math.isfinite(value)]
    mean = sum(known) / len(known) if known else math.nan
    return measure.text(mean), measure.text(max(known, key=measure.badness, default=math.nan))


def _telling(lines: Iterable[tuple[str, ...]]) -> tuple[tuple[str, ...], ...]:
    """Return the rows of methods that this table has anything to say of."""
    return tuple(line for line in lines if any(cell != NOTHING for cell in line[1:]))


def _label(row: Row) -> str:
    return f"{row.method}†" if row.method == "ema" else row.method
