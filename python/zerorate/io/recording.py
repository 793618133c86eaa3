"""Reading of recordings: all sensors of a file, found by names of columns and topics."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Final, NamedTuple, Unpack, cast

import numpy as np

from zerorate.faults import keyword_argument, make_sentence, sentence_of
from zerorate.io.clocks.names import looks_like_time
from zerorate.io.clocks.sensor_clock import Clock
from zerorate.io.columns import Columns, TimeColumn, check_samples, find_indices
from zerorate.io.counts import Scale
from zerorate.io.evidence import Evidence
from zerorate.io.formats import LogSource, label_of, open_source
from zerorate.io.reading import (
    ReadArguments,
    ReadOptions,
    iter_values,
    load_columns,
    make_log,
    make_row_clock,
    select,
)
from zerorate.io.sensors import Sensor
from zerorate.io.supplement import SourceContent, make_supplement
from zerorate.io.table import Content, Table
from zerorate.record.devices import DEVICE
from zerorate.record.log import Log, LogError
from zerorate.record.names import canonical_unit, looks_like_sensor, meaning_of
from zerorate.record.recording import Recording
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
"""Kinds of sensors with columns that the caller can name."""
_MAX_JITTER_PERIODS: Final = 0.25
"""Smallest deviation of stamps from a clock that shows rows of several clocks, periods."""


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
    """Return the logs of all sensors in a file, found by names of columns and topics.

    Parameters
    ----------
    source
        Source as in `read_log`, or a list of sources, such as the files of an IMU and of a GNSS
        receiver. The logs of each source keep their own clocks.
    rate
        Samples per second of the gyro and of all sensors without timestamps, Hz.
    columns
        Names or indices of the gyro's columns, or columns of ``gyro``, ``accel`` and ``mag`` by
        kind: ``{"gyro": ["p", "q", "r"], "accel": [4, 5, 6]}``. Default: found by names; each
        sensor gets its own log.
    reference
        Names or indices of columns with a true angle, rate or orientation. Default: quaternions,
        and columns with names like ``encoder``, ``ref_`` or ``truth_``.
    unit
        Unit of the gyro, or units by kind, ``{"gyro": "deg/s", "accel": "g"}``, if the file does
        not state them. Values are never converted.
    topic
        Topic of a ROS recording or a PX4 log to read first: its gyro is then named ``gyro``.
    only
        Kinds of logs to read, default all: ``gyro``, ``accel``, ``mag``, ``temperature``,
        ``gravity``, ``reference``, ``position``, ``velocity``, ``position_sigma``,
        ``velocity_sigma``, ``pressure``, ``height`` (of a barometer), ``heading`` and ``baseline``
        (between two antennas).
    sensor
        One of several sensors, as in `read_log`. Default: a log for each device. If a sensor has
        raw, calibrated and filtered values, the best stage is read, and ``notes`` says so.
    scale
        Factors for the values: a number for the gyro, or factors by kind, ``{"gyro": 1 / 131,
        "accel": 1 / 16384}``. Or the result of `zerorate.raw_counts`, which also determines the
        units.
    start, stop
        Part of the logs to read: from `start` to before `stop`, s after the earliest sample of the
        source. In a list, each source counts from its own earliest sample. A gyro without samples
        in this part raises an error. Other sensors without samples are left out with a note.
    time, time_unit, torn
        As in `read_log`. With several tables, `time` applies to each table with this column.

    Returns
    -------
    Recording
        Logs with data of shape (n, k), NaN where a sample is missing. A sensor with a value in at
        most every second row gets a log at its own rate. ``fixes``, ``mounting`` and ``tables`` are
        read at first access.

    Raises
    ------
    LogError
        If no column looks like a sensor, or a gyro cannot be read (see `read_log`). Other sensors
        that cannot be read are left out, with a note in ``notes``.
    ValueError, TypeError, OSError, ImportError
        As in `read_log`. Also ValueError if a kind is unknown.

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
    """Return the recording of one topic, the same topic that `read_log` would read.

    Arguments and errors are as in `read_recording`. If the topic is ambiguous, the error is as in
    `read_log`.
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
    return _Request(chosen, _check_units(unit), _check_kinds(only), options)


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
        request = replace(request, columns={}, options=replace(request.options, topic=None))
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
    supplement = make_supplement(opened_sources, request.options.timing)
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
        all_logs, request.options.span.of([sensor_log.log for sensor_log in all_logs]), strict=True
    ):
        if part is not None:
            yield _SensorLog(kind, part)
            continue
        if kind == "gyro":
            raise request.options.span.empty_error().with_context(f"{', '.join(log.names)}: ")
        missed = sentence_of(request.options.span.empty_error())
        notes.append(make_sentence(f"{', '.join(log.names)}: left out, for ", missed))


@dataclass(frozen=True)
class _Request:
    columns: Mapping[str, Columns]
    unit: Mapping[str, str]
    only: tuple[str, ...]
    options: ReadOptions
    is_single_topic: bool = False

    def stated_unit(self, sensor: Sensor) -> str | None:
        """Return the stated unit of a sensor; gravity has the unit of accelerations."""
        return self.unit.get("accel" if sensor.kind == "gravity" else sensor.kind)

    def requires(self, sensors: Iterable[Sensor]) -> bool:
        """Return True if one of these sensors was requested, so its faults are errors."""
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
    """Return logs by name: the kind, with a number from the second log of a kind on."""
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
    """Yield the logs of one source; append notes on omissions, and the names of columns."""
    tables = [] if request.is_single_topic else _choose_tables(content, request.options.topic)
    if not tables:
        tables = [content.choose_table(request.options.topic)]
    for evidence in map(Evidence.of, request.options.timing.apply_to_all(tables)):
        table = evidence.table
        column_names.extend(map(table.label, range(table.width)))
        sensors = _choose_sensors(evidence, request, notes)
        if "" in content.tables and request.only == KINDS:
            notes.extend(_describe_unread(table, sensors))
        wanted = [sensor for sensor in sensors if sensor.kind in request.only]
        for shared in _group_by_clock(evidence, wanted):
            yield from _read_readable(evidence, shared, request, source_meta, notes)
        if any(sensor.kind == "reference" for sensor in wanted):
            notes.extend(table.meta.notes)  # notes on the time base
        request = replace(request, columns={})


def _choose_tables(content: Content, topic: str | None) -> list[Table]:
    first = [] if topic is None else [content.choose_table(topic)]
    topics = content.tables if content.sensors is None else content.sensors
    return [*first, *(content.tables[t] for t in topics if content.tables[t] not in first)]


def _choose_sensors(evidence: Evidence, request: _Request, notes: list[str]) -> list[Sensor]:
    """Return the requested and found sensors of a table, with their units."""
    table = evidence.table
    chosen = []
    for kind, columns in request.columns.items():
        check_samples(table, columns)
        chosen.append(Sensor(kind, find_indices(table, columns or ())))
    # Without names, only requested columns are read.
    if table.names is not None or "gyro" not in request.columns:
        taken = {index for sensor in chosen for index in sensor.indices}
        found, own_notes = evidence.of_all_devices(request.options.sensor, taken)
        notes.extend(own_notes)
        chosen += [sensor for sensor in found if sensor.kind not in request.columns]
    return [
        evidence.in_unit(one, request.stated_unit(one), request.options.scaling, one.kind == "gyro")
        for one in chosen
    ]


def _describe_unread(table: Table, sensors: Sequence[Sensor]) -> Iterator[str]:
    used = {index for sensor in sensors for index in sensor.indices}
    unread = [
        name
        for index, name in enumerate(table.names or ())
        if index not in used and index != table.time and not _is_known(name)
    ]
    if unread:
        yield f"no sensor is known by the name of: {', '.join(unread)}"


def _is_known(name: str) -> bool:
    """Return True for the name of a time or of a sensor."""
    meaning = meaning_of(name)
    return looks_like_time(name) or (meaning is not None and bool(meaning.kind))


def _list_columns(table: Table, sensors: Iterable[Sensor]) -> str:
    return ", ".join(table.label(index) for sensor in sensors for index in sensor.indices)


def _group_by_clock(evidence: Evidence, sensors: Sequence[Sensor]) -> list[list[Sensor]]:
    """Return the sensors in groups that share a time column and its length."""
    groups: dict[tuple[int | None, int], list[Sensor]] = {}
    lengths = evidence.table.lengths
    for sensor in sensors:
        rows = 0 if lengths is None else lengths[sensor.indices[0]]
        groups.setdefault((evidence.time_of(sensor.indices), rows), []).append(sensor)
    return list(groups.values())


def _read_readable(
    evidence: Evidence,
    sensors: Sequence[Sensor],
    request: _Request,
    source_meta: dict[str, str],
    notes: list[str],
) -> list[_SensorLog]:
    """Return the logs of sensors on one clock; sensors that cannot be read are left out."""
    try:
        return list(_make_logs(evidence, sensors, request, source_meta, notes))
    except LogError as error:
        if len(sensors) > 1:
            alone = (
                _read_readable(evidence, [sensor], request, source_meta, notes)
                for sensor in sensors
            )
            return [log for each in alone for log in each]
        if request.requires(sensors):
            raise
        listed = _list_columns(evidence.table, sensors)
        notes.append(make_sentence(f"{listed}: left out, for ", sentence_of(error)))
        return []


def _make_logs(
    evidence: Evidence,
    sensors: Sequence[Sensor],
    request: _Request,
    source_meta: dict[str, str],
    notes: list[str],
) -> Iterator[_SensorLog]:
    has_stamps = evidence.time_of(sensors[0].indices) is not None
    needs_rate = not has_stamps or any(sensor.kind == "gyro" for sensor in sensors)
    selection = select(evidence, sensors, request.options.rate if needs_rate else None)
    columns, time = load_columns(selection)
    rows = make_row_clock(selection, time, len(columns[0]))
    logs: list[Log] = []
    for sensor, values in iter_values(selection, columns):
        values, clock = _drop_empty_rows(values, rows) or (values, rows)
        meta = {**source_meta, DEVICE: sensor.device} if sensor.device else source_meta
        log = make_log(selection, sensor, values, clock.for_sensor(values), meta, logs)
        logs.append(log)
        if np.isnan(log.data).all() and not request.requires([sensor]):
            notes.append(f"{', '.join(log.names)}: left out, for all samples are missing")
            continue
        yield _SensorLog(sensor.kind, log)


def _drop_empty_rows(values: Floats, rows: Clock) -> tuple[Floats, Clock] | None:
    """Return the rows with values, and their clock; None if the clock of all rows is used.

    A sensor has its own clock if it has a value in at most every second row. It also has one if
    rows of several sensors alternate, so that all rows together form no clock.
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
