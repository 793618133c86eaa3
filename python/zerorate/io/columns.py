"""The choice of columns: those of the time, and those of data that a caller means."""

from __future__ import annotations

import difflib
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final, Literal

import numpy as np

from zerorate.faults import keyword_argument, make_sentence
from zerorate.io.clocks.names import looks_like_time
from zerorate.io.clocks.units import check_time_unit
from zerorate.io.evidence import gyro_of_many, named_time, not_of_gyro, unnamed_time
from zerorate.io.table import Table
from zerorate.io.triads import (
    Triad,
    choose_triads,
    describe_axes,
    describe_others,
    find_triads,
    list_devices,
    select_triads,
)
from zerorate.record.devices import several_devices
from zerorate.record.log import LogError
from zerorate.record.names import KIND_OF_UNIT, looks_like_gyro, meaning_of

_AXES: Final = 3
_KIND_NAMES: Final = {
    "gyro": "a gyro",
    "accel": "an accelerometer",
    "mag": "a magnetometer",
    "angle": "an angle",
}
_WANTED_NAMES: Final = {("gyro",): "a gyro", ("gyro", "accel"): "a gyro or an accelerometer"}

SKIP: Final = "skip"
"""Treatment of torn lines where a caller gives one."""

Columns = str | int | Sequence[str | int] | None
TimeColumn = str | int | Literal[False] | None
"""Name or index of the time column, False for none; None to find it."""


@dataclass(frozen=True)
class Timing:
    """Caller's choice of the column and unit of time, and of the rows to leave out.

    Raises
    ------
    ValueError
        If the unit is not known, or torn lines are to be anything but left out.
    """

    column: TimeColumn = None
    unit: str | None = None
    torn: str | None = None

    def __post_init__(self) -> None:
        """Bring the unit to its one spelling."""
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
        (index,) = _find_indices(table, self.column)
        return replace(table, time=index)

    def apply_to_all(self, tables: Sequence[Table]) -> list[Table]:
        """Return the tables of a source, of which some may have a time by another name."""
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


@dataclass(frozen=True)
class ColumnChoice:
    """Indices of the time column (None without one) and of the data columns, and notes."""

    time: int | None
    data: tuple[int, ...]
    notes: tuple[str, ...] = ()


def choose_columns(
    table: Table,
    columns: Columns,
    kinds: Sequence[str] = ("gyro",),
    sensor: str | None = None,
    is_sole: bool = False,
) -> ColumnChoice:
    """Return the time column and the data columns of a table.

    ``columns`` is the caller's request: names, indices, one of them, or None for one sensor
    of each kind, which ``sensor`` may name; LogError for several of them where ``is_sole`` asks for
    one. Of a table without names that is all but the time, if
    these are three columns or fewer.
    """
    indices = None if columns is None else _find_indices(table, columns)
    if table.names is None:
        time, counters = unnamed_time(table, indices or ())
    else:
        time, counters = named_time(table, table.names, indices, kinds), ()
    if indices is not None:
        return ColumnChoice(time, indices)
    if table.data is not None:
        return ColumnChoice(time, table.data)
    if table.names is None:
        return ColumnChoice(time, *_choose_unnamed(table, {time, *counters}))
    data, notes = _choose_sensors(table, table.names, time, kinds, sensor, is_sole)
    return ColumnChoice(time, data, notes)


def check_samples(table: Table, columns: Columns) -> None:
    """Raise LogError if a requested column holds the time."""
    if columns is None:
        return
    for index in _find_indices(table, columns):
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


def _choose_unnamed(
    table: Table, excluded: set[int | None]
) -> tuple[tuple[int, ...], tuple[str, ...]]:
    """Return the columns of a table without names that are a gyro's, and the note on them.

    Raises
    ------
    LogError
        If they are many, or hold what no gyro measures.
    """
    data_columns = tuple(i for i in range(table.width) if i not in excluded)
    if not data_columns:
        raise _make_not_found_error("a gyro", table)
    if len(data_columns) > _AXES:
        likely = gyro_of_many(table, data_columns)[0] or data_columns[-_AXES:]
        last = ",".join(map(str, likely))
        raise LogError(
            make_sentence(
                f"the table has no names, and {len(data_columns)} columns apart from the time "
                "are no gyro of "
                "three axes; say which are, counted from 0, such as ",
                keyword_argument("columns", last),
            )
        )
    if (found := not_of_gyro(table, data_columns)) is not None:
        why, left = found
        columns = keyword_argument("columns", ",".join(map(str, left)))
        raise LogError(
            make_sentence(f"the table has no names, and {why}; ", columns, " reads as a gyro")
        )
    listed = ", ".join(map(table.label, data_columns))
    return data_columns, (f"the table has no names: {listed} are read as a gyro",)


def _choose_sensors(
    table: Table,
    names: tuple[str, ...],
    time: int | None,
    kinds: Sequence[str],
    sensor: str | None,
    is_sole: bool,
) -> tuple[tuple[int, ...], tuple[str, ...]]:
    """Return the columns of one sensor of each kind, and notes on them."""
    triads = find_triads({i: name for i, name in enumerate(names) if i != time})
    of_kinds = [triad for triad in triads if triad.kind in kinds]
    if not of_kinds:
        raise _make_not_found_error(_WANTED_NAMES[tuple(kinds)], table)
    select_triads(of_kinds, sensor)
    data: list[int] = []
    notes: list[str] = []
    for kind in kinds:
        own = [triad for triad in of_kinds if triad.kind == kind]
        own_sensor = sensor if _has_sensor(own, sensor) else None
        devices = list_devices(own, names) if is_sole else ()
        if own_sensor is None and len(devices) > 1:
            raise several_devices(devices)
        chosen, unread = choose_triads(own, own_sensor)
        for triad in chosen:
            own_names = [names[i] for i in triad.indices]
            _check_axis_count(kind, own_names)
            _check_unit(kind, own_names)
            notes.extend(describe_axes(triad, own_names))
            data.extend(triad.indices)
        _check_unique([names[i] for triad in own for i in triad.indices])
        label = ", ".join(names[i] for triad in chosen for i in triad.indices)
        notes.extend(describe_others(chosen, unread, label))
    return tuple(data), tuple(notes)


def _check_axis_count(kind: str, names: Sequence[str]) -> None:
    """Raise LogError for more columns of one name than a sensor has axes."""
    if len(names) > _AXES:
        raise LogError(
            make_sentence(
                f"{len(names)} columns are of {_KIND_NAMES[kind]}, expected three axes: "
                f"{', '.join(names)}; say which, such as ",
                keyword_argument("columns", ",".join(names[:_AXES])),
            )
        )


def _check_unit(kind: str, names: Sequence[str]) -> None:
    for name, meaning in zip(names, map(meaning_of, names), strict=True):
        unit = "" if meaning is None else meaning.unit or ""
        of_unit = KIND_OF_UNIT.get(unit, "angle" if unit in ("deg", "rad") else kind)
        if of_unit != kind:
            raise LogError(
                make_sentence(
                    f"column '{name}' is named like {_KIND_NAMES[kind]} but is in {unit}, "
                    "the unit of "
                    f"{_KIND_NAMES[of_unit]}; ",
                    keyword_argument("columns"),
                    " reads it all the same",
                )
            )


def _check_unique(names: Sequence[str]) -> None:
    repeated = sorted({name for name in names if names.count(name) > 1})
    if repeated:
        raise LogError(
            make_sentence(
                f"names must differ, repeated: {', '.join(repeated)}; choose by position with ",
                keyword_argument("columns"),
            )
        )


def _has_sensor(triads: Sequence[Triad], sensor: str | None) -> bool:
    """Return True if a sensor is present: one name may be of the gyro, or of the accelerometer."""
    try:
        return bool(select_triads(triads, sensor))
    except LogError:
        return False


def _find_indices(table: Table, columns: str | int | Sequence[str | int]) -> tuple[int, ...]:
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


def _make_not_found_error(wanted: str, table: Table) -> LogError:
    choose = f"no column looks like {wanted}; choose with "
    return LogError(
        make_sentence(choose, keyword_argument("columns"), f" from: {_list_columns(table)}")
    )


def _list_columns(table: Table) -> str:
    names = [table.label(i) for i in range(table.width)]
    shown = names if len(names) <= 60 else [*names[:60], f"... ({len(names)} in all)"]
    return ", ".join(shown)
