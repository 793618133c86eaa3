"""Rows that repeat the one before, in a live stream: the evidence of a log, and the samples left.

A log leaves such rows out where its sensor is slower for certain (`zerorate.io.clocks.repeats`),
and its stamps do not confirm the rate stated for the rows themselves. A stream asks the same once
as many rows have come as that takes.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import Any, Final, Self

import numpy as np

from zerorate.io.clocks.clock import fitted_grid
from zerorate.io.clocks.gaps import WINDOW
from zerorate.io.clocks.repeats import FEWEST_CHANGES, HEAD, LEAST, repeated, rows_held, slower
from zerorate.record.clock import counted
from zerorate.record.log import LogError

_FIRST: Final = 64
"""Rows after which a stream whose rows do not repeat, or come at the rate stated, is known."""
_AT_RATE: Final = 0.97
"""Periods of the rate stated from one row to the next from which on rows are not too many."""
_GAIN: Final = 1.0 / 64.0
"""Part by which the phase of the sensor follows each of its changes."""
_SHIFTED: Final = 0.15
"""Samples beyond half a row by which a change is off where the log has lost rows."""
_MOST_SHIFTED: Final = 0.49


class HeldRows:
    """Finds the rows of a stream that hold a sample of a slower sensor, and leaves them out.

    All rows are kept until there is evidence: most streams disprove it with the first 64 rows. A
    sensor's sample that happens to equal the one before is given with the next change, or late.

    Parameters
    ----------
    rate : float
        Rate stated, Hz.

    Attributes
    ----------
    period : float or None
        Rows that hold a sample; None until they are known to.
    possible : bool
        Whether rows may hold samples of a slower sensor.
    left_out_count : int
        Rows left out.

    Examples
    --------
    >>> from zerorate.io.clocks.held import HeldRows
    >>> held = HeldRows(rate=50.0)
    >>> rows = [[float(k * k % 100_003)] for k in range(1024) for _ in range(2)]
    >>> found = [held.look(row, 0.01 * i, row) for i, row in enumerate(rows[:2047])]
    >>> len(found[-1]), held.period, held.take(rows[2047], 20.47, rows[2047])
    (1024, 2.0, [])
    """

    def __init__(self, rate: float) -> None:
        self.rate, self.possible = rate, True
        self.period: float | None = None
        self.left_out_count = 0
        self._rows_rate = 0.0
        self._last: list[float] = []
        self._changes, self._due = 0, FEWEST_CHANGES
        # Until it is known: all rows. Then: those since the last sample, one place each.
        self._kept: list[list[Any]] = []
        self._values: list[list[float]] = []
        # Rows and samples since the first, and by how many samples changes are late on average.
        self._place, self._tick, self._phase = 0, 0, 0.0

    def look(self, row: Any, stamp: float | None, values: list[float]) -> list[Any] | None:  # noqa: ANN401
        """Keep a row; once there is evidence return the rows (row, stamp) that are samples."""
        self._changes += not self._again(values)
        self._kept.append([row, stamp])
        self._values.append(values)
        rows = len(self._kept)
        if rows >= _FIRST and not rows & (rows - 1):
            self.possible = rows >= 0.5 * (1.0 + LEAST) * self._changes and self._too_many()
        found = None
        if self.possible and (self._changes >= self._due or rows >= HEAD):
            found, self._due = self._judged(), 2 * self._due
            self.possible = found is not None or rows < HEAD
        if found is not None or not self.possible:
            self._kept, self._values = [], []
        return found

    def take(self, row: Any, stamp: float | None, values: list[float]) -> list[Any]:  # noqa: ANN401
        """Return the rows (row, stamp) that are samples, those kept among them, once known."""
        again = self._again(values)
        self._place += 1
        self._kept.append([row, stamp])
        assert self.period is not None
        if again and len(self._kept) < WINDOW * self.period:
            return []
        return self._samples(again)

    def sentences(self) -> Iterator[str]:
        """Yield how many rows were left out."""
        if self.period is not None:
            rows, count = self._rows_rate, self.left_out_count + len(self._kept)
            yield (
                f"clock: {counted(count, 'row')} left out that repeat the one "
                f"before, as of a sensor of {rows / self.period:.6g} Hz in rows of {rows:.6g} Hz"
            )

    def state(self) -> dict[str, Any]:
        """Return all that it knows, as JSON keeps it."""
        return dict(vars(self))

    @classmethod
    def of_state(cls, rate: float, state: Mapping[str, Any]) -> Self:
        """Return what `state` gave; ValueError if it is of another stream."""
        found = cls(rate)
        if vars(found).keys() != state.keys() or state["rate"] != rate:
            raise ValueError("the state is that of another stream")
        vars(found).update(state)
        return found

    def _again(self, values: list[float]) -> bool:
        last, self._last = self._last, values
        if values == last:
            return True
        same = all(a == b or (a != a and b != b) for a, b in zip(values, last, strict=False))
        return bool(last) and same and any(a == a for a in values)

    def _too_many(self) -> bool:
        """Whether rows come faster than at the rate stated."""
        stamps = [stamp for _, stamp in self._kept]
        if any(stamp is None for stamp in stamps):
            return False
        return float(np.median(np.diff(stamps))) * self.rate < _AT_RATE

    def _judged(self) -> list[Any] | None:
        """Return the rows that are samples by the evidence of a log, None if there is none."""
        if not self._too_many():
            return None
        stamps = np.array([stamp for _, stamp in self._kept])
        values = np.array(self._values)
        try:
            grid = fitted_grid(stamps - stamps[0], 0.0, self.rate)
        except LogError:
            return None
        held = rows_held(values, grid.places(HEAD))
        if held is None or grid.agrees(self.rate):
            return None
        own = slower(grid, repeated(values), held)
        assert own.used is not None
        used = own.used.tolist()
        self._begin(used, grid.rate, grid.rate / own.rate)
        return [self._kept[i] for i in used]

    def _begin(self, used: Sequence[int], rows_rate: float, period: float) -> None:
        """Go on after the last row that is a sample, which is the last that came."""
        self._rows_rate, self.period = rows_rate, period
        self.left_out_count = len(self._values) - len(used)
        last = np.array(used[-int(1 / _GAIN) :]) - used[-1]
        late = last / period
        self._phase = float(np.mean(late - np.rint(late)))
        self._place = self._tick = 0

    def _samples(self, again: bool) -> list[Any]:
        """Return the rows of the samples up to the last row, a change unless it is so again."""
        assert self.period is not None
        late, begin = self._place / self.period - self._phase, self._place - len(self._kept)
        tick = math.floor(late) if again else max(self._tick + 1, math.ceil(late - 0.5))
        ticks = range(self._tick + 1, tick)
        places = [round((one + self._phase) * self.period) for one in ticks]
        self._tick = max(self._tick, tick - 1) if again else tick
        if not again:
            places.append(self._place)
            self._follow(late - round(late))
        rows = [self._kept[place - begin - 1] for place in places if place > begin]
        if places:
            gone, self._kept = self._kept, self._kept[max(0, places[-1] - begin) :]
            self.left_out_count += len(gone) - len(self._kept) - len(rows)
        return rows

    def _follow(self, late: float) -> None:
        """Follow the phase of the sensor; rows that were lost shift it at once."""
        assert self.period is not None
        most = min(_MOST_SHIFTED, 0.5 / self.period + _SHIFTED)
        self._phase += late if abs(late) > most else _GAIN * late
