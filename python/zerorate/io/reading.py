"""Selection and reading of gyros, accelerometers or requested columns from a source's tables."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Final, TypedDict, Unpack

import numpy as np

from zerorate.faults import keyword_argument, make_sentence
from zerorate.io.clocks.grid import Grid
from zerorate.io.clocks.repeats import HEAD_ROWS
from zerorate.io.clocks.sensor_clock import Clock, make_clock
from zerorate.io.clocks.stamps import Stamps, convert_texts, to_seconds
from zerorate.io.columns import Columns, TimeColumn, Timing, check_samples, find_indices
from zerorate.io.counts import Scale, Scaling, describe_counts
from zerorate.io.evidence import Evidence
from zerorate.io.formats import LogSource, label_of, open_source
from zerorate.io.parts import suggest_grouping
from zerorate.io.sensors import ALL_SENSORS, Sensor
from zerorate.io.table import Column, Table, to_numbers
from zerorate.io.timecolumns import NOT_TIME, candidates, clock_beside
from zerorate.record.clock import describe_rate_error
from zerorate.record.log import Log, LogError, check_rate
from zerorate.record.names import (
    KIND_OF_UNIT,
    UNKNOWN_UNIT,
    canonical_unit,
    foreign_unit,
    looks_like_accelerometer,
    looks_like_gyro,
    meaning_of,
    split_unit,
)
from zerorate.record.span import Span
from zerorate.types import Floats


class ReadArguments(TypedDict, total=False):
    """Arguments of `read_log`, except source and unit, shared by all functions that read a log."""

    rate: float | None
    columns: Columns
    topic: str | None
    sensor: str | None
    scale: Scale
    start: float | None
    stop: float | None
    time: TimeColumn
    time_unit: str | None
    torn: str | None


@dataclass(frozen=True)
class ReadOptions:
    """Caller's options of reading, except the choice of sensors.

    Parameters
    ----------
    rate, columns, topic, sensor
        Arguments of `read_log`; the rate has been checked.
    scaling
        Factors for the values.
    span
        Part of the log to read.
    timing
        Caller's choices on the timestamps.
    """

    rate: float | None = None
    columns: Columns = None
    topic: str | None = None
    scaling: Scaling = field(default_factory=Scaling)
    span: Span = field(default_factory=Span)
    timing: Timing = field(default_factory=Timing)
    sensor: str | None = None

    @classmethod
    def of(
        cls,
        *,
        rate: float | None = None,
        columns: Columns = None,
        topic: str | None = None,
        sensor: str | None = None,
        scale: Scale = None,
        start: float | None = None,
        stop: float | None = None,
        time: TimeColumn = None,
        time_unit: str | None = None,
        torn: str | None = None,
    ) -> ReadOptions:
        """Return the options from a reader's arguments; ValueError if an argument is not valid."""
        checked = None if rate is None else check_rate(rate)
        span, timing = Span(start, stop), Timing(time, time_unit, torn)
        return cls(checked, columns, topic, Scaling.of(scale), span, timing, sensor)


@dataclass(frozen=True)
class Selection:
    """Sensors selected from a table, with their columns, the time column and the stated rate."""

    table: Table
    sensors: tuple[Sensor, ...]
    time: int | None
    rate: float | None

    @property
    def data(self) -> tuple[int, ...]:
        """Indices of the columns of all sensors."""
        return tuple(index for sensor in self.sensors for index in sensor.indices)

    @property
    def names(self) -> list[str]:
        """Names of the columns of all sensors."""
        return [self.table.label(index) for index in self.data]

    def meta(self, source_meta: dict[str, str], grid: Grid) -> dict[str, object]:
        """Return the metadata of every sensor, with the metadata of the source."""
        own = self.table.meta
        calibration = None if own.calibration is None else dict(own.calibration)
        known = {"sensor": own.sensor, "axes": own.axes, "calibration": calibration}
        stated = {key: value for key, value in known.items() if value is not None}
        return {**source_meta, "clock": grid.report, **stated}


def read_log(
    source: LogSource,
    rate: float | None = None,
    columns: str | int | Sequence[str | int] | None = None,
    unit: str | None = None,
    topic: str | None = None,
    *,
    sensor: str | None = None,
    scale: Scale = None,
    start: float | None = None,
    stop: float | None = None,
    time: TimeColumn = None,
    time_unit: str | None = None,
    torn: str | None = None,
) -> Log:
    r"""Return the gyro channels of a recording on a uniform time grid.

    Parameters
    ----------
    source
        A file or an object in memory; ``docs/reference/logs.md`` describes each.

        - text tables: ``.csv .tsv .txt .dat``
        - arrays: ``.npy``, ``.npz``, ``.mat``, HDF5 (``.h5 .hdf5``)
        - Parquet (``.parquet``) and Arrow IPC (``.arrow .feather .ipc``)
        - ROS: ROS 1 ``.bag``, folder or ``.db3`` of a ROS 2 bag, ``.mcap``
        - autopilots: PX4's ``.ulg``, ArduPilot's ``.bin`` or its text, Betaflight's ``.bbl``
        - cameras: ``.mp4``
        - data frames of pandas or polars, and objects with ``__arrow_c_stream__``
        - dicts of arrays by name, structured arrays, arrays (n,) or (n, k)
    rate
        Samples per second, Hz. Necessary if the file has neither timestamps nor a rate in its
        metadata. With timestamps, it must agree with them to 1 %, and becomes the rate of the log.
    columns
        Names or indices of columns, or a single name or index. Indices begin at 0; negative indices
        count from the end. Default: the axes x, y, z of one gyro, found by their names
        (``gyro_x_dps``, ``wx``, ``angular_velocity.x``) in any order. Default in a table without
        names: all columns except the time, at most three.
    unit
        ``"rad/s"``, ``"deg/s"``, ``"deg/h"``, ``"g"`` or ``"m/s^2"``, if the file does not state
        it. Default: the suffix of the columns' names (``_dps``, ``[rad s^-1]``), or else the
        metadata; ``"unit"`` if unknown. Values are never converted.
    topic
        Topic of a ROS recording or a PX4 log. Necessary if several ROS topics have
        ``sensor_msgs/Imu``. Default for PX4: ``sensor_combined``, or else the first topic with a
        gyro.
    sensor
        One of several gyros, by words of its columns' names, such as ``"imu2"``, ``"left ankle"``
        or ``"uncalibrated"``. ``"all"`` reads the gyros of all devices together. Default: the gyro
        with three axes. Among several gyros, unfiltered comes before filtered, then calibrated
        before raw, then the first in the file. A note names the other gyros.
    scale
        Factor that converts raw counts or other values to `unit`: a number, or the result of
        `zerorate.raw_counts`. The latter also determines the unit.
    start, stop
        Part of the log to read: from `start` to before `stop`, s after the first sample. Default:
        the whole log. The clock is always determined from the whole log.
    time
        Name or index of the time column, if its name does not show it. False ignores timestamps and
        uses `rate`.
    time_unit
        Unit of numeric timestamps, if neither their name nor their values show it: ``"s"``,
        ``"ms"``, ``"us"``, ``"ns"``, ``"100us"``, ``"min"``, ``"h"``, ``"days"``, or ``"samples"``
        at the stated `rate`.
    torn
        ``"skip"`` omits lines of a text table that are not complete rows. By default, such a line
        raises an error with its number. A cut first line, or a last line cut by the end of the
        file, raises no error.

    Returns
    -------
    Log
        Log with data of shape (n, k), float64, NaN where a sample is missing. ``meta["clock"]``
        describes the timestamps, and ``meta["notes"]`` the assumptions.

    Raises
    ------
    LogError
        If the content is unexpected, or the log is shorter than ``start`` or ``stop``. The message
        names the file, the position and what was expected.
    ValueError
        If ``rate``, ``unit``, ``scale``, ``start``, ``stop`` or ``time_unit`` is not valid.
    TypeError
        If the object has none of these types.
    OSError
        If the file is missing, a folder, or cannot be read.
    ImportError
        If the format needs a package that is not installed; the message names the extra.

    Notes
    -----
    The time column has the name ``time``, ``t``, ``timestamp``, ``stamp`` or similar. A column
    ``millis``, ``micros``, ``seconds``, ``elapsed``, ``ts``, ``date`` or ``datetime`` is the time
    column if its values increase. Times are numbers, dates or times of day.

    The unit of numeric times is `time_unit`, or else the suffix (``_s _ms _us _ns``). Without both,
    it is the unit in which the numbers are dates of this century. If they are no dates, it is the
    only unit that gives the stated `rate`, or a rate from 0.5 Hz to 32 kHz. If two units remain, an
    error is raised.

    In a table without names, the first column is the time if only this column increases in
    near-equal steps over most rows. A column that only counts rows (0, 1, 2, ...) is left out, and
    ``rate`` is necessary. If the rate of the clock changes, the log keeps the stamps in ``stamps``.

    Missing samples, found by comparing the stamps with a uniform clock, become NaN rows. Late or
    repeated stamps do not add or remove rows. If the clock jumps back, the rows keep the file's
    order and the time continues. If a host stamped samples when they arrived in bursts, they get
    the times of a regular clock that fits the earliest stamps. If the sensor is slower than its
    log, rows repeat. Repeated rows are left out, unless ``rate`` is the rate of the timestamps.

    Examples
    --------
    >>> import tempfile
    >>> from pathlib import Path
    >>> from zerorate.io import read_log
    >>> path = Path(tempfile.mkdtemp()) / "log.csv"
    >>> _ = path.write_text("time_s,gyro_x_dps\n0.00,0.1\n0.01,0.2\n0.02,0.1\n")
    >>> read_log(path)
    Log(3 samples at 100 Hz, 0.03 s, deg/s: gyro_x_dps)
    >>> read_log({"gyro_x": [0.1, 0.2, 0.1]}, rate=100, unit="deg/s")
    Log(3 samples at 100 Hz, 0.03 s, deg/s: gyro_x)
    """
    options = ReadOptions.of(
        rate=rate, columns=columns, topic=topic, sensor=sensor, scale=scale,
        start=start, stop=stop, time=time, time_unit=time_unit, torn=torn,
    )  # fmt: skip
    return read_logs(source, options, find_one(options, unit))[0]


Find = Callable[[Evidence], tuple[list[Sensor], list[str]]]
"""Function that finds the requested sensors among a table's columns; it also returns notes."""


def find_one(options: ReadOptions, unit: str | None, is_sole: bool = False) -> Find:
    """Return a function that finds a gyro, or uses the requested columns as one sensor."""
    stated = None if unit is None else canonical_unit(unit)

    def find(evidence: Evidence) -> tuple[list[Sensor], list[str]]:
        indices, notes = _find_columns(evidence, options, ("gyro",), is_sole)
        sensor = Sensor(evidence.kind_of(indices), indices)
        return [evidence.in_unit(sensor, stated, options.scaling, first=True)], notes

    return find


def _find_columns(
    evidence: Evidence, options: ReadOptions, kinds: Sequence[str], is_sole: bool = False
) -> tuple[tuple[int, ...], list[str]]:
    """Return the requested columns, or the columns of one sensor per kind, and notes."""
    table = evidence.table
    if options.columns is not None:
        check_samples(table, options.columns)
        return find_indices(table, options.columns), []
    try:
        sensors, notes = evidence.one_of_each(kinds, options.sensor, is_sole)
    except LogError as error:
        has_clock = table.names is None or evidence.time_of() is not None
        if has_clock or _find_rate(options.rate, table) is not None:
            raise
        raise error.with_context("", make_sentence("; ", _lacking_rate(table))) from None
    return tuple(index for sensor in sensors for index in sensor.indices), notes


def read_logs(source: LogSource, options: ReadOptions, find: Find) -> list[Log]:
    """Return a log for each sensor that `find` selects in a source, from one reading.

    Errors are as in `read_log`.
    """
    label = label_of(source)
    try:
        kind, content = open_source(source)
        table = options.timing.apply(content.choose_table(options.topic))
        evidence = Evidence.of(table)
        sensors, notes = find(evidence)
        selection = select(evidence, sensors, options.rate, notes)
        logs = make_logs(selection, {"source": label, "format": kind})
        return list(cut_logs(options.span, logs))
    except LogError as error:
        raise error.with_context(f"{label}: ") from None


def cut_logs(span: Span, logs: Sequence[Log]) -> Iterator[Log]:
    """Yield the parts of logs within a span; LogError for a log without samples in it."""
    for part in span.of(logs):
        if part is None:
            raise span.empty_error()
        yield part


def select(
    evidence: Evidence, sensors: Sequence[Sensor], rate: float | None, notes: Sequence[str] = ()
) -> Selection:
    """Return the selection of sensors; LogError if there is neither a clock nor a rate."""
    table, rate = evidence.table, _find_rate(rate, evidence.table)
    time = evidence.time_of([index for sensor in sensors for index in sensor.indices])
    if time is None and rate is None:
        raise LogError(_lacking_rate(table))
    return Selection(table.noted(*notes), tuple(sensors), time, rate)


def _lacking_rate(table: Table) -> str:
    """Return the message for a table with neither timestamps nor a rate."""
    hint_text = "".join(f"; {note}" for note in table.meta.notes if NOT_TIME in note)
    lacking = "there are no timestamps for the sampling rate; give "
    rate = keyword_argument("rate")
    return make_sentence(lacking, rate, f" in Hz{hint_text}", *candidates(table))


def make_row_clock(selection: Selection, column: Column | None, rows: int) -> Clock:
    """Return the clock of a table's rows, from a column of timestamps or the stated rate."""
    if selection.time is not None and column is not None:
        column = convert_texts(column, selection.table.label(selection.time))
    hint = suggest_grouping(selection.table, selection.time, column)
    try:
        clock = make_clock(_read_stamps(selection, column), selection.rate, rows)
    except LogError as error:
        raise error.with_context("", make_sentence("; ", hint) if hint else "") from None
    return replace(clock, notes=(*clock.notes, hint)) if hint else clock


def _read_stamps(selection: Selection, column: Column | None) -> Stamps | None:
    """Return the timestamps in a column; None without a column."""
    if selection.time is None or column is None:
        return None
    if len(column) == 0:
        raise LogError("there are columns but no rows")
    table = selection.table
    unit_hint = clock_beside(table, selection.time)
    return to_seconds(
        column, table.label(selection.time), selection.rate, table.time_unit, unit_hint
    )


def load_columns(selection: Selection) -> tuple[list[Column], Column | None]:
    """Return the data columns, and the time column if there is one."""
    if selection.time is None:
        return selection.table.load(selection.data), None
    *columns, time = selection.table.load((*selection.data, selection.time))
    return columns, time


def make_logs(
    selection: Selection, source_meta: dict[str, str], rows: Clock | None = None
) -> list[Log]:
    """Return a log for each sensor, all from one reading.

    ``source_meta`` is metadata of the source; ``rows`` is the clock of the rows, if known.
    """
    columns, time = load_columns(selection)
    rows = rows or make_row_clock(selection, time, len(columns[0]))
    logs: list[Log] = []
    for sensor, values in iter_values(selection, columns):
        clock = rows.for_sensor(values)
        logs.append(make_log(selection, sensor, values, clock, source_meta, logs))
    return logs


def iter_values(selection: Selection, columns: list[Column]) -> Iterator[tuple[Sensor, Floats]]:
    """Yield each sensor with its values, shape (n, k), and release the columns after copying.

    A long log would otherwise be in memory twice.
    """
    columns.reverse()
    for sensor in selection.sensors:
        rows = len(columns[-1])
        if rows == 0:
            raise LogError("there are columns but no rows")
        values = np.empty((rows, len(sensor.indices)))
        # Some bit patterns are a NaN that causes a warning when converted to double.
        with np.errstate(invalid="ignore"):
            for axis, index in enumerate(sensor.indices):
                values[:, axis] = to_numbers(columns.pop(), selection.table.label(index))
        yield sensor, values


def make_log(
    selection: Selection,
    sensor: Sensor,
    values: Floats,
    clock: Clock,
    source_meta: dict[str, str],
    others: Iterable[Log] = (),
) -> Log:
    """Return the log of one sensor with the clock of its rows.

    If another log has equal times, both share one array.
    """
    names, grid = list(map(selection.table.label, sensor.indices)), clock.grid
    data = scale_values(_put_on_grid(values, grid), sensor.factor)
    time = _even_times(clock, others)
    missing_notes = describe_missing(names, [bool(np.isnan(column).all()) for column in data.T])
    notes = (*describe_assumptions(selection, sensor, values[:HEAD_ROWS], clock), *missing_notes)
    meta = {**selection.meta(source_meta, grid), "notes": notes}
    stamp_times = grid.times(range(grid.length))
    stamps = None if stamp_times is None else clock.start + stamp_times
    return Log(time, grid.rate, data, tuple(names), sensor.unit, meta, stamps)


def _even_times(clock: Clock, others: Iterable[Log]) -> Floats:
    """Return the times of a clock's uniform grid; the array of another log if it is equal."""
    grid = clock.grid
    for log in others:
        if (log.n, log.rate, log.time[0]) == (grid.length, grid.rate, clock.start):
            return log.time
    return clock.start + np.arange(grid.length) / grid.rate


def _find_rate(rate: float | None, table: Table) -> float | None:
    if rate is not None or table.meta.rate is None:
        return rate
    try:
        return check_rate(table.meta.rate)
    except ValueError as error:
        raise LogError(f"in the metadata, {error}") from None


_MAX_NAMED: Final = 3
"""Number of columns listed in a sentence."""


def _put_on_grid(values: Floats, grid: Grid) -> Floats:
    if grid.used_rows is not None:
        values = values[grid.used_rows]
    if grid.gapped_indices is None:
        return values
    data = np.full((grid.length, values.shape[1]), np.nan)
    data[grid.gapped_indices] = values
    return data


def scale_values(values: Floats, factor: float | None) -> Floats:
    """Return values of any shape multiplied by a factor; unchanged without a factor."""
    if factor is None:
        return values
    with np.errstate(over="ignore", invalid="ignore"):
        return values * factor


def describe_assumptions(
    selection: Selection, sensor: Sensor, head: Floats, clock: Clock
) -> list[str]:
    """Return the sentences on assumptions about a sensor's unit and its clock."""
    notes, grid = list(selection.table.meta.notes), clock.grid
    names = list(map(selection.table.label, sensor.indices))
    counts = None
    if sensor.kind in ("gyro", "accel") and selection.table.meta.unit is None:
        unscaled = sensor.factor is None
        counts = describe_counts(names, sensor.kind, sensor.unit, head) if unscaled else None
    if counts is not None:
        notes.append(counts)
    elif sensor.unit == UNKNOWN_UNIT and _needs_unit(names):
        notes.append(_describe_unit(names, sensor.factor))
    notes.extend((*clock.notes, *_describe_bursts(grid)))
    if abs(grid.report.rate / grid.rate - 1) > 1e-5:
        note = f"rate {grid.rate:g} Hz as stated; the timestamps run at {grid.report.rate:g}"
        rate_note = describe_rate_error(grid.rate, grid.report.rate)
        notes.append(f"{note}: {rate_note}" if rate_note else note)
    return notes


def _needs_unit(names: Sequence[str]) -> bool:
    """Return True if the unit matters; for a magnetometer only the direction matters."""
    meanings = [meaning_of(name) for name in names]
    return any(meaning is None or meaning.kind in ("gyro", "accel") for meaning in meanings)


def _describe_unit(names: Sequence[str], factor: float | None) -> str:
    """Return the sentence on a unit that is unknown or not supported."""
    foreign = foreign_unit(names)
    if foreign is None:
        listed = ", ".join(names[:_MAX_NAMED]) + (" and so on" if len(names) > _MAX_NAMED else "")
        return make_sentence(f"the unit of {listed} is not known; give ", keyword_argument("unit"))
    if factor is not None:
        times = f"the data are those in {foreign.name} times {factor:g}; give "
        return make_sentence(times, keyword_argument("unit"))
    return make_sentence(
        f"the data are in {foreign.name}, a unit that is not computed with; ",
        keyword_argument("unit", foreign.unit),
        " with ",
        keyword_argument("scale", f"{foreign.factor:.9g}"),
        f" makes {foreign.unit} of them",
    )


def _describe_bursts(grid: Grid) -> Iterator[str]:
    report = grid.report
    if report.burst_count:
        yield (
            f"the samples arrived in {report.burst_count} bursts and were stamped then; they were "
            f"put on the regular clock of {report.rate:.7g} Hz that made them"
        )
    elif report.missing_count and report.missing_count > len(grid.indices):
        yield make_sentence(
            "more samples are missing than there are; if they were stamped as they arrived, in "
            "bursts, ",
            keyword_argument("rate"),
            " says so",
        )


def describe_missing(names: Iterable[str], missing: Iterable[bool]) -> list[str]:
    """Return the sentences on columns without samples."""
    pairs = zip(names, missing, strict=True)
    return [f"column '{name}' is all missing" for name, empty in pairs if empty]


def read_sensors(
    source: LogSource,
    *,
    unit: str | Sequence[str] | None = None,
    **arguments: Unpack[ReadArguments],
) -> tuple[Log, ...]:
    """Return the gyros of a recording as one log, and its accelerometers as another.

    Parameters
    ----------
    source
        As in `read_log`.
    unit
        Unit of the rates, of the accelerations, or both (with a comma, or as a sequence). Give it
        if the file does not state it. A column without a known sensor or suffix has the first unit.
    **arguments
        Arguments of `read_log`. By default one gyro and one accelerometer of every device are read.
        ``scale`` can have a factor for each kind, ``{"gyro": 1 / 131, "accel": 1 / 16384}``.
        ``start`` and ``stop`` count from the earlier of the two first samples.

    Returns
    -------
    tuple of Log
        One or two logs, gyros first. They share a clock, unless one sensor is slower than its rows.

    Raises
    ------
    LogError, ValueError, TypeError, OSError, ImportError
        As `read_log`. Also if a kind gets two units, or a unit is given for a kind without columns.
    """
    listed = unit.split(",") if isinstance(unit, str) else unit or ()
    units = _sort_units([canonical_unit(unit_name) for unit_name in listed])
    arguments["sensor"] = arguments.get("sensor") or ALL_SENSORS
    options = ReadOptions.of(**arguments)

    def find(evidence: Evidence) -> tuple[list[Sensor], list[str]]:
        indices, notes = _find_columns(evidence, options, (*_QUANTITIES,))
        sensors = _sort_by_kind(evidence, indices, units)
        in_units = [
            evidence.in_unit(sensor, units.get(sensor.kind), options.scaling, sensor is sensors[0])
            for sensor in sensors
        ]
        return in_units, notes

    return tuple(read_logs(source, options, find))


_QUANTITIES: Final = {"gyro": "angular rate", "accel": "acceleration"}


def _sort_units(units: list[str]) -> dict[str, str]:
    of_kinds = {KIND_OF_UNIT[unit]: unit for unit in units}
    if len(of_kinds) < len(units):
        of_each = f" takes one unit of each kind, got {', '.join(units)}"
        raise ValueError(make_sentence(keyword_argument("unit"), of_each))
    return of_kinds


def _sort_by_kind(
    evidence: Evidence, indices: Sequence[int], units: Mapping[str, str]
) -> list[Sensor]:
    """Return columns as a gyro and an accelerometer; other columns get the first unit."""
    file_kind = KIND_OF_UNIT.get(evidence.table.meta.unit or "")
    fallback = next(iter(units), file_kind if file_kind in _QUANTITIES else "gyro")
    kinds = [_find_kind(evidence.table.label(index), fallback or "gyro") for index in indices]
    for kind, unit in units.items():
        if kind not in kinds:
            raise LogError(f"unit '{unit}' was given, but no column holds an {_QUANTITIES[kind]}")
    of_kinds = {
        k: [i for i, kind in zip(indices, kinds, strict=True) if kind == k] for k in _QUANTITIES
    }
    return [Sensor(kind, tuple(own)) for kind, own in of_kinds.items() if own]


def _find_kind(name: str, fallback: str) -> str:
    unit = split_unit(name)[1]
    if unit is None:
        return (
            "gyro"
            if looks_like_gyro(name)
            else "accel"
            if looks_like_accelerometer(name)
            else fallback
        )
    kind = KIND_OF_UNIT.get(unit)
    if kind not in _QUANTITIES:
        raise LogError(f"column '{name}' is in {unit}, expected an angular rate or an acceleration")
    return kind
