"""Clocks: the uniform grid that fits timestamps, however late, coarse or incomplete."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Final, NamedTuple

import numpy as np

from zerorate.faults import given, said
from zerorate.io.clocks.arrivals import Bursts, bursts, floor
from zerorate.io.clocks.gaps import LONG_STEP, LONG_WINDOW, WINDOW, missing_samples, places
from zerorate.io.clocks.grid import Grid
from zerorate.io.clocks.wander import Wander, wander_of
from zerorate.record.clock import ClockReport
from zerorate.record.log import LogError
from zerorate.types import Floats, Integers

_BLOCK: Final = 1 << 16
_ROUNDS: Final = 3
"""Times that gaps and the wander of a clock are judged by each other."""
RESTART_S: Final = 1.0
"""Seconds by which a clock that steps back began anew; a network sets one by less."""
RESTART_GAP_S: Final = 10.0
"""Seconds taken as missing where it did, for how long it was off is not known: so long without a
sample no heading is known."""


@dataclass(frozen=True)
class _SteadyClock:
    """Rate, Hz, and the deviation of the stamps from it, s, which is that of their rounding."""

    rate: float
    rms: float
    most: float


def _steady_clock(stamps: Floats, start: float) -> _SteadyClock | None:
    """Return the clock of stamps whose place no estimate could tell better, None for others.

    The rate is the one that the estimates for other stamps come to: it is the roundest among all
    within four times their doubt, and the stamps keep to it within a quarter of that.
    """
    span = float(stamps[-1])
    if not span > 0.0:
        return None
    doubt = _resolution(start, span)
    rate = _roundest(span / (len(stamps) - 1), 4.0 * doubt / span)
    squares = most = 0.0
    for first in range(0, len(stamps), _BLOCK):
        part = stamps[first : first + _BLOCK]
        off = part - np.arange(first, first + len(part)) / rate
        most = max(most, float(off.max()), -float(off.min()))
        if most > 0.25 * doubt:
            return None
        squares += float(np.square(off, out=off).sum())
    return _SteadyClock(rate, math.sqrt(squares / len(stamps)), most)


def _resolution(start: float, last: float) -> float:
    """Return what stamps tell at best, s: the first one bounds the precision of the others."""
    return float(4 * np.finfo(np.float64).eps * (abs(start) + abs(last)))


def _roundest(period: float, doubt: float) -> float:
    """Return the rate of the fewest digits, of itself or its period, within a relative doubt."""
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
        Seconds since the first one, shape (n,), finite.
    start
        The first stamp, s; it bounds the precision of the others.
    rate
        Rate stated by the caller or the file, Hz. It is taken if the stamps agree.

    Raises
    ------
    LogError
        If the stamps are no clock, contradict the rate, or leave a gap too long to fill.
    """
    return fitted_grid(stamps, start, rate).at(rate)


def fitted_grid(stamps: Floats, start: float = 0.0, rate: float | None = None) -> Grid:
    """Return the grid of `fit_grid` at its own rate, which may not be the one stated."""
    if len(stamps) < 2:
        if rate is None:
            raise LogError(said("one row gives no rate; give ", given("rate")))
        return Grid(rate, 1, ClockReport(rate))
    if (steady := _steady_clock(stamps, start)) is not None:
        report = ClockReport(steady.rate, jitter_rms=steady.rms, jitter_max=steady.most)
        return Grid(steady.rate, len(stamps), report)
    steps = np.diff(stamps)
    _check_forward(steps)
    return _irregular(stamps, steps, start, rate)


def _irregular(stamps: Floats, steps: Floats, start: float, rate: float | None) -> Grid:
    """Return the grid of samples that were stamped as they were made, or as they arrived."""
    period = _first_period(stamps, steps)
    late = _arrived(stamps, steps, start, rate)
    believed = late is not None and (rate is None or late.agrees(rate))
    if late is not None and believed and period * late.rate < 0.5:
        return late
    try:
        found = _sampled(stamps, steps, start, period)
    except LogError:
        # Bursts without their clock may leave gaps that are too long to fill.
        if late is None:
            raise
        return late
    grid = found.grid(steps)
    whole = not found.missing.any() or (rate is not None and grid.agrees(rate))
    return grid if late is None or whole else late


class _Fit(NamedTuple):
    """Rate, Hz, deviation of the stamps, s, and samples missing in each step, all of one clock."""

    rate: float
    deviation: Floats
    missing: Floats
    place: Integers
    wander: Wander | None = None

    def grid(self, steps: Floats) -> Grid:
        """Return the grid of stamps that are these steps apart."""
        length = int(self.place[-1]) + 1
        spread = None if length == len(self.place) else self.place
        if self.wander is None:
            report = _report(steps, self.missing, self.deviation, self.rate)
            return Grid(self.rate, length, report, spread)
        return self._wandering(steps, length, spread, self.wander)

    def _wandering(
        self, steps: Floats, length: int, spread: Integers | None, wander: Wander
    ) -> Grid:
        """Return the grid of stamps that are kept, for no even clock is theirs."""
        even = self.place / self.rate
        kept = wander.kept(even, self.deviation, 1.0 / self.rate)
        kept -= kept[0]
        report = _report(steps, self.missing, self.deviation - wander.level, self.rate)
        report = replace(
            report,
            wander=float(np.abs(kept - even).max()),
            slowest=wander.slowest,
            fastest=wander.fastest,
        )
        return Grid(self.rate, length, report, spread, kept=kept)


def _sampled(stamps: Floats, steps: Floats, start: float, period: float) -> _Fit:
    """Return the clock of stamps that may be late, early, coarse, or missing."""
    even = _rebased(stamps, steps, period)
    for _ in range(2):
        missing = missing_samples(even, period)
        place = places(missing, even)
        period = _slope(even, place)
    fit = _Fit(*clock_through(even, place, start), missing, place)
    return _followed(fit, even, start)


def _followed(fit: _Fit, stamps: Floats, start: float) -> _Fit:
    """Return a clock that wanders with its gaps judged against itself, any other as it is."""
    apart = int(np.count_nonzero(np.diff(stamps) > 0.5 / fit.rate))
    lump = len(stamps) / max(1, apart)
    found = _wandering(fit, stamps, lump)
    for _ in range(_ROUNDS):
        if found.wander is None or not found.missing.any():
            break
        straight = stamps - found.wander.slow
        missing = missing_samples(straight, 1.0 / found.rate)
        if missing.sum() >= found.missing.sum():
            break  # what wanders looks like gaps, not the reverse
        place = places(missing, straight)
        better = _Fit(*clock_through(stamps, place, start), missing, place)
        found = _wandering(better, stamps, lump)
    return fit if found.wander is None else found


def _wandering(fit: _Fit, stamps: Floats, lump: float) -> _Fit:
    """Return a fit with the wander of its stamps, and how far they are from its rate."""
    # The rate is rounder than their slope, from which they deviate otherwise.
    deviation = stamps - fit.place / fit.rate
    deviation -= np.median(deviation)
    return fit._replace(deviation=deviation, wander=wander_of(deviation, 1.0 / fit.rate, lump))


def _arrived(stamps: Floats, steps: Floats, start: float, rate: float | None) -> Grid | None:
    """Return the grid of samples that arrived in bursts, None if they did not."""
    back = np.where(steps < -LONG_STEP * float(stamps[-1]) / len(steps), steps, 0.0)
    if back.any():
        period = float(stamps[-1] - back.sum()) / len(steps)
        even = stamps - np.append(0.0, np.cumsum(_with_gaps(back, period)))
    else:
        even = stamps
    if (found := bursts(even, rate)) is None:
        return None
    place = places(found.missing, even)
    own_rate, _ = clock_through(even[found.last], place[found.last], start)
    if rate is not None and len(found.last) < LONG_WINDOW:
        own_rate = rate  # which so few bursts do not tell better
    late = even - place / own_rate
    offset = floor(late[found.last])
    wander = wander_of(late[found.last], 1.0 / own_rate, rows=found.last, n=len(stamps))
    if wander is not None:
        return _arrived_wandering(own_rate, place, wander, steps, found)
    grid = _Fit(own_rate, late - offset, found.missing, place).grid(steps)
    report = replace(grid.report, burst_count=len(found.last))
    return replace(grid, report=report, offset=offset)


def _arrived_wandering(
    rate: float, place: Integers, wander: Wander, steps: Floats, found: Bursts
) -> Grid:
    """Return the grid of samples that arrived in bursts from a clock that wanders."""
    # A burst says when its samples came; the line under them, when they were made.
    fit = _Fit(rate, wander.level, found.missing, place, wander)
    grid = fit.grid(steps)
    report = replace(grid.report, burst_count=len(found.last))
    return replace(grid, report=report, offset=float(wander.level[0]))


def _check_forward(steps: Floats) -> None:
    backward = int((steps < 0).sum())
    if backward > max(1, 0.01 * len(steps)):
        raise LogError(
            f"the time column goes backward in {backward} of {len(steps)} steps, "
            "expected timestamps that rise"
        )


def _first_period(stamps: Floats, steps: Floats) -> float:
    """Return the period to a few per cent, unmoved by gaps, coarse stamps and bursts."""
    middle = float(np.median(steps))
    near = np.abs(steps - middle) <= 0.5 * middle
    if middle > 0 and near.mean() >= 0.9:
        return float(steps[near].mean())
    # Lost samples never shorten a step: many short ones are late stamps or bursts.
    if np.mean(steps < 0.5 * middle) > 0.05 or middle <= 0:
        return _slope(stamps, np.arange(len(stamps)))
    # Coarse stamps even out over many rows, where lost samples do not.
    lag = max(1, min(512, len(stamps) // 8))
    low, half, high = np.percentile(stamps[lag:] - stamps[:-lag], (25, 50, 75))
    if high - low > 1.5 * middle:
        return float(steps[near].mean())
    return float(half) / lag


def _advancing(period: float) -> float:
    if not 0 < period < np.inf:
        raise LogError("the timestamps do not advance")
    return period


def _rebased(stamps: Floats, steps: Floats, period: float) -> Floats:
    """Return the stamps with every lasting jump backward taken out.

    Where the clock began anew, `RESTART_GAP_S` seconds are left.
    """
    jump = set_back(stamps, steps, period)
    if not jump.any():
        return stamps
    return stamps - np.cumsum(_with_gaps(jump, period))


def _with_gaps(jump: Floats, period: float) -> Floats:
    """Return jumps backward that leave a gap where the clock began anew."""
    gap = min(RESTART_GAP_S, len(jump) * period)
    return np.where(jump < -RESTART_S, jump - gap, jump)


def set_back(stamps: Floats, steps: Floats, period: float) -> Floats:
    """Return the lasting jump backward of the stamps before each row, s, shape (n,)."""
    jump = np.zeros(len(stamps))
    if not (steps < 0.0).any():
        return jump
    deviation = stamps - period * np.arange(len(stamps))
    for row in np.flatnonzero(steps < 0) + 1:
        before = np.median(deviation[max(0, row - WINDOW) : row])
        after = np.median(deviation[row : row + WINDOW])
        if after - before < -LONG_STEP * period:
            jump[row] = after - before
    return jump


def _slope(stamps: Floats, place: Integers) -> float:
    half = len(stamps) // 2
    slopes = (stamps[half:] - stamps[:-half]) / (place[half:] - place[:-half])
    return _advancing(float(np.median(slopes)))


def clock_through(stamps: Floats, place: Integers, start: float = 0.0) -> tuple[float, Floats]:
    """Return the rate, Hz, of stamps whose places are known, and how far they are from it, s.

    It is the roundest one that they cannot tell from the fitted one.
    """
    period = _slope(stamps, place)
    deviation = stamps - period * place
    deviation -= np.median(deviation)
    unsure = float(np.median(np.abs(deviation))) + _resolution(start, float(stamps[-1]))
    return _roundest(period, unsure / (period * int(place[-1]))), deviation


def _report(steps: Floats, missing: Floats, deviation: Floats, rate: float) -> ClockReport:
    gaps = missing > 0
    restarts = gaps & (steps < -RESTART_S)
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
