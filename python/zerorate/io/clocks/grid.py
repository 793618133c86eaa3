"""Uniform grids that the rows of a log stand on."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from zerorate.record.clock import ALIKE, ClockReport
from zerorate.record.log import LogError
from zerorate.types import Floats, Integers


@dataclass(frozen=True)
class Grid:
    """A uniform clock, and where the rows of a log stand on it.

    Parameters
    ----------
    rate, length
        Samples per second, Hz, and how many there are.
    report
        What the timestamps told.
    spread
        Place of each row that is used, None where they leave no gaps.
    used
        The rows that are used, None for all.
    offset
        Time of the first place since the first stamp, s.
    kept
        Time of each row that is used since the first place, s, where the clock wanders so that
        its stamps are kept; else None.
    """

    rate: float
    length: int
    report: ClockReport
    spread: Integers | None = None
    used: Integers | None = None
    offset: float = 0.0
    kept: Floats | None = None

    @property
    def place(self) -> Integers:
        """Place of each row that is used, shape (n,)."""
        return self.places(self.length)

    def places(self, count: int) -> Integers:
        """Return the places of so many rows at the beginning, or of all if there are fewer."""
        if self.spread is None:
            return np.arange(min(count, self.length))
        return self.spread[:count]

    def times(self, part: range) -> Floats | None:
        """Return the times of some places since the first, between rows where they are gaps.

        None stands for an even clock.
        """
        if self.kept is None or self.spread is None:
            return None if self.kept is None else self.kept[part.start : part.stop]
        return np.asarray(np.interp(np.arange(part.start, part.stop), self.spread, self.kept))

    def agrees(self, rate: float) -> bool:
        """Whether a rate that somebody has stated is that of the stamps."""
        return abs(self.report.rate / rate - 1) <= ALIKE

    def at(self, rate: float | None) -> Grid:
        """Return the grid at the rate stated, if there is one; LogError if the stamps differ."""
        if rate is None:
            return self
        if not self.agrees(rate):
            raise LogError(
                f"the rate is stated as {rate:g} Hz, but the timestamps run at "
                f"{self.report.rate:g} Hz"
            )
        return replace(self, rate=rate)


def unstamped(n: int, rate: float) -> Grid:
    """Return the grid of n rows without timestamps."""
    return Grid(rate, n, ClockReport(rate, stamped=False))
