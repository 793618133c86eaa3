"""The reading of recordings: all sensors of a file, found by the names of columns and topics."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Final, NamedTuple, Unpack, cast

import numpy as np

from zerorate.faults import keyword_argument, make_sentence, sentence_of
from zerorate.io.clocks.names import looks_like_time
from zerorate.io.clocks.sensor_clock import Clock
from zerorate.io.columns import Columns, TimeColumn, Timing, check_samples, choose_columns
from zerorate.io.counts import Scale, Scaling
from zerorate.io.evidence import with_time
from zerorate.io.formats import LogSource, label_of, open_source
from zerorate.io.reading import (
    Group,
    ReadArguments,
    ReadOptions,
    iter_values,
    load_columns,
    make_log,
    make_row_clock,
    select_columns,
)
from zerorate.io.supplement import SourceContent, make_supplement
from zerorate.io.table import Content, Table
from zerorate.io.triads import (
    Triad,
    describe_axes,
    device_label,
    find_triads,
    keep_best_stage,
    select_triads,
)
from zerorate.record.devices import DEVICE
from zerorate.record.log import Log, LogError, units_of
from zerorate.record.names import (
    UNKNOWN_UNIT,
    Meaning,
    canonical_unit,
    check_foreign,
    common_unit,
    is_quaternion,
    looks_like_sensor,
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
    "pressure",
    "height",
    "heading",
    "baseline",
)
_NAMEABLE_KINDS: Final = ("gyro", "accel", "mag")
"""Kinds whose columns may be named."""
_ACCEL_UNITS: Final = ("g", "m/s^2")
_UNITLESS: Final = "1"
_MAX_JITTER_PERIODS: Final = 0.25
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
    torn: str | None = None,
) -> Recording:
    """Return the logs of all sensors in a file, found by the names of its columns and topics.

    Parameters
    ----------
    source
        As in `read_log`; or a list of them, such as the file of an IMU and that of a GNSS
        receiver, whose logs keep their own clocks.
    rate
        Samples per second of the gyro and of sensors without timestamps, Hz.
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
        ``velocity_sigma``, their standard deviations; ``pressure``, ``height`` of a barometer,
        ``heading``, and ``baseline`` of two antennas.
    sensor
        Sensor of several, as of `read_log`. By default there is a log for each device, and of
        values in several stages (raw, calibrated, filtered) the best is read, as ``notes`` says.
    scale
        Factors of the values: a number for the gyro, ``{"gyro": 1 / 131, "accel":
        1 / 16384}``, or `zerorate.raw_counts` of a device, whose units are then known.
    start, stop
        Part of the logs to read, s: from `start` to before `stop`, counted from the earliest sample
        of all logs of a source; those of a list have clocks of their own. Another sensor than the
        gyro without a sample there is left out, and ``notes`` says so.
    time, time_unit, torn
        As in `read_log`; in a source of several tables the column is that of those that have it.

    Returns
    -------
    Recording
        Logs of shape (n, k), NaN where a sample is missing. A sensor that has a value in every
        second row or fewer has a log at its own rate. The recording's ``fixes``, ``mounting`` and
        ``tables`` are read at first access.

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
    is_list = isinstance(source, (list, tuple))
    sources = list(cast(Sequence[LogSource], source)) if is_list else [cast(LogSource, source)]
    if not sources:
        raise LogError("there is no source to read")
    of_kinds = columns if isinstance(columns, Mapping) else {"gyro": columns}
    options = ReadOptions.of(
        rate=rate, topic=topic, sensor=sensor, scale=scale,
        start=start, stop=stop, time=time, time_unit=time_unit, torn=torn,
    )  # fmt: skip
    return _read_sources(sources, _make_request(options, of_kinds, reference, unit, only))


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
    options = ReadOptions.of(**arguments)
    request = _make_request(options, {"gyro": options.columns}, reference, unit, only)
    return _read_sources([source], replace(request, is_single_topic=True))


def _make_request(
    options: ReadOptions,
    columns: Mapping[str, Columns],
    reference: Columns,
    unit: str | Mapping[str, str] | None,
    only: Iterable[str] | None,
) -> _Request:
    unknown = [kind for kind in columns if kind not in _NAMEABLE_KINDS]
    if unknown:
        raise ValueError(
            make_sentence(
                keyword_argument("columns"),
                f" takes those of {', '.join(_NAMEABLE_KINDS)}, got '{unknown[0]}'",
            )
        )
    known = {**columns, "reference": reference}
    chosen = {kind: names for kind, names in known.items() if names is not None}
    return _Request(
        chosen, _check_units(unit), options.topic, _check_kinds(only), False,
        options.sensor, options.rate, options.scaling, options.span, options.timing,
    )  # fmt: skip


def _read_sources(sources: Sequence[LogSource], request: _Request) -> Recording:
    label = ", ".join(map(label_of, sources))
    logs: list[_SensorLog] = []
    notes: list[str] = []
    column_names: list[str] = []
    opened_sources: list[SourceContent] = []
    for source in sources:
        try:
            kind, content = open_source(source)
            opened_sources.append(SourceContent(source, kind, content))
            source_meta = {"source": label_of(source), "format": kind}
            logs.extend(
                _cut_to_span(
                    _read_source(content, source_meta, request, notes, column_names), request, notes
                )
            )
        except LogError as error:
            raise error.with_context(f"{label_of(source)}: ") from None
        request = replace(request, columns={}, topic=None)
    if not logs and notes and any(map(looks_like_sensor, column_names)):
        raise LogError(make_sentence(f"{label}: ", notes[-1]))
    if not logs:
        wanted = "a sensor" if request.only == KINDS else f"a {request.only[0]}"
        raise LogError(
            make_sentence(
                f"{label}: no column looks like {wanted}; choose with ",
                keyword_argument("columns"),
                f" from: {', '.join(column_names)}",
            )
        )
    supplement = make_supplement(opened_sources, request.timing)
    return Recording(
        _name_logs(logs), label, notes=tuple(dict.fromkeys(notes)), supplement=supplement
    )


class _SensorLog(NamedTuple):
    kind: str
    log: Log


def _cut_to_span(
    logs: Iterable[_SensorLog], request: _Request, notes: list[str]
) -> Iterator[_SensorLog]:
    """Yield the parts of a source's logs within the requested span."""
    all_logs = list(logs)
    if not all_logs:
        return
    for (kind, log), part in zip(
        all_logs, request.span.of([sensor_log.log for sensor_log in all_logs]), strict=True
    ):
        if part is not None:
            yield _SensorLog(kind, part)
            continue
        if kind == "gyro":
            raise request.span.empty_error().with_context(f"{', '.join(log.names)}: ")
        missed = sentence_of(request.span.empty_error())
        notes.append(make_sentence(f"{', '.join(log.names)}: left out, for ", missed))


class _SensorKey(NamedTuple):
    """Kind, name and device of a sensor whose columns are found by their names."""

    kind: str
    name: str = ""
    device: str = ""


class _Sensor(NamedTuple):
    """Columns of a table, by their indices, that are the axes of one sensor."""

    kind: str
    indices: tuple[int, ...]
    unit: str
    factor: float | None = None
    device: str = ""


@dataclass(frozen=True)
class _Request:
    columns: Mapping[str, Columns]
    unit: Mapping[str, str]
    topic: str | None
    only: tuple[str, ...]
    is_single_topic: bool = False
    sensor: str | None = None
    rate: float | None = None
    scaling: Scaling = field(default_factory=Scaling)
    span: Span = field(default_factory=Span)
    timing: Timing = field(default_factory=Timing)

    def requires(self, sensors: Iterable[_Sensor]) -> bool:
        """Return True if one of these sensors was requested, so that its faults are errors."""
        requested = {"gyro", *self.columns}
        return any(sensor.kind in requested for sensor in sensors)


def _check_units(unit: str | Mapping[str, str] | None) -> dict[str, str]:
    stated = {"gyro": unit} if isinstance(unit, str) else dict(unit or {})
    _check_kinds(stated)
    known = ("gyro", "accel")
    return {kind: canonical_unit(u) if kind in known else str(u) for kind, u in stated.items()}


def _check_kinds(only: Iterable[str] | None) -> tuple[str, ...]:
    kinds = KINDS if only is None else tuple(only)
    unknown = [kind for kind in kinds if kind not in KINDS]
    if unknown:
        raise ValueError(f"there is no kind of log '{unknown[0]}'; known: {', '.join(KINDS)}")
    return kinds


def _name_logs(sensor_logs: Sequence[_SensorLog]) -> dict[str, Log]:
    """Return logs by name: the kind, and from the second of a kind on its number."""
    counts = dict.fromkeys(KINDS, 0)
    logs = {}
    for kind, log in sensor_logs:
        logs[f"{kind}_{counts[kind]}" if counts[kind] else kind] = log
        counts[kind] += 1
    return logs


def _read_source(
    content: Content,
    source_meta: dict[str, str],
    request: _Request,
    notes: list[str],
    column_names: list[str],
) -> Iterator[_SensorLog]:
    """Yield the logs of one source; add omissions, and the present columns."""
    tables = [] if request.is_single_topic else _choose_tables(content, request.topic)
    if not tables:
        tables = [content.choose_table(request.topic)]
    for table in map(with_time, request.timing.apply_to_all(tables)):
        column_names.extend(table.label(index) for index in range(table.width))
        sensors = _choose_sensors(table, request, notes)
        if "" in content.tables and request.only == KINDS:
            notes.extend(_describe_unread(table, sensors))
        wanted = [sensor for sensor in sensors if sensor.kind in request.only]
        for shared in _group_by_clock(table, wanted):
            yield from _read_readable(table, shared, request, source_meta, notes)
        if any(sensor.kind == "reference" for sensor in wanted):
            notes.extend(table.meta.notes)  # of the data that others are compared with
        request = replace(request, columns={})


def _choose_tables(content: Content, topic: str | None) -> list[Table]:
    first = [] if topic is None else [content.choose_table(topic)]
    topics = content.tables if content.sensors is None else content.sensors
    return [*first, *(content.tables[t] for t in topics if content.tables[t] not in first)]


def _choose_sensors(table: Table, request: _Request, notes: list[str]) -> list[_Sensor]:
    """Return the sensors of a table: requested ones, and those found by name."""
    for columns in request.columns.values():
        check_samples(table, columns)
    stated_columns = {
        kind: choose_columns(table, columns).data for kind, columns in request.columns.items()
    }
    used = {index for places in stated_columns.values() for index in places}
    groups: dict[_SensorKey, list[int]] = {
        _SensorKey(k): list(p) for k, p in stated_columns.items()
    }
    # Without names only the requested columns are found.
    is_decided = table.names is None and "gyro" in stated_columns
    named_groups = {} if is_decided else _find_sensors(table, request, used, notes)
    if table.names is None and not is_decided:
        notes.extend(choose_columns(table, None).notes)
    for key, places in named_groups.items():
        if key.kind not in stated_columns:
            groups[key] = places
    return [
        _make_sensor(table, key.kind, places, request)._replace(device=key.device)
        for key, places in groups.items()
    ]


def _find_sensors(
    table: Table, request: _Request, used: set[int], notes: list[str]
) -> dict[_SensorKey, list[int]]:
    """Return the columns of the sensors found by name, in the order of the file."""
    meanings = {i: one for i, one in _find_meanings(table).items() if i not in used}
    named_words = {i: table.label(i) for i, one in meanings.items() if one.words is not None}
    groups: dict[_SensorKey, list[int]] = {}
    for index, meaning in meanings.items():
        if index not in named_words:
            groups.setdefault(_SensorKey(meaning.kind, meaning.sensor), []).append(index)
    triads = find_triads(named_words)
    chosen = _choose_triads(triads, request.sensor, notes)
    for number, triad in enumerate(chosen):
        device = device_label(triad, table.label(triad.indices[0]))
        groups[_SensorKey(triad.kind, f"{triad.stem} {number}", device)] = list(triad.indices)
        notes.extend(describe_axes(triad, [table.label(i) for i in triad.indices]))
    return dict(sorted(groups.items(), key=lambda item: min(item[1])))


def _choose_triads(triads: list[Triad], sensor: str | None, notes: list[str]) -> list[Triad]:
    """Return the sensors that are read, by their kind: all devices in their best stage."""
    pool = (
        triads
        if sensor is None
        else [triad for triad in triads if triad in select_triads(triads, sensor)]
    )
    kinds = {triad.kind for triad in pool}
    best, others = keep_best_stage([*pool, *(triad for triad in triads if triad.kind not in kinds)])
    if others:
        stems = ", ".join(dict.fromkeys(triad.stem for triad in others))
        notes.append(f"of several stages of one sensor the best is read; left out: {stems}")
    return best


def _find_meanings(table: Table) -> dict[int, Meaning]:
    """Return the meanings of sensors' columns; the file may list those without a known name."""
    kind = "accel" if table.meta.unit in _ACCEL_UNITS else "gyro"
    listed = Meaning(kind, "", None)
    if table.names is None:
        return dict.fromkeys(choose_columns(table, None).data, listed)
    meanings = {}
    for index, name in enumerate(table.names):
        if index == table.time or looks_like_time(name):
            continue
        meaning = meaning_of(name)
        if meaning is None and table.data is not None and index in table.data:
            meaning = listed
        if meaning is not None:
            meanings[index] = meaning
    return meanings


def _make_sensor(table: Table, kind: str, indices: list[int], request: _Request) -> _Sensor:
    names = [table.label(index) for index in indices]
    stated_unit = request.unit.get("accel" if kind == "gravity" else kind)
    stated_units = _find_stated_units(table)
    if kind in ("gyro", "accel"):
        stated_unit = request.scaling.unit(kind, stated_unit)
        factor = request.scaling.factor_for(kind, first=kind == "gyro")
        check_foreign(names, stated_unit, factor)
        file_unit = _single_unit(kind, {stated_units.get(i, table.meta.unit) for i in indices})
        return _Sensor(kind, tuple(indices), common_unit(names, stated_unit, file_unit), factor)
    if all(map(is_quaternion, names)):
        # Components may stand in any order, w last for instance.
        order = sorted(range(len(names)), key=lambda i: names[i][-1].lower())
        return _Sensor(kind, tuple(indices[i] for i in order), stated_unit or _UNITLESS)
    units = [
        _find_unit(name) or stated_unit or stated_units.get(index, UNKNOWN_UNIT)
        for index, name in zip(indices, names, strict=True)
    ]
    return _Sensor(kind, tuple(indices), units[0] if len(set(units)) == 1 else ", ".join(units))


def _single_unit(kind: str, units: set[str | None]) -> str | None:
    """Return the one unit that a file states for a gyro or an accelerometer, if it is of that."""
    unit = units.pop() if len(units) == 1 else None
    return unit if (unit in _ACCEL_UNITS) == (kind == "accel") else None


def _find_stated_units(table: Table) -> dict[int, str]:
    """Return the units that a file states for the columns that it lists as data."""
    if table.data is None or table.meta.unit is None:
        return {}
    units = units_of(table.meta.unit, len(table.data))
    return dict(zip(table.data, units, strict=True))


def _find_unit(name: str) -> str | None:
    meaning = meaning_of(name)
    return split_unit(name)[1] if meaning is None else meaning.unit


def _describe_unread(table: Table, sensors: Sequence[_Sensor]) -> Iterator[str]:
    used = {index for sensor in sensors for index in sensor.indices}
    unread = [
        name
        for index, name in enumerate(table.names or ())
        if index not in used and index != table.time and not _is_known(name)
    ]
    if unread:
        yield f"no sensor is known by the name of: {', '.join(unread)}"


def _is_known(name: str) -> bool:
    """Return True for a time and for a column of a sensor, read or not."""
    meaning = meaning_of(name)
    return looks_like_time(name) or (meaning is not None and bool(meaning.kind))


def _list_columns(table: Table, sensors: Iterable[_Sensor]) -> str:
    return ", ".join(table.label(index) for sensor in sensors for index in sensor.indices)


def _group_by_clock(table: Table, sensors: Sequence[_Sensor]) -> list[list[_Sensor]]:
    """Return the sensors in groups that share the column of timestamps and its length."""
    groups: dict[tuple[int | None, int], list[_Sensor]] = {}
    for sensor in sensors:
        time = choose_columns(table, sensor.indices).time
        rows = 0 if table.lengths is None else table.lengths[sensor.indices[0]]
        groups.setdefault((time, rows), []).append(sensor)
    return list(groups.values())


def _read_readable(
    table: Table,
    sensors: Sequence[_Sensor],
    request: _Request,
    source_meta: dict[str, str],
    notes: list[str],
) -> list[_SensorLog]:
    """Return the logs of sensors on one clock, without those that cannot be read."""
    try:
        return list(_make_logs(table, sensors, request, source_meta, notes))
    except LogError as error:
        if len(sensors) > 1:
            alone = (
                _read_readable(table, [sensor], request, source_meta, notes) for sensor in sensors
            )
            return [log for each in alone for log in each]
        if request.requires(sensors):
            raise
        notes.append(
            make_sentence(f"{_list_columns(table, sensors)}: left out, for ", sentence_of(error))
        )
        return []


def _make_logs(
    table: Table,
    sensors: Sequence[_Sensor],
    request: _Request,
    source_meta: dict[str, str],
    notes: list[str],
) -> Iterator[_SensorLog]:
    indices = [index for sensor in sensors for index in sensor.indices]

    def grouped(names: list[str], file_unit: str | None) -> list[Group]:
        return [
            Group(
                tuple(indices.index(index) for index in sensor.indices),
                sensor.unit,
                sensor.kind if sensor.kind in ("gyro", "accel") else None,
                sensor.factor,
            )
            for sensor in sensors
        ]

    has_stamps = choose_columns(table, indices).time is not None
    needs_rate = not has_stamps or any(sensor.kind == "gyro" for sensor in sensors)
    selection = select_columns(table, request.rate if needs_rate else None, indices, grouped)
    columns, time = load_columns(selection)
    rows = make_row_clock(selection, time, len(columns[0]))
    logs: list[Log] = []
    for sensor, (group, values) in zip(sensors, iter_values(selection, columns), strict=True):
        names = [selection.names[i] for i in group.indices]
        values, clock = _drop_empty_rows(values, rows) or (values, rows)
        meta = {**source_meta, DEVICE: sensor.device} if sensor.device else source_meta
        log = make_log(selection, group, values, clock.for_sensor(values), meta, logs)
        logs.append(log)
        if np.isnan(log.data).all() and not request.requires([sensor]):
            notes.append(f"{', '.join(names)}: left out, for all samples are missing")
            continue
        yield _SensorLog(sensor.kind, log)


def _drop_empty_rows(values: Floats, rows: Clock) -> tuple[Floats, Clock] | None:
    """Return the values that are there, and their clock; None if it is that of all rows.

    It is another one if the sensor has a value in every second row or fewer, or if the rows of
    several sensors stand between each other so that together they are no clock.
    """
    is_known = np.isfinite(values).any(axis=1)
    if is_known.all():
        return None
    known_rows = np.flatnonzero(is_known)
    if len(known_rows) in (0, 1):
        return None
    is_unsteady = rows.grid.report.jitter_max * rows.grid.rate > _MAX_JITTER_PERIODS
    if np.median(np.diff(known_rows)) < 2 and not is_unsteady:
        return None
    try:
        return values[known_rows], rows.for_rows(known_rows)
    except LogError:
        return None
