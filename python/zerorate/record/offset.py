"""Offset between the clocks of fixes and sensors."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Final

from zerorate.faults import ArgumentError
from zerorate.record.fixes import Fixes
from zerorate.views import Result

_SIGNIFICANCE_SIGMAS: Final = 3.0
"""Smallest offset that is reported, in standard deviations."""


@dataclass(frozen=True)
class TimeOffset(Result):
    """Offset between two clocks, as `find_time_offset` returns it.

    Parameters
    ----------
    seconds : float
        Offset to add to the times of positions, s; NaN if it is not identifiable.
    sigma : float
        Standard deviation of `seconds`, s; infinite if not identifiable.
    velocity_seconds : float
        Offset to add to the times of velocities, s; NaN if it is equal to `seconds`. It can differ
        because receivers may filter velocities separately.
    velocity_sigma : float
        Standard deviation of `velocity_seconds`, s.
    rate : float
        Growth of the offsets, s per s.
    rate_sigma : float
        Standard deviation of `rate`, s per s.
    middle : float
        Time of a fix to which both offsets refer, s. At other times, `rate` changes them.
    nis : float
        Mean normalised innovation squared per scalar with this offset; 1 if the model is right, NaN
        if unknown.
    antenna : tuple of float or None
        Vector from the sensors to the antenna, m forward, right, down. It is estimated together
        with the offset; None if not estimated.
    antenna_sigma : tuple of float or None
        Standard deviations of `antenna`, m.

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
    antenna: tuple[float, float, float] | None = None
    antenna_sigma: tuple[float, float, float] | None = None

    @classmethod
    def of(cls, value: float | TimeOffset) -> TimeOffset:
        """Return a known offset from a number.

        Raises
        ------
        ValueError
            If the number is not finite.
        """
        offset = value if isinstance(value, TimeOffset) else cls(float(value), 0.0)
        if not math.isfinite(offset.seconds):
            raise ArgumentError("time_offset", f"must be a number of seconds, got {offset.seconds}")
        return offset

    @property
    def identifiable(self) -> bool:
        """True if the record determines the offset, which requires changes of velocity."""
        return math.isfinite(self.sigma)

    @property
    def parts(self) -> tuple[tuple[str, float, float], ...]:
        """Names, values and standard deviations of the reported numbers."""
        rows = [("time offset, s", self.seconds, self.sigma)]
        if math.isfinite(self.velocity_seconds):
            rows.append(("of velocities, s", self.velocity_seconds, self.velocity_sigma))
        if self.rate:
            rows.append(("rate", self.rate, self.rate_sigma))
        return tuple(rows)

    def applied(self, fixes: Fixes) -> Fixes:
        """Return fixes with times on the sensors' clock."""
        if not self.rate and not math.isfinite(self.velocity_seconds):
            return fixes.shifted(self.seconds)
        drift = self.rate * (fixes.time - self.middle)
        epoch = None if fixes.epoch is None else fixes.epoch - self.seconds
        velocity_time = fixes.velocity_time
        velocity_offset = (
            self.seconds if math.isnan(self.velocity_seconds) else self.velocity_seconds
        )
        velocity = (
            (fixes.time if velocity_time is None else velocity_time) + velocity_offset + drift
        )
        time = fixes.time + self.seconds + drift
        same_clock = math.isnan(self.velocity_seconds) and velocity_time is None
        return replace(
            fixes, time=time, velocity_time=None if same_clock else velocity, epoch=epoch
        )

    def differs(self, stated: float, min_difference: float) -> bool:
        """Return True if it differs from `stated` significantly and by over `min_difference`."""
        if not self.identifiable:
            return False
        offsets = [(self.seconds, self.sigma)]
        if math.isfinite(self.velocity_seconds):
            offsets.append((self.velocity_seconds, self.velocity_sigma))
        apart = any(
            abs(x - stated) > max(min_difference, _SIGNIFICANCE_SIGMAS * sigma)
            for x, sigma in offsets
        )
        return apart or abs(self.rate) > _SIGNIFICANCE_SIGMAS * self.rate_sigma
