"""Candidates for the clock of a table, scored by name, unit and values.

A name that certainly is a time has the highest score, then a possible name, then a unit of time in
the name. Without these, a column is the clock if its values increase evenly at the rate of a
sensor. Columns of hours to milliseconds, or of seconds and nanoseconds, together form one clock.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from itertools import takewhile
from typing import Final, NamedTuple

import numpy as np

from zerorate.faults import Argument, keyword_argument
from zerorate.io.clocks.coarse import in_whole_seconds, spread
from zerorate.io.clocks.names import (
    UNITS,
    find_time_unit,
    has_time_name,
    looks_like_time,
)
from zerorate.io.clocks.stamps import UnitHint, convert_texts, to_seconds
from zerorate.io.clocks.units import PER_SECOND, plausible_units, row_step
from zerorate.io.table import Column, Table, to_numbers
from zerorate.record.log import LogError
from zerorate.record.names import meaning_of, split_unit, to_snake_case
from zerorate.types import Floats

NOT_TIME: Final = " is not read as the time: "
_BACKWARD: Final = 0.01
"""Largest share of backward steps in a clock; clocks are sometimes set back."""
_ALIKE: Final = 0.02
"""Largest relative difference between two clocks of a log over its whole length."""
_NAMED, _MAYBE, _UNIT, _RISES = 3, 2, 1, 0
"""Scores: certain name, possible name, unit of time in the name, values only."""
_SCORES: Final = {
    _NAMED: "by its name",
    _MAYBE: "by its name, and it rises",
    _UNIT: "by the unit in its name, and it rises evenly",
    _RISES: "by its values, which rise evenly",
}
_FEWEST: Final = 10
"""Smallest number of rows to recognise a clock by its values."""
_NS_PER_UNIT: Final = {"h": 3600 * 10**9, "min": 60 * 10**9, "s": 10**9, "ms": 10**6, "us": 10**3}
_UNIT_OF_WORD: Final = {
    word: unit for unit, words in UNITS.items() for word in words if unit != "days"
}
_UNIT_OF_WORD.update(hour="h", minute="min", nanosec="ns")


class Clue(NamedTuple):
    """Column that may be the clock: its index, its score, and its median step in counts."""

    place: int
    score: int
    step: float

    @property
    def evidence(self) -> str:
        """Evidence in words."""
        return _SCORES[self.score]


def with_clock(table: Table) -> Table:
    """Return the table with its time column, if only the values show it."""
    table = _join_parts_of_time(table)
    names = table.names
    if table.time is not None or table.timeless or names is None:
        return table
    if any(map(looks_like_time, names)):
        return _with_finer(table, names)
    clues, notes = clues_of(table)
    best = _best(clues, table)
    if best is None:
        return table.noted(*(note for note in notes if note not in table.meta.notes))
    if best.score < _MAYBE:
        table = table.noted(f"column '{names[best.place]}' is read as the clock {best.evidence}")
    return replace(table, time=best.place)


def _with_finer(table: Table, names: tuple[str, ...]) -> Table:
    """Return the table with a finer clock, if its only clock has whole seconds."""
    clocks = [i for i, name in enumerate(names) if looks_like_time(name)]
    others = [i for i, name in enumerate(names) if i not in clocks and meaning_of(name) is None]
    if len(clocks) > 1 or not others or table.whole is None:
        return table  # other formats load only requested columns
    try:
        (column,) = table.load(clocks)
        stamps = to_seconds(column, names[clocks[0]], None, table.time_unit)
    except LogError:
        return table
    if not in_whole_seconds(stamps.seconds):
        return table
    found = (_joined_with(table, stamps.seconds, other) for other in others)
    other, joined = next((one for one in zip(others, found, strict=True) if one[1]), (0, None))
    if joined is None:
        return table
    whole = f"'{names[clocks[0]]}' has whole seconds"
    return joined.noted(f"{whole}; column '{names[other]}' has the rest")


def _joined_with(table: Table, seconds: Floats, index: int) -> Table | None:
    """Return the table with seconds refined by another column; None if it cannot refine them.

    The column contains the fraction of a second, is a clock itself, or counts rows.
    """
    values = load_numbers(table, index)
    if values is None or not np.isfinite(values).all() or len(values) != len(seconds):
        return None
    values = values.astype(np.float64)
    steps, turns = np.diff(values), np.diff(seconds) > 0
    if (steps[~turns] >= 0).all() and (steps[turns] < 0).all() and values.min() >= 0:
        scale = next((unit for unit in (1e3, 1e6, 1e9) if values.max() < unit), None)
        return _with_seconds(table, index, seconds + values / scale) if scale else None
    if not (steps > 0).all():
        return None
    if np.median(steps) == 1:
        finer = spread(seconds, np.rint(values - values[0]).astype(np.int64))
        return finer and _with_seconds(table, index, finer[0])
    # A finer clock always stays within its whole second.
    runs = (u for u, per in PER_SECOND.items() if np.ptp(values / per - seconds) < 1.0 + _ALIKE)
    unit = next(runs, None)
    return replace(table, time=index, time_unit=unit) if unit else None


def _with_seconds(table: Table, index: int, seconds: Floats) -> Table:
    whole = np.rint(seconds * 1e9).astype("timedelta64[ns]")
    return _with_joined(table, [index], f"{table.label(index)} (s)", lambda _: whole)


def clues_of(table: Table) -> tuple[list[Clue], list[str]]:
    """Return the columns that may be the clock, and notes on rejected names of a time."""
    clues: list[Clue] = []
    notes: list[str] = []
    if table.lengths is not None and len(set(table.lengths)) > 1:
        return clues, notes
    for index in range(table.width):
        name = table.label(index)
        if has_time_name(name):
            why_not = _why_no_clock(table, index)
            if why_not is None:
                clues.append(Clue(index, _NAMED if looks_like_time(name) else _MAYBE, 0.0))
            else:
                notes.append(f"column '{name}'{NOT_TIME}{why_not}")
        elif meaning_of(name) is None and (step := _even_step(table, index)) is not None:
            clues.append(Clue(index, _UNIT if find_time_unit(name) else _RISES, step))
    return clues, notes


def candidates(table: Table) -> list[str | Argument]:
    """Return the end of an error message: the argument to give for each possible clock."""
    clues, _ = clues_of(table)
    if not clues:
        return []
    first: str | int = clues[0].place if table.names is None else table.label(clues[0].place)
    listed = ", ".join(f"'{table.label(clue.place)}'" for clue in clues)
    typed = keyword_argument("time", str(first), f"time={first!r}")
    return [f"; {listed} rise as a clock does: ", typed, " with ", keyword_argument("time_unit")]


def _best(clues: Sequence[Clue], table: Table) -> Clue | None:
    """Return the clock with the highest score; of several equal clocks that agree, the finest."""
    best = max((clue.score for clue in clues), default=0)
    likely = [clue for clue in clues if clue.score == best]
    if len(likely) < 2 or best >= _MAYBE:
        return likely[0] if likely else None
    units = {clue: find_time_unit(table.label(clue.place)) for clue in likely}
    finest = max(likely, key=lambda clue: clue.step * PER_SECOND[units[clue] or "s"])
    agree = (_agree(finest.step / one.step, units[finest], units[one]) for one in likely)
    return finest if all(agree) else None


def _agree(ratio: float, unit: str | None, other: str | None) -> bool:
    """Return True if two clocks with this ratio of steps differ only in their unit."""
    if unit and other:
        return abs(ratio * PER_SECOND[other] / PER_SECOND[unit] - 1) < _ALIKE
    return any(abs(ratio / scale - 1) < _ALIKE for scale in (1.0, 1e3, 1e6, 1e9))


def _even_step(table: Table, index: int) -> float | None:
    """Return the step of a column that increases evenly at a sensor's rate; None for others.

    A column with steps of 1 is a counter, unless its name has a unit.
    """
    column = load_column(table, index)
    if column is None or len(column) < _FEWEST or not steady(column):
        return None
    name = table.label(index)
    unit = find_time_unit(name)
    if unit is None and split_unit(name)[1] is not None:
        return None  # an angle or a length
    if column.dtype.kind in "Mm":
        return 1.0
    step = row_step(column - column[0])
    known = plausible_units(step, column)
    if (unit is None and (counts_rows(column) or not known)) or (unit and unit not in known):
        return None
    return step


def _why_no_clock(table: Table, index: int) -> str | None:
    """Return the reason why a column has no timestamps; None if nearly all are in order."""
    name = table.label(index)
    try:
        (column,) = table.load([index])
        # Every clock increases, whatever its unit.
        unit = table.time_unit or find_time_unit(name) or "s"
        steps = np.diff(to_seconds(column, name, 1.0, unit).seconds)
    except LogError as error:
        return str(error)
    in_order = len(steps) == 0 or ((steps < 0).mean() <= _BACKWARD and (steps > 0).any())
    return None if in_order else "its values do not rise"


def clock_beside(table: Table, time: int) -> UnitHint:
    """Return a function that finds a time column's unit by another clock of the table.

    The other clock is a column with a time's name, a unit in its name, and the same duration.
    """

    def hint(units: Sequence[str]) -> tuple[str, str] | None:
        for index, name in enumerate(table.names or ()):
            known = find_time_unit(name)
            if index == time or known is None or not has_time_name(name):
                continue
            ratio = _ratio(table, time, index)
            for unit in units if ratio is not None else ():
                if abs((ratio or 0.0) * PER_SECOND[known] / PER_SECOND[unit] - 1) <= _ALIKE:
                    return unit, name
        return None

    return hint


def _ratio(table: Table, one: int, other: int) -> float | None:
    """Return the ratio of the increases of two columns; None if one does not increase."""
    spans = []
    for column in (load_column(table, one), load_column(table, other)):
        if column is None or column.dtype.kind not in "fiu" or len(column) < 2:
            return None
        spans.append((len(column), float(column[-1]) - float(column[0])))
    (rows, span), (other_rows, other_span) = spans
    return span / other_span if rows == other_rows and other_span > 0 else None


def time_of(table: Table, data: Sequence[int]) -> int | None:
    """Return the time column for data columns; of several, the one that matches the first."""
    if table.timeless:
        return None
    if table.time is not None:
        return table.time if table.time not in data else None
    if table.names is None:
        return unnamed_time(table, data)[0]
    free = [i for i, name in enumerate(table.names) if i not in data and looks_like_time(name)]
    fit = partial(_fit, table, data[0]) if data else lambda _: 0
    return max(free, key=fit, default=None)


def _fit(table: Table, data: int, time: int) -> tuple[bool, int]:
    """Return the match of a time to a data column: equal length, and number of shared folders."""
    same = table.lengths is None or table.lengths[time] == table.lengths[data]
    paths = (table.label(index).split("/")[:-1] for index in (time, data))
    shared = takewhile(lambda pair: pair[0] == pair[1], zip(*paths, strict=False))
    return same, sum(1 for _ in shared)


def unnamed_time(table: Table, taken: Sequence[int]) -> tuple[int | None, tuple[int, ...]]:
    """Return the time column of a table without names, or None, and its row counters."""
    if table.time is not None:
        return (table.time if table.time not in taken else None), ()
    if table.timeless or table.width < 2 or 0 in taken:
        return None, ()
    columns = {i: load_column(table, i) for i in range(table.width)}
    rising = [i for i, column in columns.items() if column is not None and steady(column)]
    texts = tuple(i for i, column in columns.items() if column is None)
    if rising != [next((i for i in columns if i not in texts), 0)]:
        return None, texts
    clock = columns[rising[0]]
    counts = clock is not None and counts_rows(clock)
    return (None, (*rising, *texts)) if counts else (rising[0], texts)


def load_column(table: Table, index: int) -> Column | None:
    """Return a column, with texts converted to dates; None if it has other texts."""
    try:
        return convert_texts(table.load([index])[0], "")
    except LogError:
        return None


def load_numbers(table: Table, index: int) -> Column | None:
    """Return a column of numbers; None if it has anything else."""
    column = load_column(table, index)
    return column if column is not None and column.dtype.kind in "fiub" else None


def rises(column: Column) -> bool:
    """Return True if values increase like a clock: over most rows, and hardly ever fall."""
    steps = np.diff(column.astype(np.float64)) if column.dtype.kind in "fiu" else np.ones(1)
    return len(steps) > 0 and bool((steps < 0).mean() <= _BACKWARD and (steps > 0).mean() > 0.5)


def steady(column: Column) -> bool:
    """Return True if values increase like a clock: in near-equal steps over most rows."""
    if len(column) < 3 or column.dtype.kind not in "fiuMm":
        return False
    counts = column.view(np.int64) if column.dtype.kind in "Mm" else column
    with np.errstate(invalid="ignore"):  # for infinities
        steps = np.diff(counts.astype(np.float64))
        middle = np.median(steps)
        near = np.abs(steps - middle) <= 0.5 * middle
        return bool(middle > 0 and (steps > 0).mean() >= 0.9 and near.mean() >= 0.8)


def counts_rows(column: Column) -> bool:
    """Return True if an increasing column counts by one."""
    return column.dtype.kind != "M" and bool(np.median(np.diff(column)) == 1)


def _join_parts_of_time(table: Table) -> Table:
    """Return a table with one more column for a time that is split over several columns.

    The parts are hours, minutes and seconds, optionally with a finer part, if no column is named
    like a time. Or they are whole seconds, and nanoseconds or microseconds with the same name.
    """
    if table.time is not None or table.timeless or table.names is None:
        return table
    parts = _parts_of_day(table.names) or _parts_of_second(table)
    if not parts or (table.lengths is not None and len(set(table.lengths)) > 1):
        return table
    label = " and ".join(table.names[i] for i in parts.values())
    return _with_joined(table, [*parts.values()], label, partial(_join_parts, [*parts]))


def _with_joined(
    table: Table, places: Sequence[int], label: str, join: Callable[[list[Column]], Column]
) -> Table:
    """Return a table with one more column: the time made of other columns."""

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


def _parts_of_day(names: Sequence[str]) -> dict[str, int]:
    """Return the columns of hours, minutes, seconds and optionally milliseconds, by unit."""
    columns: dict[str, int] = {}
    for index, name in enumerate(names):
        unit = _UNIT_OF_WORD.get(to_snake_case(name))
        if unit in _NS_PER_UNIT:
            columns.setdefault(unit, index)
    whole = {"h", "min", "s"} <= columns.keys() and not any(map(looks_like_time, names))
    return columns if whole else {}


def _parts_of_second(table: Table) -> dict[str, int]:
    """Return the columns of whole seconds and of nanoseconds with the same name except the unit.

    All nanoseconds are below one second.
    """
    stems: dict[tuple[str, str | None], int] = {}
    for index, name in enumerate(table.names or ()):
        stem, _, word = to_snake_case(name).rpartition("_")
        stems.setdefault((stem, _UNIT_OF_WORD.get(word)), index)
    for (stem, unit), index in stems.items():
        if unit != "s" or (stem, "ns") not in stems or not (stem == "" or looks_like_time(stem)):
            continue
        parts = {"s": index, "ns": stems[stem, "ns"]}
        seconds, rest = (load_numbers(table, i) for i in parts.values())
        if seconds is None or rest is None or not (np.rint(seconds) == seconds).all():
            return {}
        return parts if ((rest >= 0) & (rest < 1e9)).all() else {}
    return {}


def _join_parts(units: Sequence[str], columns: list[Column]) -> Column:
    """Return integer nanoseconds as durations, which have a unit."""
    total = None
    for unit, column in zip(units, columns, strict=True):
        numbers = to_numbers(column, unit)
        if numbers.dtype.kind == "f" and not np.isfinite(numbers).all():
            row = int(np.flatnonzero(~np.isfinite(numbers))[0])
            raise LogError(f"the {unit} of the time are not finite in row {row} (counting from 0)")
        scale = _NS_PER_UNIT.get(unit, 1)
        # Seconds since 1970 times 1e9 exceed the precision of a double.
        whole = np.floor(numbers).astype(np.int64)
        counts = whole * scale + np.rint((numbers - whole) * scale).astype(np.int64)
        total = counts if total is None else total + counts
    assert total is not None
    return total.astype("timedelta64[ns]")
