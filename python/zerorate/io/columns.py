"""The choice of columns: those of the time, and those of data that a caller means."""

from __future__ import annotations

import difflib
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import takewhile
from typing import Final, Literal

import numpy as np

from zerorate.faults import given, said
from zerorate.io.clocks.names import looks_like_time, may_be_time, named_like_time, time_unit
from zerorate.io.clocks.stamps import Beside, to_seconds, without_texts
from zerorate.io.clocks.units import PER_SECOND, checked_time_unit
from zerorate.io.table import Column, Table
from zerorate.io.timecolumns import with_one_time
from zerorate.io.triads import (
    Triad,
    chosen_of,
    named,
    note_on_axes,
    note_on_others,
    triads_in,
)
from zerorate.record.log import LogError
from zerorate.record.names import KIND_OF_UNIT, looks_like_gyro, meaning_of

NOT_TIME: Final = " is not taken for the time: "
_BACKWARD: Final = 0.01
"""Part of the steps of a clock that may lead back, as by a clock that was set."""
_ALIKE: Final = 0.02
"""Part by which two clocks of a log may differ over all of it."""

_AXES: Final = 3
_CALLED: Final = {
    "gyro": "a gyro",
    "accel": "an accelerometer",
    "mag": "a magnetometer",
    "angle": "an angle",
}
_SOUGHT: Final = {("gyro",): "a gyro", ("gyro", "accel"): "a gyro or an accelerometer"}

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
    """Indices of the time column (None without one) and of the data columns, and what to note."""

    time: int | None
    data: tuple[int, ...]
    notes: tuple[str, ...] = ()


def choose(
    table: Table,
    columns: Columns,
    kinds: Sequence[str] = ("gyro",),
    sensor: str | None = None,
) -> Choice:
    """Return the time column and the data columns of a table.

    ``columns`` is what the caller asked for: names, indices, one of them, or None for one sensor
    of each kind, which ``sensor`` may name. Of a table without names that is all but the time, if
    these are three columns or fewer.
    """
    asked = None if columns is None else _asked(table, columns)
    if table.names is None:
        time, counter = _unnamed_time(table, asked or ())
    else:
        time, counter = _named_time(table, table.names, asked, kinds), None
    if asked is not None:
        return Choice(time, asked)
    if table.data is not None:
        return Choice(time, table.data)
    if table.names is None:
        return Choice(time, _of_unnamed(table, {time, counter}))
    data, notes = _sensors(table, table.names, time, kinds, sensor)
    return Choice(time, data, notes)


def with_time(table: Table) -> Table:
    """Return the table with its time column, where only the values tell that a name is of one.

    Columns that `may_be_time` are looked at where no name is plainly that of the time. One that
    does not rise is no clock: it may hold durations.
    """
    table = with_one_time(table)
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
        raise LogError(
            said(given("columns"), f" names '{name}', which holds the time, not samples{hint}"),
            "columns",
        )


def _of_unnamed(table: Table, excluded: set[int | None]) -> tuple[int, ...]:
    """Return the columns of a table without names that are samples; LogError if they are many."""
    others = tuple(i for i in range(table.width) if i not in excluded)
    if not others:
        raise _none_like("a gyro", table)
    if len(others) > _AXES:
        last = ",".join(map(str, others[-_AXES:]))
        raise LogError(
            said(
                f"the table has no names, and {len(others)} columns beside the time are no gyro of "
                "three axes; say which are, counted from 0, such as ",
                given("columns", last),
            )
        )
    return others


def _sensors(
    table: Table,
    names: tuple[str, ...],
    time: int | None,
    kinds: Sequence[str],
    sensor: str | None,
) -> tuple[tuple[int, ...], tuple[str, ...]]:
    """Return the columns of one sensor of each kind, and what to note of them."""
    found = triads_in({i: name for i, name in enumerate(names) if i != time})
    of_kinds = [triad for triad in found if triad.kind in kinds]
    if not of_kinds:
        raise _none_like(_SOUGHT[tuple(kinds)], table)
    named(of_kinds, sensor)
    data: list[int] = []
    notes: list[str] = []
    for kind in kinds:
        own = [triad for triad in of_kinds if triad.kind == kind]
        chosen, left = chosen_of(own, sensor if _is_named(own, sensor) else None)
        for triad in chosen:
            own_names = [names[i] for i in triad.places]
            _check_three(kind, own_names)
            _check_unit(kind, own_names)
            notes.extend(note_on_axes(triad, own_names))
            data.extend(triad.places)
        _check_different([names[i] for triad in own for i in triad.places])
        label = ", ".join(names[i] for triad in chosen for i in triad.places)
        notes.extend(note_on_others(chosen, left, label))
    return tuple(data), tuple(notes)


def _check_three(kind: str, names: Sequence[str]) -> None:
    """Raise LogError for more columns of one name than a sensor has axes."""
    if len(names) > _AXES:
        raise LogError(
            said(
                f"{len(names)} columns are of {_CALLED[kind]}, expected three axes: "
                f"{', '.join(names)}; say which, such as ",
                given("columns", ",".join(names[:_AXES])),
            )
        )


def _check_unit(kind: str, names: Sequence[str]) -> None:
    for name, meaning in zip(names, map(meaning_of, names), strict=True):
        unit = "" if meaning is None else meaning.unit or ""
        of_unit = KIND_OF_UNIT.get(unit, "angle" if unit in ("deg", "rad") else kind)
        if of_unit != kind:
            raise LogError(
                said(
                    f"column '{name}' is named like {_CALLED[kind]} but is in {unit}, the unit of "
                    f"{_CALLED[of_unit]}; ",
                    given("columns"),
                    " reads it all the same",
                )
            )


def _check_different(names: Sequence[str]) -> None:
    repeated = sorted({name for name in names if names.count(name) > 1})
    if repeated:
        raise LogError(
            said(
                f"names must differ, repeated: {', '.join(repeated)}; choose by position with ",
                given("columns"),
            )
        )


def _is_named(triads: Sequence[Triad], sensor: str | None) -> bool:
    """Whether a sensor is among these: one name may be of the gyro, or of the accelerometer."""
    try:
        return bool(named(triads, sensor))
    except LogError:
        return False


def _asked(table: Table, columns: str | int | Sequence[str | int]) -> tuple[int, ...]:
    single = isinstance(columns, (str, int, np.integer))
    wanted = [columns] if single else list(columns)  # type: ignore[arg-type]
    if not wanted:
        raise LogError(
            said(given("columns"), " is empty; name at least one column or leave it out"), "columns"
        )
    indices = tuple(_index(table, column) for column in wanted)
    repeated = sorted({table.label(i) for i in indices if indices.count(i) > 1})
    if repeated:
        raise LogError(
            said(given("columns"), f" names a column twice: {', '.join(repeated)}"), "columns"
        )
    return indices


def _index(table: Table, column: object) -> int:
    if isinstance(column, str):
        return _index_of_name(table, column)
    if isinstance(column, bool) or not isinstance(column, (int, np.integer)):
        raise LogError(
            said(given("columns"), f" takes names and indices, got {column!r}"), "columns"
        )
    if not -table.width <= column < table.width:
        raise LogError(
            f"there is no column {column}: the file has {table.width} columns", "columns"
        )
    return int(column) % table.width


def _index_of_name(table: Table, name: str) -> int:
    names = [table.label(i) for i in range(table.width)]
    found = [i for i, own in enumerate(names) if own == name]
    if len(found) > 1:
        raise LogError(
            f"{len(found)} columns are named '{name}'; choose one by its index", "columns"
        )
    if found:
        return found[0]
    close = difflib.get_close_matches(name, names, n=3)
    hint = f"; close: {', '.join(close)}" if close else ""
    raise LogError(f"there is no column '{name}'{hint}; the file has: {_listed(table)}", "columns")


def _none_like(sought: str, table: Table) -> LogError:
    choose = f"no column looks like {sought}; choose with "
    return LogError(said(choose, given("columns"), f" from: {_listed(table)}"))


def _listed(table: Table) -> str:
    names = [table.label(i) for i in range(table.width)]
    shown = names if len(names) <= 60 else [*names[:60], f"... ({len(names)} in all)"]
    return ", ".join(shown)


def _named_time(
    table: Table,
    names: tuple[str, ...],
    asked: Sequence[int] | None,
    kinds: Sequence[str],
) -> int | None:
    taken = asked or ()
    if table.timeless:
        return None
    if table.time is not None:
        return table.time if table.time not in taken else None
    free = [i for i, name in enumerate(names) if i not in taken and looks_like_time(name)]
    others = (i for i, name in enumerate(names) if i not in free and _is_of(name, kinds))
    data = next(iter(taken), next(others, None))
    if data is None:
        return next(iter(free), None)
    return max(free, key=lambda i: _belongs(table, names, i, data), default=None)


def _is_of(name: str, kinds: Sequence[str]) -> bool:
    meaning = meaning_of(name)
    return meaning is not None and meaning.kind in kinds


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
    with np.errstate(invalid="ignore"):  # of infinities
        steps = np.diff(counts.astype(np.float64))
        middle = np.median(steps)
        near = np.abs(steps - middle) <= 0.5 * middle
        return bool(middle > 0 and (steps > 0).mean() >= 0.9 and near.mean() >= 0.8)


def _counts_rows(column: Column) -> bool:
    return column.dtype.kind != "M" and column[0] in (0, 1) and bool(np.all(np.diff(column) == 1))
