"""A log that comes in blocks, from a file larger than memory or from one in memory."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
import numpy.typing as npt

from zerorate.io.errors import LogError
from zerorate.io.header import Header
from zerorate.io.log import Log
from zerorate.io.placing import Places, placed
from zerorate.io.quantity import canonical_unit
from zerorate.io.rates import checked_rate
from zerorate.io.reading import (
    Selection,
    clock_of,
    gyros_of_one_unit,
    logs_of,
    notes_on_clock,
    notes_on_missing,
    selected,
)
from zerorate.io.sources import label_of, opened
from zerorate.io.table import Column, Table, as_numbers

__all__ = ["Recording", "open_recording"]

Floats = npt.NDArray[np.float64]

_ROWS: Final = 1 << 17


@dataclass(frozen=True)
class Recording:
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
    """

    header: Header
    time: Callable[[int, int], Floats]
    blocks: Callable[[int], Iterator[Floats]]
    whole: Log | None = None

    @classmethod
    def of(cls, log: Log) -> Recording:
        """Return the recording of a log in memory."""

        def blocks(rows: int) -> Iterator[Floats]:
            for first in range(0, log.n, rows):
                yield np.ascontiguousarray(log.data[first : first + rows].T)

        return cls(Header.of(log), lambda first, end: log.time[first:end], blocks, log)

    def log(self) -> Log:
        """Return the whole log in memory."""
        if self.whole is not None:
            return self.whole
        header = self.header
        data = next(self.blocks(header.n)).T
        missing = [bool(np.isnan(column).all()) for column in data.T]
        header = header.noting(notes_on_missing(header.names, missing))
        time = self.time(0, header.n)
        return Log(time, header.rate, data, header.names, header.unit, header.meta)


def open_recording(
    path: str | os.PathLike[str],
    rate: float | None = None,
    columns: str | int | Sequence[str | int] | None = None,
    unit: str | None = None,
    topic: str | None = None,
) -> Recording:
    """Return a file's log in blocks, with the arguments and faults of `read_log`.

    Of a Parquet file the time column alone is read here; any other format is loaded whole.
    """
    grouped = gyros_of_one_unit(None if unit is None else canonical_unit(unit))
    given = None if rate is None else checked_rate(rate)
    label = label_of(path)
    try:
        kind, table = opened(path, topic)
        told = {"source": label, "format": kind}
        chosen = selected(table, given, columns, grouped)
        if chosen.table.pieces is None:
            return Recording.of(logs_of(chosen, told)[0])
        return _in_pieces(chosen, told, label)
    except LogError as error:
        raise LogError(f"{label}: {error}") from None


def _in_pieces(chosen: Selection, told: dict[str, str], label: str) -> Recording:
    table, time = chosen.table, chosen.time
    column = None if time is None else _whole(table, time)
    if table.rows == 0:
        raise LogError("there are columns but no rows")
    clock = clock_of(chosen, column, table.rows)
    grid, start = clock.grid, clock.start
    meta = {**chosen.meta(told, grid), "notes": tuple(notes_on_clock(chosen.groups[0].unit, clock))}
    header = Header(grid.length, grid.rate, tuple(chosen.names), chosen.groups[0].unit, meta)
    places = Places.of(grid.spread, grid.length)

    def times(first: int, end: int) -> Floats:
        return start + np.arange(first, end) / grid.rate

    def blocks(rows: int) -> Iterator[Floats]:
        try:
            yield from placed(_numbers(table, chosen, rows), places, rows, len(chosen.names))
        except LogError as error:
            raise LogError(f"{label}: {error}") from None

    return Recording(header, times, blocks)


def _whole(table: Table, index: int) -> Column:
    """Return one column, without a copy of it beside it."""
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


def _numbers(table: Table, chosen: Selection, rows: int) -> Iterator[list[Column]]:
    assert table.pieces is not None
    for columns in table.pieces(chosen.data, rows):
        yield [as_numbers(c, name) for c, name in zip(columns, chosen.names, strict=True)]
