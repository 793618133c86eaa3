"""What is to be added to the times of fixes so that they are on the clock of the sensors."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Final

from zerorate.faults import ArgumentError
from zerorate.record.fixes import Fixes
from zerorate.views import Result

_TOLD: Final = 3.0
"""Deviations beyond which something is told."""


@dataclass(frozen=True)
class TimeOffset(Result):
    """A difference of two clocks, as `find_time_offset` returns it.

    Parameters
    ----------
    seconds : float
        To be added to the times of the fixes, as those of their positions; NaN if it is not
        identifiable.
    sigma : float
        Its standard deviation, s; infinite if it is not identifiable.
    velocity_seconds : float
        To be added to the times of their velocities, which a receiver may filter on their own; NaN
        if it is that of the positions.
    velocity_sigma : float
        Its standard deviation, s.
    rate : float
        Seconds by which the offset grows in a second.
    rate_sigma : float
        Its standard deviation.
    middle : float
        Time of a fix at which the offsets hold, s.
    nis : float
        Mean normalised innovation squared of a scalar with it, 1 if all is right; NaN if not known.

    Examples
    --------
    >>> import zerorate as zr
    >>> drive = zr.simulate_drive(50.0, 120.0, seed=1)
    >>> start = zr.navigation.find_start(drive.recording(), drive.fixes)
    >>> found = zr.navigation.find_time_offset(drive.recording(), drive.fixes.shifted(0.12), start)
    >>> found.identifiable, bool(found.applied(drive.fixes).time[0] < drive.fixes.time[0])
    (True, True)
    """

    seconds: float
    sigma: float
    velocity_seconds: float = math.nan
    velocity_sigma: float = math.nan
    rate: float = 0.0
    rate_sigma: float = math.nan
    middle: float = 0.0
    nis: float = math.nan

    @classmethod
    def of(cls, given: float | TimeOffset) -> TimeOffset:
        """Return an offset of one number as one that is known.

        Raises
        ------
        ValueError
            If it is not a finite number.
        """
        offset = given if isinstance(given, TimeOffset) else cls(float(given), 0.0)
        if not math.isfinite(offset.seconds):
            raise ArgumentError("time_offset", f"must be a number of seconds, got {offset.seconds}")
        return offset

    @property
    def identifiable(self) -> bool:
        """Whether the record tells it: the vehicle must change its velocity."""
        return math.isfinite(self.sigma)

    @property
    def parts(self) -> tuple[tuple[str, float, float], ...]:
        """Names, values and deviations of all that is told."""
        found = [("time offset, s", self.seconds, self.sigma)]
        if math.isfinite(self.velocity_seconds):
            found.append(("of velocities, s", self.velocity_seconds, self.velocity_sigma))
        if self.rate:
            found.append(("rate", self.rate, self.rate_sigma))
        return tuple(found)

    def applied(self, fixes: Fixes) -> Fixes:
        """Return fixes on the clock of the sensors."""
        if not self.rate and not math.isfinite(self.velocity_seconds):
            return fixes.shifted(self.seconds)
        drift = self.rate * (fixes.time - self.middle)
        epoch = None if fixes.epoch is None else fixes.epoch - self.seconds
        own = fixes.velocity_time
        later = self.seconds if math.isnan(self.velocity_seconds) else self.velocity_seconds
        velocity = (fixes.time if own is None else own) + later + drift
        time = fixes.time + self.seconds + drift
        together = math.isnan(self.velocity_seconds) and own is None
        return replace(fixes, time=time, velocity_time=None if together else velocity, epoch=epoch)

    def differs(self, told: float, least: float) -> bool:
        """Whether it is surely another one than is told, by so much at least, s."""
        if not self.identifiable:
            return False
        offsets = [(self.seconds, self.sigma)]
        if math.isfinite(self.velocity_seconds):
            offsets.append((self.velocity_seconds, self.velocity_sigma))
        apart = any(abs(x - told) > max(least, _TOLD * sigma) for x, sigma in offsets)
        return apart or abs(self.rate) > _TOLD * self.rate_sigma
