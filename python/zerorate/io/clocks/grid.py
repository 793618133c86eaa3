"""Uniform grids that the rows of a log stand on, and reports on the stamps that told them."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from zerorate.io.log import LogError
from zerorate.types import Floats, Integers

ALIKE: Final = 0.01
"""Part by which a rate may differ from one that is stated, and stamps from their grid."""

_TURNS: Final = 1e-3
"""Part by which a rate may be wrong before turns are: no gyro's scale is known better."""


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
        Deviation of the stamps from that clock, s; of stamps of arrival how late they are.
    repeated, backward
        Stamps equal to, and less than, the one before. Their rows are kept in file order.
    gaps, missing_count
        Places where samples are missing, and the number of NaN rows put there.
    longest_gap
        Longest step between two stamps at a gap, s.
    bursts
        Bursts in which the samples arrived, if the stamps are those of arrival, else 0.
    repeats
        Rows left out because they repeat the one before, the sensor being slower than its log.
    wander
        How far the even clock is from the stamps at most, s, where these wander so that they are
        kept; else 0. The jitter is then that about the clock that wanders.
    slowest, fastest
        Rates between which such a clock ran, Hz, over a fortieth of the log; else 0.
    step_rms
        Deviation of the steps between stamps from a period, s, where no sample is missing and no
        stamp repeated.
    late_count
        Steps of more than a period and a half at which no sample is missing.
    """

    rate: float
    stamped: bool = True
    jitter_rms: float = 0.0
    jitter_max: float = 0.0
    repeated_count: int = 0
    backward_count: int = 0
    gap_count: int = 0
    missing_count: int = 0
    longest_gap: float = 0.0
    burst_count: int = 0
    repeat_count: int = 0
    wander: float = 0.0
    slowest: float = 0.0
    fastest: float = 0.0
    step_rms: float = 0.0
    late_count: int = 0

    @property
    def regular(self) -> bool:
        """Whether there are timestamps and nothing is to be said of them."""
        return self.stamped and not self._faults()

    @property
    def as_told(self) -> bool:
        """Whether the rate is that which somebody has stated, and nothing contradicts it."""
        return not self.stamped and not self._faults()

    def summary(self) -> str:
        """Return one sentence on the clock.

        Examples
        --------
        >>> ClockReport(rate=100.0).summary()
        'clock regular at 100 Hz'
        """
        faults = self._faults()
        if not self.stamped:
            clock = f"no timestamps, rate {self.rate:.7g} Hz as stated"
            return f"{clock} for the rows, with {', '.join(faults)}" if faults else clock
        if not faults:
            return f"clock regular at {self.rate:.7g} Hz"
        return f"clock at {self.rate:.7g} Hz with {', '.join(faults)}"

    def _faults(self) -> list[str]:
        faults = []
        if self.wander:
            faults.append(
                f"a rate that runs from {self.slowest:.4g} to {self.fastest:.4g} Hz, so that an "
                f"even clock is up to {self.wander:.3g} s from the stamps, which are kept"
            )
        rms, most = 1e3 * self.jitter_rms, 1e3 * self.jitter_max
        if self.burst_count:
            late = f"late by {rms:.3g} ms rms, {most:.3g} ms at most"
            faults.append(f"stamps of arrival in {_counted(self.burst_count, 'burst')} ({late})")
        elif self.jitter_max * self.rate > ALIKE:
            faults.append(f"jitter of {rms:.3g} ms rms ({most:.3g} ms at most)")
        if self.repeated_count:
            faults.append(_counted(self.repeated_count, "repeated stamp"))
        if self.backward_count:
            faults.append(_counted(self.backward_count, "backward step"))
        if self.repeat_count:
            faults.append(
                f"{_counted(self.repeat_count, 'row')} left out that repeat the one before"
            )
        if self.gap_count:
            missing = _counted(self.missing_count, "missing sample")
            gaps = f"{missing} in {_counted(self.gap_count, 'gap')}"
            faults.append(f"{gaps} (longest {self.longest_gap:.3g} s)")
        return faults


@dataclass(frozen=True)
class Grid:
    """A uniform clock, and where the rows of a log stand on it.

    Parameters
    ----------
    rate, length
        Samples per second, Hz, and how many there are.
    report
        What the timestamps told.
    spread
        Place of each row that is used, None where they leave no gaps.
    used
        The rows that are used, None for all.
    offset
        Time of the first place since the first stamp, s.
    kept
        Time of each row that is used since the first place, s, where the clock wanders so that
        its stamps are kept; else None.
    """

    rate: float
    length: int
    report: ClockReport
    spread: Integers | None = None
    used: Integers | None = None
    offset: float = 0.0
    kept: Floats | None = None

    @property
    def place(self) -> Integers:
        """Place of each row that is used, shape (n,)."""
        return self.places(self.length)

    def places(self, count: int) -> Integers:
        """Return the places of so many rows at the beginning, or of all if there are fewer."""
        if self.spread is None:
            return np.arange(min(count, self.length))
        return self.spread[:count]

    def times(self, part: range) -> Floats | None:
        """Return the times of some places since the first, between rows where they are gaps.

        None stands for an even clock.
        """
        if self.kept is None or self.spread is None:
            return None if self.kept is None else self.kept[part.start : part.stop]
        return np.asarray(np.interp(np.arange(part.start, part.stop), self.spread, self.kept))

    def agrees(self, rate: float) -> bool:
        """Whether a rate that somebody has stated is that of the stamps."""
        return abs(self.report.rate / rate - 1) <= ALIKE

    def at(self, rate: float | None) -> Grid:
        """Return the grid at the rate stated, if there is one; LogError if the stamps differ."""
        if rate is None:
            return self
        if not self.agrees(rate):
            raise LogError(
                f"the rate is stated as {rate:g} Hz, but the timestamps run at "
                f"{self.report.rate:g} Hz"
            )
        return replace(self, rate=rate)


def _counted(count: int, noun: str) -> str:
    return f"{count} {noun}{'' if count == 1 else 's'}"


def on_rate(stated: float, stamped: float) -> str:
    """Return what becomes of turns where the rate stated is not that of the stamps, "" of nothing.

    Examples
    --------
    >>> on_rate(100.0, 99.0)
    'every turn comes out 1 % too small; leave the rate out, and the stamps count'
    """
    off = stamped / stated - 1.0
    if abs(off) <= _TURNS:
        return ""
    size = "small" if off < 0.0 else "large"
    return (
        f"every turn comes out {100.0 * abs(off):.2g} % too {size}; leave the rate out, and the "
        "stamps count"
    )


def unstamped(n: int, rate: float) -> Grid:
    """Return the grid of n rows without timestamps."""
    return Grid(rate, n, ClockReport(rate, stamped=False))
