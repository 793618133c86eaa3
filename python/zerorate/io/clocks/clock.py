"""Uniform clocks that fit timestamps, even if these are late, coarse or incomplete."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Final, NamedTuple

import numpy as np

from zerorate.faults import keyword_argument, make_sentence
from zerorate.io.clocks.arrivals import Bursts, find_bursts, find_floor
from zerorate.io.clocks.gaps import (
    LONG_STEP_PERIODS,
    LONG_WINDOW_ROWS,
    WINDOW_ROWS,
    count_missing,
    grid_indices,
)
from zerorate.io.clocks.grid import Grid
from zerorate.io.clocks.wander import Wander, find_wander
from zerorate.record.clock import ClockReport
from zerorate.record.log import LogError
from zerorate.types import Floats, Integers

_BLOCK: Final = 1 << 16
_BLOCK_ROWS: Final = 3
"""Length of blocks of equal stamps, in rows, from which on blocks are compared."""
_MAX_ROUNDS: Final = 3
"""Rounds of the alternating estimate of gaps and wander."""
MIN_RESTART_S: Final = 1.0
"""Smallest backward step of a restarted clock, s; a network time service makes smaller ones."""
RESTART_GAP_S: Final = 10.0
"""Time counted as missing at a restart, s, because its length is unknown."""


@dataclass(frozen=True)
class _SteadyClock:
    """Rate, Hz, and the deviation of the stamps from it by rounding, s."""

    rate: float
    rms: float
    max_deviation: float


def _fit_steady_clock(stamps: Floats, start: float) -> _SteadyClock | None:
    """Return the clock of stamps that agree with it to their rounding; None for other stamps.

    The rate is the roundest within four times its uncertainty. The stamps agree with it to a
    quarter of that.
    """
    span = float(stamps[-1])
    if not span > 0.0:
        return None
    doubt = _stamp_resolution(start, span)
    rate = roundest(span / (len(stamps) - 1), 4.0 * doubt / span)
    squares = max_deviation = 0.0
    for first in range(0, len(stamps), _BLOCK):
        part = stamps[first : first + _BLOCK]
        off = part - np.arange(first, first + len(part)) / rate
        max_deviation = max(max_deviation, float(off.max()), -float(off.min()))
        if max_deviation > 0.25 * doubt:
            return None
        squares += float(np.square(off, out=off).sum())
    return _SteadyClock(rate, math.sqrt(squares / len(stamps)), max_deviation)


def _stamp_resolution(start: float, last: float) -> float:
    """Return the resolution of stamps, s; a large first stamp makes it coarse."""
    return float(4 * np.finfo(np.float64).eps * (abs(start) + abs(last)))


def roundest(period: float, doubt: float) -> float:
    """Return the rate with the fewest digits, in Hz or as a period, in a relative tolerance."""
    for digits in range(1, 16):
        for rate in (float(f"{1 / period:.{digits}g}"), 1 / float(f"{period:.{digits}g}")):
            if abs(rate * period - 1) <= doubt:
                return rate
    return 1 / period


def fit_grid(stamps: Floats, start: float = 0.0, rate: float | None = None) -> Grid:
    """Return the uniform grid that fits the stamps.

    Parameters
    ----------
    stamps
        Times since the first stamp, s, shape (n,), finite.
    start
        First stamp, s. A large value limits the precision of the other stamps.
    rate
        Rate stated by the caller or the file, Hz; it is used if the stamps agree.

    Raises
    ------
    LogError
        If the stamps form no clock, contradict the rate, or have a gap too long to fill.
    """
    return fit_own_grid(stamps, start, rate).at_rate(rate)


def fit_own_grid(stamps: Floats, start: float = 0.0, rate: float | None = None) -> Grid:
    """Return the grid of `fit_grid` at the stamps' own rate, not the stated rate."""
    if len(stamps) < 2:
        if rate is None:
            raise LogError(make_sentence("one row gives no rate; give ", keyword_argument("rate")))
        return Grid(rate, 1, ClockReport(rate))
    if (steady := _fit_steady_clock(stamps, start)) is not None:
        report = ClockReport(steady.rate, jitter_rms=steady.rms, jitter_max=steady.max_deviation)
        return Grid(steady.rate, len(stamps), report)
    steps = np.diff(stamps)
    _check_forward(steps)
    return _fit_irregular(stamps, steps, start, rate)


def _fit_irregular(stamps: Floats, steps: Floats, start: float, rate: float | None) -> Grid:
    """Return the grid of samples with irregular stamps, made by the sensor or on arrival."""
    period = _estimate_period(stamps, steps)
    late = _fit_arrivals(stamps, steps, start, rate)
    is_plausible = late is not None and (rate is None or late.agrees_with(rate))
    if late is not None and is_plausible and period * late.rate < 0.5:
        return late
    try:
        fit = _fit_samples(stamps, steps, start, period)
    except LogError:
        # If arrival stamps are read as a sensor's stamps, their gaps can be too long to fill.
        if late is None:
            raise
        return late
    grid = fit.make_grid(steps)
    is_complete = not fit.missing.any() or (rate is not None and grid.agrees_with(rate))
    return grid if late is None or is_complete else late


class _Fit(NamedTuple):
    """Rate, Hz, deviation of the stamps, s, and missing samples per step, of one clock."""

    rate: float
    deviation: Floats
    missing: Floats
    indices: Integers
    wander: Wander | None = None

    def make_grid(self, steps: Floats) -> Grid:
        """Return the grid of stamps with these steps."""
        length = int(self.indices[-1]) + 1
        spread = None if length == len(self.indices) else self.indices
        if self.wander is None:
            report = _make_report(steps, self.missing, self.deviation, self.rate)
            return Grid(self.rate, length, report, spread)
        return self._make_wandering_grid(steps, length, spread, self.wander)

    def _make_wandering_grid(
        self, steps: Floats, length: int, spread: Integers | None, wander: Wander
    ) -> Grid:
        """Return the grid with the stamps kept, because no uniform clock fits them."""
        even = self.indices / self.rate
        kept = wander.stamp_times(even, self.deviation, 1.0 / self.rate)
        kept -= kept[0]
        report = _make_report(steps, self.missing, self.deviation - wander.level, self.rate)
        report = replace(
            report,
            wander=float(np.abs(kept - even).max()),
            slowest=wander.slowest,
            fastest=wander.fastest,
        )
        return Grid(self.rate, length, report, spread, stamp_times=kept)


def _fit_samples(stamps: Floats, steps: Floats, start: float, period: float) -> _Fit:
    """Return the clock of stamps that can be late, early, coarse or missing."""
    rebased = _remove_setbacks(stamps, steps, period)
    for _ in range(2):
        missing = count_missing(rebased, period)
        indices = grid_indices(missing, rebased)
        period = _fit_period(rebased, indices)
    fit = _Fit(*fit_rate(rebased, indices, start), missing, indices)
    return _follow_wander(fit, rebased, start)


def _follow_wander(fit: _Fit, stamps: Floats, start: float) -> _Fit:
    """Return a wandering clock with gaps measured against itself; other clocks unchanged."""
    block_count = int(np.count_nonzero(np.diff(stamps) > 0.5 / fit.rate))
    block_rows = len(stamps) / max(1, block_count)
    best = _add_wander(fit, stamps, block_rows)
    for _ in range(_MAX_ROUNDS):
        if best.wander is None or not best.missing.any():
            break
        straight = stamps - best.wander.slow
        missing = count_missing(straight, 1.0 / best.rate)
        if missing.sum() >= best.missing.sum():
            break  # wander looks like gaps, but gaps do not look like wander
        indices = grid_indices(missing, straight)
        better = _Fit(*fit_rate(stamps, indices, start), missing, indices)
        best = _add_wander(better, stamps, block_rows)
    return fit if best.wander is None else best


def _add_wander(fit: _Fit, stamps: Floats, lump: float) -> _Fit:
    """Return a fit with the wander of its stamps, and their deviation from its rate."""
    # The rate is rounded; the stamps would otherwise seem to drift from it.
    deviation = stamps - fit.indices / fit.rate
    deviation -= np.median(deviation)
    return fit._replace(deviation=deviation, wander=find_wander(deviation, 1.0 / fit.rate, lump))


def _fit_arrivals(stamps: Floats, steps: Floats, start: float, rate: float | None) -> Grid | None:
    """Return the grid of samples that arrived in bursts; None for other stamps."""
    back = np.where(steps < -LONG_STEP_PERIODS * float(stamps[-1]) / len(steps), steps, 0.0)
    if back.any():
        period = float(stamps[-1] - back.sum()) / len(steps)
        even = stamps - np.append(0.0, np.cumsum(_leave_restart_gaps(back, period)))
    else:
        even = stamps
    if (arrivals := find_bursts(even, rate)) is None:
        return None
    indices = grid_indices(arrivals.missing, even)
    own_rate, _ = fit_rate(even[arrivals.last], indices[arrivals.last], start)
    if rate is not None and len(arrivals.last) < LONG_WINDOW_ROWS:
        own_rate = rate  # a few bursts cannot improve the stated rate
    late = even - indices / own_rate
    offset = find_floor(late[arrivals.last])
    wander = find_wander(late[arrivals.last], 1.0 / own_rate, rows=arrivals.last, n=len(stamps))
    if wander is not None:
        return _make_wandering_arrivals(own_rate, indices, wander, steps, arrivals)
    grid = _Fit(own_rate, late - offset, arrivals.missing, indices).make_grid(steps)
    report = replace(grid.report, burst_count=len(arrivals.last))
    return replace(grid, report=report, offset=offset)


def _make_wandering_arrivals(
    rate: float, indices: Integers, wander: Wander, steps: Floats, arrivals: Bursts
) -> Grid:
    """Return the grid of samples that arrived in bursts from a wandering clock."""
    # Stamps of a burst are arrival times; the line below the bursts gives the sensor's times.
    fit = _Fit(rate, wander.level, arrivals.missing, indices, wander)
    grid = fit.make_grid(steps)
    report = replace(grid.report, burst_count=len(arrivals.last))
    return replace(grid, report=report, offset=float(wander.level[0]))


def _check_forward(steps: Floats) -> None:
    backward = int((steps < 0).sum())
    if backward > max(1, 0.01 * len(steps)):
        raise LogError(
            f"the time column goes backward in {backward} of {len(steps)} steps, "
            "expected timestamps that rise"
        )


def _estimate_period(stamps: Floats, steps: Floats) -> float:
    """Return the period to a few per cent, insensitive to gaps, coarse stamps and bursts."""
    middle = float(np.median(steps))
    near = np.abs(steps - middle) <= 0.5 * middle
    if middle > 0 and near.mean() >= 0.9:
        return float(steps[near].mean())
    # Lost samples never shorten a step: many short steps mean late stamps or bursts.
    if np.mean(steps < 0.5 * middle) > 0.05 or middle <= 0:
        return _fit_period(stamps, np.arange(len(stamps)))
    # Coarse stamps average out over many rows, lost samples do not.
    lag = max(1, min(512, len(stamps) // 8))
    low, half, high = np.percentile(stamps[lag:] - stamps[:-lag], (25, 50, 75))
    if high - low > 1.5 * middle:
        return float(steps[near].mean())
    return float(half) / lag


def _check_period(period: float) -> float:
    if not 0 < period < np.inf:
        raise LogError("the timestamps do not advance")
    return period


def _remove_setbacks(stamps: Floats, steps: Floats, period: float) -> Floats:
    """Return the stamps without lasting backward jumps.

    At a restart of the clock, a gap of `RESTART_GAP_S` remains.
    """
    jump = find_setbacks(stamps, steps, period)
    if not jump.any():
        return stamps
    return stamps - np.cumsum(_leave_restart_gaps(jump, period))


def _leave_restart_gaps(jump: Floats, period: float) -> Floats:
    """Return backward jumps with a gap left at each restart of the clock."""
    gap = min(RESTART_GAP_S, len(jump) * period)
    return np.where(jump < -MIN_RESTART_S, jump - gap, jump)


def find_setbacks(stamps: Floats, steps: Floats, period: float) -> Floats:
    """Return the lasting backward jump of the stamps before each row, s, shape (n,)."""
    jump = np.zeros(len(stamps))
    if not (steps < 0.0).any():
        return jump
    deviation = stamps - period * np.arange(len(stamps))
    for row in np.flatnonzero(steps < 0) + 1:
        before = np.median(deviation[max(0, row - WINDOW_ROWS) : row])
        after = np.median(deviation[row : row + WINDOW_ROWS])
        if after - before < -LONG_STEP_PERIODS * period:
            jump[row] = after - before
    return jump


def _fit_period(stamps: Floats, indices: Integers) -> float:
    half = len(stamps) // 2
    edges = np.flatnonzero(stamps[1:] != stamps[:-1])
    block = int(edges[1] - edges[0]) if len(edges) > 2 * LONG_STEP_PERIODS else 1
    if block >= _BLOCK_ROWS and half >= block and (np.diff(edges) == block).all():
        half -= half % block  # compare equal positions in the blocks
    slopes = (stamps[half:] - stamps[:-half]) / (indices[half:] - indices[:-half])
    return _check_period(float(np.median(slopes)))


def fit_rate(stamps: Floats, indices: Integers, start: float = 0.0) -> tuple[float, Floats]:
    """Return the rate, Hz, of stamps with known indices, and their deviations from it, s.

    The rate is the roundest that the stamps cannot distinguish from the best fit.
    """
    period = _fit_period(stamps, indices)
    deviation = stamps - period * indices
    deviation -= np.median(deviation)
    doubt = float(np.median(np.abs(deviation))) + _stamp_resolution(start, float(stamps[-1]))
    return roundest(period, doubt / (period * int(indices[-1]))), deviation


def _make_report(steps: Floats, missing: Floats, deviation: Floats, rate: float) -> ClockReport:
    gaps = missing > 0
    restarts = gaps & (steps < -MIN_RESTART_S)
    lengths = np.where(restarts, missing / rate, steps)[gaps]
    whole = steps[~gaps & (steps > 0.0)]
    return ClockReport(
        rate=rate,
        jitter_rms=float(np.sqrt(np.mean(deviation**2))),
        jitter_max=float(np.abs(deviation).max()),
        repeated_count=int((steps == 0).sum()),
        backward_count=int((steps < 0).sum()),
        gap_count=int(gaps.sum()),
        missing_count=int(missing.sum()),
        longest_gap=float(lengths.max()) if gaps.any() else 0.0,
        restart_count=int(restarts.sum()),
        step_rms=float(np.sqrt(np.mean((whole - 1.0 / rate) ** 2))) if whole.size else 0.0,
        late_count=int(np.count_nonzero(whole > 1.5 / rate)),
    )
