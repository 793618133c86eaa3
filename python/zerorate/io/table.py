"""Interface of readers: named columns, loaded on request, with the file's metadata.

A reader is a function of a path that returns the file's `Content`. A `Format` describes which files
it reads. `zerorate.io.formats` lists all formats.
"""

from __future__ import annotations

import reprlib
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Final, NamedTuple, Protocol

import numpy as np
import numpy.typing as npt

from zerorate.faults import keyword_argument, make_sentence
from zerorate.record.log import LogError
from zerorate.record.missing import without_masks
from zerorate.texts import escape_line

Column = npt.NDArray[Any]

NO_TOPICS: Final = make_sentence(
    keyword_argument("topic"),
    " chooses among the topics of a ROS recording or an autopilot's log; this is neither",
)


@dataclass(frozen=True)
class Metadata:
    """Metadata of a file; each field is None if the file does not have it.

    ``axes`` describes the directions of x, y and z in words. ``calibration`` has the logger's
    corrections of its sensors, by its own names.
    """

    rate: float | None = None
    unit: str | None = None
    sensor: str | None = None
    axes: str | None = None
    names: tuple[str, ...] | None = None
    notes: tuple[str, ...] = ()
    calibration: Mapping[str, float] | None = None

    def __post_init__(self) -> None:
        """Raise LogError for fields that are not text; the rate is checked when it is used."""
        for key, value in (("unit", self.unit), ("sensor", self.sensor), ("axes", self.axes)):
            if value is not None:
                object.__setattr__(self, key, _check_text(key, value))
        if self.names is not None:
            if not isinstance(self.names, (list, tuple)):
                raise LogError(
                    f"in the metadata, names must be a list, got {reprlib.repr(self.names)}"
                )
            object.__setattr__(self, "names", tuple(_check_text("a name", n) for n in self.names))


def _check_text(key: str, value: object) -> str:
    if not isinstance(value, str):
        raise LogError(f"in the metadata, {key} must be text, got {reprlib.repr(value)}")
    return escape_line(value)


@dataclass(frozen=True)
class Table:
    """Columns of a file, loaded on request.

    - ``names``: columns' names; None for a table without names
    - ``time``: index of the time column, if the format determines it
    - ``data``: data columns, if the file lists them
    - ``lengths``: number of values per column, if columns may differ in length
    - ``pieces``: function of columns' indices and a number of rows; it yields pieces of at most
      this length, if the format supports it
    - ``rows``: number of rows of all pieces
    - ``labels``: function that returns a column of texts, if ``load`` cannot
    - ``time_unit``: unit of the time column, if stated by the caller
    - ``timeless``: True if the caller wants no time column
    - ``whole``: function that returns the table without torn lines
    """

    width: int
    load: Callable[[Sequence[int]], list[Column]]
    names: tuple[str, ...] | None = None
    meta: Metadata = field(default_factory=Metadata)
    time: int | None = None
    data: tuple[int, ...] | None = None
    lengths: tuple[int, ...] | None = None
    pieces: Callable[[Sequence[int], int], Iterator[list[Column]]] | None = None
    rows: int = 0
    labels: Callable[[int], Column] | None = None
    time_unit: str | None = None
    timeless: bool = False
    whole: Callable[[], Table] | None = None

    def label(self, index: int) -> str:
        """Return the column's name, or a name made from its index."""
        return self.names[index] if self.names is not None else f"column_{index}"

    def noted(self, *notes: str) -> Table:
        """Return the table with further notes."""
        if not notes:
            return self
        whole = self.whole
        rest = None if whole is None else lambda: whole().noted(*notes)
        return replace(self, meta=replace(self.meta, notes=(*self.meta.notes, *notes)), whole=rest)

    def in_memory(self, wanted: Iterable[int]) -> Table:
        """Return the table with some columns in memory; unchanged if a column cannot be loaded."""
        places = tuple(dict.fromkeys(wanted))
        try:
            columns = dict(zip(places, self.load(places), strict=True))
        except LogError:
            return self  # the error is raised when the column is used

        def load(requested: Sequence[int]) -> list[Column]:
            is_there = all(i in columns for i in requested)
            return [columns[i] for i in requested] if is_there else self.load(requested)

        return replace(self, load=load)


@dataclass(frozen=True)
class Content:
    """Tables of a file by topic, and the default topic.

    A format without topics has one table with an empty name. ``sensors`` lists the topics of a
    recording; None for all topics.
    """

    tables: Mapping[str, Table]
    find_topic: Callable[[str | None], str]
    sensors: tuple[str, ...] | None = None

    def choose_table(self, topic: str | None) -> Table:
        """Return the table of the requested topic, None for the default one."""
        return self.tables[self.find_topic(topic)]

    @classmethod
    def of(cls, table: Table) -> Content:
        """Return the content of a file without topics."""

        def only(requested: str | None) -> str:
            if requested is not None:
                raise LogError(NO_TOPICS, "topic")
            return ""

        return cls({"": table}, only)


class Reader(Protocol):
    """A function that reads the contents of one format, and loads as little as possible."""

    def __call__(self, path: Path, /) -> Content:
        """Return the content of a file; LogError if it is damaged or has another format."""


class Needs(NamedTuple):
    """Package that is necessary to read a format, and the extra that installs it."""

    package: str
    extra: str


@dataclass(frozen=True)
class Format:
    """A file format.

    ``description`` is its name in a sentence. ``signatures`` are the possible beginnings of its
    files, empty for text. ``matches_head`` returns True for other beginnings of this format.
    """

    kind: str
    description: str
    suffixes: tuple[str, ...]
    signatures: tuple[bytes, ...]
    read: Reader
    needs: Needs | None = None
    matches_head: Callable[[bytes], bool] | None = None

    def fits(self, head: bytes) -> bool:
        """Return True if a file with this beginning may have this format; False for text."""
        return head.startswith(self.signatures) or (
            self.matches_head is not None and self.matches_head(head)
        )


def apply_listed_names(table: Table) -> Table:
    """Return the table with the names in its metadata for the columns after the time.

    Further columns are not data, but can be requested.
    """
    listed = table.meta.names
    if table.names is None or listed is None or not _begins_with(table.names[1:], listed):
        return table
    end = 1 + len(listed)
    names = (table.names[0], *listed, *table.names[end:])
    return replace(table, names=names, time=0, data=tuple(range(1, end)))


def _begins_with(columns: Sequence[str], listed: Sequence[str]) -> bool:
    if len(listed) >= len(columns):
        return len(listed) == len(columns)
    # A shorter list in a foreign file may describe something else.
    return all(column.startswith(name) for column, name in zip(columns, listed, strict=False))


def to_numbers(column: Column, label: str) -> Column:
    """Return a one-dimensional column of numbers, with NaN for missing values.

    Missing values are NaN, masked values, None, or NA of pandas. Nulls of Arrow and polars are
    already NaN.

    Raises
    ------
    LogError
        If the column contains anything but real numbers.
    """
    column = without_masks(column)
    if column.dtype.kind not in "fiub":
        raise LogError(f"column '{label}' holds {column.dtype}, expected real numbers")
    if column.dtype.kind == "f" and column.dtype.itemsize > 8:
        return column.astype(np.float64)
    return column
