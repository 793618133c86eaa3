"""Uniform grids that the rows of a log stand on."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from zerorate.record.clock import RATE_TOLERANCE, ClockReport
from zerorate.record.log import LogError
from zerorate.types import Floats, Integers


@dataclass(frozen=True)
class Grid:
    """A uniform clock, and the indices of a log's rows on it.

    Parameters
    ----------
    rate, length
        Samples per second, Hz, and how many there are.
    report
        Report on the timestamps.
    gapped_indices
        Place of each row that is used, None where they leave no gaps.
    used_rows
        The rows that are used, None for all.
    offset
        Time of the first place since the first stamp, s.
    stamp_times
        Time of each row that is used since the first place, s, where the clock wanders so that
        its stamps are kept; else None.
    """

    rate: float
    length: int
    report: ClockReport
    gapped_indices: Integers | None = None
    used_rows: Integers | None = None
    offset: float = 0.0
    stamp_times: Floats | None = None

    @property
    def indices(self) -> Integers:
        """Place of each row that is used, shape (n,)."""
        return self.first_indices(self.length)

    def first_indices(self, count: int) -> Integers:
        """Return the places of so many rows at the beginning, or of all if there are fewer."""
        if self.gapped_indices is None:
            return np.arange(min(count, self.length))
        return self.gapped_indices[:count]

    def times(self, part: range) -> Floats | None:
        """Return the times of some places since the first, between rows where they are gaps.

        None stands for an even clock.
        """
        if self.stamp_times is None or self.gapped_indices is None:
            return None if self.stamp_times is None else self.stamp_times[part.start : part.stop]
        return np.asarray(
            np.interp(np.arange(part.start, part.stop), self.gapped_indices, self.stamp_times)
        )

    def agrees_with(self, rate: float) -> bool:
        """Return True if a rate that somebody has stated is that of the stamps."""
        return abs(self.report.rate / rate - 1) <= RATE_TOLERANCE

    def at_rate(self, rate: float | None) -> Grid:
        """Return the grid at the rate stated, if there is one; LogError if the stamps differ."""
        if rate is None:
            return self
        if not self.agrees_with(rate):
            raise LogError(
                f"the rate is stated as {rate:g} Hz, but the timestamps run at "
                f"{self.report.rate:g} Hz"
            )
        return replace(self, rate=rate)


def make_unstamped_grid(n: int, rate: float) -> Grid:
    """Return the grid of n rows without timestamps."""
    return Grid(rate, n, ClockReport(rate, stamped=False))
