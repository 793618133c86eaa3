"""Clock of a live stream: immediate estimates, and their later revisions.

The clock of a log (`zerorate.io.clocks.clock`) uses all stamps, the clock of a stream only the
stamps to date. Both follow one rule: without a loss, a sample comes one period after the sample
before, even if the stamps are late, coarse or equal. If only later stamps can show a loss, this
clock first decides by its current state. When these stamps have arrived, it calls the functions of
the log's clock. If their result differs, `CausalClock.revised` contains the corrected steps.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from typing import Any, Final, NamedTuple, Self

import numpy as np

from zerorate.io.clocks.clock import MIN_RESTART_S, RESTART_GAP_S, find_setbacks, fit_own_grid
from zerorate.io.clocks.gaps import LONG_STEP_PERIODS, LONG_WINDOW_ROWS, WINDOW_ROWS, count_missing
from zerorate.record.clock import count_noun
from zerorate.record.log import LogError
from zerorate.types import Floats

MAX_GAP_S: Final = 3600.0
"""Longest gap reported as missing samples, s. After an hour, filters forget nothing more."""
_HISTORY_ROWS: Final = LONG_WINDOW_ROWS + WINDOW_ROWS
"""Rows before a step that determine it, and largest number of rows after it."""
_MIN_START_ROWS: Final = 64
_MIN_START_S: Final = 0.25
_MAX_START_ROWS: Final = 2048
"""Largest number of rows in the first fit of the clock."""
_MAX_LEVELS: Final = 32
"""Number of levels used to estimate the period."""
_MIN_LEVELS: Final = 4
_BLOCKS_PER_LEVEL: Final = 8
"""Blocks of equal stamps per level."""
_PERIOD_TOLERANCE: Final = 1e-5
"""Relative difference of periods that count as equal: no gyro's scale is more accurate."""
_MAX_SLEW: Final = 0.02
"""Largest relative change of a step to correct earlier errors of the time."""
_MIN_LONG_BLOCK_ROWS: Final = 4.0
"""Length of blocks, in rows, from which on only the latest stamps of blocks are compared."""
_MAX_STEP_PERIODS: Final = 64
"""Longest step, in periods; longer steps are shortened for the estimate."""


class Step(NamedTuple):
    """Step from one sample to the next.

    Parameters
    ----------
    missing : int
        Number of samples lost in between.
    dt : float or None
        Time per sample, s; None for the period of the stated rate.
    time : float
        Time since the first sample, s.
    """

    missing: int
    dt: float | None
    time: float


_REGULAR_STEP: Final = Step(0, None, math.nan)


class CausalClock:
    """Converts stamps to steps as they arrive.

    - Equal stamps, as from a FIFO, and late stamps become steps of one period.
    - Stamps that stay ahead of the row count show lost samples, counted as missing.
    - Stamps that jump back and stay there show a clock that was set; samples continue. After a jump
      of over a second, the clock restarted, and `RESTART_GAP_S` count as missing.
    - The period follows the stated rate unless the stamps contradict it.

    Parameters
    ----------
    rate : float
        Stated rate, Hz.
    times : bool
        Compute the times of the steps; otherwise they are NaN.

    Attributes
    ----------
    period : float
        Period of the stamps to date, s.
    own : bool
        True if steps use the period of the stamps because it contradicts the stated rate.
    revised : list of Step or None
        After `take`: corrected steps of the undecided samples, including the last; None without a
        correction.

    Examples
    --------
    >>> from zerorate.io.clocks.causal import CausalClock
    >>> clock = CausalClock(100.0)
    >>> [clock.take(stamp).missing for stamp in (0.0, 0.01, 0.02, 0.06, 0.07)]
    [0, 0, 0, 3, 0]
    >>> block = CausalClock(100.0)
    >>> [block.take(stamp).missing for stamp in (0.0, 0.0, 0.0, 0.03, 0.03, 0.03)]
    [0, 0, 0, 0, 0, 0]
    """

    def __init__(self, rate: float, times: bool = True) -> None:
        self._times = times
        self.rate, self.period, self.own = rate, 1.0 / rate, False
        self.revised: list[Step] | None = None
        self.equal_count = self.backward_count = self.restart_count = 0
        self.gap_count = self.missing_count = self.revised_count = 0
        self._begun, self._learning = False, _start_rows(rate)
        self._last = 0.0
        # The line through the stamps: index and time of its last row, and that row's lateness.
        self._place, self._line, self._late = 0, 0.0, 0.0
        # Reported times count from an index and its time, with one sample per dt.
        self._since, self._base = 0, 0.0
        self._dt: float | None = None
        self._offset: float | None = None
        self._lates: list[float] = []
        self._levels: list[list[float]] = []
        self._left = self._rows = LONG_WINDOW_ROWS
        self._short_count, self._block, self._width = 0, 1.0, WINDOW_ROWS
        # Undecided rows, and the state before them.
        self._open: list[list[Any]] = []
        self._mark: list[Any] = []
        self._quiet = 0

    @property
    def times(self) -> bool:
        """True if steps have times."""
        return self._times

    @property
    def undecided(self) -> int:
        """Number of samples with steps that may still be revised, including the last sample."""
        return len(self._open)

    def take(self, stamp: float | None, lost: int = 0) -> Step:
        """Return the step to a sample with this stamp, s since the first stamp; None if unknown.

        ``lost`` is the number of lost samples before it, from sequence numbers.
        """
        self.revised = None
        if not self._begun:
            return self._begin(stamp or 0.0)
        period = self.period
        if stamp is None:
            step = (1 + lost) * period
            self._last += step
        else:
            step = stamp - self._last
            self._last = stamp
        if step < 0.5 * period:
            self._short_count += 1
            self.equal_count += step == 0.0
        if (
            self._open
            or lost
            or not -LONG_STEP_PERIODS * period < step < LONG_STEP_PERIODS * period
        ):
            return self._take_irregular(step, lost)
        self._place += 1
        self._line += period
        self._late += step - period
        self._lates.append(self._late)
        self._left -= 1
        if self._left <= 0:
            self._take_level()
        if self._times:
            return Step(0, self._dt, self._time_at(self._place))
        return _REGULAR_STEP if self._dt is None else Step(0, self._dt, math.nan)

    def sentences(self) -> Iterator[str]:
        """Yield sentences on the corrections, with their counts."""
        off = f"how long the clock was off is not known, {RESTART_GAP_S:g} s are taken as missing"
        lost = f"{count_noun(self.missing_count, 'sample')} taken as missing"
        for count, noun, done in (
            (self.equal_count, "equal stamp", "samples are taken a period apart"),
            (self.gap_count, "gap", lost),
            (self.backward_count, "step back", "the samples go on"),
            (self.restart_count, "new beginning", off),
        ):
            if count:
                yield f"clock: {count_noun(count, noun)}; {done}"
        if self.own:
            yield (
                f"clock: the stamps run at {1.0 / self.period:.6g} Hz, not at the rate stated, "
                f"{self.rate:g} Hz; the stamps count"
            )

    def state(self) -> dict[str, Any]:
        """Return the state for JSON."""
        return {name: value for name, value in vars(self).items() if name != "revised"}

    @classmethod
    def of_state(cls, rate: float, state: Mapping[str, Any]) -> Self:
        """Return the clock with a saved state; ValueError if the state is not valid."""
        clock = cls(rate, state["_times"])
        if clock.state().keys() != state.keys() or state["rate"] != rate:
            raise ValueError("the state is that of another clock")
        vars(clock).update(state)
        return clock

    def _begin(self, stamp: float) -> Step:
        self._begun, self._last = True, stamp
        self._lates.append(0.0)
        self._mark = [0, 0.0, 0.0, 0]
        self._open.append([0.0, 0, 0, 0.0])
        return Step(0, None, 0.0)

    def _time_at(self, index: int) -> float:
        count = index - self._since
        return self._base + (count / self.rate if self._dt is None else count * self._dt)

    def _take_irregular(self, step: float, lost: int) -> Step:
        """Return the step for an irregular stamp, or while rows are undecided."""
        missing, jump = self._estimate_missing(step - lost * self.period)
        doubt = missing > 0 or jump < 0.0 or step < -LONG_STEP_PERIODS * self.period
        if doubt and not self._open:
            self._mark = [self._place, self._line, self._late, len(self._lates)]
        self._quiet = 0 if doubt else self._quiet + 1
        if doubt or self._open:
            self._open.append([step, lost, missing, jump])
        result = self._advance(step, lost, missing, jump)
        if self._open and self._has_evidence():
            self._decide()
            result = self.revised[-1] if self.revised else result
        if self._left <= 0 and not self._open:
            self._take_level()
        return result

    def _estimate_missing(self, step: float) -> tuple[int, float]:
        """Return the missing samples in a step and the jump of the clock, from earlier stamps."""
        period = self.period
        if step < -MIN_RESTART_S:
            missing = round(RESTART_GAP_S / period)
            return missing, step - (1 + missing) * period
        if step <= LONG_STEP_PERIODS * period:
            return 0, 0.0
        late = self._late + step - period
        # A stamp is no gap if earlier stamps were equally late.
        missing = max(0, round((late - max(self._lates[-self._width :])) / period))
        max_missing = self._max_missing
        return (
            (missing, 0.0)
            if missing <= max_missing
            else (max_missing, step - (1 + max_missing) * period)
        )

    @property
    def _max_missing(self) -> int:
        return int(MAX_GAP_S / self.period)

    def _advance(self, step: float, lost: int, missing: int, jump: float) -> Step:
        """Advance the clock by a decided step."""
        count = 1 + lost + missing
        self._place += count
        self._line += count * self.period
        self._late += step - jump - count * self.period
        self._lates.append(self._late)
        self._left -= 1
        self._count(missing, jump, 1)
        return Step(lost + missing, self._dt, self._time_at(self._place))

    def _count(self, missing: int, jump: float, times: int) -> None:
        if jump < -MIN_RESTART_S:
            self.restart_count += times
        elif jump < 0.0:
            self.backward_count += times
        elif missing:
            self.gap_count += times
            self.missing_count += times * missing

    def _has_evidence(self) -> bool:
        """Return True if enough rows have arrived to decide the undecided rows."""
        rows = len(self._open)
        if self._learning:
            return rows >= self._learning
        if self._block > _MIN_LONG_BLOCK_ROWS:
            return rows >= 2.0 * self._block + WINDOW_ROWS
        if self._width > WINDOW_ROWS or rows >= _HISTORY_ROWS:
            return rows >= _HISTORY_ROWS
        return self._quiet >= WINDOW_ROWS and self._is_level()

    def _is_level(self) -> bool:
        """Return True if the last stamps are as regular as the stamps before the doubtful one."""
        before, after = self._lates[: self._mark[3]][-WINDOW_ROWS:], self._lates[-WINDOW_ROWS:]
        usual = max(before) - min(before) if before else 0.0
        return max(after) - min(after) <= usual + 0.5 * self.period

    def _decide(self) -> None:
        """Decide the undecided rows; fill `revised` if reported steps change."""
        decided = self._fit_start() if self._learning else self._decide_gaps()
        self._learning = 0
        rows, self._open = self._open, []
        if decided is None or (self._dt is None and decided == [row[2:] for row in rows]):
            return
        first = not self._mark[3]
        for _, _, missing, jump in rows:
            self._count(missing, jump, -1)
        self._place, self._line, self._late, late_count = self._mark
        del self._lates[late_count:]
        self.revised_count += 1
        self.revised = []
        for (step, lost, *_), (missing, jump) in zip(rows, decided, strict=True):
            if first and not self.revised:
                self._lates.append(0.0)
                self.revised.append(Step(0, self._dt, 0.0))
                continue
            self.revised.append(self._advance(step, lost, missing, jump))

    def _fit_start(self) -> list[list[Any]] | None:
        """Fit the clock of the first rows as for a log; return None if that fails."""
        if any(lost for _, lost, _, _ in self._open):
            return None
        stamps = np.cumsum([step for step, *_ in self._open])
        try:
            grid = fit_own_grid(stamps, 0.0, self.rate)
        except LogError:
            return None
        block_count = int(np.count_nonzero(np.diff(stamps) > 0.5 / grid.rate))
        self._block = len(stamps) / max(1, block_count)
        doubt = 2.0 * grid.report.jitter_max * grid.rate / len(stamps)
        self._set_period(1.0 / float(grid.rate), float(doubt))
        self._since, self._base = 0, 0.0
        self._set_widths(2.0 * grid.report.jitter_max)
        missing = np.diff(grid.indices, prepend=-1) - 1
        return self._add_jumps(
            missing.tolist(), find_setbacks(stamps, np.diff(stamps), self.period)
        )

    def _decide_gaps(self) -> list[list[Any]] | None:
        """Return missing samples and jumps before each undecided row, from the log's functions."""
        if self._block > _MIN_LONG_BLOCK_ROWS:
            return self._decide_by_blocks()
        period, late_count = self.period, self._mark[3]
        before = self._lates[max(0, late_count - _HISTORY_ROWS) : late_count]
        excess = [step - (1 + lost) * period for step, lost, *_ in self._open]
        late = np.concatenate((before, self._mark[2] + np.cumsum(excess)))
        stamps = late + period * np.arange(len(late))
        # Equal stamps are no backward step; rounding would make them one.
        steps = np.diff(stamps)
        steps[np.abs(steps) < _PERIOD_TOLERANCE * period] = 0.0
        back = find_setbacks(stamps, steps, period)
        stamps -= np.cumsum(back)
        stamps, more = _shorten_leaps(stamps, period)
        try:
            missing = np.append(0.0, count_missing(stamps, period))
        except LogError:
            return None
        missing[missing > 0] += more[missing > 0]
        n = len(self._open)
        self._correct_by_levels(missing[-n:], late - np.cumsum(back))
        return self._add_jumps(missing[-n:].astype(int).tolist(), back[-n:])

    def _correct_by_levels(self, missing: Floats, late: Floats) -> None:
        """Correct a single gap by the levels before and after it, if both are regular."""
        gaps = np.flatnonzero(missing)
        if len(gaps) == 1 and self._quiet >= WINDOW_ROWS and self._is_level():
            levels = np.median(late[: -len(missing)][-WINDOW_ROWS:]), np.median(late[-WINDOW_ROWS:])
            missing[gaps] = max(0.0, np.rint((levels[1] - levels[0]) / self.period))

    def _decide_by_blocks(self) -> list[list[Any]]:
        """Return the result of `_decide_gaps` for long blocks, from their latest stamps."""
        if any(jump < 0.0 for *_, jump in self._open):
            return [row[2:] for row in self._open]
        period, late_count = self.period, self._mark[3]
        width = int(2.0 * self._block) + 1
        steps = [step - (1 + lost) * period for step, lost, *_ in self._open]
        after = self._mark[2] + np.cumsum(steps)[-width:]
        shift = float(after.max()) - max(self._lates[max(0, late_count - width) : late_count])
        return [[max(0, round(shift / period)), 0.0]] + [[0, 0.0]] * (len(steps) - 1)

    def _add_jumps(self, missing: list[int], back: Floats) -> list[list[Any]]:
        decided: list[list[Any]] = []
        for count, jump in zip(missing, back.tolist(), strict=True):
            if jump < -MIN_RESTART_S and not self._learning:
                count += round(RESTART_GAP_S / self.period)
            gap = count * self.period if jump < -MIN_RESTART_S else 0.0
            excess = max(0, count - self._max_missing)
            decided.append([count - excess, jump - gap + excess * self.period])
        return decided

    def _take_level(self) -> None:
        """Add a level of the stamps, and update the period."""
        width = max(LONG_WINDOW_ROWS, int(_BLOCKS_PER_LEVEL * self._block))
        ordered = sorted(self._lates[-width:])
        level = self._line + ordered[len(ordered) // 2]
        self._levels.append([self._place, level])
        del self._levels[:-_MAX_LEVELS]
        if self._offset is None:
            self._offset = level - self._time_at(self._place)
        rows = self._rows - self._left
        self._block = rows / max(1, rows - self._short_count)
        self._short_count = 0
        self._set_widths(ordered[-1] - ordered[0])
        del self._lates[: -max(_HISTORY_ROWS, self._left)]
        if len(self._levels) >= _MIN_LEVELS:
            self._follow()

    def _set_widths(self, spread: float) -> None:
        """Set the number of rows to measure the lateness of stamps, and the rows of a level."""
        self._left = self._rows = max(LONG_WINDOW_ROWS, int(_BLOCKS_PER_LEVEL * self._block))
        self._width = WINDOW_ROWS if spread <= 0.5 * self.period else self._left

    def _follow(self) -> None:
        """Estimate the period from the levels."""
        indices, levels = np.array(self._levels).T
        half = len(indices) // 2
        period = float(
            np.median((levels[half:] - levels[:-half]) / (indices[half:] - indices[:-half]))
        )
        bends = np.diff(levels - period * indices, 2)
        if period > 0.0:
            self._set_period(
                period, 4.0 * float(np.abs(bends).max()) / float(levels[-1] - levels[0])
            )

    def _set_period(self, period: float, doubt: float) -> None:
        """Set the period of the stamps, and `own` if it contradicts the stated rate."""
        self.own = bool(abs(period * self.rate - 1.0) > max(doubt, _PERIOD_TOLERANCE))
        period = period if self.own else 1.0 / self.rate
        rows = range(len(self._lates) - 1, -1, -1)
        change = period - self.period
        self._lates = [late + change * i for late, i in zip(self._lates, rows, strict=True)]
        self.period = period
        time = self._time_at(self._place)
        lag = self._level_lag(time)
        dt = None
        if self.own or abs(lag) > max(1.0, self._block) * period:
            slew = min(_MAX_SLEW, max(-_MAX_SLEW, lag / (self._left * period)))
            dt = period * (1.0 + slew)
        if dt != self._dt:
            self._since, self._base, self._dt = self._place, time, dt

    def _level_lag(self, time: float) -> float:
        """Return the lag of the reported time behind the level of the stamps, s."""
        return self._levels[-1][1] - self._offset - time if self._offset is not None else 0.0


def _start_rows(rate: float) -> int:
    return min(_MAX_START_ROWS, max(_MIN_START_ROWS, round(_MIN_START_S * rate)))


def _shorten_leaps(stamps: Floats, period: float) -> tuple[Floats, Floats]:
    """Return stamps with lasting jumps shortened, and the number of samples removed at each."""
    more = np.zeros(len(stamps))
    stamps = stamps.copy()
    for row in (np.flatnonzero(np.diff(stamps) > _MAX_STEP_PERIODS * period) + 1).tolist():
        late = stamps - period * np.arange(len(stamps))
        leap = np.median(late[row : row + WINDOW_ROWS]) - np.median(
            late[max(0, row - WINDOW_ROWS) : row]
        )
        more[row] = max(0.0, np.rint(leap / period) - _MAX_STEP_PERIODS)
        stamps[row:] -= more[row] * period
    return stamps, more
