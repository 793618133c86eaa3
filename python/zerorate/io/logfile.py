"""Logs that are read block by block, from files larger than memory or from memory."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Final, Unpack

import numpy as np

from zerorate.io.clocks.repeats import HEAD, repeated
from zerorate.io.clocks.sensor_clock import Clock
from zerorate.io.counts import Scaling
from zerorate.io.formats import LogSource, label_of, opened
from zerorate.io.reading import (
    Asked,
    ReadArguments,
    Selection,
    all_within,
    loaded_of,
    logs_of,
    notes_on,
    notes_on_missing,
    one_group,
    row_clock,
    scaled,
    selected,
)
from zerorate.io.table import Column, Table, as_numbers
from zerorate.io.triads import accelerometer_of
from zerorate.record.log import Header, Log, LogError
from zerorate.record.span import Span
from zerorate.types import Booleans, Floats, Integers


@dataclass(frozen=True)
class Places:
    """Where rows stand on a grid of some length: runs without gaps, each by its first row.

    A grid without gaps is one run, however long.
    """

    rows: int
    length: int
    first: Integers
    place: Integers

    @classmethod
    def of(cls, place: Integers | None, length: int) -> Places:
        """Return the runs in the rising places of all rows, shape (n,), None for no gaps."""
        if place is None:
            none = np.zeros(1, np.int64)
            return cls(length, length, none, none)
        first = np.concatenate(([0], np.flatnonzero(np.diff(place) != 1) + 1))
        return cls(len(place), length, first, place[first])

    def within(self, low: int, high: int) -> Iterator[tuple[int, int]]:
        """Yield the place and the number of rows of each run in a part of the grid, in order."""
        ends = self.place + np.diff(np.append(self.first, self.rows))
        inside = range(np.searchsorted(ends, low, "right"), np.searchsorted(self.place, high))
        for run in inside:
            begin = max(low, int(self.place[run]))
            yield begin, min(high, int(ends[run])) - begin


def placed(
    pieces: Iterator[list[Column]],
    places: Places,
    rows: int,
    channels: int,
    part: range | None = None,
) -> Iterator[Floats]:
    """Yield arrays (k, rows) of the grid or a part of it, the last one shorter, NaN in gaps."""
    part = range(places.length) if part is None else part
    source = _Rows(pieces)
    source.skip(sum(count for _, count in places.within(0, part.start)))
    for low in range(part.start, part.stop, rows):
        high = min(part.stop, low + rows)
        parts = list(places.within(low, high))
        whole = sum(count for _, count in parts) == high - low
        block = np.empty((channels, high - low)) if whole else _missing(channels, high - low)
        for place, count in parts:
            source.fill(block[:, place - low : place - low + count])
        yield block


def _missing(channels: int, rows: int) -> Floats:
    return np.full((channels, rows), np.nan)


class _Rows:
    """Rows of pieces of any length, taken in order."""

    def __init__(self, pieces: Iterator[list[Column]]) -> None:
        self._pieces = pieces
        self._piece: list[Column] = []
        self._at = 0

    def fill(self, out: Floats) -> None:
        """Copy the next rows into an array (k, rows)."""
        done = 0
        while done < out.shape[1]:
            left = len(self._piece[0]) - self._at if self._piece else 0
            if left == 0:
                self._next()
                continue
            count = min(left, out.shape[1] - done)
            for row, column in zip(out, self._piece, strict=True):
                row[done : done + count] = column[self._at : self._at + count]
            self._at += count
            done += count

    def skip(self, count: int) -> None:
        """Leave out the next rows."""
        while count > 0:
            left = len(self._piece[0]) - self._at if self._piece else 0
            if left == 0:
                self._next()
                continue
            self._at += min(left, count)
            count -= left

    def _next(self) -> None:
        try:
            self._piece, self._at = next(self._pieces), 0
        except StopIteration:
            raise LogError("there are fewer rows than the file says: it is damaged") from None


_ROWS: Final = 1 << 17
_AXES: Final = 3


@dataclass(frozen=True)
class LogFile:
    """A log on a uniform time grid of which a part at a time is in memory.

    Parameters
    ----------
    header : Header
        What is known before any data are read. Its notes do not tell of columns that are all
        missing.
    time : callable
        Gives the times of the samples from a first one up to an end, s.
    blocks : callable
        Gives the data in arrays (k, rows), the last one shorter, NaN where a sample is missing.
        While they are read a `LogError` may be raised.
    whole : Log or None
        The log itself, where it is in memory already.
    stamps : callable or None
        Gives when samples were taken, as `time` does, where the clock wanders; else None.
    """

    header: Header
    time: Callable[[int, int], Floats]
    blocks: Callable[[int], Iterator[Floats]]
    whole: Log | None = None
    stamps: Callable[[int, int], Floats] | None = None

    @classmethod
    def of(cls, log: Log) -> LogFile:
        """Return a log in memory in the same form."""

        def blocks(rows: int) -> Iterator[Floats]:
            for first in range(0, log.n, rows):
                yield np.ascontiguousarray(log.data[first : first + rows].T)

        kept = log.stamps
        stamps = None if kept is None else lambda first, end: kept[first:end]
        return cls(Header.of(log), lambda first, end: log.time[first:end], blocks, log, stamps)

    def sampled(self, first: int, end: int) -> Floats:
        """Return when samples were taken, s, from a first one up to an end."""
        return (self.stamps or self.time)(first, end)

    def log(self) -> Log:
        """Return the whole log in memory."""
        if self.whole is not None:
            return self.whole
        header = self.header
        data = next(self.blocks(header.n)).T
        missing = [bool(np.isnan(column).all()) for column in data.T]
        header = header.noting(notes_on_missing(header.names, missing))
        time = self.time(0, header.n)
        stamps = None if self.stamps is None else self.stamps(0, header.n)
        return Log(time, header.rate, data, header.names, header.unit, header.meta, stamps)


def open_log(
    path: LogSource, *, unit: str | None = None, **arguments: Unpack[ReadArguments]
) -> LogFile:
    """Return a file's log in blocks, with the arguments and faults of `read_log`.

    Of a Parquet file the time column alone is read here; any other format is loaded whole.
    """
    return _opened(path, Asked.of(**arguments), unit, accel=False)[0]


def open_imu(
    path: LogSource, *, unit: str | None = None, **arguments: Unpack[ReadArguments]
) -> tuple[LogFile, LogFile | None]:
    """Return the log that `open_log` returns, and that of its accelerometer.

    The accelerometer is the one of the same table that is named like the gyro, or the only one. It
    is None if there is none, if it has not three axes or cannot be read, and where a log is of
    several gyros.
    """
    return _opened(path, Asked.of(**arguments), unit, accel=True)


def _opened(
    path: LogSource, asked: Asked, unit: str | None, *, accel: bool
) -> tuple[LogFile, LogFile | None]:
    label = label_of(path)
    try:
        kind, content = opened(path)
        table = asked.timing.told(content.chosen(asked.topic))
        told = {"source": label, "format": kind}
        grouped = one_group(unit, asked.scaling)
        chosen = selected(table, asked.rate, asked.columns, grouped, sensor=asked.sensor)
        beside = accelerometer_of(chosen.table.names or (), chosen.data) if accel else ()
        chosen = replace(chosen, table=_loaded_once(chosen, beside))
        rows = _row_clock(chosen)
        gyro = _of_selection(chosen, told, label, asked.span, rows)
        return gyro, _accelerometer(chosen, beside, told, label, asked, rows)
    except LogError as error:
        raise error.around(f"{label}: ") from None


def _loaded_once(chosen: Selection, beside: Sequence[int]) -> Table:
    """Return the table with the columns of both sensors and the time in memory, if any are."""
    table, time = chosen.table, () if chosen.time is None else (chosen.time,)
    if table.pieces is not None:
        return table
    wanted = tuple(dict.fromkeys((*chosen.data, *beside, *time)))
    try:
        columns = dict(zip(wanted, table.load(wanted), strict=True))
    except LogError:
        return table  # what is wrong is said where it is read

    def load(asked: Sequence[int]) -> list[Column]:
        there = all(i in columns for i in asked)
        return [columns[i] for i in asked] if there else table.load(asked)

    return replace(table, load=load)


def _row_clock(chosen: Selection) -> Clock:
    """Return the clock of a table's rows."""
    table = chosen.table
    if table.pieces is None:
        columns, time = loaded_of(chosen)
        return row_clock(chosen, time, len(columns[0]))
    column = None if chosen.time is None else _whole(table, chosen.time)
    if table.rows == 0:
        raise LogError("there are columns but no rows")
    return row_clock(chosen, column, table.rows)


def _of_selection(
    chosen: Selection, told: dict[str, str], label: str, span: Span, rows: Clock
) -> LogFile:
    if chosen.table.pieces is None:
        return LogFile.of(*all_within(span, logs_of(chosen, told, rows)))
    return _in_pieces(chosen, told, label, span, rows)


def _accelerometer(
    gyro: Selection,
    places: tuple[int, ...],
    told: dict[str, str],
    label: str,
    asked: Asked,
    rows: Clock,
) -> LogFile | None:
    if len(places) != _AXES:
        return None
    grouped = one_group(None, Scaling())
    try:
        chosen = selected(gyro.table, asked.rate, places, grouped)
        same = (chosen.time, chosen.rate) == (gyro.time, gyro.rate)
        own = rows if same else _row_clock(chosen)
        return _of_selection(chosen, told, label, asked.span, own)
    except LogError:
        return None


def _in_pieces(
    chosen: Selection, told: dict[str, str], label: str, span: Span, rows: Clock
) -> LogFile:
    (group,) = chosen.groups
    head = _head(chosen)
    clock = _clock(chosen, rows, head)
    grid, start = clock.grid, clock.start
    part = span.places(grid.length, grid.rate)
    meta = {**chosen.meta(told, grid), "notes": tuple(notes_on(chosen, group, head, clock))}
    header = Header(len(part), grid.rate, tuple(chosen.names), group.unit, meta)
    if not span.whole:
        span.check(grid.length / grid.rate, grid.rate)
        header = header.noting([span.note(grid.length / grid.rate)])
    if not part:
        raise span.missed()
    places = Places.of(grid.spread, grid.length)

    def times(first: int, end: int) -> Floats:
        return start + np.arange(part.start + first, part.start + end) / grid.rate

    def blocks(rows: int) -> Iterator[Floats]:
        try:
            pieces = _numbers(chosen, rows)
            pieces = pieces if grid.used is None else _only(grid.used, pieces)
            for block in placed(pieces, places, rows, len(chosen.names), part):
                yield scaled(block, group.factor)
        except LogError as error:
            raise error.around(f"{label}: ") from None

    def stamps(first: int, end: int) -> Floats:
        kept = grid.times(range(part.start + first, part.start + end))
        assert kept is not None
        return start + kept

    return LogFile(header, times, blocks, stamps=None if grid.kept is None else stamps)


def _whole(table: Table, index: int) -> Column:
    """Return one column, without a second copy of it."""
    assert table.pieces is not None
    column = None
    done = 0
    for (piece,) in table.pieces([index], _ROWS):
        column = np.empty(table.rows, piece.dtype) if column is None else column
        if piece.dtype != column.dtype:
            break
        column[done : done + len(piece)] = piece
        done += len(piece)
    # Missing values turn whole numbers into floats, in some of the pieces only.
    return table.load([index])[0] if column is None or done < table.rows else column


def _head(chosen: Selection) -> Floats:
    """Return the first `HEAD` rows of the values, or all if there are fewer."""
    beginning = [_together(piece) for piece in _beginning(chosen)]
    if not beginning:
        raise LogError("truncated or damaged: it says that it has rows, and has none")
    return np.concatenate(beginning)[:HEAD]


def _clock(chosen: Selection, rows: Clock, head: Floats) -> Clock:
    """Return the clock of a sensor, of whose values only those at the beginning are looked at."""

    def again() -> Booleans:
        parts, last = [], None
        for piece in map(_together, _numbers(chosen, _ROWS)):
            parts.append(repeated(piece, last))
            last = piece[-1]
        return np.concatenate(parts)

    return rows.of_sensor(head, again)


def _together(piece: list[Column]) -> Floats:
    return np.column_stack(piece).astype(np.float64, copy=False)


def _beginning(chosen: Selection) -> Iterator[list[Column]]:
    rows = 0
    for piece in _numbers(chosen, HEAD):
        yield piece
        rows += len(piece[0])
        if rows >= HEAD:
            return


def _only(used: Integers, pieces: Iterator[list[Column]]) -> Iterator[list[Column]]:
    """Yield the rows of pieces that are used."""
    begin = 0
    for piece in pieces:
        end = begin + len(piece[0])
        low, high = np.searchsorted(used, (begin, end))
        yield [column[used[low:high] - begin] for column in piece]
        begin = end


def _numbers(chosen: Selection, rows: int) -> Iterator[list[Column]]:
    assert chosen.table.pieces is not None
    for columns in chosen.table.pieces(chosen.data, rows):
        yield [as_numbers(c, name) for c, name in zip(columns, chosen.names, strict=True)]
