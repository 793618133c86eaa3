"""Evidence for the role, unit and clock of each column of a table.

Roles come from the columns' names (`zerorate.io.sensors`), from the file's own list, or from the
values if a table has no names. Units come from a name, an argument, the other axes, or the
metadata. `zerorate.io.timecolumns` finds the clocks. All other modules use these results.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Final, NamedTuple

import numpy as np

from zerorate.faults import keyword_argument, make_sentence
from zerorate.io.clocks.names import find_time_unit, has_time_name, looks_like_time
from zerorate.io.columns import not_found
from zerorate.io.counts import Scaling
from zerorate.io.sensors import (
    IMU_KINDS,
    Sensor,
    choose_sensors,
    find_sensors,
    keep_best_stage,
    list_devices,
    list_stems,
    select_sensors,
)
from zerorate.io.table import Table, to_numbers
from zerorate.io.timecolumns import clues_of, time_of, unnamed_time, with_clock
from zerorate.record.devices import several_devices
from zerorate.record.log import LogError, units_of
from zerorate.record.names import (
    KIND_OF_UNIT,
    UNKNOWN_UNIT,
    check_foreign,
    common_unit,
    is_quaternion,
    looks_like_accelerometer,
    looks_like_gyro,
    meaning_of,
    split_unit,
)
from zerorate.types import Floats

_AXES: Final = "xyz"
_SCALED_KINDS: Final = ("gyro", "accel")
_UNITLESS: Final = "1"
_GYRO_END: Final = 4000.0
"""Largest rate that a gyro can measure, deg/s."""
_GRAVITY: Final = (1.0, 9.80665)
_OF_GRAVITY: Final = 0.03
"""Largest relative difference between the force at rest and gravity."""
_MAX_UNNAMED_COLUMNS: Final = 12
"""Largest width of a table without names that is searched: six sensor columns, times, counters."""
_KIND_NAMES: Final = {
    "gyro": "a gyro",
    "accel": "an accelerometer",
    "mag": "a magnetometer",
    "angle": "an angle",
}


class Role(NamedTuple):
    """Name, role, unit and log of a column; role and unit with their evidence.

    Unknown texts are empty.
    """

    name: str
    meaning: str
    unit: str
    log: str


@dataclass(frozen=True)
class Evidence:
    """Sensors of a table, with their columns, units and clocks."""

    table: Table

    @classmethod
    def of(cls, table: Table) -> Evidence:
        """Return the evidence for a table; data are loaded only if the names are insufficient."""
        unnamed = table.names is None
        return cls(table.in_memory(range(table.width)) if unnamed else with_clock(table))

    def sensors(self, without: Collection[int] = ()) -> list[Sensor]:
        """Return the sensors of a table with names, except the columns in `without`."""
        table, taken = self.table, {self.table.time, *without}
        names = {i: n for i, n in enumerate(table.names or ()) if i not in taken}
        names = {i: name for i, name in names.items() if not looks_like_time(name)}
        listed = [i for i in table.data or () if i in names and meaning_of(names[i]) is None]
        found = find_sensors(names)
        if listed:
            found.append(Sensor(self._listed_kind, tuple(listed)))
        return sorted(found, key=lambda sensor: min(sensor.indices))

    @property
    def _listed_kind(self) -> str:
        """Kind of the data columns that a file lists, if their names are unknown."""
        return "accel" if KIND_OF_UNIT.get(self.table.meta.unit or "") == "accel" else "gyro"

    def one_of_each(
        self, kinds: Sequence[str], wanted: str | None, is_sole: bool = False
    ) -> tuple[list[Sensor], list[str]]:
        """Return one sensor of each kind (the requested one, if named), and notes.

        In a table without names, the sensor is all columns except the time, at most three. Raises
        LogError without a sensor, and for several devices if ``is_sole`` is True.
        """
        if self.table.data is not None:
            return [Sensor(self._listed_kind, self.table.data)], []
        if self.table.names is None:
            return self._by_values()
        of_kinds = [sensor for sensor in self.sensors() if sensor.kind in kinds]
        if not of_kinds:
            raise not_found(" or ".join(_KIND_NAMES[kind] for kind in kinds), self.table)
        select_sensors(of_kinds, wanted)
        chosen: list[Sensor] = []
        notes: list[str] = []
        for kind in kinds:
            own = [sensor for sensor in of_kinds if sensor.kind == kind]
            # A name may match only the gyro, or only the accelerometer.
            is_named = wanted is None or any(s in own for s in select_sensors(of_kinds, wanted))
            chosen_of_kind, own_notes = self._choose(own, wanted if is_named else None, is_sole)
            chosen += chosen_of_kind
            notes += own_notes
        return chosen, notes

    def _choose(
        self, own: list[Sensor], wanted: str | None, is_sole: bool
    ) -> tuple[list[Sensor], list[str]]:
        """Return the chosen sensors of a kind after a check of their columns, and notes."""
        names = self.table.names or ()
        devices = list_devices(own, names) if is_sole and wanted is None else ()
        if len(devices) > 1:
            raise several_devices(devices)
        chosen = choose_sensors(own, wanted)
        for sensor in chosen:
            _check_axes(sensor, self._labels(sensor))
        _check_unique([name for sensor in own for name in self._labels(sensor)])
        notes = list(self._describe_axes(chosen))
        others = [sensor for sensor in own if sensor not in chosen]
        if chosen and others:
            label = ", ".join(name for sensor in chosen for name in self._labels(sensor))
            is_read = f"of several sensors {label} is read; "
            listed = f" chooses another: {list_stems(others)}"
            notes.append(make_sentence(is_read, keyword_argument("sensor"), listed))
        return chosen, notes

    def of_all_devices(
        self, wanted: str | None, without: Collection[int]
    ) -> tuple[list[Sensor], list[str]]:
        """Return the sensors of all kinds and devices, each in its best stage, and notes."""
        if self.table.names is None:
            chosen, notes = self._by_values()
            left = [tuple(i for i in sensor.indices if i not in without) for sensor in chosen]
            return [Sensor(self._listed_kind, indices) for indices in left if indices], notes
        sensors = self.sensors(without)
        named = [one for one in sensors if meaning_of(self._labels(one)[0]) is not None]
        imus = [one for one in named if one.kind in IMU_KINDS]
        pool = select_sensors(imus, wanted)
        kinds = {sensor.kind for sensor in pool}
        best, others = keep_best_stage([*pool, *(s for s in imus if s.kind not in kinds)])
        chosen = [one for one in sensors if one in best or one not in imus]
        notes = list(self._describe_axes(chosen))
        if others:
            left_out = "of several stages of one sensor the best is read; left out: "
            notes.insert(0, left_out + ", ".join(dict.fromkeys(one.stem for one in others)))
        return [s._replace(device=s.label(self._labels(s)[0])) for s in chosen], notes

    def _labels(self, sensor: Sensor) -> list[str]:
        return [self.table.label(index) for index in sensor.indices]

    def _describe_axes(self, sensors: Sequence[Sensor]) -> Iterator[str]:
        """Yield a sentence for each sensor with axes assumed from the order of its columns."""
        for sensor in sensors:
            if sensor.is_complete and not sensor.has_named_axes:
                names = ", ".join(self._labels(sensor))
                yield f"the names {names} show no axes, so they are x, y, z in this order"

    def _by_values(self) -> tuple[list[Sensor], list[str]]:
        """Return the gyro columns of a table without names, and a note on them.

        Raises
        ------
        LogError
            If there are more than three columns, or their values are impossible for a gyro.
        """
        table = self.table
        if table.data is not None:
            return [Sensor(self._listed_kind, table.data)], []
        time, counters = unnamed_time(table, ())
        places = tuple(i for i in range(table.width) if i not in {time, *counters})
        if not places:
            raise not_found("a gyro", table)
        if len(places) > len(_AXES):
            likely = _imu_by_values(table, places)[0] or places[-len(_AXES) :]
            lacking = (
                f"the table has no names, and {len(places)} columns apart from the time are no "
                "gyro of three axes; say which are, counted from 0, such as "
            )
            columns = keyword_argument("columns", ",".join(map(str, likely)))
            raise LogError(make_sentence(lacking, columns))
        if (found := _not_of_gyro(table, places)) is not None:
            why, left = found
            columns = keyword_argument("columns", ",".join(map(str, left)))
            begin = f"the table has no names, and {why}; "
            raise LogError(make_sentence(begin, columns, " reads as a gyro"))
        listed = ", ".join(map(table.label, places))
        sensor = Sensor(self._listed_kind, places)
        return [sensor], [f"the table has no names: {listed} are read as a gyro"]

    def in_unit(self, sensor: Sensor, stated: str | None, scaling: Scaling, first: bool) -> Sensor:
        """Return a sensor with its unit and factor; `first`: it is the first one to be read.

        Raises
        ------
        LogError
            If its columns differ in unit, or their unit differs from the stated unit.
        """
        names = self._labels(sensor)
        if sensor.kind in _SCALED_KINDS:
            stated = scaling.unit(sensor.kind, stated)
            factor = scaling.factor_for(sensor.kind, first)
            check_foreign(names, stated, factor)
            if KIND_OF_UNIT.get(stated or "") == "accel" and all(map(looks_like_gyro, names)):
                like = f"{', '.join(names)} are named like a gyro"
                raise LogError(f"unit '{stated}' was given, but {like}")
            unit = common_unit(names, stated, self._file_unit(sensor))
            return sensor._replace(unit=unit, factor=factor)
        if all(map(is_quaternion, names)):
            # Components can be in any order, for example w last.
            order = sorted(sensor.indices, key=lambda i: self.table.label(i)[-1].lower())
            return sensor._replace(indices=tuple(order), unit=stated or _UNITLESS)
        listed = self._listed_units()
        units = [
            _named_unit(name) or stated or listed.get(index, UNKNOWN_UNIT)
            for index, name in zip(sensor.indices, names, strict=True)
        ]
        return sensor._replace(unit=units[0] if len(set(units)) == 1 else ", ".join(units))

    def _listed_units(self) -> Mapping[int, str]:
        """Return the units that a file states for its listed data columns."""
        data, unit = self.table.data, self.table.meta.unit
        return (
            {}
            if data is None or unit is None
            else dict(zip(data, units_of(unit, len(data)), strict=True))
        )

    def _file_unit(self, sensor: Sensor) -> str | None:
        """Return the unit that a file states for a sensor; None for another quantity's unit."""
        stated = self.table.meta.unit
        if sensor.indices == self.table.data:
            return stated
        listed = self._listed_units()
        units = {listed.get(index, stated) for index in sensor.indices}
        stated = units.pop() if len(units) == 1 else None
        kind = KIND_OF_UNIT.get(stated or "")
        return None if kind in _SCALED_KINDS and kind != sensor.kind else stated

    def kind_of(self, columns: Sequence[int]) -> str:
        """Return the kind of requested columns: "accel" if all have an accelerometer's name."""
        names = [self.table.label(index) for index in columns]
        if all(looks_like_accelerometer(name) and not looks_like_gyro(name) for name in names):
            return "accel"
        unknown = all(meaning_of(name) is None for name in names)
        return self._listed_kind if unknown else "gyro"

    def time_of(self, data: Sequence[int] = ()) -> int | None:
        """Return the time column for some data columns."""
        return time_of(self.table, data)

    def roles(self, logs: Mapping[str, tuple[str, str]]) -> list[Role]:
        """Return the role of each column; `logs` has log and unit of the columns that are read."""
        first = next((s.indices[0] for s in self.sensors() if s.kind == "gyro"), None)
        time = self.time_of([self.table.width - 1 if first is None else first])
        clues = {clue.place: clue.evidence for clue in clues_of(self.table)[0]}
        return [
            self._role_of_time(index, clues.get(index, "as stated"), index == time)
            if index == time or looks_like_time(self.table.label(index))
            else self._role(index, clues.get(index), *logs.get(self.table.label(index), ("", "")))
            for index in range(self.table.width)
        ]

    def _role_of_time(self, index: int, clue: str, is_clock: bool) -> Role:
        name, log = self.table.label(index), "time" if is_clock else ""
        meaning = "time" if has_time_name(name) else f"time, {clue}"
        unit, stated = find_time_unit(name), self.table.time_unit if is_clock else None
        if stated not in (None, unit):
            return Role(name, meaning, f"{stated}, by the other clock", log)
        return Role(name, meaning, f"{unit}, by its name" if unit else "by its numbers", log)

    def _role(self, index: int, clue: str | None, log: str, known: str) -> Role:
        """Return the role of a column that is not a time."""
        name = self.table.label(index)
        found = meaning_of(name)
        named = split_unit(name)[1] if found is None else found.unit
        unit = f"{named}, by its name" if named else ""
        if found is None:
            by_place = f"{log}, by its position" if log else ""
            return Role(name, f"may be the time {clue}" if clue else by_place, unit, log)
        words = found.words
        axis = "" if words is None or words.axis is None else _AXES[words.axis]
        parts = (found.kind, "" if words is None else words.stage, axis)
        if not unit and known in KIND_OF_UNIT:
            unit = f"{known}, by the names of its other axes"
        elif not unit:
            stated = self.table.meta.unit
            unit = f"{stated}, by the metadata" if stated else "not known"
        return Role(name, " ".join(filter(None, parts)), unit, log)


def _named_unit(name: str) -> str | None:
    meaning = meaning_of(name)
    return split_unit(name)[1] if meaning is None else meaning.unit


def _check_axes(sensor: Sensor, names: Sequence[str]) -> None:
    """Raise LogError for a sensor with over three columns or with a foreign unit."""
    like = _KIND_NAMES[sensor.kind]
    if len(names) > len(_AXES):
        many = f"{len(names)} columns are of {like}, expected three axes: {', '.join(names)}"
        columns = keyword_argument("columns", ",".join(names[: len(_AXES)]))
        raise LogError(make_sentence(many, "; say which, such as ", columns))
    for name in names:
        unit = _named_unit(name) or ""
        kind = KIND_OF_UNIT.get(unit, "angle" if unit in ("deg", "rad") else sensor.kind)
        if kind != sensor.kind:
            foreign = f"in {unit}, the unit of {_KIND_NAMES[kind]}; "
            raise LogError(
                make_sentence(
                    f"column '{name}' is named like {like} but is {foreign}",
                    keyword_argument("columns"),
                    " reads it all the same",
                )
            )


def _check_unique(names: Sequence[str]) -> None:
    repeated = ", ".join(sorted({name for name in names if names.count(name) > 1}))
    if repeated:
        differ = f"names must differ, repeated: {repeated}; choose by position with "
        raise LogError(make_sentence(differ, keyword_argument("columns")))


def _load_values(table: Table, places: Sequence[int]) -> list[Floats]:
    columns = zip(places, table.load(places), strict=True)
    return [to_numbers(column, table.label(i)) for i, column in columns]


def _not_of_gyro(table: Table, places: Sequence[int]) -> tuple[str, Sequence[int]] | None:
    """Return the reason why unnamed columns are no gyro, and columns that may be the gyro.

    Return None if the columns may be a gyro.
    """
    values = _load_values(table, places)
    whole = all(np.all(np.isnan(column) | (column == np.rint(column))) for column in values)
    for index, column in zip(places, values, strict=True):
        level = float(np.nanmedian(np.abs(column))) if np.isfinite(column).any() else 0.0
        if level > _GYRO_END and not whole:
            left = [i for i in places if i != index]
            return f"column {index} holds values about {level:.6g}, which no gyro measures", left
    if len(values) == len(_AXES) and (g := _gravity(values)) is not None:
        return f"its columns keep the length {g:g}, as gravity does and no gyro", places
    return None


def _length(values: Sequence[Floats]) -> float | None:
    """Return the constant length of vectors, such as gravity; None if the length changes."""
    size = np.sqrt(np.sum(np.square(np.stack(values).astype(np.float64)), axis=0))
    known = size[np.isfinite(size)]
    length = float(np.median(known)) if known.size else 0.0
    if length == 0.0 or np.percentile(np.abs(known / length - 1), 90) >= _OF_GRAVITY:
        return None
    return length


def _gravity(values: Sequence[Floats]) -> float | None:
    """Return 1 or 9.80665 if the vectors have this constant length; otherwise None."""
    length = _length(values)
    near = (g for g in _GRAVITY if length is not None and abs(length / g - 1) < _OF_GRAVITY)
    return next(near, None)


def _imu_by_values(table: Table, places: Sequence[int]) -> tuple[Sequence[int], Sequence[int]]:
    """Return the columns of gyro and accelerometer in a table without names.

    Three columns form the accelerometer if their vector has the constant length of gravity. Three
    columns form the gyro if their vector has no constant length. If the values do not show a
    sensor, its columns are empty.
    """
    if len(places) % len(_AXES):
        return (), ()
    threes = [places[i : i + len(_AXES)] for i in range(0, len(places), len(_AXES))]
    values = [_load_values(table, three) for three in threes]
    gyros = [three for three, own in zip(threes, values, strict=True) if _length(own) is None]
    accels = [three for three, own in zip(threes, values, strict=True) if _gravity(own)]
    return gyros[0] if len(gyros) == 1 else (), accels[0] if len(accels) == 1 else ()


def named_by_values(table: Table) -> Table:
    """Return a table with names for its six unnamed columns, if they are gyro and accelerometer."""
    imu_width = 2 * len(_AXES)
    if table.names is not None or not imu_width <= table.width <= _MAX_UNNAMED_COLUMNS:
        return table
    try:
        time, counters = unnamed_time(table, ())
        places = [i for i in range(table.width) if i not in {time, *counters}]
        gyro, accel = _imu_by_values(table, places) if len(places) == imu_width else ((), ())
        if not gyro or not accel or _not_of_gyro(table, gyro) is not None:
            return table
    except LogError:
        return table
    names = {
        i: f"{kind}_{axis}"
        for kind, own in (("gyro", gyro), ("accel", accel))
        for i, axis in zip(own, _AXES, strict=True)
    }
    listed = tuple(names.get(i, f"column_{i}") for i in range(table.width))
    return replace(table, names=listed, time=time, timeless=time is None).noted(
        f"the table has no names: columns {', '.join(map(str, accel))} keep the length of gravity "
        f"and are read as the accelerometer, {', '.join(map(str, gyro))} for the gyro"
    )
