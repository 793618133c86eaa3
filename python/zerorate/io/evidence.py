"""Evidence for the clock of a table: of each column, scored here and nowhere else.

A name that is plainly of a time counts most, then one that may be, then a unit of time in a name.
A column without any of these is the clock if its values rise evenly at a rate that sensors have.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import takewhile
from typing import Final, NamedTuple

import numpy as np

from zerorate.faults import Argument, keyword_argument
from zerorate.io.clocks.coarse import in_whole_seconds, spread
from zerorate.io.clocks.names import find_time_unit, has_time_name, looks_like_time, may_be_time
from zerorate.io.clocks.stamps import UnitHint, convert_texts, to_seconds
from zerorate.io.clocks.units import PER_SECOND, plausible_units, row_step
from zerorate.io.table import Column, Table, to_numbers
from zerorate.io.timecolumns import join_time_columns, with_joined
from zerorate.record.log import LogError
from zerorate.record.names import meaning_of, split_unit
from zerorate.types import Floats

NOT_TIME: Final = " is not read as the time: "
_BACKWARD: Final = 0.01
"""Part of the steps of a clock that may lead back, as by a clock that was set."""
_ALIKE: Final = 0.02
"""Part by which two clocks of a log may differ over all of it."""
_NAMED, _MAYBE, _UNIT, _RISES = 3, 2, 1, 0
"""Scores: a name of a time, one that may be, a unit of time, and values alone."""
_SCORES: Final = {
    _NAMED: "by its name",
    _MAYBE: "by its name, and it rises",
    _UNIT: "by the unit in its name, and it rises evenly",
    _RISES: "by its values, which rise evenly",
}
_FEWEST: Final = 10
"""Fewest rows for a clock by values alone."""
_GYRO_END: Final = 4000.0
"""Largest rate that a gyro measures, deg/s."""
_GRAVITY: Final = (1.0, 9.80665)
_OF_GRAVITY: Final = 0.03
"""Part by which an accelerometer at rest may differ from gravity."""
_AXES: Final = "xyz"
_AXES_COUNT: Final = 3
_MAX_UNNAMED_COLUMNS: Final = 12
"""Most columns of a table without names that are searched: six of sensors, times and counters."""


class Clue(NamedTuple):
    """A column that may be the clock: its index, its score, and the counts from row to row."""

    place: int
    score: int
    step: float

    @property
    def evidence(self) -> str:
        """The evidence in words."""
        return _SCORES[self.score]


def with_time(table: Table) -> Table:
    """Return the table with its time column, where only the values show it."""
    table = join_time_columns(table)
    names = table.names
    stated = table.time is not None or table.timeless
    if stated or names is None:
        return table
    if any(map(looks_like_time, names)):
        return _with_finer(table, names)
    clues, notes = clues_of(table)
    best = _best(clues, table)
    if best is not None:
        if best.score < _MAYBE:
            notes = [f"column '{names[best.place]}' is read as the clock {best.evidence}"]
            noted = replace(table.meta, notes=(*table.meta.notes, *notes))
            return replace(table, time=best.place, meta=noted)
        return replace(table, time=best.place)
    noted_so = tuple(dict.fromkeys((*table.meta.notes, *notes)))
    return replace(table, meta=replace(table.meta, notes=noted_so)) if notes else table


def _with_finer(table: Table, names: tuple[str, ...]) -> Table:
    """Return the table with a finer column than its only clock, if that has whole seconds."""
    clocks = [i for i, name in enumerate(names) if looks_like_time(name)]
    others = [i for i, name in enumerate(names) if i not in clocks and meaning_of(name) is None]
    if len(clocks) > 1 or not others or table.whole is None:
        return table  # of other formats only requested columns are loaded
    try:
        (column,) = table.load(clocks)
        stamps = to_seconds(column, names[clocks[0]], None, table.time_unit)
    except LogError:
        return table
    if not in_whole_seconds(stamps.seconds):
        return table
    for other in others:
        found = _joined_with(table, stamps.seconds, other)
        if found is not None:
            note = f"'{names[clocks[0]]}' has whole seconds; column '{names[other]}' has the rest"
            meta = replace(found.meta, notes=(*found.meta.notes, note))
            return replace(found, meta=meta)
    return table


def _joined_with(table: Table, seconds: Floats, index: int) -> Table | None:
    """Return the table with the clock of whole seconds and another column, None for no such.

    That has the part of a second, is a clock of its own, or counts rows.
    """
    try:
        (column,) = table.load([index])
        values = to_numbers(column, "").astype(np.float64)
    except LogError:
        return None
    steps, turns = np.diff(values), np.diff(seconds) > 0
    if not np.isfinite(values).all() or len(values) != len(seconds):
        return None
    if (steps[~turns] >= 0).all() and (steps[turns] < 0).all() and values.min() >= 0:
        scale = next((unit for unit in (1e3, 1e6, 1e9) if values.max() < unit), None)
        return _with_seconds(table, index, seconds + values / scale) if scale else None
    if not (steps > 0).all():
        return None
    if np.median(steps) == 1:
        finer = spread(seconds, np.rint(values - values[0]).astype(np.int64))
        return finer and _with_seconds(table, index, finer[0])
    unit = next((u for u in PER_SECOND if _runs(values, seconds, PER_SECOND[u])), None)
    return replace(table, time=index, time_unit=unit) if unit else None


def _runs(values: Floats, seconds: Floats, per_second: float) -> bool:
    """Return True if a clock that counts so fast is within its second all the time."""
    return bool(np.ptp(values / per_second - seconds) < 1.0 + _ALIKE)


def _with_seconds(table: Table, index: int, seconds: Floats) -> Table:
    label = f"{table.label(index)} (s)"
    whole = np.rint(seconds * 1e9).astype("timedelta64[ns]")
    return with_joined(table, [index], label, lambda _: whole)


def clues_of(table: Table) -> tuple[list[Clue], list[str]]:
    """Return the columns that may be the clock, and why others that are named so are none."""
    if table.lengths is not None and len(set(table.lengths)) > 1:
        return [], []
    clues, notes = [], []
    for index in range(table.width):
        name = table.label(index)
        if looks_like_time(name) or may_be_time(name):
            why_not = _why_no_clock(table, index)
            if why_not is None:
                score = _NAMED if looks_like_time(name) else _MAYBE
                clues.append(Clue(index, score, 0.0))
            else:
                notes.append(f"column '{name}'{NOT_TIME}{why_not}")
        elif meaning_of(name) is None and (step := _even_step(table, index)) is not None:
            clues.append(Clue(index, _UNIT if find_time_unit(name) else _RISES, step))
    return clues, notes


def candidates(table: Table) -> list[str | Argument]:
    """Return the end of a refusal: the option to type for each column that may be the clock."""
    clues, _ = clues_of(table)
    if not clues:
        return []
    names = [table.label(clue.place) for clue in clues]
    first: str | int = names[0] if table.names is not None else clues[0].place
    listed = ", ".join(f"'{name}'" for name in names)
    typed = keyword_argument("time", str(first), f"time={first!r}")
    return [f"; {listed} rise as a clock does: ", typed, " with ", keyword_argument("time_unit")]


def _best(clues: Sequence[Clue], table: Table) -> Clue | None:
    """Return the clock of most evidence; among equal ones the finest, if they agree, else None."""
    best = max((clue.score for clue in clues), default=0)
    likely = [clue for clue in clues if clue.score == best]
    if len(likely) < 2 or best >= _MAYBE:
        return likely[0] if likely else None
    finest = max(likely, key=lambda clue: clue.step * _per_second(table, clue))
    return finest if all(_agree(finest, one, table) for one in likely) else None


def _per_second(table: Table, clue: Clue) -> float:
    return PER_SECOND[find_time_unit(table.label(clue.place)) or "s"]


def _agree(one: Clue, other: Clue, table: Table) -> bool:
    """Return True if two clocks differ in their unit alone."""
    units = [find_time_unit(table.label(clue.place)) for clue in (one, other)]
    ratio = one.step / other.step
    if units[0] and units[1]:
        ratio *= PER_SECOND[units[1]] / PER_SECOND[units[0]]
        return bool(abs(ratio - 1) < _ALIKE)
    return any(abs(ratio / scale - 1) < _ALIKE for scale in (1.0, 1e3, 1e6, 1e9))


def _even_step(table: Table, index: int) -> float | None:
    """Return the counts from row to row of a column that rises evenly at the rate of a sensor.

    A column that counts by one is no clock but a counter, unless its name has a unit.
    """
    try:
        (column,) = table.load([index])
        column = convert_texts(column, "")
    except LogError:
        return None
    if len(column) < _FEWEST or not steady(column):
        return None
    unit = find_time_unit(table.label(index))
    if unit is None and split_unit(table.label(index))[1] is not None:
        return None  # an angle, a length
    if column.dtype.kind in "Mm":
        return 1.0
    step = row_step(column - column[0])
    known = plausible_units(step, column)
    if (unit is None and (_counts_rows(column) or not known)) or (unit and unit not in known):
        return None
    return step


def _why_no_clock(table: Table, index: int) -> str | None:
    """Return the reason why a column holds no timestamps; None if hardly any is out of order."""
    try:
        (column,) = table.load([index])
        # Whatever their unit, a clock rises.
        unit = table.time_unit or find_time_unit(table.label(index)) or "s"
        seconds = to_seconds(column, table.label(index), 1.0, unit).seconds
    except LogError as error:
        return str(error)
    steps = np.diff(seconds)
    rises = len(steps) == 0 or ((steps < 0).mean() <= _BACKWARD and (steps > 0).any())
    return None if rises else "its values do not rise"


def clock_beside(table: Table, time: int) -> UnitHint:
    """Return a hint on a time column's unit from another clock of the table, if there is one.

    That is a column named like a time, with its unit in its name, that runs as far in the log.
    """

    def hint(units: Sequence[str]) -> tuple[str, str] | None:
        for index, name in enumerate(table.names or ()):
            unit = find_time_unit(name)
            if index == time or unit is None or not has_time_name(name):
                continue
            ratio = _ratio(table, time, index)
            for one in units:
                scale = PER_SECOND[one] / PER_SECOND[unit]
                if ratio is not None and abs(ratio / scale - 1) <= _ALIKE:
                    return one, name
        return None

    return hint


def _ratio(table: Table, one: int, other: int) -> float | None:
    """Return the ratio of two columns' rates of counting, None if one of them does not count."""
    try:
        loaded = table.load([one, other])
    except LogError:
        return None
    spans = []
    for column in loaded:
        column = convert_texts(column, "")
        if column.dtype.kind not in "fiu" or len(column) < 2:
            return None
        spans.append(float(column[-1]) - float(column[0]))
    return spans[0] / spans[1] if len(loaded[0]) == len(loaded[1]) and spans[1] > 0 else None


def named_time(
    table: Table,
    names: tuple[str, ...],
    requested: Sequence[int] | None,
    kinds: Sequence[str],
) -> int | None:
    """Return the time column of a table with names: of several the one that fits the data."""
    taken = requested or ()
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
    """Return the match of a time to a data column: by its length, then by shared folders."""
    same = table.lengths is None or table.lengths[time] == table.lengths[data]
    folders = zip(names[time].split("/")[:-1], names[data].split("/")[:-1], strict=False)
    return same, sum(1 for _ in takewhile(lambda pair: pair[0] == pair[1], folders))


def unnamed_time(table: Table, taken: Sequence[int]) -> tuple[int | None, tuple[int, ...]]:
    """Return the time column of a table without names, maybe None, and its counters of rows."""
    if table.time is not None:
        return (table.time if table.time not in taken else None), ()
    if table.timeless or table.width < 2 or 0 in taken:
        return None, ()
    numbers = {i: column for i in range(table.width) if (column := loaded(table, i)) is not None}
    rising = [i for i, column in numbers.items() if steady(column)]
    texts = tuple(i for i in range(table.width) if i not in numbers)
    if rising != [min(numbers, default=0)]:
        return None, texts
    return (None, (*rising, *texts)) if _counts_rows(numbers[rising[0]]) else (rising[0], texts)


def loaded(table: Table, index: int) -> Column | None:
    """Return a column, None if it holds texts."""
    try:
        return table.load([index])[0]
    except LogError:
        return None


def rises(column: Column) -> bool:
    """Return True if values rise over most rows and hardly ever fall, as a clock's do."""
    steps = np.diff(column.astype(np.float64)) if column.dtype.kind in "fiu" else np.ones(1)
    return (
        bool((steps < 0).mean() <= _BACKWARD and (steps > 0).mean() > 0.5) if len(steps) else False
    )


def steady(column: Column) -> bool:
    """Return True if values rise in near-equal steps over most rows, as a clock's do."""
    if len(column) < 3 or column.dtype.kind not in "fiuMm":
        return False
    counts = column.view(np.int64) if column.dtype.kind in "Mm" else column
    with np.errstate(invalid="ignore"):  # of infinities
        steps = np.diff(counts.astype(np.float64))
        middle = np.median(steps)
        near = np.abs(steps - middle) <= 0.5 * middle
        return bool(middle > 0 and (steps > 0).mean() >= 0.9 and near.mean() >= 0.8)


def _counts_rows(column: Column) -> bool:
    return column.dtype.kind != "M" and bool(np.median(np.diff(column)) == 1)


def not_of_gyro(table: Table, places: Sequence[int]) -> tuple[str, Sequence[int]] | None:
    """Return the reason why a table without names has no gyro, and the columns that may be one.

    None stands for a gyro.
    """
    columns = table.load(places)
    values = [to_numbers(c, table.label(i)) for i, c in zip(places, columns, strict=True)]
    whole = [bool(np.all(np.isnan(column) | (column == np.rint(column)))) for column in values]
    for index, column in zip(places, values, strict=True):
        level = float(np.nanmedian(np.abs(column))) if np.isfinite(column).any() else 0.0
        if level > _GYRO_END and not all(whole):
            left = [i for i in places if i != index]
            return f"column {index} holds values about {level:.6g}, which no gyro measures", left
    if len(values) == len(_AXES) and (size := _length(values)) is not None:
        for g in _GRAVITY:
            if abs(size / g - 1) < _OF_GRAVITY:
                return f"its columns keep the length {g:g}, as gravity does and no gyro", places
    return None


def _length(values: Sequence[Floats]) -> float | None:
    """Return the length that vectors keep, as gravity and fields do; None if it changes."""
    size = np.sqrt(np.sum(np.square(np.stack(values).astype(np.float64)), axis=0))
    known = size[np.isfinite(size)]
    length = float(np.median(known)) if known.size else 0.0
    if length == 0.0 or np.percentile(np.abs(known / length - 1), 90) >= _OF_GRAVITY:
        return None
    return length


def gyro_of_many(table: Table, places: Sequence[int]) -> tuple[Sequence[int], Sequence[int]]:
    """Return the columns of gyro and accelerometer in a table without names.

    Three columns that keep the length of gravity are an accelerometer. Of six the others are the
    gyro, if they keep none. Either is empty where the values do not show it.
    """
    threes = [places[i : i + _AXES_COUNT] for i in range(0, len(places), _AXES_COUNT)]
    if len(places) % _AXES_COUNT:
        return (), ()
    kept = [_length([to_numbers(c, "") for c in table.load(three)]) for three in threes]
    free = [three for three, length in zip(threes, kept, strict=True) if length is None]
    accel = [
        three
        for three, length in zip(threes, kept, strict=True)
        if length is not None and any(abs(length / g - 1) < _OF_GRAVITY for g in _GRAVITY)
    ]
    gyro = free[0] if len(free) == 1 else ()
    return gyro, accel[0] if len(accel) == 1 else ()


def named_by_values(table: Table) -> Table:
    """Return a table with its six columns named as gyro and accelerometer by their values."""
    if table.names is not None or not 2 * _AXES_COUNT <= table.width <= _MAX_UNNAMED_COLUMNS:
        return table
    try:
        time, counters = unnamed_time(table, ())
        places = [i for i in range(table.width) if i not in {time, *counters}]
        gyro, accel = gyro_of_many(table, places) if len(places) == 2 * _AXES_COUNT else ((), ())
        known = gyro and accel and not_of_gyro(table, gyro) is None
    except LogError:
        return table
    if not known:
        return table
    names = {i: f"{kind}_{axis}" for kind, own in (("gyro", gyro), ("accel", accel))
             for i, axis in zip(own, _AXES, strict=True)}  # fmt: skip
    note = (
        f"the table has no names: columns {', '.join(map(str, accel))} keep the length of gravity "
        f"and are read as the accelerometer, {', '.join(map(str, gyro))} for the gyro"
    )
    meta = replace(table.meta, notes=(*table.meta.notes, note))
    listed = tuple(names.get(i, f"column_{i}") for i in range(table.width))
    return replace(table, names=listed, time=time, timeless=time is None, meta=meta)
