"""Choice of columns by the caller: columns of the time and of the data."""

from __future__ import annotations

import difflib
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final, Literal

import numpy as np

from zerorate.faults import keyword_argument, make_sentence
from zerorate.io.clocks.names import looks_like_time
from zerorate.io.clocks.units import check_time_unit
from zerorate.io.table import Table
from zerorate.record.log import LogError
from zerorate.record.names import looks_like_gyro

SKIP: Final = "skip"
"""Value of `Timing.torn`: torn lines are left out."""

Columns = str | int | Sequence[str | int] | None
TimeColumn = str | int | Literal[False] | None
"""Name or index of the time column; False for no time, None to find the column."""


@dataclass(frozen=True)
class Timing:
    """Caller's choice of the time column and its unit, and treatment of torn lines.

    Raises
    ------
    ValueError
        If the unit is unknown, or ``torn`` has another value than "skip".
    """

    column: TimeColumn = None
    unit: str | None = None
    torn: str | None = None

    def __post_init__(self) -> None:
        """Check the fields, and convert the unit to its standard spelling."""
        if self.torn not in (None, SKIP):
            raise ValueError(
                make_sentence(keyword_argument("torn"), f" must be '{SKIP}', got {self.torn!r}")
            )
        object.__setattr__(self, "unit", check_time_unit(self.unit))

    def apply(self, table: Table) -> Table:
        """Return a table with the stated time column; LogError if there is no such column."""
        if self.torn is not None and table.whole is not None:
            table = table.whole()
        if self.unit is not None:
            table = replace(table, time_unit=self.unit)
        if self.column is None:
            return table
        if self.column is False:
            return replace(table, time=None, timeless=True)
        (index,) = find_indices(table, self.column)
        return replace(table, time=index)

    def apply_to_all(self, tables: Sequence[Table]) -> list[Table]:
        """Return the tables of a source; those with the stated time column use it."""
        has_column = [
            isinstance(self.column, str) and self.column in (t.names or ()) for t in tables
        ]
        if not any(has_column):
            return [self.apply(table) for table in tables]
        default_timing = replace(self, column=None)
        return [
            (self if own else default_timing).apply(t)
            for t, own in zip(tables, has_column, strict=True)
        ]


def check_samples(table: Table, columns: Columns) -> None:
    """Raise LogError if a requested column is a time."""
    if columns is None:
        return
    for index in find_indices(table, columns):
        name = table.label(index)
        if index != table.time and not (table.names is not None and looks_like_time(name)):
            continue
        gyros = ", ".join(own for own in table.names or () if looks_like_gyro(own))
        hint = f"; the gyro columns are {gyros}" if gyros else ""
        raise LogError(
            make_sentence(
                keyword_argument("columns"),
                f" names '{name}', which holds the time, not samples{hint}",
            ),
            "columns",
        )


def find_indices(table: Table, columns: str | int | Sequence[str | int]) -> tuple[int, ...]:
    """Return the indices of the requested columns; LogError if a column does not exist."""
    single = isinstance(columns, (str, int, np.integer))
    wanted = [columns] if single else list(columns)  # type: ignore[arg-type]
    if not wanted:
        raise LogError(
            make_sentence(
                keyword_argument("columns"), " is empty; name at least one column or leave it out"
            ),
            "columns",
        )
    indices = tuple(_find_index(table, column) for column in wanted)
    repeated = sorted({table.label(i) for i in indices if indices.count(i) > 1})
    if repeated:
        raise LogError(
            make_sentence(
                keyword_argument("columns"), f" names a column twice: {', '.join(repeated)}"
            ),
            "columns",
        )
    return indices


def _find_index(table: Table, column: object) -> int:
    if isinstance(column, str):
        return _find_index_by_name(table, column)
    if isinstance(column, bool) or not isinstance(column, (int, np.integer)):
        raise LogError(
            make_sentence(keyword_argument("columns"), f" takes names and indices, got {column!r}"),
            "columns",
        )
    if not -table.width <= column < table.width:
        raise LogError(
            f"there is no column {column}: the file has {table.width} columns", "columns"
        )
    return int(column) % table.width


def _find_index_by_name(table: Table, name: str) -> int:
    names = [table.label(i) for i in range(table.width)]
    matches = [i for i, own in enumerate(names) if own == name]
    if len(matches) > 1:
        raise LogError(
            f"{len(matches)} columns are named '{name}'; choose one by its index", "columns"
        )
    if matches:
        return matches[0]
    close = difflib.get_close_matches(name, names, n=3)
    hint = f"; close: {', '.join(close)}" if close else ""
    raise LogError(
        f"there is no column '{name}'{hint}; the file has: {_list_columns(table)}", "columns"
    )


def not_found(wanted: str, table: Table) -> LogError:
    """Return the error for a table without a column of the requested sensor."""
    choose = f"no column looks like {wanted}; choose with "
    return LogError(
        make_sentence(choose, keyword_argument("columns"), f" from: {_list_columns(table)}")
    )


def _list_columns(table: Table) -> str:
    names = [table.label(i) for i in range(table.width)]
    shown = names if len(names) <= 60 else [*names[:60], f"... ({len(names)} in all)"]
    return ", ".join(shown)
