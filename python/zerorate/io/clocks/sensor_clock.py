"""Clock of a sensor: the clock of its table's rows, or its own if it is slower."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from zerorate.io.clocks.clock import fit_own_grid
from zerorate.io.clocks.coarse import spread
from zerorate.io.clocks.grid import Grid, make_unstamped_grid
from zerorate.io.clocks.repeats import (
    HEAD_ROWS,
    find_repeats,
    find_rows_per_sample,
    make_sensor_grid,
    sent_again,
)
from zerorate.io.clocks.stamps import Stamps
from zerorate.record.log import LogError, check_rate
from zerorate.types import Booleans, Floats, Integers


@dataclass(frozen=True)
class Clock:
    """Grid of some rows, with the start time and the assumptions.

    Parameters
    ----------
    grid, start
        Grid of the rows, and time of its first index, s.
    stamps
        Timestamps; None without timestamps.
    rate
        Stated rate, Hz; None without one.
    notes
        Sentences on assumptions.
    """

    grid: Grid
    start: float
    stamps: Stamps | None
    rate: float | None
    notes: tuple[str, ...] = ()

    def for_sensor(self, head: Floats, load_repeats: Callable[[], Booleans] | None = None) -> Clock:
        """Return the clock of the sensor with values in these rows, at the stated rate.

        If rows repeat because the sensor is slower, the sensor gets its own clock. It does not if
        the timestamps confirm the stated rate for all rows.

        Parameters
        ----------
        head
            Values, shape (n, k), or their first `HEAD_ROWS` rows.
        load_repeats
            Function that returns the mask of repeated rows, if `head` is not all values.

        Raises
        ------
        LogError
            If the timestamps contradict the stated rate.
        """
        rows_per_sample = find_rows_per_sample(head[:HEAD_ROWS], self.grid.first_indices(HEAD_ROWS))
        if rows_per_sample is None:
            return self._without_sent_again(head, load_repeats)
        sensor_grid = make_sensor_grid(
            self.grid,
            find_repeats(head) if load_repeats is None else load_repeats(),
            rows_per_sample,
        )
        stamped, rows = self.grid.report.stamped, self.grid.rate
        repeat_part = sensor_grid.report.repeat_count / (
            sensor_grid.report.repeat_count + len(sensor_grid.indices)
        )
        note = (
            f"{repeat_part:.0%} of the rows repeat the one before, as of a sensor of "
            f"{sensor_grid.rate:.6g} Hz in "
            f"a log of {rows:.6g} Hz"
        )
        if stamped and self.rate is not None and self.grid.agrees_with(self.rate):
            return self._apply_rate(f"{note}; they are kept, for that is the rate stated")
        rate = self.rate if stamped else None
        return replace(self, grid=sensor_grid, rate=rate)._apply_rate(
            f"{note}; each sample is taken once"
        )

    def _without_sent_again(self, head: Floats, again: Callable[[], Booleans] | None) -> Clock:
        """Return the clock without repeated rows that are no samples."""
        kept = self.rate is not None and self.grid.agrees_with(self.rate)
        if self.stamps is None or kept or self.grid.report.burst_count:
            return self._apply_rate()
        seconds = self.stamps.seconds
        first = head[:HEAD_ROWS]
        if not sent_again(first, find_repeats(first), seconds[: len(first)]):
            return self._apply_rate()
        rows = np.flatnonzero(~(find_repeats(head) if again is None else again()))
        part = 1.0 - len(rows) / len(seconds)
        clock = self.for_rows(rows)
        report = replace(clock.grid.report, repeat_count=len(seconds) - len(rows))
        grid = replace(clock.grid, used_rows=rows, report=report)
        said = f"{part:.0%} of the rows repeat the one before, with no clock of their own; left out"
        return replace(self, grid=grid, start=clock.start)._apply_rate(said)

    def for_rows(self, rows: Integers) -> Clock:
        """Return the clock of some rows; LogError if they form no clock."""
        if self.stamps is None:
            seconds, start = rows / check_rate(self.rate), 0.0
        else:
            seconds, start = self.stamps.seconds[rows], self.stamps.start
        start += float(seconds[0])
        grid = fit_own_grid(seconds - seconds[0], start)
        # A stated rate that fits all rows does not apply to some of them.
        rate = None if self.rate is None or self.grid.agrees_with(self.rate) else self.rate
        return Clock(grid, start + grid.offset, None, rate, self.notes)

    def _apply_rate(self, *notes: str) -> Clock:
        try:
            return replace(self, grid=self.grid.at_rate(self.rate), notes=(*self.notes, *notes))
        except LogError as error:
            note = self.stamps and self.stamps.note
            raise error.with_context("", f" ({note})" if note else "") from None


def make_clock(stamps: Stamps | None, rate: float | None, rows: int) -> Clock:
    """Return the clock from the timestamps, or from the stated rate."""
    if stamps is None:
        return Clock(make_unstamped_grid(rows, check_rate(rate)), 0.0, None, rate)
    notes = (stamps.note,) if stamps.note else ()
    if (finer := spread(stamps.seconds)) is not None:
        stamps, notes = replace(stamps, seconds=finer[0] - finer[0][0]), (*notes, finer[1])
    try:
        grid = fit_own_grid(stamps.seconds, stamps.start, rate)
    except LogError as error:
        raise error.with_context("", f" ({stamps.note})" if stamps.note else "") from None
    return Clock(grid, stamps.start + grid.offset, stamps, rate, notes)
