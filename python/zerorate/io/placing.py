"""Rows of a file to their places on the grid, block by block."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from zerorate.io.errors import LogError
from zerorate.io.table import Column

__all__ = ["Places", "placed"]

Floats = npt.NDArray[np.float64]
Counts = npt.NDArray[np.int64]


@dataclass(frozen=True)
class Places:
    """Where rows stand on a grid of some length: runs without gaps, each by its first row.

    A grid without gaps is one run, however long.
    """

    rows: int
    length: int
    first: Counts
    place: Counts

    @classmethod
    def of(cls, place: Counts | None, length: int) -> Places:
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
    pieces: Iterator[list[Column]], places: Places, rows: int, channels: int
) -> Iterator[Floats]:
    """Yield arrays (k, rows) of the grid, the last one shorter, with NaN in its gaps."""
    source = _Rows(pieces)
    for low in range(0, places.length, rows):
        high = min(places.length, low + rows)
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

    def _next(self) -> None:
        try:
            self._piece, self._at = next(self._pieces), 0
        except StopIteration:
            raise LogError("there are fewer rows than the file says: it is damaged") from None
