"""The choice of columns: those of the time, and those of data that a caller means."""

from __future__ import annotations

import difflib
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import takewhile
from typing import Final, Literal

import numpy as np

from zerorate.io.clocks.names import looks_like_time, may_be_time, named_like_time, time_unit
from zerorate.io.clocks.stamps import Beside, to_seconds, without_texts
from zerorate.io.clocks.units import PER_SECOND, checked_time_unit
from zerorate.io.log import LogError
from zerorate.io.names import looks_like_gyro
from zerorate.io.table import Column, Table

__all__ = ["NOT_TIME", "Choice", "Columns", "TimeColumn", "Timing", "check_samples", "choose"]
__all__ += ["clock_beside", "with_time"]

NOT_TIME: Final = " is not taken for the time: "
_BACKWARD: Final = 0.01
"""Part of the steps of a clock that may lead back, as by a clock that was set."""
_ALIKE: Final = 0.02
"""Part by which two clocks of a log may differ over all of it."""

Columns = str | int | Sequence[str | int] | None
TimeColumn = str | int | Literal[False] | None
"""Name or index of the time column, False for none; None to find it."""


@dataclass(frozen=True)
class Timing:
    """What a caller says of the timestamps: their column, and their unit.

    Raises
    ------
    ValueError
        If the unit is not known.
    """

    column: TimeColumn = None
    unit: str | None = None

    def __post_init__(self) -> None:
        """Bring the unit to its one spelling."""
        object.__setattr__(self, "unit", checked_time_unit(self.unit))

    def told(self, table: Table) -> Table:
        """Return a table with its time as the caller says; LogError if there is no such column."""
        if self.unit is not None:
            table = replace(table, time_unit=self.unit)
        if self.column is None:
            return table
        if self.column is False:
            return replace(table, time=None, timeless=True)
        (index,) = _asked(table, self.column)
        return replace(table, time=index)

    def told_of_all(self, tables: Sequence[Table]) -> list[Table]:
        """Return the tables of a source, of which some may have a time by another name."""
        have = [isinstance(self.column, str) and self.column in (t.names or ()) for t in tables]
        if not any(have):
            return [self.told(table) for table in tables]
        others = replace(self, column=None)
        return [(self if own else others).told(t) for t, own in zip(tables, have, strict=True)]


@dataclass(frozen=True)
class Choice:
    """Indices of the time column (None without one) and of the data columns."""

    time: int | None
    data: tuple[int, ...]


def choose(
    table: Table, columns: Columns, wanted: Callable[[str], bool] = looks_like_gyro
) -> Choice:
    """Return the time column and the data columns of a table.

    ``columns`` is what the caller asked for: names, indices, one of them, or None for all
    columns with a name that is ``wanted`` (all but the time where the table has no names).
    """
    asked = None if columns is None else _asked(table, columns)
    if table.names is None:
        time, counter = _unnamed_time(table, asked or ())
    else:
        time, counter = _named_time(table, table.names, asked, wanted), None
    if asked is None:
        asked = _default(table, {time, counter}, wanted)
    return Choice(time, asked)


def with_time(table: Table) -> Table:
    """Return the table with its time column, where only the values tell that a name is of one.

    Columns that `may_be_time` are looked at where no name is plainly that of the time. One that
    does not rise is no clock: it may hold durations.
    """
    names = table.names
    told = table.time is not None or table.timeless
    if told or names is None or any(map(looks_like_time, names)):
        return table
    one_length = table.lengths is None or len(set(table.lengths)) == 1
    notes = []
    for i in (i for i, name in enumerate(names) if may_be_time(name) and one_length):
        why_not = _why_no_clock(table, i)
        if why_not is None:
            return replace(table, time=i)
        notes.append(f"column '{names[i]}'{NOT_TIME}{why_not}")
    noted = dict.fromkeys((*table.meta.notes, *notes))
    return replace(table, meta=replace(table.meta, notes=tuple(noted))) if notes else table


def _why_no_clock(table: Table, index: int) -> str | None:
    """Return why the values of a column are no timestamps; None if hardly any is out of order."""
    try:
        (column,) = table.load([index])
        # Whatever their unit, a clock rises.
        unit = table.time_unit or time_unit(table.label(index)) or "s"
        seconds = to_seconds(column, table.label(index), 1.0, unit).seconds
    except LogError as error:
        return str(error)
    steps = np.diff(seconds)
    rises = len(steps) == 0 or ((steps < 0).mean() <= _BACKWARD and (steps > 0).any())
    return None if rises else "its values do not rise"


def clock_beside(table: Table, time: int) -> Beside:
    """Return what tells the unit of a time column by another clock of the table, if there is one.

    That is a column named like a time, with its unit in its name, that runs as far in the log.
    """

    def tells(units: Sequence[str]) -> tuple[str, str] | None:
        for index, name in enumerate(table.names or ()):
            unit = time_unit(name)
            if index == time or unit is None or not named_like_time(name):
                continue
            ratio = _ratio(table, time, index)
            for one in units:
                scale = PER_SECOND[one] / PER_SECOND[unit]
                if ratio is not None and abs(ratio / scale - 1) <= _ALIKE:
                    return one, name
        return None

    return tells


def _ratio(table: Table, one: int, other: int) -> float | None:
    """Return how much faster one column counts than another, None where one of them does not."""
    try:
        loaded = table.load([one, other])
    except LogError:
        return None
    spans = []
    for column in loaded:
        column = without_texts(column, "")
        if column.dtype.kind not in "fiu" or len(column) < 2:
            return None
        spans.append(float(column[-1]) - float(column[0]))
    return spans[0] / spans[1] if len(loaded[0]) == len(loaded[1]) and spans[1] > 0 else None


def check_samples(table: Table, asked: Columns) -> None:
    """Raise LogError if a column that was asked for holds the time."""
    if asked is None:
        return
    for index in _asked(table, asked):
        name = table.label(index)
        if index != table.time and not (table.names is not None and looks_like_time(name)):
            continue
        gyros = ", ".join(own for own in table.names or () if looks_like_gyro(own))
        hint = f"; the gyro columns are {gyros}" if gyros else ""
        raise LogError(f"columns= names '{name}', which holds the time, not samples{hint}")


def _default(
    table: Table, excluded: set[int | None], wanted: Callable[[str], bool]
) -> tuple[int, ...]:
    if table.data is not None:
        return table.data
    others = [i for i in range(table.width) if i not in excluded]
    if table.names is not None:
        others = [i for i in others if wanted(table.names[i])]
    if not others:
        sought = "a gyro" if wanted is looks_like_gyro else "a gyro or an accelerometer"
        raise LogError(
            f"no column looks like {sought}; choose with columns= from: {_listed(table)}"
        )
    return tuple(others)


def _asked(table: Table, columns: str | int | Sequence[str | int]) -> tuple[int, ...]:
    single = isinstance(columns, (str, int, np.integer))
    wanted = [columns] if single else list(columns)  # type: ignore[arg-type]
    if not wanted:
        raise LogError("columns= is empty; name at least one column or leave it out")
    indices = tuple(_index(table, column) for column in wanted)
    repeated = sorted({table.label(i) for i in indices if indices.count(i) > 1})
    if repeated:
        raise LogError(f"columns= names a column twice: {', '.join(repeated)}")
    return indices


def _index(table: Table, column: object) -> int:
    if isinstance(column, str):
        return _index_of_name(table, column)
    if isinstance(column, bool) or not isinstance(column, (int, np.integer)):
        raise LogError(f"columns= takes names and indices, got {column!r}")
    if not -table.width <= column < table.width:
        raise LogError(f"there is no column {column}: the file has {table.width} columns")
    return int(column) % table.width


def _index_of_name(table: Table, name: str) -> int:
    names = [table.label(i) for i in range(table.width)]
    found = [i for i, own in enumerate(names) if own == name]
    if len(found) > 1:
        raise LogError(f"{len(found)} columns are named '{name}'; choose one by its index")
    if found:
        return found[0]
    close = difflib.get_close_matches(name, names, n=3)
    hint = f"; close: {', '.join(close)}" if close else ""
    raise LogError(f"there is no column '{name}'{hint}; the file has: {_listed(table)}")


def _listed(table: Table) -> str:
    names = [table.label(i) for i in range(table.width)]
    shown = names if len(names) <= 60 else [*names[:60], f"... ({len(names)} in all)"]
    return ", ".join(shown)


def _named_time(
    table: Table,
    names: tuple[str, ...],
    asked: Sequence[int] | None,
    wanted: Callable[[str], bool],
) -> int | None:
    taken = asked or ()
    if table.timeless:
        return None
    if table.time is not None:
        return table.time if table.time not in taken else None
    free = [i for i, name in enumerate(names) if i not in taken and looks_like_time(name)]
    others = (i for i, name in enumerate(names) if i not in free and wanted(name))
    data = next(iter(taken), next(others, None))
    if data is None:
        return next(iter(free), None)
    return max(free, key=lambda i: _belongs(table, names, i, data), default=None)


def _belongs(table: Table, names: tuple[str, ...], time: int, data: int) -> tuple[bool, int]:
    """Return how well a time fits a data column: by its length, then by the folders they share."""
    same = table.lengths is None or table.lengths[time] == table.lengths[data]
    folders = zip(names[time].split("/")[:-1], names[data].split("/")[:-1], strict=False)
    return same, sum(1 for _ in takewhile(lambda pair: pair[0] == pair[1], folders))


def _unnamed_time(table: Table, taken: Sequence[int]) -> tuple[int | None, int | None]:
    """Return the time column and the row counter of a table without names, each maybe None."""
    if table.time is not None:
        return (table.time if table.time not in taken else None), None
    if table.timeless:
        return None, None
    if table.width < 2 or 0 in taken:
        return None, None
    columns = table.load(range(table.width))
    if not _steady(columns[0]) or any(_steady(column) for column in columns[1:]):
        return None, None
    if _counts_rows(columns[0]):
        return None, 0
    return 0, None


def _steady(column: Column) -> bool:
    """Whether values rise in near-equal steps over most rows, as a clock's do."""
    if len(column) < 3 or column.dtype.kind not in "fiuM":
        return False
    counts = column.view(np.int64) if column.dtype.kind == "M" else column
    steps = np.diff(counts.astype(np.float64))
    with np.errstate(invalid="ignore"):
        middle = np.median(steps)
        near = np.abs(steps - middle) <= 0.5 * middle
        return bool(middle > 0 and (steps > 0).mean() >= 0.9 and near.mean() >= 0.8)


def _counts_rows(column: Column) -> bool:
    return column.dtype.kind != "M" and column[0] in (0, 1) and bool(np.all(np.diff(column) == 1))
