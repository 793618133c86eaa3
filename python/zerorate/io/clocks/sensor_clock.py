"""The clock of a sensor: that of the rows of its table, or one of its own if it is slower."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

from zerorate.io.clocks.clock import fitted_grid
from zerorate.io.clocks.grid import Grid, unstamped
from zerorate.io.clocks.repeats import HEAD, repeated, rows_held, slower
from zerorate.io.clocks.stamps import Stamps
from zerorate.record.log import LogError, checked_rate
from zerorate.types import Booleans, Floats, Integers


@dataclass(frozen=True)
class Clock:
    """The grid of some rows, the time of its first place, s, and what is known of both.

    Parameters
    ----------
    grid, start
        Grid of the rows, and the time of its first place, s.
    stamps
        The timestamps, None without them.
    rate
        The rate stated, Hz, None without it.
    notes
        What was assumed.
    """

    grid: Grid
    start: float
    stamps: Stamps | None
    rate: float | None
    notes: tuple[str, ...] = ()

    def of_sensor(self, head: Floats, again: Callable[[], Booleans] | None = None) -> Clock:
        """Return the clock of the sensor whose values stand in the rows, at the rate stated.

        Where the rows repeat because the sensor is slower, it is the sensor's own, unless a rate
        is stated that the timestamps confirm for the rows themselves.

        Parameters
        ----------
        head
            The values, shape (n, k), or the first `HEAD` rows of them.
        again
            Gives which rows repeat the one before, where these are not all values.

        Raises
        ------
        LogError
            If the timestamps contradict the rate stated.
        """
        held = rows_held(head[:HEAD], self.grid.places(HEAD))
        if held is None:
            return self._settled()
        own = slower(self.grid, repeated(head) if again is None else again(), held)
        stamped, rows = self.grid.report.stamped, self.grid.rate
        part = own.report.repeat_count / (own.report.repeat_count + len(own.place))
        said = (
            f"{part:.0%} of the rows repeat the one before, as of a sensor of {own.rate:.6g} Hz in "
            f"a log of {rows:.6g} Hz"
        )
        if stamped and self.rate is not None and self.grid.agrees(self.rate):
            return self._settled(f"{said}; they are kept, for that is the rate stated")
        rate = self.rate if stamped else None
        return replace(self, grid=own, rate=rate)._settled(f"{said}; each sample is taken once")

    def among(self, rows: Integers) -> Clock:
        """Return the clock of some of the rows; LogError if they have none."""
        if self.stamps is None:
            seconds, start = rows / checked_rate(self.rate), 0.0
        else:
            seconds, start = self.stamps.seconds[rows], self.stamps.start
        start += float(seconds[0])
        grid = fitted_grid(seconds - seconds[0], start)
        # A rate that is that of all rows says nothing of some of them.
        rate = None if self.rate is None or self.grid.agrees(self.rate) else self.rate
        return Clock(grid, start + grid.offset, None, rate, self.notes)

    def _settled(self, *said: str) -> Clock:
        try:
            return replace(self, grid=self.grid.at(self.rate), notes=(*self.notes, *said))
        except LogError as error:
            assumed = self.stamps and self.stamps.note
            raise error.around("", f" ({assumed})" if assumed else "") from None


def clock_of(stamps: Stamps | None, rate: float | None, rows: int) -> Clock:
    """Return the clock that timestamps tell, or the rate stated."""
    if stamps is None:
        return Clock(unstamped(rows, checked_rate(rate)), 0.0, None, rate)
    try:
        grid = fitted_grid(stamps.seconds, stamps.start, rate)
    except LogError as error:
        raise error.around("", f" ({stamps.note})" if stamps.note else "") from None
    notes = (stamps.note,) if stamps.note else ()
    return Clock(grid, stamps.start + grid.offset, stamps, rate, notes)
