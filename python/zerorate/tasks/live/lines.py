"""The lines of a stream: their cells and columns, and their answers."""

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum
from functools import cached_property
from typing import Any, Final, TypeAlias

import numpy as np
import numpy.typing as npt

from zerorate._native import DriftFilter
from zerorate.faults import given, said
from zerorate.io.clocks.iso8601 import is_date
from zerorate.io.clocks.names import named_like_time
from zerorate.io.readers.cells import from_inert, inert, number
from zerorate.io.triads import places_of
from zerorate.record import LogError
from zerorate.record.names import UNKNOWN, common_unit

# As many digits as a counter of 64 bits may have.
_INTEGER: Final = re.compile(r"[+-]?[0-9]{1,20}")

_UNPRINTABLE: Final = "it holds characters that cannot be printed"

_Column: TypeAlias = float | bool | npt.NDArray[Any]
"""One number a channel: alone, or as an array of shape (k,)."""


class LineError(ValueError):
    """A line is not what the lines before it, or the options, let expect."""


class ColumnError(LineError):
    """A line shows that the columns are others than was asked for: no later line can be used."""


def cells_of(line: str) -> list[str]:
    """Return the cells of a line; commas separate them, or blanks where there is no comma."""
    if "," in line:
        return [cell.strip() for cell in line.split(",")]
    return line.split() or [""]


@dataclass(frozen=True)
class Wanted:
    """What was asked for: columns by name or position, None for those that hold gyros."""

    columns: tuple[str | int, ...] | None = None
    sequence: str | int | None = None
    fields: int | None = None
    unit: str | None = None
    time: str | int | None = None
    mixed: bool = False
    """Whether channels are of several units, so that there is no unit of all."""


@dataclass(frozen=True)
class Layout:
    """How every line is laid out: which columns are filtered; all others pass through.

    `names` are those of the header, if there was one, and `unit` is that of the channels, if it is
    known.
    """

    fields: int
    channels: tuple[int, ...]
    sequence: int | None
    names: tuple[str, ...] | None
    unit: str | None = None

    @property
    def labels(self) -> list[str]:
        """What the channels are called: their names, else their positions."""
        names = self.names or tuple(f"column {i}" for i in range(self.fields))
        return [names[i] for i in self.channels]

    @property
    def passing(self) -> list[str]:
        """What the columns that pass through are called."""
        names = self.names or tuple(map(str, range(self.fields)))
        return [name for i, name in enumerate(names) if i not in self.channels]

    def row(self, cells: Sequence[str]) -> list[float]:
        """Return the sample in the cells of a line, one number a channel; LineError if none."""
        self._check_count(cells)
        row = [_number(cells[i]) for i in self.channels]
        # What passes through may reach a terminal.
        if len(row) < self.fields and not "".join(cells).isprintable():
            raise LineError(_UNPRINTABLE)
        return row

    def sequence_number(self, cells: Sequence[str]) -> int:
        """Return the sequence number in the cells of a line; LineError if there is none."""
        self._check_count(cells)
        cell = cells[self.sequence or 0]
        if not _INTEGER.fullmatch(cell):
            raise LineError(f"the sequence number is '{_shortened(cell)}', expected an integer")
        return int(cell)

    def is_header(self, cells: Sequence[str]) -> bool:
        """Return whether a line names the columns again; ColumnError if it names others."""
        if self.names is None or not any(cell[:1].isalpha() for cell in cells):
            return False
        found = _filled(cells)
        if found == self.names:
            return True
        # A garbled line may hold any words, but hardly some of the names and nothing else.
        whole = len(found) == self.fields and all(map(_name_like, found))
        if whole and set(found) & set(self.names):
            names, known = ",".join(found), ",".join(self.names)
            raise ColumnError(f"it names the columns {names}, before they were {known}")
        return False

    def answer(self, cells: Sequence[str], texts: Sequence[str]) -> str:
        """Return the answer to a line: texts in the place of channels, further ones at its end."""
        if self._alone:
            return ",".join(texts)
        whole = list(cells)
        for place, text in zip(self.channels, texts, strict=False):
            whole[place] = text
        return ",".join([*whole, *texts[len(self.channels) :]])

    def header(self, cells: Sequence[str], beside: Sequence["Beside"]) -> str:
        """Return the names of an answer's columns."""
        names = [from_inert(cell) for cell in cells]
        further = [f"{column}_{names[i]}" for column in beside for i in self.channels]
        return ",".join([*map(inert, names), *further])

    @cached_property
    def _alone(self) -> bool:
        return self.channels == tuple(range(self.fields))

    def _check_count(self, cells: Sequence[str]) -> None:
        # Nothing but a line's end says that all of it is missing.
        if len(cells) != self.fields:
            raise LineError(f"it has {len(cells)} cells, expected {self.fields}")


def find_layout(cells: Sequence[str], wanted: Wanted) -> Layout:
    """Return the layout that the first line shows, be it a header or a sample.

    Raises
    ------
    LineError
        If the line is empty, garbled, or has another number of cells than was said.
    ColumnError
        If it lacks a column.
    """
    if list(cells) == [""]:
        raise LineError("it is empty, expected names or numbers")
    if wanted.fields not in (None, len(cells)):
        raise LineError(f"it has {len(cells)} cells, expected {wanted.fields}")
    names = names_in(cells)
    sequence = None if wanted.sequence is None else position_of(wanted.sequence, names, len(cells))
    time = None if wanted.time is None else position_of(wanted.time, names, len(cells))
    apart = (sequence, time)
    if wanted.columns is not None:
        channels = tuple(position_of(column, names, len(cells)) for column in wanted.columns)
        _check_channels(channels, sequence, names)
        if time in channels:
            raise ColumnError(said(given("columns"), " names the column of the time"))
    elif names is not None:
        channels = tuple(i for i in _gyros(names) if i not in apart)
    else:
        places = (i for i, cell in enumerate(cells) if not is_date(cell))
        channels = tuple(i for i in places if i not in apart)
    if not channels:
        raise ColumnError(_on_no_channel(names))
    unit = None if wanted.mixed else _unit(channels, names, wanted.unit)
    return Layout(len(cells), channels, sequence, names, unit)


def names_in(cells: Sequence[str]) -> tuple[str, ...] | None:
    """Return the names in a first line, None if it holds a sample; LineError if neither."""
    return None if all(is_date(cell) or _is_number(cell) for cell in cells) else _names(cells)


def _gyros(names: Sequence[str]) -> list[int]:
    return list(places_of(names, "gyro"))


def _on_no_channel(names: Sequence[str] | None) -> str:
    if names is None:
        return "it holds the sequence number alone, expected a sample next to it"
    return said(
        "no column looks like a gyro; choose with ", given("columns"), f" from: {', '.join(names)}"
    )


def _check_channels(
    channels: Sequence[int], sequence: int | None, names: Sequence[str] | None
) -> None:
    """Refuse columns that were asked for as gyros and are none."""
    if len(set(channels)) < len(channels):
        raise ColumnError(said(given("columns"), " names a column twice"))
    if sequence in channels:
        raise ColumnError(said(given("columns"), " names the column of the sequence number"))
    named = tuple(names or ())
    times = [named[i] for i in channels if named and named_like_time(named[i])]
    if times:
        gyros = ", ".join(named[gyro] for gyro in _gyros(named))
        hint = f"; the gyro columns are {gyros}" if gyros else ""
        raise ColumnError(
            said(given("columns"), f" names '{times[0]}', which holds the time, not samples{hint}")
        )


def _unit(channels: Sequence[int], names: Sequence[str] | None, given: str | None) -> str | None:
    if names is None:
        return given
    try:
        found = common_unit([names[i] for i in channels], given, None)
    except LogError as error:
        raise ColumnError(str(error)) from None
    return None if found == UNKNOWN else found


def _name_like(cell: str) -> bool:
    return cell[:1].isalpha() and not _is_number(cell)


def _names(cells: Sequence[str]) -> tuple[str, ...]:
    # A header of numbers and names is more likely a sample that was garbled.
    if any(cell and _is_number(cell) for cell in cells):
        raise LineError("it holds names and numbers, expected one or the other")
    if not "".join(cells).isprintable():
        raise LineError(_UNPRINTABLE)
    return _filled(cells)


def _filled(cells: Sequence[str]) -> tuple[str, ...]:
    return tuple(from_inert(cell) or f"column_{i}" for i, cell in enumerate(cells))


def position_of(column: str | int, names: tuple[str, ...] | None, fields: int) -> int:
    """Return the position of a column that was asked for; ColumnError if there is none."""
    if isinstance(column, int):
        if not 0 <= column < fields:
            raise ColumnError(f"there is no column {column}, the line has {fields}, from 0 on")
        return column
    if names is None:
        raise ColumnError(f"there is no column '{column}', the line names none")
    if column not in names:
        raise ColumnError(f"there is no column '{column}', expected one of {', '.join(names)}")
    return names.index(column)


def _number(cell: str) -> float:
    """Return the number in a cell, NaN where it is missing.

    Raises
    ------
    LineError
        If it is neither.
    """
    try:
        return number(cell, decimal_comma=False)
    except ValueError as error:
        raise LineError(f"'{_shortened(cell)}' {error}") from None


def number_or_nan(cell: str) -> float:
    """Return the number in a cell, NaN where there is none."""
    try:
        return _number(cell)
    except LineError:
        return math.nan


def _is_number(cell: str) -> bool:
    """Return whether a cell holds a number, or says that one is missing."""
    try:
        _number(cell)
    except LineError:
        return False
    return True


def _shortened(cell: str) -> str:
    """Return a cell as a message may show it."""
    shown = cell if len(cell) <= 40 else cell[:37] + "..."
    return shown.encode("unicode_escape").decode("ascii")


class Beside(StrEnum):
    """Columns that may follow the rate in an answer.

    Examples
    --------
    >>> from zerorate.tasks.live import Beside
    >>> [column.value for column in Beside]
    ['bias', 'bias_sigma', 'at_rest', 'saturated', 'stuck']
    """

    bias = "bias"
    bias_sigma = "bias_sigma"
    at_rest = "at_rest"
    saturated = "saturated"
    stuck = "stuck"


def answer(rate: _Column, filter_: DriftFilter, beside: Sequence[Beside]) -> list[str]:
    """Return the rate of every channel, then every further column of every channel."""
    if not beside:
        return texts_of(rate)
    columns = (rate, *(getattr(filter_, name) for name in beside))
    return [text for column in columns for text in texts_of(column)]


def texts_of(column: _Column) -> list[str]:
    """Return numbers as the shortest texts that give the same floats again; a flag as 0 or 1."""
    values = column.tolist() if isinstance(column, np.ndarray) else [column]
    return [repr(value) if type(value) is float else str(int(value)) for value in values]
