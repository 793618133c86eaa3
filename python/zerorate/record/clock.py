"""Report on the clock of a log: deviations of its stamps from a uniform grid."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

from zerorate.numerals import shorten

RATE_TOLERANCE: Final = 0.01
"""Largest relative difference between two rates, and between stamps and their grid."""

_SCALE_TOLERANCE: Final = 1e-3
"""Relative error of a rate that does not matter for angles: gyro scales are less accurate."""


@dataclass(frozen=True)
class ClockReport:
    """Deviations of a log's timestamps from a uniform clock.

    Parameters
    ----------
    rate
        Rate of the best uniform clock through the stamps, Hz; without stamps the stated rate.
    stamped
        True if the file had timestamps.
    jitter_rms, jitter_max
        RMS and largest deviation of the stamps from this clock, s. For stamps of arrival, the
        deviation is the delay.
    repeated_count, backward_count
        Numbers of stamps equal to the stamp before, and less than the stamp before.
        Their rows stay in file order.
    gap_count, missing_count
        Number of gaps, and number of NaN rows inserted there.
    longest_gap
        Longest interval between the two stamps at a gap, s.
    burst_count
        Number of bursts in which samples arrived; 0 if the stamps are no times of arrival.
    repeat_count
        Number of rows left out because they repeat the row before: the sensor is slower than the
        log.
    wander
        Largest difference between uniform clock and stamps, s, if the rate of the clock changes;
        else 0. If the rate changes, the log keeps the stamps, and the jitter is relative to the
        changing clock.
    slowest, fastest
        Slowest and fastest rate of a changing clock, Hz, as means over a fortieth of the log. 0 if
        the rate does not change.
    step_rms
        Standard deviation of the intervals between stamps, s. Missing samples and repeated stamps
        are excluded.
    late_count
        Number of intervals between stamps that exceed 1.5 periods although no sample is missing.
    restart_count
        Number of restarts of the clock: steps back by more than 1 s. The time lost at a restart is
        unknown. It counts as 10 s of missing samples, or as the log's length if that is shorter.

    Examples
    --------
    >>> from zerorate.record import ClockReport
    >>> ClockReport(rate=100.0, missing_count=3, gap_count=1, longest_gap=0.04).summary()
    'clock at 100 Hz with 3 missing samples in 1 gap (longest 0.04 s)'
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
    restart_count: int = 0

    @property
    def regular(self) -> bool:
        """True if the file had timestamps, and they have no fault."""
        return self.stamped and not self._faults()

    @property
    def as_stated(self) -> bool:
        """True if the rate is the stated rate and stamps do not contradict it."""
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
                f"a rate that varies from {shorten(self.slowest, 4)} to "
                f"{shorten(self.fastest, 4)} Hz, so the "
                f"stamps are kept: a uniform clock is off by up to {shorten(self.wander, 3)} s"
            )
        rms, max_jitter = 1e3 * self.jitter_rms, 1e3 * self.jitter_max
        if self.burst_count:
            late = f"late by {shorten(rms, 3)} ms rms, {shorten(max_jitter, 3)} ms at most"
            faults.append(f"stamps of arrival in {count_noun(self.burst_count, 'burst')} ({late})")
        elif self.jitter_max * self.rate > RATE_TOLERANCE:
            faults.append(
                f"jitter of {shorten(rms, 3)} ms rms ({shorten(max_jitter, 3)} ms at most)"
            )
        if self.repeated_count:
            faults.append(count_noun(self.repeated_count, "repeated stamp"))
        if self.backward_count:
            faults.append(count_noun(self.backward_count, "backward step"))
        if self.restart_count:
            times = count_noun(self.restart_count, "new beginning")
            faults.append(f"{times}, each after an unknown time without samples")
        if self.repeat_count:
            faults.append(
                f"{count_noun(self.repeat_count, 'row')} left out that repeat the one before"
            )
        if self.gap_count:
            missing = count_noun(self.missing_count, "missing sample")
            gaps = f"{missing} in {count_noun(self.gap_count, 'gap')}"
            faults.append(f"{gaps} (longest {shorten(self.longest_gap, 3)} s)")
        return faults


def count_noun(count: int, noun: str) -> str:
    """Return a count with its noun, in the plural unless the count is 1."""
    return f"{count} {noun}{'' if count == 1 else 's'}"


def describe_rate_error(stated: float, stamped: float) -> str:
    """Return a sentence on the effect of a wrong stated rate on angles; "" if there is none.

    Examples
    --------
    >>> describe_rate_error(100.0, 99.0)
    'every turn comes out 1 % too small; omit the rate to use that of the stamps'
    """
    error = stamped / stated - 1.0
    if abs(error) <= _SCALE_TOLERANCE:
        return ""
    size = "small" if error < 0.0 else "large"
    return (
        f"every turn comes out {shorten(100.0 * abs(error))} % too {size}; omit the rate to use "
        f"that of the stamps"
    )
