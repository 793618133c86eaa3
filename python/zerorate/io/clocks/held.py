"""Repeated rows in a live stream, recognised with the tests for a log.

A log omits repeated rows for one of two reasons: its sensor is slower
(`zerorate.io.clocks.repeats`), or rows were sent twice. It keeps them if the stamps confirm the
stated rate for all rows. A stream makes the same tests when it has enough rows.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import Any, Final, Self

import numpy as np

from zerorate.io.clocks.clock import fit_own_grid
from zerorate.io.clocks.gaps import WINDOW_ROWS
from zerorate.io.clocks.repeats import (
    HEAD_ROWS,
    MIN_CHANGES,
    MIN_ROWS_PER_SAMPLE,
    find_repeats,
    find_rows_per_sample,
    make_sensor_grid,
    sent_again,
    stamped_again,
)
from zerorate.record.clock import count_noun
from zerorate.record.log import LogError

_FIRST_CHECK_ROWS: Final = 64
"""Number of rows after which most streams are known to have no repeated rows."""
_MIN_STEP_PERIODS: Final = 0.97
"""Smallest step between rows, in stated periods, at which rows are not too many."""
_PHASE_GAIN: Final = 1.0 / 64.0
"""Gain with which the phase of the sensor follows each change."""
_SHIFT_MARGIN_SAMPLES: Final = 0.15
"""Margin beyond half a row, in samples, from which on a late change shows lost rows."""
_MAX_SHIFT_SAMPLES: Final = 0.49


class HeldRows:
    """Finder of a stream's repeated rows, which are no samples and are left out.

    A repeated row comes from a slower sensor, or was sent twice. All rows are kept until there is
    evidence; in most streams the first 64 rows show that none are repeated. If a slower sensor's
    sample equals the sample before, it is returned late, or with the next change.

    Parameters
    ----------
    rate : float
        Stated rate, Hz.

    Attributes
    ----------
    period : float or None
        Number of rows per sample of a slower sensor; None if not known.
    again : bool
        True if rows are known to be sent twice.
    possible : bool
        True if repeated rows are still possible.
    left_out_count : int
        Number of rows left out.

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
        self.again = False
        self.left_out_count = 0
        self._rows_rate = 0.0
        self._last: list[float] = []
        self._changes, self._due = 0, MIN_CHANGES
        # Undecided: all rows. Later: the rows since the last sample.
        self._kept: list[list[Any]] = []
        self._values: list[list[float]] = []
        # Rows and samples since the first, and the mean delay of changes in samples.
        self._place, self._tick, self._phase = 0, 0, 0.0

    @property
    def known(self) -> bool:
        """True if it is known which rows are no samples."""
        return self.again or self.period is not None

    def look(self, row: Any, stamp: float | None, values: list[float]) -> list[Any] | None:  # noqa: ANN401
        """Keep a row; return the rows (row, stamp) that are samples once there is evidence."""
        self._changes += not self._is_repeat(values)
        self._kept.append([row, stamp])
        self._values.append(values)
        rows = len(self._kept)
        is_check = rows >= _FIRST_CHECK_ROWS and not rows & (rows - 1)
        if is_check:
            self.possible = (
                rows >= 0.5 * (1.0 + MIN_ROWS_PER_SAMPLE) * self._changes and self._is_too_fast()
            )
        samples = self._select_samples(False) if self.possible and is_check else None
        is_due = self._changes >= self._due or rows >= HEAD_ROWS
        if samples is None and self.possible and is_due:
            samples, self._due = self._select_samples(True), 2 * self._due
            self.possible = samples is not None or rows < HEAD_ROWS
        if samples is not None or not self.possible:
            self._kept, self._values = [], []
        return samples

    def take(self, row: Any, stamp: float | None, values: list[float]) -> list[Any]:  # noqa: ANN401
        """Return the rows (row, stamp) that are samples, with kept rows; call it once `known`."""
        is_repeat = self._is_repeat(values)
        if self.again:
            self.left_out_count += is_repeat
            return [] if is_repeat else [[row, stamp]]
        self._place += 1
        self._kept.append([row, stamp])
        assert self.period is not None
        if is_repeat and len(self._kept) < WINDOW_ROWS * self.period:
            return []
        return self._take_samples(is_repeat)

    def sentences(self) -> Iterator[str]:
        """Yield a sentence with the number of rows left out."""
        if self.again:
            yield (
                f"clock: {count_noun(self.left_out_count, 'row')} left out that repeat the one "
                "before, with no clock of their own"
            )
        elif self.period is not None:
            rows, count = self._rows_rate, self.left_out_count + len(self._kept)
            yield (
                f"clock: {count_noun(count, 'row')} left out that repeat the one "
                f"before, as of a sensor of {rows / self.period:.6g} Hz in rows of {rows:.6g} Hz"
            )

    def state(self) -> dict[str, Any]:
        """Return the state for JSON."""
        return dict(vars(self))

    @classmethod
    def of_state(cls, rate: float, state: Mapping[str, Any]) -> Self:
        """Return the object of a saved `state`; ValueError if it is of another stream."""
        held_rows = cls(rate)
        if vars(held_rows).keys() != state.keys() or state["rate"] != rate:
            raise ValueError("the state is that of another stream")
        vars(held_rows).update(state)
        return held_rows

    def _is_repeat(self, values: list[float]) -> bool:
        last, self._last = self._last, values
        if values == last:
            return True
        same = all(a == b or (a != a and b != b) for a, b in zip(values, last, strict=False))
        return bool(last) and same and any(a == a for a in values)

    def _is_too_fast(self) -> bool:
        """Return True if rows arrive faster than the stated rate, in single steps or on average."""
        stamps = [stamp for _, stamp in self._kept]
        if any(stamp is None for stamp in stamps):
            return False
        steps = np.diff(stamps)
        step = min(float(np.median(steps)), float(np.mean(steps)))
        return step * self.rate < _MIN_STEP_PERIODS

    def _select_samples(self, is_due: bool) -> list[Any] | None:
        """Return the rows that are samples, from the tests for a log; None without evidence.

        If `is_due` is False, only repeated rows with repeated stamps count.
        """
        if not self._is_too_fast():
            return None
        stamps = np.array([stamp for _, stamp in self._kept])
        values = np.array(self._values)
        repeats = find_repeats(values)
        if not is_due and not stamped_again(repeats, stamps):
            return None
        try:
            grid = fit_own_grid(stamps - stamps[0], 0.0, self.rate)
        except LogError:
            return None
        if grid.agrees_with(self.rate):
            return None
        rows_per_sample = find_rows_per_sample(values, grid.first_indices(HEAD_ROWS))
        if rows_per_sample is None:
            self.again = not grid.report.burst_count and sent_again(values, repeats, stamps)
            self.left_out_count = int(repeats.sum()) if self.again else 0
            used = np.flatnonzero(~repeats).tolist()
            return [self._kept[i] for i in used] if self.again else None
        sensor_grid = make_sensor_grid(grid, repeats, rows_per_sample)
        assert sensor_grid.used_rows is not None
        used_rows = sensor_grid.used_rows.tolist()
        self._begin(used_rows, grid.rate, grid.rate / sensor_grid.rate)
        return [self._kept[i] for i in used_rows]

    def _begin(self, used: Sequence[int], rows_rate: float, period: float) -> None:
        """Continue after the last sample, which is the last row to date."""
        self._rows_rate, self.period = rows_rate, period
        self.left_out_count = len(self._values) - len(used)
        last = np.array(used[-int(1 / _PHASE_GAIN) :]) - used[-1]
        late = last / period
        self._phase = float(np.mean(late - np.rint(late)))
        self._place = self._tick = 0

    def _take_samples(self, is_repeat: bool) -> list[Any]:
        """Return the sample rows up to the last row; `is_repeat`: the last row is no change."""
        assert self.period is not None
        late, begin = self._place / self.period - self._phase, self._place - len(self._kept)
        tick = math.floor(late) if is_repeat else max(self._tick + 1, math.ceil(late - 0.5))
        ticks = range(self._tick + 1, tick)
        positions = [round((number + self._phase) * self.period) for number in ticks]
        self._tick = max(self._tick, tick - 1) if is_repeat else tick
        if not is_repeat:
            positions.append(self._place)
            self._follow(late - round(late))
        rows = [self._kept[place - begin - 1] for place in positions if place > begin]
        if positions:
            before, self._kept = self._kept, self._kept[max(0, positions[-1] - begin) :]
            self.left_out_count += len(before) - len(self._kept) - len(rows)
        return rows

    def _follow(self, late: float) -> None:
        """Follow the phase of the sensor; a shift by lost rows is corrected at once."""
        assert self.period is not None
        max_shift = min(_MAX_SHIFT_SAMPLES, 0.5 / self.period + _SHIFT_MARGIN_SAMPLES)
        self._phase += late if abs(late) > max_shift else _PHASE_GAIN * late
