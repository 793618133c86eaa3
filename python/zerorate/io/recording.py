"""The reading of recordings: all sensors of a file, found by the names of columns and topics."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Final, NamedTuple, Unpack, cast

import numpy as np

from zerorate.faults import given, said, sentence_of
from zerorate.io.clocks.names import looks_like_time
from zerorate.io.clocks.sensor_clock import Clock
from zerorate.io.columns import Columns, TimeColumn, Timing, check_samples, choose, with_time
from zerorate.io.counts import Scale, Scaling
from zerorate.io.formats import LogSource, label_of, opened
from zerorate.io.reading import (
    Asked,
    Group,
    ReadArguments,
    loaded_of,
    log_of,
    row_clock,
    selected,
    values_of,
)
from zerorate.io.supplement import Opened, supplement_of
from zerorate.io.table import Content, Table
from zerorate.io.triads import Triad, named, note_on_axes, triads_in, without_worse
from zerorate.record.log import Log, LogError, units_of
from zerorate.record.names import (
    UNKNOWN,
    Meaning,
    canonical_unit,
    check_foreign,
    common_unit,
    is_quaternion,
    meaning_of,
    split_unit,
)
from zerorate.record.recording import Recording
from zerorate.record.span import Span
from zerorate.types import Floats

KINDS: Final = (
    "gyro",
    "accel",
    "mag",
    "temperature",
    "gravity",
    "reference",
    "position",
    "velocity",
    "position_sigma",
    "velocity_sigma",
)
_ASKED: Final = ("gyro", "accel", "mag")
"""Kinds whose columns may be named."""
_ACCELERATIONS: Final = ("g", "m/s^2")
_ONE: Final = "1"
_UNSTEADY: Final = 0.25
"""Periods by which stamps leave a clock that is not the sensor's own."""


def read_recording(
    source: LogSource | Sequence[LogSource],
    rate: float | None = None,
    *,
    columns: Columns | Mapping[str, Columns] = None,
    reference: Columns = None,
    unit: str | Mapping[str, str] | None = None,
    topic: str | None = None,
    only: Iterable[str] | None = None,
    sensor: str | None = None,
    scale: Scale = None,
    start: float | None = None,
    stop: float | None = None,
    time: TimeColumn = None,
    time_unit: str | None = None,
) -> Recording:
    """Return the logs of all sensors in a file, found by the names of its columns and topics.

    Parameters
    ----------
    source
        As of `read_log`; or a list of them, such as the file of an IMU and that of a GNSS
        receiver, whose logs keep their own clocks.
    rate
        Samples per second of the gyro and of what has no timestamps, Hz.
    columns
        Names or indices of the gyro's columns, or of those of several kinds, ``{"gyro": ["p", "q",
        "r"], "accel": [4, 5, 6]}``, also ``mag``; by default they are found, one log a sensor.
    reference
        Names or indices of the reference's columns; by default those named ``encoder``, ``ref_``,
        ``truth_`` or so, and quaternions.
    unit
        Of the gyro, or of several kinds, ``{"gyro": "deg/s", "accel": "g"}``, where the file does
        not say it. Values are never converted.
    topic
        The topic of a ROS recording or a PX4 log that comes first, so that its gyro is ``gyro``.
    only
        Kinds of logs to read; default all: ``gyro``, ``accel``, ``mag``, ``temperature``,
        ``gravity``, ``reference``, ``position``, ``velocity``, and ``position_sigma`` and
        ``velocity_sigma``, their standard deviations.
    sensor
        Which sensor of several, as of `read_log`. By default there is a log for each device, and of
        values in several stages (raw, calibrated, filtered) the best is read, as ``notes`` says.
    scale
        What values are multiplied by: a number for the gyro, ``{"gyro": 1 / 131, "accel":
        1 / 16384}``, or `zerorate.raw_counts` of a device, whose units are then known.
    start, stop
        Seconds between which the logs are read: from `start`, to before `stop`. They are counted
        from the earliest sample of all logs of a source; those of a list have clocks of their
        own. Another sensor than the gyro without a sample there is left out, and ``notes`` says
        so.
    time, time_unit
        As of `read_log`; in a source of several tables the column is that of those that have it.

    Returns
    -------
    Recording
        Logs of shape (n, k), NaN where a sample is missing. A sensor that has a value in every
        second row or fewer has a log at its own rate. Its ``fixes``, ``mounting`` and ``tables``
        are read when first asked for.

    Raises
    ------
    LogError
        If nothing in it looks like a sensor, or a gyro cannot be read, as `read_log` does. Other
        sensors that cannot be read are left out, and ``notes`` says so.
    ValueError, TypeError, OSError, ImportError
        As `read_log`; also if a kind is not known.

    Examples
    --------
    >>> import numpy as np
    >>> import zerorate as zr
    >>> imu = {"t": np.arange(8) / 100, "gyro_radps": np.zeros((8, 3)), "accel_g": np.ones((8, 3))}
    >>> gnss = {"t": np.arange(3) / 4, "lat_deg": np.ones(3), "height_m": np.ones(3)}
    >>> recording = zr.read_recording([imu, gnss])
    >>> recording.position
    Log(3 samples at 4 Hz, 0.75 s, deg, m: lat_deg, height_m)
    >>> recording.gyro.rate, recording.accel.unit
    (100.0, 'g')
    """
    several = isinstance(source, (list, tuple))
    sources = list(cast(Sequence[LogSource], source)) if several else [cast(LogSource, source)]
    if not sources:
        raise LogError("there is no source to read")
    of_kinds = columns if isinstance(columns, Mapping) else {"gyro": columns}
    asked = Asked.of(
        rate=rate, topic=topic, sensor=sensor, scale=scale,
        start=start, stop=stop, time=time, time_unit=time_unit,
    )  # fmt: skip
    return _recording(sources, _request(asked, of_kinds, reference, unit, only))


def read_topic(
    source: LogSource,
    *,
    reference: Columns = None,
    unit: str | None = None,
    only: Iterable[str] | None = None,
    **arguments: Unpack[ReadArguments],
) -> Recording:
    """Return the recording of one topic alone, the one that `read_log` would read.

    Arguments and faults are those of `read_recording` and, of several topics to choose from, those
    of `read_log`.
    """
    asked = Asked.of(**arguments)
    request = _request(asked, {"gyro": asked.columns}, reference, unit, only)
    return _recording([source], replace(request, alone=True))


def _request(
    asked: Asked,
    columns: Mapping[str, Columns],
    reference: Columns,
    unit: str | Mapping[str, str] | None,
    only: Iterable[str] | None,
) -> _Request:
    unknown = [kind for kind in columns if kind not in _ASKED]
    if unknown:
        raise ValueError(
            said(given("columns"), f" takes those of {', '.join(_ASKED)}, got '{unknown[0]}'")
        )
    known = {**columns, "reference": reference}
    chosen = {kind: names for kind, names in known.items() if names is not None}
    return _Request(
        chosen, _units(unit), asked.topic, _kinds(only), False,
        asked.sensor, asked.rate, asked.scaling, asked.span, asked.timing,
    )  # fmt: skip


def _recording(sources: Sequence[LogSource], request: _Request) -> Recording:
    label = ", ".join(map(label_of, sources))
    found: list[_Found] = []
    notes: list[str] = []
    offered: list[str] = []
    sensed: list[Opened] = []
    for one in sources:
        try:
            kind, content = opened(one)
            sensed.append(Opened(one, kind, content))
            told = {"source": label_of(one), "format": kind}
            found.extend(_within(_logs_in(content, told, request, notes, offered), request, notes))
        except LogError as error:
            raise error.around(f"{label_of(one)}: ") from None
        request = replace(request, columns={}, topic=None)
    if not found:
        sought = "a sensor" if request.only == KINDS else f"a {request.only[0]}"
        raise LogError(
            said(
                f"{label}: no column looks like {sought}; choose with ",
                given("columns"),
                f" from: {', '.join(offered)}",
            )
        )
    supplement = supplement_of(sensed, request.timing)
    return Recording(_named(found), label, notes=tuple(dict.fromkeys(notes)), supplement=supplement)


class _Found(NamedTuple):
    kind: str
    log: Log


def _within(found: Iterable[_Found], request: _Request, notes: list[str]) -> Iterator[_Found]:
    """Yield the parts of a source's logs that lie in the span asked for."""
    whole = list(found)
    if not whole:
        return
    for (kind, log), part in zip(whole, request.span.of([one.log for one in whole]), strict=True):
        if part is not None:
            yield _Found(kind, part)
            continue
        if kind == "gyro":
            raise request.span.missed().around(f"{', '.join(log.names)}: ")
        missed = sentence_of(request.span.missed())
        notes.append(said(f"{', '.join(log.names)}: left out, for ", missed))


class _Sensor(NamedTuple):
    """Columns of a table, by their indices, that are the axes of one sensor."""

    kind: str
    places: tuple[int, ...]
    unit: str
    factor: float | None = None


@dataclass(frozen=True)
class _Request:
    columns: Mapping[str, Columns]
    unit: Mapping[str, str]
    topic: str | None
    only: tuple[str, ...]
    alone: bool = False
    sensor: str | None = None
    rate: float | None = None
    scaling: Scaling = field(default_factory=Scaling)
    span: Span = field(default_factory=Span)
    timing: Timing = field(default_factory=Timing)

    def requires(self, sensors: Iterable[_Sensor]) -> bool:
        """Whether a sensor among these was asked for, so that a fault in it is one of all."""
        asked = {"gyro", *self.columns}
        return any(sensor.kind in asked for sensor in sensors)


def _units(unit: str | Mapping[str, str] | None) -> dict[str, str]:
    given = {"gyro": unit} if isinstance(unit, str) else dict(unit or {})
    _kinds(given)
    known = ("gyro", "accel")
    return {kind: canonical_unit(u) if kind in known else str(u) for kind, u in given.items()}


def _kinds(only: Iterable[str] | None) -> tuple[str, ...]:
    kinds = KINDS if only is None else tuple(only)
    unknown = [kind for kind in kinds if kind not in KINDS]
    if unknown:
        raise ValueError(f"there is no kind of log '{unknown[0]}'; known: {', '.join(KINDS)}")
    return kinds


def _named(found: Sequence[_Found]) -> dict[str, Log]:
    """Return logs by name: the kind, and from the second of a kind on its number."""
    counts = dict.fromkeys(KINDS, 0)
    logs = {}
    for kind, log in found:
        logs[f"{kind}_{counts[kind]}" if counts[kind] else kind] = log
        counts[kind] += 1
    return logs


def _logs_in(
    content: Content,
    told: dict[str, str],
    request: _Request,
    notes: list[str],
    offered: list[str],
) -> Iterator[_Found]:
    """Yield the logs of one source; add what was left out, and the columns that there are."""
    tables = [] if request.alone else _tables(content, request.topic)
    if not tables:
        tables = [content.chosen(request.topic)]
    for table in map(with_time, request.timing.told_of_all(tables)):
        offered.extend(table.label(index) for index in range(table.width))
        sensors = _sensors(table, request, notes)
        if "" in content.tables and request.only == KINDS:
            notes.extend(_on_others(table, sensors))
        wanted = [sensor for sensor in sensors if sensor.kind in request.only]
        for shared in _by_clock(table, wanted):
            yield from _readable(table, shared, request, told, notes)
        if any(sensor.kind == "reference" for sensor in wanted):
            notes.extend(table.meta.notes)  # of what others are judged by
        request = replace(request, columns={})


def _tables(content: Content, topic: str | None) -> list[Table]:
    first = [] if topic is None else [content.chosen(topic)]
    topics = content.tables if content.sensors is None else content.sensors
    return [*first, *(content.tables[t] for t in topics if content.tables[t] not in first)]


def _sensors(table: Table, request: _Request, notes: list[str]) -> list[_Sensor]:
    """Return the sensors of a table: those asked for, and those found by name."""
    for columns in request.columns.values():
        check_samples(table, columns)
    taken = {kind: choose(table, columns).data for kind, columns in request.columns.items()}
    used = {index for places in taken.values() for index in places}
    groups: dict[tuple[str, str], list[int]] = {(k, ""): list(p) for k, p in taken.items()}
    # Without names nothing is found beside what is asked for.
    told = table.names is None and "gyro" in taken
    named_so = {} if told else _found(table, request, used, notes)
    for (kind, sensor), places in named_so.items():
        if kind not in taken:
            groups[kind, sensor] = places
    return [_sensor(table, kind, places, request) for (kind, _), places in groups.items()]


def _found(
    table: Table, request: _Request, used: set[int], notes: list[str]
) -> dict[tuple[str, str], list[int]]:
    """Return the columns of the sensors found by name, in the order of the file."""
    meanings = {i: one for i, one in _meanings(table).items() if i not in used}
    named_words = {i: table.label(i) for i, one in meanings.items() if one.words is not None}
    groups: dict[tuple[str, str], list[int]] = {}
    for index, meaning in meanings.items():
        if index not in named_words:
            groups.setdefault((meaning.kind, meaning.sensor), []).append(index)
    found = triads_in(named_words)
    chosen = _meant(found, request.sensor, notes)
    for number, triad in enumerate(chosen):
        groups[triad.kind, f"{triad.stem} {number}"] = list(triad.places)
        notes.extend(note_on_axes(triad, [table.label(i) for i in triad.places]))
    return dict(sorted(groups.items(), key=lambda item: min(item[1])))


def _meant(found: list[Triad], sensor: str | None, notes: list[str]) -> list[Triad]:
    """Return the sensors that are read, by their kind: all devices in their best stage."""
    pool = found if sensor is None else [one for one in found if one in named(found, sensor)]
    kinds = {one.kind for one in pool}
    kept, left = without_worse([*pool, *(one for one in found if one.kind not in kinds)])
    if left:
        stems = ", ".join(dict.fromkeys(one.stem for one in left))
        notes.append(f"of several stages of one sensor the best is read; left out: {stems}")
    return kept


def _meanings(table: Table) -> dict[int, Meaning]:
    """Return what columns are of sensors; the file may list those of one without a known name."""
    kind = "accel" if table.meta.unit in _ACCELERATIONS else "gyro"
    listed = Meaning(kind, "", None)
    if table.names is None:
        return dict.fromkeys(choose(table, None).data, listed)
    found = {}
    for index, name in enumerate(table.names):
        if index == table.time or looks_like_time(name):
            continue
        meaning = meaning_of(name)
        if meaning is None and table.data is not None and index in table.data:
            meaning = listed
        if meaning is not None:
            found[index] = meaning
    return found


def _sensor(table: Table, kind: str, places: list[int], request: _Request) -> _Sensor:
    names = [table.label(index) for index in places]
    given = request.unit.get("accel" if kind == "gravity" else kind)
    stated_units = _stated_units(table)
    if kind in ("gyro", "accel"):
        given = request.scaling.unit(kind, given)
        factor = request.scaling.of_kind(kind, first=kind == "gyro")
        check_foreign(names, given, factor)
        stated = _of_one(kind, {stated_units.get(i, table.meta.unit) for i in places})
        return _Sensor(kind, tuple(places), common_unit(names, given, stated), factor)
    if all(map(is_quaternion, names)):
        # Components may stand in any order, w last for instance.
        order = sorted(range(len(names)), key=lambda i: names[i][-1].lower())
        return _Sensor(kind, tuple(places[i] for i in order), given or _ONE)
    units = [
        _unit_of(name) or given or stated_units.get(index, UNKNOWN)
        for index, name in zip(places, names, strict=True)
    ]
    return _Sensor(kind, tuple(places), units[0] if len(set(units)) == 1 else ", ".join(units))


def _of_one(kind: str, units: set[str | None]) -> str | None:
    """Return the one unit that a file states for a gyro or an accelerometer, if it is of that."""
    unit = units.pop() if len(units) == 1 else None
    return unit if (unit in _ACCELERATIONS) == (kind == "accel") else None


def _stated_units(table: Table) -> dict[int, str]:
    """Return the units that a file states for the columns that it lists as data."""
    if table.data is None or table.meta.unit is None:
        return {}
    units = units_of(table.meta.unit, len(table.data))
    return dict(zip(table.data, units, strict=True))


def _unit_of(name: str) -> str | None:
    meaning = meaning_of(name)
    return split_unit(name)[1] if meaning is None else meaning.unit


def _on_others(table: Table, sensors: Sequence[_Sensor]) -> Iterator[str]:
    used = {index for sensor in sensors for index in sensor.places}
    others = [
        name
        for index, name in enumerate(table.names or ())
        if index not in used and index != table.time and not looks_like_time(name)
    ]
    if others:
        yield f"no sensor is known by the name of: {', '.join(others)}"


def _listed(table: Table, sensors: Iterable[_Sensor]) -> str:
    return ", ".join(table.label(index) for sensor in sensors for index in sensor.places)


def _by_clock(table: Table, sensors: Sequence[_Sensor]) -> list[list[_Sensor]]:
    """Return the sensors in groups that share the column of timestamps and its length."""
    groups: dict[tuple[int | None, int], list[_Sensor]] = {}
    for sensor in sensors:
        time = choose(table, sensor.places).time
        rows = 0 if table.lengths is None else table.lengths[sensor.places[0]]
        groups.setdefault((time, rows), []).append(sensor)
    return list(groups.values())


def _readable(
    table: Table,
    sensors: Sequence[_Sensor],
    request: _Request,
    told: dict[str, str],
    notes: list[str],
) -> list[_Found]:
    """Return the logs of sensors on one clock, without those that cannot be read."""
    try:
        return list(_logs(table, sensors, request, told, notes))
    except LogError as error:
        if len(sensors) > 1:
            alone = (_readable(table, [sensor], request, told, notes) for sensor in sensors)
            return [found for each in alone for found in each]
        if request.requires(sensors):
            raise
        notes.append(said(f"{_listed(table, sensors)}: left out, for ", sentence_of(error)))
        return []


def _logs(
    table: Table,
    sensors: Sequence[_Sensor],
    request: _Request,
    told: dict[str, str],
    notes: list[str],
) -> Iterator[_Found]:
    places = [index for sensor in sensors for index in sensor.places]

    def grouped(names: list[str], file_unit: str | None) -> list[Group]:
        return [
            Group(
                tuple(places.index(index) for index in sensor.places),
                sensor.unit,
                sensor.kind if sensor.kind in ("gyro", "accel") else None,
                sensor.factor,
            )
            for sensor in sensors
        ]

    stamped = choose(table, places).time is not None
    concerned = not stamped or any(sensor.kind == "gyro" for sensor in sensors)
    chosen = selected(table, request.rate if concerned else None, places, grouped)
    columns, time = loaded_of(chosen)
    rows = row_clock(chosen, time, len(columns[0]))
    logs: list[Log] = []
    for sensor, (group, values) in zip(sensors, values_of(chosen, columns), strict=True):
        names = [chosen.names[i] for i in group.places]
        values, clock = _with_values(values, rows) or (values, rows)
        log = log_of(chosen, group, values, clock.of_sensor(values), told, logs)
        logs.append(log)
        if np.isnan(log.data).all() and not request.requires([sensor]):
            notes.append(f"{', '.join(names)}: left out, for all samples are missing")
            continue
        yield _Found(sensor.kind, log)


def _with_values(values: Floats, rows: Clock) -> tuple[Floats, Clock] | None:
    """Return the values that are there, and their clock; None if it is that of all rows.

    It is another one if the sensor has a value in every second row or fewer, or if the rows of
    several sensors stand between each other so that together they are no clock.
    """
    known = np.isfinite(values).any(axis=1)
    if known.all():
        return None
    there = np.flatnonzero(known)
    if len(there) in (0, 1):
        return None
    unsteady = rows.grid.report.jitter_max * rows.grid.rate > _UNSTEADY
    if np.median(np.diff(there)) < 2 and not unsteady:
        return None
    try:
        return values[there], rows.among(there)
    except LogError:
        return None
