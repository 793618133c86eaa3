"""Velocity and course from positions only, by lines through the positions."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from zerorate.geometry.earth import local_ned
from zerorate.navigation.lag import Lag, find_lag, is_rate
from zerorate.navigation.windows import Means, RotationAngle, Windows, sigma_of_position
from zerorate.record.fixes import Fixes
from zerorate.types import Floats

_MIN_SHARE: Final = 0.6
"""Smallest share of a line's positions that must be present."""
_WIDTHS_S: Final = (1.0, 1.5, 2.0, 3.0, 4.0, 6.0, 8.0, 12.0)
_MAX_TURN_SIGMA_RAD: Final = 0.35
_SMOOTHING_STEP_S: Final = 0.02
MIN_TURNED_RAD: Final = 3.0
"""Smallest total change of course to find a clock offset, rad."""
_MIN_CORRELATION: Final = 0.9
_SLOPE_FACTOR: Final = 1.25
_MIN_OVERLAP: Final = 0.9
"""Smallest share of the squared course rates that must overlap the gyro's record."""
_PEAK_WIDTHS: Final = 1.5
_PEAK_WIDTH_S: Final = 5.0


@dataclass(frozen=True, eq=False)
class LineVelocities:
    """Slopes of least-squares lines through positions, one line per quarter of their width.

    Parameters
    ----------
    width : float
        Duration of each line, s.
    time : ndarray, shape (n,)
        Middle of each line, s.
    velocity : ndarray, shape (n, 2)
        Velocity north and east, m/s. NaN if there are too few positions.
    sigma : ndarray, shape (n,)
        Standard deviation on each axis, m/s.
    """

    width: float
    time: Floats
    velocity: Floats
    sigma: Floats

    @classmethod
    def of(cls, fixes: Fixes, width: float) -> LineVelocities:
        """Return the lines of a given width, s, through the positions of fixes."""
        there = np.isfinite(fixes.position[:, :2]).all(axis=1)
        time, sigma = fixes.time[there], sigma_of_position(fixes)[there]
        if len(time) < 3:
            return cls(width, np.empty(0), np.empty((0, 2)), np.empty(0))
        position = fixes.position[there]
        level = np.column_stack([position[:, :2], np.nan_to_num(position[:, 2])])
        metres = local_ned(level, level[0])[:, :2]
        middle = np.arange(time[0] + 0.5 * width, time[-1] - 0.5 * width + 1e-9, 0.25 * width)
        first = np.searchsorted(time, middle - 0.5 * width - 1e-6)
        last = np.searchsorted(time, middle + 0.5 * width + 1e-6)

        def summed(values: Floats) -> Floats:
            total = np.concatenate((np.zeros((1, *values.shape[1:])), np.cumsum(values, axis=0)))
            difference: Floats = total[last] - total[first]
            return difference

        since = time - time[0]
        n = np.maximum((last - first).astype(np.float64), 1.0)
        mean = summed(since) / n
        spread = summed(since**2) - n * mean**2
        centred = metres - metres.mean(axis=0)
        slope = summed(since[:, np.newaxis] * centred) - mean[:, np.newaxis] * summed(centred)
        due = width / max(float(np.median(np.diff(time))), 1e-6) + 1.0
        good = (last - first >= max(3.0, _MIN_SHARE * due)) & (spread > 1e-9)
        safe = np.where(good, spread, 1.0)
        own = np.sqrt(summed(sigma**2) / n / safe)
        velocity = np.where(good[:, np.newaxis], slope / safe[:, np.newaxis], np.nan)
        return cls(width, middle, velocity, np.where(good, own, np.inf))

    @property
    def speed(self) -> Floats:
        """Horizontal speed, m/s; 0 if unknown."""
        speed: Floats = np.nan_to_num(np.hypot(*self.velocity.T))
        return speed


@dataclass(frozen=True, eq=False)
class LineCourse:
    """Course rate from straight lines, the gyro's angle over the same lines, and their lag."""

    windows: Windows
    rotation: RotationAngle
    lag: Lag | None
    score: float
    turned: float

    @classmethod
    def of(cls, means: Means, fixes: Fixes, down: Floats, width: float) -> LineCourse:
        """Return the course from lines of a given width, s, and its lag."""
        windows, turn = _turns(LineVelocities.of(fixes, width))
        rotation = _smooth(means.about(down), width)
        lag = find_lag(rotation, windows, max(_PEAK_WIDTH_S, _PEAK_WIDTHS * width))
        known = windows.course_known
        turned = 0.25 * float(np.abs(turn[known]).sum())
        if lag is None:
            return cls(windows, rotation, None, 0.0, turned)
        score = math.atanh(min(abs(lag.correlation), 1.0 - 1e-9)) * math.sqrt(known.sum() / 4.0)
        inside = (windows.start + lag.seconds >= rotation.time[0]) & (
            windows.stop + lag.seconds <= rotation.time[-1]
        )
        energy = np.nan_to_num(turn) ** 2
        certain = bool(
            lag.certain
            and abs(lag.correlation) >= _MIN_CORRELATION
            and is_rate(lag.slope, _SLOPE_FACTOR)
            and energy[inside].sum() >= _MIN_OVERLAP * energy.sum()
            and turned >= MIN_TURNED_RAD
        )
        return cls(windows, rotation, replace(lag, certain=certain), score, turned)


def find_line_courses(means: Means, fixes: Fixes, down: Floats) -> list[LineCourse]:
    """Return the courses from lines of all widths, the best first. Certain lags come first."""
    courses = [LineCourse.of(means, fixes, down, width) for width in _widths(fixes)]
    return sorted(
        courses, key=lambda one: (one.lag is not None and one.lag.certain, one.score), reverse=True
    )


def _widths(fixes: Fixes) -> Iterator[float]:
    interval = float(np.median(np.diff(fixes.time))) if len(fixes) > 1 else math.inf
    yield from (width for width in _WIDTHS_S if width >= 2.0 * interval - 1e-6)


def _turns(lines: LineVelocities) -> tuple[Windows, Floats]:
    """Return the change of course from each line to the line one width later."""
    v, sigma, time = lines.velocity, lines.sigma, lines.time
    speed = np.maximum(np.hypot(*v.T), 1e-9)
    course, spread = np.arctan2(v[:, 1], v[:, 0]), sigma / speed
    turn = np.remainder(course[4:] - course[:-4] + np.pi, 2.0 * np.pi) - np.pi
    sigma_turn = np.hypot(spread[4:], spread[:-4])
    known = np.isfinite(turn) & (sigma_turn < _MAX_TURN_SIGMA_RAD)
    unknown = np.full(len(turn), np.nan)
    windows = Windows(
        time[:-4],
        time[4:],
        np.where(known, turn / lines.width, np.nan),
        np.where(known, sigma_turn / lines.width, np.nan),
        *[unknown] * 5,
    )
    return windows, turn


def _smooth(rotation: RotationAngle, width: float) -> RotationAngle:
    """Return the angle smoothed with parabolic weights, as a line fit smooths the course."""
    first, last = rotation.time[0], rotation.time[-1]
    grid = np.arange(first, last, _SMOOTHING_STEP_S)
    half = round(0.5 * width / _SMOOTHING_STEP_S)
    if len(grid) < 2 * half + 2:
        return rotation
    angle = np.interp(grid, rotation.time, rotation.angle)
    weights = 1.0 - (np.arange(-half, half + 1) / (half + 0.5)) ** 2
    size = 1 << int(len(grid) + len(weights)).bit_length()
    offset = angle[0]
    spectrum = np.fft.rfft(angle - offset, size) * np.fft.rfft(weights / weights.sum(), size)
    smooth = np.fft.irfft(spectrum, size)[2 * half : len(grid)] + offset
    return RotationAngle(grid[half : len(grid) - half], smooth)
