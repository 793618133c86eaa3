"""Times in several columns, hours to milliseconds or seconds and nanoseconds, as one."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from typing import Final

import numpy as np

from zerorate.io.clocks.names import UNITS, looks_like_time
from zerorate.io.table import Column, Table, to_numbers
from zerorate.record.log import LogError
from zerorate.record.names import to_snake_case

_NS_PER_UNIT: Final = {"h": 3600 * 10**9, "min": 60 * 10**9, "s": 10**9, "ms": 10**6, "us": 10**3}
_UNIT_OF_WORD: Final = {
    word: unit for unit, words in UNITS.items() for word in words if unit != "days"
}
_UNIT_OF_WORD.update(hour="h", minute="min", nanosec="ns")


def join_time_columns(table: Table) -> Table:
    """Return a table with one more column for a time that stands in several, if it does.

    That is hours, minutes and seconds, with or without a finer one, where no column is named like
    a time; or whole seconds and their nanoseconds or microseconds under one name.
    """
    names = table.names
    if table.time is not None or table.timeless or names is None:
        return table
    pair = _find_seconds_pair(names)
    time_columns = _find_time_of_day(names) or (pair if pair and _are_parts(table, pair) else None)
    if time_columns is None or (table.lengths is not None and len(set(table.lengths)) > 1):
        return table
    label = " and ".join(names[i] for i in time_columns.values())
    joined = partial(_join_parts, list(time_columns))
    return with_joined(table, list(time_columns.values()), label, joined)


def with_joined(
    table: Table, places: Sequence[int], label: str, join: Callable[[list[Column]], Column]
) -> Table:
    """Return a table with one more column, of its time, that is made of others."""

    def load(wanted: Sequence[int]) -> list[Column]:
        own = [i for i in wanted if i != table.width]
        parts = places if len(own) < len(wanted) else []
        loaded = table.load([*own, *parts])
        columns = dict(zip(own, loaded, strict=False))
        if parts:
            columns[table.width] = join(loaded[len(own) :])
        return [columns[i] for i in wanted]

    return replace(
        table,
        width=table.width + 1,
        load=load,
        names=(*(table.names or ()), label),
        time=table.width,
        lengths=None if table.lengths is None else (*table.lengths, table.lengths[0]),
        pieces=None,
    )


def _find_time_of_day(names: Sequence[str]) -> dict[str, int] | None:
    """Return the columns of hours, minutes, seconds and maybe milliseconds, by their units."""
    if any(map(looks_like_time, names)):
        return None
    columns: dict[str, int] = {}
    for index, name in enumerate(names):
        unit = _UNIT_OF_WORD.get(to_snake_case(name))
        if unit in _NS_PER_UNIT:
            columns.setdefault(unit, index)
    return columns if {"h", "min", "s"} <= columns.keys() else None


def _find_seconds_pair(names: Sequence[str]) -> dict[str, int] | None:
    """Return the columns of seconds and of their nanoseconds, of one name but for the unit."""
    stems: dict[tuple[str, str], int] = {}
    for index, name in enumerate(names):
        before, _, word = to_snake_case(name).rpartition("_")
        unit = _UNIT_OF_WORD.get(word)
        if unit is not None:
            stems.setdefault((before, unit), index)
    for (stem, unit), index in stems.items():
        if unit == "s" and (stem, "ns") in stems and _is_time(stem):
            return {"s": index, "ns": stems[stem, "ns"]}
    return None


def _is_time(stem: str) -> bool:
    return stem == "" or looks_like_time(stem)


def _are_parts(table: Table, pair: dict[str, int]) -> bool:
    """Return True if seconds are whole and nanoseconds below one second, as parts of one time."""
    try:
        seconds, rest = (to_numbers(c, "") for c in table.load(list(pair.values())))
    except LogError:
        return False
    return bool((np.rint(seconds) == seconds).all() and ((rest >= 0) & (rest < 1e9)).all())


def _join_parts(units: Sequence[str], columns: list[Column]) -> Column:
    """Return whole nanoseconds as durations, which have a unit."""
    total = None
    for unit, column in zip(units, columns, strict=True):
        numbers = to_numbers(column, unit)
        if numbers.dtype.kind == "f" and not np.isfinite(numbers).all():
            row = int(np.flatnonzero(~np.isfinite(numbers))[0])
            raise LogError(f"the {unit} of the time are not finite in row {row} (counting from 0)")
        scale = _NS_PER_UNIT.get(unit, 1)
        # Seconds since 1970 times a thousand million are no double.
        whole = np.floor(numbers).astype(np.int64)
        counts = whole * scale + np.rint((numbers - whole) * scale).astype(np.int64)
        total = counts if total is None else total + counts
    assert total is not None
    return total.astype("timedelta64[ns]")
