"""Logs that are read block by block, from files larger than memory or from memory."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from typing import Final, Unpack

import numpy as np

from zerorate.io.clocks.grid import Grid
from zerorate.io.clocks.repeats import HEAD_ROWS, find_repeats
from zerorate.io.clocks.sensor_clock import Clock
from zerorate.io.counts import Scaling
from zerorate.io.evidence import Evidence
from zerorate.io.formats import LogSource, label_of, open_source
from zerorate.io.reading import (
    ReadArguments,
    ReadOptions,
    Selection,
    cut_logs,
    describe_assumptions,
    describe_missing,
    find_one,
    load_columns,
    make_logs,
    make_row_clock,
    scale_values,
    select,
)
from zerorate.io.sensors import Sensor, find_accelerometer
from zerorate.io.table import Column, Table, to_numbers
from zerorate.record.log import Header, Log, LogError
from zerorate.record.span import Span
from zerorate.types import Booleans, Floats, Integers


def fill_grid(
    pieces: Iterator[list[Column]], grid: Grid, rows: int, channels: int, part: range
) -> Iterator[Floats]:
    """Yield arrays (k, rows) for a part of a grid, NaN in gaps; the last array may be shorter."""
    places = grid.gapped_indices
    source = _RowReader(pieces)
    begin = part.start if places is None else int(np.searchsorted(places, part.start))
    source.skip(begin)
    for low in range(part.start, part.stop, rows):
        high = min(part.stop, low + rows)
        end = high if places is None else int(np.searchsorted(places, high))
        is_complete = end - begin == high - low
        size = (channels, high - low)
        block = np.empty(size) if is_complete else np.full(size, np.nan)
        for first, columns in source.take(begin, end):
            last = first + len(columns[0])
            to = slice(first - low, last - low) if places is None else places[first:last] - low
            for row, column in zip(block, columns, strict=True):
                row[to] = column
        begin = end
        yield block


class _RowReader:
    """Rows from pieces of any length, in order."""

    def __init__(self, pieces: Iterator[list[Column]]) -> None:
        self._pieces = pieces
        self._piece: list[Column] = []

    def take(self, begin: int, end: int) -> Iterator[tuple[int, list[Column]]]:
        """Yield the next rows, from `begin` to before `end`, in parts with their first index."""
        while begin < end:
            if not self._piece or len(self._piece[0]) == 0:
                self._read_next()
                continue
            count = min(len(self._piece[0]), end - begin)
            yield begin, [column[:count] for column in self._piece]
            self._piece = [column[count:] for column in self._piece]
            begin += count

    def skip(self, count: int) -> None:
        """Skip the next rows."""
        for _ in self.take(0, count):
            pass

    def _read_next(self) -> None:
        try:
            self._piece = next(self._pieces)
        except StopIteration:
            raise LogError("there are fewer rows than the file says: it is damaged") from None


_PIECE_ROWS: Final = 1 << 17
_AXES: Final = 3


@dataclass(frozen=True)
class LogFile:
    """A log on a uniform time grid, with one part at a time in memory.

    Parameters
    ----------
    header : Header
        Header, known before any data are read. Its notes do not mention columns without any sample.
    time : callable
        Function of a first index and an end; it returns the times of these samples, s.
    blocks : callable
        Function of a number of rows. It yields the data in arrays (k, rows), NaN where a sample is
        missing. The last array may be shorter. Reading may raise `LogError`.
    whole : Log or None
        Log in memory, if it has been read already.
    stamps : callable or None
        Function of a first index and an end; it returns the samples' stamps, s. None for a regular
        clock.
    """

    header: Header
    time: Callable[[int, int], Floats]
    blocks: Callable[[int], Iterator[Floats]]
    whole: Log | None = None
    stamps: Callable[[int, int], Floats] | None = None

    @classmethod
    def of(cls, log: Log) -> LogFile:
        """Return a log in memory as a `LogFile`."""

        def blocks(rows: int) -> Iterator[Floats]:
            for first in range(0, log.n, rows):
                yield np.ascontiguousarray(log.data[first : first + rows].T)

        log_stamps = log.stamps
        stamps = None if log_stamps is None else lambda first, end: log_stamps[first:end]
        return cls(Header.of(log), lambda first, end: log.time[first:end], blocks, log, stamps)

    def sampled(self, first: int, end: int) -> Floats:
        """Return the times of the samples from index `first` to before `end`, s."""
        return (self.stamps or self.time)(first, end)

    def log(self) -> Log:
        """Return the whole log in memory."""
        if self.whole is not None:
            return self.whole
        header = self.header
        data = next(self.blocks(header.n)).T
        missing = [bool(np.isnan(column).all()) for column in data.T]
        header = header.with_notes(describe_missing(header.names, missing))
        time = self.time(0, header.n)
        stamps = None if self.stamps is None else self.stamps(0, header.n)
        return Log(time, header.rate, data, header.names, header.unit, header.meta, stamps)


def open_log(
    path: LogSource, *, unit: str | None = None, **arguments: Unpack[ReadArguments]
) -> LogFile:
    """Open a file's log for reading in blocks, with the arguments and errors of `read_log`.

    For a Parquet file, this function reads only the time column. All other formats are loaded
    completely.
    """
    return _open_logs(path, ReadOptions.of(**arguments), unit, accel=False)[0]


def open_imu(
    path: LogSource, *, unit: str | None = None, **arguments: Unpack[ReadArguments]
) -> tuple[LogFile, LogFile | None]:
    """Open the log of a gyro, as `open_log` does, and the log of its accelerometer.

    The accelerometer is in the gyro's table. It has the gyro's device name, or is the only
    accelerometer. Its log is None in three cases:

    - It is missing or cannot be read.
    - It does not have three axes.
    - ``sensor`` requests all gyros.

    If the table has several gyros and ``sensor`` is not given, a LogError lists them.
    """
    return _open_logs(path, ReadOptions.of(**arguments), unit, accel=True)


def _open_logs(
    path: LogSource, options: ReadOptions, unit: str | None, *, accel: bool
) -> tuple[LogFile, LogFile | None]:
    label = label_of(path)
    try:
        kind, content = open_source(path)
        table = options.timing.apply(content.choose_table(options.topic))
        source_meta = {"source": label, "format": kind}
        evidence = Evidence.of(table)
        sensors, notes = find_one(options, unit, is_sole=accel)(evidence)
        selection = select(evidence, sensors, options.rate, notes)
        accel_columns = (
            find_accelerometer(selection.table.names or (), selection.data) if accel else ()
        )
        wanted = [*selection.data, *accel_columns, *[i for i in (selection.time,) if i is not None]]
        if selection.table.pieces is None:
            selection = replace(selection, table=selection.table.in_memory(wanted))
        rows = _make_row_clock(selection)
        gyro = _make_log_file(selection, source_meta, label, options.span, rows)
        return gyro, _find_accelerometer(
            selection, accel_columns, source_meta, label, options, rows
        )
    except LogError as error:
        raise error.with_context(f"{label}: ") from None


def _make_row_clock(selection: Selection) -> Clock:
    """Return the clock of a table's rows."""
    table = selection.table
    if table.pieces is None:
        columns, time = load_columns(selection)
        return make_row_clock(selection, time, len(columns[0]))
    column = None if selection.time is None else _load_column(table, selection.time)
    if table.rows == 0:
        raise LogError("there are columns but no rows")
    return make_row_clock(selection, column, table.rows)


def _make_log_file(
    selection: Selection, source_meta: dict[str, str], label: str, span: Span, rows: Clock
) -> LogFile:
    if selection.table.pieces is None:
        return LogFile.of(*cut_logs(span, make_logs(selection, source_meta, rows)))
    return _make_pieced_log(selection, source_meta, label, span, rows)


def _find_accelerometer(
    gyro: Selection,
    columns: tuple[int, ...],
    source_meta: dict[str, str],
    label: str,
    options: ReadOptions,
    rows: Clock,
) -> LogFile | None:
    if len(columns) != _AXES:
        return None
    try:
        evidence = Evidence(gyro.table)
        accel = evidence.in_unit(Sensor("accel", columns), None, Scaling(), first=False)
        selection = select(evidence, [accel], options.rate)
        has_same_clock = (selection.time, selection.rate) == (gyro.time, gyro.rate)
        own_clock = rows if has_same_clock else _make_row_clock(selection)
        return _make_log_file(selection, source_meta, label, options.span, own_clock)
    except LogError:
        return None


def _make_pieced_log(
    selection: Selection, source_meta: dict[str, str], label: str, span: Span, rows: Clock
) -> LogFile:
    (sensor,) = selection.sensors
    head = _load_head(selection)
    clock = _make_sensor_clock(selection, rows, head)
    grid, start = clock.grid, clock.start
    part = span.row_range(grid.length, grid.rate)
    meta = {
        **selection.meta(source_meta, grid),
        "notes": tuple(describe_assumptions(selection, sensor, head, clock)),
    }
    header = Header(len(part), grid.rate, tuple(selection.names), sensor.unit, meta)
    if not span.whole:
        span.check(grid.length / grid.rate, grid.rate)
        header = header.with_notes([span.note(grid.length / grid.rate)])
    if not part:
        raise span.empty_error()

    def times(first: int, end: int) -> Floats:
        return start + np.arange(part.start + first, part.start + end) / grid.rate

    def blocks(rows: int) -> Iterator[Floats]:
        try:
            pieces = _read_numbers(selection, rows)
            pieces = pieces if grid.used_rows is None else _select_rows(grid.used_rows, pieces)
            for block in fill_grid(pieces, grid, rows, len(selection.data), part):
                yield scale_values(block, sensor.factor)
        except LogError as error:
            raise error.with_context(f"{label}: ") from None

    def stamps(first: int, end: int) -> Floats:
        stamp_times = grid.times(range(part.start + first, part.start + end))
        assert stamp_times is not None
        return start + stamp_times

    return LogFile(header, times, blocks, stamps=None if grid.stamp_times is None else stamps)


def _load_column(table: Table, index: int) -> Column:
    """Return a column without a second copy in memory."""
    assert table.pieces is not None
    column = None
    filled = 0
    for (piece,) in table.pieces([index], _PIECE_ROWS):
        column = np.empty(table.rows, piece.dtype) if column is None else column
        if piece.dtype != column.dtype:
            break
        column[filled : filled + len(piece)] = piece
        filled += len(piece)
    # Missing values turn integers into floats, but only in the pieces that contain them.
    return table.load([index])[0] if column is None or filled < table.rows else column


def _load_head(selection: Selection) -> Floats:
    """Return the first `HEAD` rows of the values, or all if there are fewer."""
    beginning = [_stack_columns(piece) for piece in _read_beginning(selection)]
    if not beginning:
        raise LogError("truncated or damaged: it says that it has rows, and has none")
    return np.concatenate(beginning)[:HEAD_ROWS]


def _make_sensor_clock(selection: Selection, rows: Clock, head: Floats) -> Clock:
    """Return the clock of a sensor; only the first values are checked for repeats."""

    def again() -> Booleans:
        parts, last = [], None
        for piece in map(_stack_columns, _read_numbers(selection, _PIECE_ROWS)):
            parts.append(find_repeats(piece, last))
            last = piece[-1]
        return np.concatenate(parts)

    return rows.for_sensor(head, again)


def _stack_columns(piece: list[Column]) -> Floats:
    return np.column_stack(piece).astype(np.float64, copy=False)


def _read_beginning(selection: Selection) -> Iterator[list[Column]]:
    rows = 0
    for piece in _read_numbers(selection, HEAD_ROWS):
        yield piece
        rows += len(piece[0])
        if rows >= HEAD_ROWS:
            return


def _select_rows(used_rows: Integers, pieces: Iterator[list[Column]]) -> Iterator[list[Column]]:
    """Yield the used rows of each piece."""
    begin = 0
    for piece in pieces:
        end = begin + len(piece[0])
        low, high = np.searchsorted(used_rows, (begin, end))
        yield [column[used_rows[low:high] - begin] for column in piece]
        begin = end


def _read_numbers(selection: Selection, rows: int) -> Iterator[list[Column]]:
    assert selection.table.pieces is not None
    for columns in selection.table.pieces(selection.data, rows):
        yield [to_numbers(c, name) for c, name in zip(columns, selection.names, strict=True)]
