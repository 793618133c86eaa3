"""Clocks: timestamps of any unit, the uniform grid that fits them, and a report on both."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Final

import numpy as np
import numpy.typing as npt

from zerorate.io.gaps import LONG_STEP, WINDOW, missing_samples, places
from zerorate.io.log import LogError
from zerorate.io.missing import without_masks
from zerorate.io.names import plain
from zerorate.io.table import Column
from zerorate.types import Booleans, Floats, Integers

__all__ = ["ClockReport", "Grid", "Stamps", "fit_grid", "to_seconds", "unstamped"]

_BLOCK: Final = 1 << 16
_ALIKE: Final = 0.01


@dataclass(frozen=True)
class _SteadyClock:
    """Rate, Hz, and the deviation of the stamps from it, s, which is that of their rounding."""

    rate: float
    rms: float
    most: float


def _steady_clock(stamps: Floats, start: float) -> _SteadyClock | None:
    """Return the clock of stamps whose place no estimate could tell better, None for others.

    The rate is the one that the estimates for other stamps come to: it is the _roundest among all
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


def _steps_between(column: npt.NDArray[np.float64 | np.int64]) -> tuple[float, float] | None:
    """Return the least and the largest step, None unless they are positive and all but equal."""
    ends = list(_ends(column))
    if not ends:
        return None
    least, most = min(low for low, _ in ends), max(high for _, high in ends)
    return (least, most) if 0.0 < most <= (1.0 + _ALIKE) * least else None


def _ends(column: npt.NDArray[np.float64 | np.int64]) -> Iterator[tuple[float, float]]:
    for first in range(0, len(column) - 1, _BLOCK):
        steps = np.diff(column[first : first + _BLOCK + 1])
        yield float(steps.min()), float(steps.max())


_PER_SECOND = {"s": 1.0, "ms": 1e3, "us": 1e6, "ns": 1e9}
_SPELLINGS = {
    "s": ("s", "sec", "secs", "second", "seconds"),
    "ms": ("ms", "msec", "msecs", "millis"),
    "us": ("us", "µs", "usec", "usecs", "micros"),
    "ns": ("ns", "nsec", "nsecs", "nanos"),
}
_UNIT = {spelling: unit for unit, all_ in _SPELLINGS.items() for spelling in all_}
_LONGEST = 1e10
# The steps of clocks from 10 Hz to 10 kHz: one range a unit, seconds reaching down to 2 Hz.
_STEP_BELOW = (("s", 0.5), ("ms", 100.0), ("us", 1e5), ("ns", np.inf))


@dataclass(frozen=True)
class Stamps:
    """Seconds since the first stamp, shape (n,), the first stamp itself, and what was assumed."""

    seconds: Floats
    start: float
    note: str | None


def to_seconds(column: Column, name: str, rate: float | None) -> Stamps:
    """Return the stamps in seconds.

    The unit is that of the name's suffix; without one, that whose clock comes within 1 % of
    ``rate``; without that, the step decides: below 0.5 it is seconds, below 100 milliseconds,
    below 100 000 microseconds, and nanoseconds above.
    """
    column = without_masks(column)
    if column.dtype.kind in "Mm":
        _check_whole(~np.isnat(column), name)
        kind = "datetime64[ns]" if column.dtype.kind == "M" else "timedelta64[ns]"
        column, unit, assumed = column.astype(kind).view(np.int64), "ns", False
    else:
        column = _wide(column, name)
        known = _unit_of_name(name)
        unit, assumed = known or _unit_of_step(column, rate), known is None
    per_second = _PER_SECOND[unit]
    with np.errstate(over="ignore"):
        since = column - column[0] if column[0] else column
        seconds = since.astype(np.float64, copy=False)
    if per_second != 1.0:
        seconds = seconds / per_second
    if not np.ptp(seconds) < _LONGEST:
        raise LogError(f"time column '{name}' spans more than 300 years in {unit}")
    note = f"time column '{name}' read as {unit}, judged by its step" if assumed else None
    return Stamps(seconds, float(column[0]) / per_second, note if unit != "s" else None)


def _wide(column: Column, name: str) -> Column:
    if column.dtype.kind in "iu":
        return column.astype(
            np.int64, copy=False
        )  # nanoseconds of today's date do not fit a float64
    if column.dtype.kind != "f":
        raise LogError(f"time column '{name}' holds {column.dtype}, expected numbers")
    _check_whole(np.isfinite(column), name)
    return column.astype(np.float64, copy=False)


def _check_whole(there: Booleans, name: str) -> None:
    if not there.all():
        bad = np.flatnonzero(~there)
        raise LogError(
            f"time column '{name}' is not finite in row {bad[0]} (counting from 0), "
            "expected a timestamp in every row"
        )


def _unit_of_name(name: str) -> str | None:
    words = plain(name).split("_")
    return _UNIT.get(words[-1]) if len(words) > 1 else None


def _unit_of_step(column: Column, rate: float | None) -> str:
    ends = _steps_between(column)
    units = [_unit_of(step, rate) for step in ends or ()]
    # Nothing but that unit lies between two ends so close.
    if units and units[0] == units[1]:
        return units[0]
    steps = np.diff(column).astype(np.float64)
    steps = steps[steps > 0]
    return _unit_of(float(np.median(steps)), rate) if steps.size else "s"


def _unit_of(step: float, rate: float | None) -> str:
    if rate is not None:
        for unit, per_second in _PER_SECOND.items():
            if abs(step * rate / per_second - 1) < 0.01:
                return unit
    return next(unit for unit, bound in _STEP_BELOW if step < bound)


@dataclass(frozen=True)
class ClockReport:
    """How the timestamps of a log deviate from a uniform clock.

    Parameters
    ----------
    rate
        Rate of the best uniform clock through the stamps, Hz; without stamps the rate given.
    stamped
        Whether the file had timestamps.
    jitter_rms, jitter_max
        Deviation of the stamps from that clock, s.
    repeated, backward
        Stamps equal to, and less than, the one before. Their rows are kept in file order.
    gaps, missing_samples
        Places where samples are missing, and the number of NaN rows put there.
    longest_gap
        Longest step between two stamps at a gap, s.
    """

    rate: float
    stamped: bool = True
    jitter_rms: float = 0.0
    jitter_max: float = 0.0
    repeated: int = 0
    backward: int = 0
    gaps: int = 0
    missing_samples: int = 0
    longest_gap: float = 0.0

    def summary(self) -> str:
        """Return one sentence on the clock.

        Examples
        --------
        >>> ClockReport(rate=100.0).summary()
        'clock regular at 100 Hz'
        """
        if not self.stamped:
            return f"no timestamps, rate {self.rate:.7g} Hz as stated"
        faults = self._faults()
        if not faults:
            return f"clock regular at {self.rate:.7g} Hz"
        return f"clock at {self.rate:.7g} Hz with {', '.join(faults)}"

    def _faults(self) -> list[str]:
        faults = []
        if self.jitter_max * self.rate > 0.01:
            rms, most = 1e3 * self.jitter_rms, 1e3 * self.jitter_max
            faults.append(f"jitter of {rms:.3g} ms rms ({most:.3g} ms at most)")
        if self.repeated:
            faults.append(_counted(self.repeated, "repeated stamp"))
        if self.backward:
            faults.append(_counted(self.backward, "backward step"))
        if self.gaps:
            missing = _counted(self.missing_samples, "missing sample")
            gaps = f"{missing} in {_counted(self.gaps, 'gap')}"
            faults.append(f"{gaps} (longest {self.longest_gap:.3g} s)")
        return faults


@dataclass(frozen=True)
class Grid:
    """Uniform rate (Hz), grid length, the report, and the places of rows that leave gaps."""

    rate: float
    length: int
    report: ClockReport
    spread: Integers | None = None

    @property
    def place(self) -> Integers:
        """Place of each row on the grid, shape (n,)."""
        return np.arange(self.length) if self.spread is None else self.spread


def _counted(count: int, noun: str) -> str:
    return f"{count} {noun}{'' if count == 1 else 's'}"


def unstamped(n: int, rate: float) -> Grid:
    """Return the grid of n rows without timestamps."""
    return Grid(rate, n, ClockReport(rate, stamped=False))


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
    if len(stamps) < 2:
        if rate is None:
            raise LogError("one row gives no rate; give rate=")
        return Grid(rate, 1, ClockReport(rate))
    if (steady := _steady_clock(stamps, start)) is not None:
        _check_agrees(rate, steady.rate)
        report = ClockReport(steady.rate, jitter_rms=steady.rms, jitter_max=steady.most)
        return Grid(rate or steady.rate, len(stamps), report)
    return _fitted(stamps, start, rate)


def _fitted(stamps: Floats, start: float, rate: float | None) -> Grid:
    """Return the grid of stamps that may be late, early, coarse, or missing."""
    steps = np.diff(stamps)
    _check_forward(steps)
    period = _first_period(stamps, steps)
    even = _rebased(stamps, steps, period)
    for _ in range(2):
        missing = missing_samples(even, period)
        place = places(missing, even)
        period = _slope(even, place)
    own_rate, deviation = _own_rate(even, place, start)
    report = _report(steps, missing, deviation, own_rate)
    _check_agrees(rate, own_rate)
    length = int(place[-1]) + 1
    return Grid(rate or own_rate, length, report, None if length == len(stamps) else place)


def _check_forward(steps: Floats) -> None:
    backward = int((steps < 0).sum())
    if backward > max(1, 0.01 * len(steps)):
        raise LogError(
            f"the time column goes backward in {backward} of {len(steps)} steps, "
            "expected timestamps that rise"
        )


def _check_agrees(rate: float | None, own_rate: float) -> None:
    if rate is not None and abs(own_rate / rate - 1) > 0.01:
        raise LogError(
            f"the rate is stated as {rate:g} Hz, but the timestamps run at {own_rate:g} Hz"
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
    """Return the stamps with every lasting jump backward taken out."""
    deviation = stamps - period * np.arange(len(stamps))
    jump = np.zeros(len(stamps))
    for row in np.flatnonzero(steps < 0) + 1:
        before = np.median(deviation[max(0, row - WINDOW) : row])
        after = np.median(deviation[row : row + WINDOW])
        if after - before < -LONG_STEP * period:
            jump[row] = after - before
    return stamps - np.cumsum(jump) if jump.any() else stamps


def _slope(stamps: Floats, place: Integers) -> float:
    half = len(stamps) // 2
    slopes = (stamps[half:] - stamps[:-half]) / (place[half:] - place[:-half])
    return _advancing(float(np.median(slopes)))


def _own_rate(stamps: Floats, place: Integers, start: float) -> tuple[float, Floats]:
    """Return the _roundest rate the stamps cannot tell from the fitted one, and the deviations."""
    period = _slope(stamps, place)
    deviation = stamps - period * place
    deviation -= np.median(deviation)
    unsure = float(np.median(np.abs(deviation))) + _resolution(start, float(stamps[-1]))
    return _roundest(period, unsure / (period * int(place[-1]))), deviation


def _report(steps: Floats, missing: Floats, deviation: Floats, rate: float) -> ClockReport:
    gaps = missing > 0
    return ClockReport(
        rate=rate,
        jitter_rms=float(np.sqrt(np.mean(deviation**2))),
        jitter_max=float(np.abs(deviation).max()),
        repeated=int((steps == 0).sum()),
        backward=int((steps < 0).sum()),
        gaps=int(gaps.sum()),
        missing_samples=int(missing.sum()),
        longest_gap=float(steps[gaps].max()) if gaps.any() else 0.0,
    )
