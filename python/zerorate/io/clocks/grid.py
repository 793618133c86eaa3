"""Uniform time grids for the rows of a log."""

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
        Samples per second, Hz, and number of samples.
    report
        Report on the timestamps.
    gapped_indices
        Grid index of each used row; None without gaps.
    used_rows
        Rows that are used; None for all.
    offset
        Time of the first index after the first stamp, s.
    stamp_times
        Time of each used row after the first index, s, if a wandering clock keeps its stamps; else
        None.
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
        """Grid index of each used row, shape (n,)."""
        return self.first_indices(self.length)

    def first_indices(self, count: int) -> Integers:
        """Return the indices of the first `count` used rows, or of all if there are fewer."""
        if self.gapped_indices is None:
            return np.arange(min(count, self.length))
        return self.gapped_indices[:count]

    def times(self, part: range) -> Floats | None:
        """Return the times of grid indices after the first; in gaps, interpolated between rows.

        Return None for a regular clock.
        """
        if self.stamp_times is None or self.gapped_indices is None:
            return None if self.stamp_times is None else self.stamp_times[part.start : part.stop]
        return np.asarray(
            np.interp(np.arange(part.start, part.stop), self.gapped_indices, self.stamp_times)
        )

    def agrees_with(self, rate: float) -> bool:
        """Return True if a stated rate agrees with the stamps."""
        return abs(self.report.rate / rate - 1) <= RATE_TOLERANCE

    def at_rate(self, rate: float | None) -> Grid:
        """Return the grid at the stated rate, if any; LogError if the stamps disagree."""
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
