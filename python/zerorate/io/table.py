"""What every reader returns: named columns, loaded when asked for, and the file's metadata."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
import numpy.typing as npt

from zerorate.io.errors import LogError

Column = npt.NDArray[Any]


@dataclass(frozen=True)
class Metadata:
    """What a file says about itself, each field None where it says nothing."""

    rate: float | None = None
    unit: str | None = None
    sensor: str | None = None
    names: tuple[str, ...] | None = None


@dataclass(frozen=True)
class Table:
    """Columns of a file, not yet loaded.

    ``names`` is None for a table without names, ``time`` the index of the time column where
    the format says it, ``data`` the data columns where the file lists them, ``lengths`` the
    number of values of each column where they may differ. ``pieces`` gives the columns at some
    indices in pieces of so many rows at most, and ``rows`` says how many they are together, where
    a format can be read so.
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

    def label(self, index: int) -> str:
        """Return the column's name, or one made from its index."""
        return self.names[index] if self.names is not None else f"column_{index}"

    def loaded(self) -> Table:
        """Return the table with all columns in memory."""
        columns = self.load(range(self.width))
        return replace(self, load=lambda wanted: [columns[i] for i in wanted])


def listed_names(table: Table) -> Table:
    """Return the table with the names its metadata lists for the columns after the time.

    Columns after those are no data, but can be asked for.
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


def as_numbers(column: Column, label: str) -> Column:
    """Return a one-dimensional column of numbers as it is; LogError for anything else."""
    if column.dtype.kind not in "fiub":
        raise LogError(f"column '{label}' holds {column.dtype}, expected real numbers")
    if column.dtype.kind == "f" and column.dtype.itemsize > 8:
        return column.astype(np.float64)
    return column
