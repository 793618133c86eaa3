"""The contract of readers: named columns, loaded on request, and the file's metadata on them.

A reader is a function that takes a path and returns the `Content` of the file there; a `Format`
says which files it reads. `zerorate.io.formats` lists them all.
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
    """Metadata of a file, each field None where the file has none.

    ``axes`` says where x, y and z of its sensors point, in words, ``calibration`` what the logger
    took its sensors to be off by, by its own names.
    """

    rate: float | None = None
    unit: str | None = None
    sensor: str | None = None
    axes: str | None = None
    names: tuple[str, ...] | None = None
    notes: tuple[str, ...] = ()
    calibration: Mapping[str, float] | None = None

    def __post_init__(self) -> None:
        """Refuse what is no text; the rate is looked at where it is needed."""
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
    """Columns of a file, not yet loaded.

    ``names`` is None for a table without names, ``time`` the index of the time column where
    the format says it, ``data`` the data columns where the file lists them, ``lengths`` the
    number of values of each column where they may differ. ``pieces`` gives the columns at some
    indices in pieces of so many rows at most, and ``rows`` says how many they are together, where
    a format can be read so. ``labels`` gives a column of texts, where ``load`` has none.
    ``time_unit`` is that of the time column if a caller gives it, and ``timeless`` is True if he
    wants none to be used. ``whole`` gives the table without torn lines.
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
        """Return the column's name, or one made from its index."""
        return self.names[index] if self.names is not None else f"column_{index}"

    def noted(self, *notes: str) -> Table:
        """Return the table with further notes."""
        if not notes:
            return self
        whole = self.whole
        rest = None if whole is None else lambda: whole().noted(*notes)
        return replace(self, meta=replace(self.meta, notes=(*self.meta.notes, *notes)), whole=rest)

    def in_memory(self, wanted: Iterable[int]) -> Table:
        """Return the table with some columns in memory, unless one of them cannot be loaded."""
        places = tuple(dict.fromkeys(wanted))
        try:
            columns = dict(zip(places, self.load(places), strict=True))
        except LogError:
            return self  # what is wrong is said of columns that are used

        def load(requested: Sequence[int]) -> list[Column]:
            is_there = all(i in columns for i in requested)
            return [columns[i] for i in requested] if is_there else self.load(requested)

        return replace(self, load=load)


@dataclass(frozen=True)
class Content:
    """The tables of a file by their topic, and the topic that a request means.

    A format without topics has one table, under the empty name. ``sensors`` are the topics of a
    recording, None for all of them.
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
    """A function that reads the contents of files of one format, as little as possible."""

    def __call__(self, path: Path, /) -> Content:
        """Return the content of a file; LogError if it is damaged or something else."""


class Needs(NamedTuple):
    """A package without which a format cannot be read, and the extra that installs it."""

    package: str
    extra: str


@dataclass(frozen=True)
class Format:
    """A format of files.

    ``description`` is its name in a sentence, ``signatures`` are the beginnings a file of it may
    have, none for text; ``matches_head`` returns True for other beginnings of this format.
    """

    kind: str
    description: str
    suffixes: tuple[str, ...]
    signatures: tuple[bytes, ...]
    read: Reader
    needs: Needs | None = None
    matches_head: Callable[[bytes], bool] | None = None

    def fits(self, head: bytes) -> bool:
        """Return True if a file of this format may begin so; False for text."""
        return head.startswith(self.signatures) or (
            self.matches_head is not None and self.matches_head(head)
        )


def apply_listed_names(table: Table) -> Table:
    """Return the table with the names its metadata lists for the columns after the time.

    Columns after those are no data, but can be requested.
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
    # A foreign list of fewer names may speak of anything.
    return all(column.startswith(name) for column, name in zip(columns, listed, strict=False))


def to_numbers(column: Column, label: str) -> Column:
    """Return a one-dimensional column of numbers as it is, NaN where a value is missing.

    What is missing is NaN, masked, None, or the NA of pandas; nulls of Arrow and polars are NaN
    already, for so their own conversion has it.

    Raises
    ------
    LogError
        If the column holds anything but real numbers.
    """
    column = without_masks(column)
    if column.dtype.kind not in "fiub":
        raise LogError(f"column '{label}' holds {column.dtype}, expected real numbers")
    if column.dtype.kind == "f" and column.dtype.itemsize > 8:
        return column.astype(np.float64)
    return column
