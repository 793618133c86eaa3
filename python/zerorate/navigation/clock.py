"""By how much the clock of a receiver differs from that of the sensors."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from zerorate._native import NavigationFilter
from zerorate.io import Recording
from zerorate.navigation.alignment import Alignment
from zerorate.navigation.fixes import Fixes
from zerorate.types import Floats
from zerorate.views import Result

__all__ = ["TimeOffset", "find_time_offset"]

_SPAN: Final = 0.5
"""Seconds that are searched on both sides; the filter takes fixes up to a second late."""
_COARSE: Final = 0.05
_FINE: Final = 0.01
_MEDIAN: Final = 2.366
"""Of chi-squared with three degrees of freedom."""
_DEGREES: Final = 4.0
"""Of the Student distribution that innovations are taken to have: outliers count little."""
_OPEN: Final = 1e12
"""A gate that lets all pass."""
_UNCERTAIN: Final = 0.1
"""A standard deviation, s, above which nothing is known."""


@dataclass(frozen=True)
class TimeOffset(Result):
    """A difference of two clocks, as `find_time_offset` returns it.

    Parameters
    ----------
    seconds : float
        To be added to the times of the fixes, ``time_offset`` of ``NavigationFilter.process``; NaN
        if it is not identifiable.
    sigma : float
        Its standard deviation, s; infinite if it is not identifiable.
    """

    seconds: float
    sigma: float

    @property
    def identifiable(self) -> bool:
        """Whether the record tells it: the vehicle must change its velocity."""
        return math.isfinite(self.sigma)


def find_time_offset(
    imu: Recording,
    gnss: Fixes,
    start: Alignment,
    *,
    time_offset: float = 0.0,
    **options: Any,  # noqa: ANN401
) -> TimeOffset:
    """Find what is to be added to the times of the fixes so that they fit the sensors.

    The filter runs over the recording with offsets of up to half a second; the best is the one
    with the smallest innovations of velocity. A filter takes a part of the offset for a bias of
    the accelerometer, and its deviations say nothing of it.

    Parameters
    ----------
    imu : Recording
        As ``NavigationFilter.process`` takes it, in the axes of the body.
    gnss : Fixes
        Of the receiver. Velocities that lag behind positions are seen as an offset.
    start : Alignment
        As of `NavigationFilter`.
    time_offset : float
        Where to search from, s.
    **options
        As of `NavigationFilter`, without ``adapt`` and ``gate``: here a receiver is believed, for
        what is taken for its noise is not seen as a clock.

    Raises
    ------
    ValueError
        If an option is out of range, the filter never begins, or there are no velocities:
        positions alone would not tell an offset from a drift.

    Notes
    -----
    Twice the negative logarithm of the likelihood of the innovations, of four degrees of freedom
    and scaled by their median, has a minimum at the offset; about it it grows by one at a standard
    deviation. Neighbouring innovations are taken for independent: with many fixes a second the
    deviation is too small.

    Examples
    --------
    >>> import zerorate as zr
    >>> drive = zr.simulate_drive(50.0, 120.0, seed=1)
    >>> start = zr.align(drive.recording(), latitude=48.0, heading="course")
    >>> late = drive.fixes.shifted(0.12)
    >>> found = zr.navigation.find_time_offset(drive.recording(), late, start)
    >>> abs(found.seconds + 0.12) < 4 * found.sigma < 0.1
    True
    """
    for name in ("adapt", "gate"):
        if name in options:
            raise ValueError(f"{name} is not used here: every fix counts, as it says")
    nav = NavigationFilter(start, adapt="fixed", gate=_OPEN, **options)
    runs = _Runs(imu, gnss, nav)
    coarse = time_offset + np.arange(-_SPAN, _SPAN + 0.5 * _COARSE, _COARSE)
    known = [runs.innovations(x) for x in coarse]
    scale = max(1.0, min(float(np.median(nis)) for nis in known) / _MEDIAN)
    best = float(coarse[np.argmin([_misfit(nis, scale) for nis in known])])
    fine = best + _FINE * np.arange(-5, 6)
    misfits = np.array([_misfit(runs.innovations(x), scale) for x in fine]) * len(known[0])
    curvature, slope, _ = np.polyfit(fine - best, misfits, 2)
    if not curvature > 0.0:
        return TimeOffset(math.nan, math.inf)
    sigma, at = 1.0 / math.sqrt(curvature), best - slope / (2.0 * curvature)
    if sigma > _UNCERTAIN or abs(at - time_offset) > _SPAN:
        return TimeOffset(math.nan, math.inf)
    return TimeOffset(float(at), sigma)


def _misfit(nis: Floats, scale: float) -> float:
    """Return twice the mean negative logarithm of the likelihood, but for a constant."""
    # Fixes at both ends come and go with the offset: a mean, not a sum.
    return float((_DEGREES + 3.0) * np.log1p(nis / (_DEGREES * scale)).mean())


class _Runs:
    """Runs of one filter with fixes at other times."""

    def __init__(self, imu: Recording, gnss: Fixes, nav: NavigationFilter) -> None:
        self._imu, self._gnss, self._nav = imu, gnss, nav

    def innovations(self, offset: float) -> Floats:
        """Return those of velocities, normalised and squared."""
        nav = self._nav.copy()
        track = nav.process(self._imu, self._gnss, time_offset=float(offset), keep="track")
        told = track.nis()[:, 1]
        known: Floats = told[np.isfinite(told)]
        if not known.size:
            raise ValueError(
                f"{self._gnss.source}: no velocity is used, by which an offset is found: the "
                "filter does not begin, or the receiver tells none"
            )
        return known
