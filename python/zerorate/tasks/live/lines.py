"""Lines of a stream: cells, columns and answers."""

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
from zerorate.faults import keyword_argument, make_sentence, sentence_of
from zerorate.io.clocks.iso8601 import is_date
from zerorate.io.clocks.names import has_time_name
from zerorate.io.readers.cells import make_inert, parse_number, undo_inert
from zerorate.io.sensors import find_sensor_columns
from zerorate.record import LogError
from zerorate.record.names import UNKNOWN_UNIT, common_unit

# Number of digits of a 64-bit counter.
_INTEGER: Final = re.compile(r"[+-]?[0-9]{1,20}")

_AXES: Final = "xyz"
_UNPRINTABLE: Final = "it holds characters that cannot be printed"

_Column: TypeAlias = float | bool | npt.NDArray[Any]
"""One number per channel: a single number, or an array of shape (k,)."""


class LineError(ValueError):
    """Error for a line that contradicts earlier lines or the options."""


class ColumnError(LineError):
    """Error for columns that differ from the request; the stream cannot continue."""


def split_cells(line: str) -> list[str]:
    """Return the cells of a line, separated by commas or, without a comma, by blanks."""
    if "," in line:
        return [cell.strip() for cell in line.split(",")]
    return line.split() or [""]


@dataclass(frozen=True)
class ColumnRequest:
    """Columns requested by name or position; None requests the gyro columns."""

    columns: tuple[str | int, ...] | None = None
    sequence: str | int | None = None
    fields: int | None = None
    unit: str | None = None
    time: str | int | None = None
    mixed: bool = False
    """True if channels have different units."""


@dataclass(frozen=True)
class Layout:
    """Layout of every line: the filtered columns; all other columns pass through.

    `names` are the names in the header, if any. `unit` is the unit of the channels, if known.
    """

    fields: int
    channels: tuple[int, ...]
    sequence: int | None
    names: tuple[str, ...] | None
    unit: str | None = None

    @property
    def labels(self) -> list[str]:
        """Labels of the channels: their names, or else their positions."""
        names = self.names or tuple(f"column {i}" for i in range(self.fields))
        return [names[i] for i in self.channels]

    @property
    def passthrough_labels(self) -> list[str]:
        """Labels of the columns that pass through."""
        names = self.names or tuple(map(str, range(self.fields)))
        return [name for i, name in enumerate(names) if i not in self.channels]

    def row(self, cells: Sequence[str]) -> list[float]:
        """Return the sample in the cells of a line, one number per channel; else LineError."""
        self._check_count(cells)
        row = [_parse_number(cells[i]) for i in self.channels]
        # Escape passed cells, because they may reach a terminal.
        if len(row) < self.fields and not "".join(cells).isprintable():
            raise LineError(_UNPRINTABLE)
        return row

    def sequence_number(self, cells: Sequence[str]) -> int:
        """Return the sequence number in the cells of a line; LineError if there is none."""
        self._check_count(cells)
        cell = cells[self.sequence or 0]
        if not _INTEGER.fullmatch(cell):
            raise LineError(f"the sequence number is '{_shorten_cell(cell)}', expected an integer")
        return int(cell)

    def is_header(self, cells: Sequence[str]) -> bool:
        """Return True if a line repeats the column names; ColumnError for other names."""
        if self.names is None or not any(cell[:1].isalpha() for cell in cells):
            return False
        cell_names = _fill_names(cells)
        if cell_names == self.names:
            return True
        # A garbled line may contain any words, but hardly only some of the names.
        is_complete = len(cell_names) == self.fields and all(map(_is_name_like, cell_names))
        if is_complete and set(cell_names) & set(self.names):
            names, known = ",".join(cell_names), ",".join(self.names)
            raise ColumnError(f"it names the columns {names}, before they were {known}")
        return False

    def answer(self, cells: Sequence[str], texts: Sequence[str]) -> str:
        """Return the line with `texts` in its channels; additional texts are appended."""
        if self._is_all_channels:
            return ",".join(texts)
        whole = list(cells)
        for place, text in zip(self.channels, texts, strict=False):
            whole[place] = text
        return ",".join([*whole, *texts[len(self.channels) :]])

    def header(self, cells: Sequence[str], extra_columns: Sequence["DriftColumn"]) -> str:
        """Return the names of an answer's columns."""
        names = [undo_inert(cell) for cell in cells]
        extra_names = [f"{column}_{names[i]}" for column in extra_columns for i in self.channels]
        return ",".join([*map(make_inert, names), *extra_names])

    @cached_property
    def _is_all_channels(self) -> bool:
        return self.channels == tuple(range(self.fields))

    def _check_count(self, cells: Sequence[str]) -> None:
        # A line with an empty end has all its values missing.
        if len(cells) != self.fields:
            raise LineError(f"it has {len(cells)} cells, expected {self.fields}")


def find_layout(cells: Sequence[str], request: ColumnRequest) -> Layout:
    """Return the layout from the first line, a header or a sample.

    Raises
    ------
    LineError
        If the line is empty, garbled, or has a wrong number of cells.
    ColumnError
        If a requested column is missing.
    """
    if list(cells) == [""]:
        raise LineError("it is empty, expected names or numbers")
    if request.fields not in (None, len(cells)):
        raise LineError(f"it has {len(cells)} cells, expected {request.fields}")
    names = header_names(cells, request.columns)
    sequence = (
        None if request.sequence is None else position_of(request.sequence, names, len(cells))
    )
    time = None if request.time is None else position_of(request.time, names, len(cells))
    reserved = (sequence, time)
    if request.columns is not None:
        channels = tuple(position_of(column, names, len(cells)) for column in request.columns)
        _check_channels(channels, sequence, names)
        if time in channels:
            raise ColumnError(
                make_sentence(keyword_argument("columns"), " names the column of the time")
            )
    elif names is not None:
        channels = tuple(i for i in _find_gyros(names) if i not in reserved)
    else:
        positions = (i for i, cell in enumerate(cells) if not is_date(cell))
        channels = tuple(i for i in positions if i not in reserved)
    if not channels:
        raise ColumnError(_describe_no_channel(names))
    unit = None if request.mixed else _choose_unit(channels, names, request.unit)
    return Layout(len(cells), channels, sequence, names, unit)


def header_names(
    cells: Sequence[str], columns: Sequence[str | int] | None = None
) -> tuple[str, ...] | None:
    """Return the names in a first line; None for a sample; LineError otherwise.

    If all requested positions have numbers, the line is a sample, and other cells are labels.
    """
    places = [i for i in columns or () if isinstance(i, int) and 0 <= i < len(cells)]
    if places and len(places) == len(columns or ()) and all(_is_number(cells[i]) for i in places):
        return None
    return None if all(is_date(cell) or _is_number(cell) for cell in cells) else _parse_names(cells)


def _find_gyros(names: Sequence[str]) -> list[int]:
    return list(columns_of_sensor(names, "gyro"))


def columns_of_sensor(names: Sequence[str], kind: str) -> tuple[int, ...]:
    """Return the columns of the only sensor of a kind; ColumnError if there are several."""
    try:
        return find_sensor_columns(names, kind)
    except LogError as error:
        raise ColumnError(sentence_of(error)) from None


def _describe_no_channel(names: Sequence[str] | None) -> str:
    if names is None:
        return "it has only the sequence number, expected also a sample"
    return make_sentence(
        "no column looks like a gyro; choose with ",
        keyword_argument("columns"),
        f" from: {', '.join(names)}",
    )


def _check_channels(
    channels: Sequence[int], sequence: int | None, names: Sequence[str] | None
) -> None:
    """Raise an error for requested gyro columns that are no gyro."""
    if len(set(channels)) < len(channels):
        raise ColumnError(make_sentence(keyword_argument("columns"), " names a column twice"))
    if sequence in channels:
        raise ColumnError(
            make_sentence(keyword_argument("columns"), " names the column of the sequence number")
        )
    named = tuple(names or ())
    times = [named[i] for i in channels if named and has_time_name(named[i])]
    if times:
        gyros = ", ".join(named[gyro] for gyro in _find_gyros(named))
        hint = f"; the gyro columns are {gyros}" if gyros else ""
        raise ColumnError(
            make_sentence(
                keyword_argument("columns"),
                f" names '{times[0]}', which holds the time, not samples{hint}",
            )
        )


def _choose_unit(
    channels: Sequence[int], names: Sequence[str] | None, stated: str | None
) -> str | None:
    if names is None:
        return stated
    try:
        unit = common_unit([names[i] for i in channels], stated, None)
    except LogError as error:
        raise ColumnError(str(error)) from None
    return None if unit == UNKNOWN_UNIT else unit


def _is_name_like(cell: str) -> bool:
    return cell[:1].isalpha() and not _is_number(cell)


def _parse_names(cells: Sequence[str]) -> tuple[str, ...]:
    # A header with numbers and names probably is a garbled sample.
    if any(cell and _is_number(cell) for cell in cells):
        several = sum(map(_is_number, cells)) >= len(_AXES)
        remedy = (
            "; ",
            keyword_argument("columns"),
            " takes column positions, counted from 0",
        )
        mixed = "it has both names and numbers, expected either"
        raise LineError(make_sentence(mixed, *remedy) if several else mixed)
    if not "".join(cells).isprintable():
        raise LineError(_UNPRINTABLE)
    return _fill_names(cells)


def _fill_names(cells: Sequence[str]) -> tuple[str, ...]:
    return tuple(undo_inert(cell) or f"column_{i}" for i, cell in enumerate(cells))


def position_of(column: str | int, names: tuple[str, ...] | None, fields: int) -> int:
    """Return the position of a requested column; ColumnError if there is none."""
    if isinstance(column, int):
        if not 0 <= column < fields:
            raise ColumnError(f"there is no column {column}, the line has {fields}, from 0 on")
        return column
    if names is None:
        raise ColumnError(f"there is no column '{column}', the line names none")
    if column not in names:
        raise ColumnError(f"there is no column '{column}', expected one of {', '.join(names)}")
    return names.index(column)


def _parse_number(cell: str) -> float:
    """Return the number in a cell, NaN if it is missing.

    Raises
    ------
    LineError
        If the cell has neither a number nor a mark for a missing one.
    """
    try:
        return parse_number(cell, decimal_comma=False)
    except ValueError as error:
        raise LineError(f"'{_shorten_cell(cell)}' {error}") from None


def number_or_nan(cell: str) -> float:
    """Return the number in a cell; NaN for other texts."""
    try:
        return _parse_number(cell)
    except LineError:
        return math.nan


def _is_number(cell: str) -> bool:
    """Return True if a cell has a number, or a mark for a missing one."""
    try:
        _parse_number(cell)
    except LineError:
        return False
    return True


def _shorten_cell(cell: str) -> str:
    """Return a cell shortened for a message."""
    shown = cell if len(cell) <= 40 else cell[:37] + "..."
    return shown.encode("unicode_escape").decode("ascii")


class DriftColumn(StrEnum):
    """Additional columns of an answer, after the rates.

    Examples
    --------
    >>> from zerorate.tasks.live import DriftColumn
    >>> [column.value for column in DriftColumn]
    ['bias', 'bias_sigma', 'at_rest', 'saturated', 'stuck']
    """

    bias = "bias"
    bias_sigma = "bias_sigma"
    at_rest = "at_rest"
    saturated = "saturated"
    stuck = "stuck"


def answer_texts(
    rate: _Column, filter_: DriftFilter, extra_columns: Sequence[DriftColumn]
) -> list[str]:
    """Return the rate of each channel, then the extra columns of each channel."""
    if not extra_columns:
        return format_numbers(rate)
    columns = (rate, *(getattr(filter_, name) for name in extra_columns))
    return [text for column in columns for text in format_numbers(column)]


def format_numbers(column: _Column) -> list[str]:
    """Return the shortest texts that restore the floats exactly; flags become 0 or 1."""
    values = column.tolist() if isinstance(column, np.ndarray) else [column]
    return [repr(value) if type(value) is float else str(int(value)) for value in values]
