"""Motion of a receiver, and means of the sensors over the same windows."""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import Final

import numpy as np

from zerorate.geometry.earth import local_ned
from zerorate.navigation.events import DEFAULT_POSITION_SIGMA_M, DEFAULT_VELOCITY_SIGMA_M_S
from zerorate.record.fixes import Fixes
from zerorate.record.samples import Samples
from zerorate.types import Booleans, Floats, Integers

GRAVITY_M_S2: Final = 9.81
_WIDTH_S: Final = 1.0
"""Length of a window, s."""
_GAP_WIDTHS: Final = 2.5
"""Length of a gap between fixes, in window lengths or fix intervals."""
_MAX_TURN_SIGMA_RAD: Final = 0.35
"""Largest standard deviation of a change of course for a known course, rad."""


def sigma_of_position(fixes: Fixes) -> Floats:
    """Return the horizontal standard deviation of each position on each axis, m."""
    return _horizontal_sigma(fixes.position_sigma, DEFAULT_POSITION_SIGMA_M, len(fixes))


def sigma_of_velocity(fixes: Fixes) -> Floats:
    """Return the horizontal standard deviation of each velocity on each axis, m/s."""
    return _horizontal_sigma(fixes.velocity_sigma, DEFAULT_VELOCITY_SIGMA_M_S, len(fixes))


def _horizontal_sigma(stated: Floats | None, default: float, n: int) -> Floats:
    if stated is None:
        return np.full(n, default)
    squares = np.where(np.isnan(stated[:, :2]), default, stated[:, :2]) ** 2
    sigma: Floats = np.sqrt(squares.mean(axis=1))
    return sigma


@dataclass(frozen=True, eq=False)
class Epochs:
    """Velocities of a receiver at m times, with standard deviations.

    Parameters
    ----------
    time : ndarray, shape (m,)
        Times of the velocities, s.
    velocity : ndarray, shape (m, 3)
        Velocity north, east, down, m/s. The down component is NaN if unknown.
    sigma : ndarray, shape (m,)
        Standard deviation of the horizontal velocity on each axis, m/s.
    is_reported : bool
        True if the receiver reports velocities. False if they are differences of positions.
    """

    time: Floats
    velocity: Floats
    sigma: Floats
    is_reported: bool

    @classmethod
    def of(cls, fixes: Fixes) -> Epochs:
        """Return the reported velocities, or differences of positions if there are too few."""
        if fixes.velocity is not None:
            there = np.isfinite(fixes.velocity[:, :2]).all(axis=1)
            if there.sum() > max(2.0, 0.2 * len(fixes)):
                sigma = sigma_of_velocity(fixes)[there]
                return cls(fixes.time[there], fixes.velocity[there], sigma, is_reported=True)
        return cls.between_positions(fixes)

    @classmethod
    def between_positions(cls, fixes: Fixes) -> Epochs:
        """Return velocities from differences of positions, at the middle between two fixes."""
        there = np.isfinite(fixes.position[:, :2]).all(axis=1)
        position = fixes.position[there]
        height = np.isfinite(position[:, 2])
        position = np.column_stack([position[:, :2], np.nan_to_num(position[:, 2])])
        time, sigma = fixes.time[there], sigma_of_position(fixes)[there]
        dt = np.diff(time)
        way = local_ned(position[1:], position[:-1]) if len(dt) else np.empty((0, 3))
        velocity = way / dt[:, np.newaxis]
        velocity[~(height[1:] & height[:-1]), 2] = np.nan
        spread = np.hypot(sigma[1:], sigma[:-1]) / dt
        return cls(0.5 * (time[1:] + time[:-1]), velocity, spread, is_reported=False)

    @property
    def interval(self) -> float:
        """Median interval between velocities, s."""
        return float(np.median(np.diff(self.time))) if len(self.time) > 1 else _WIDTH_S

    @property
    def speed(self) -> Floats:
        """Horizontal speed, m/s."""
        return np.hypot(self.velocity[:, 0], self.velocity[:, 1])

    def shifted(self, seconds: float) -> Epochs:
        """Return the velocities with `seconds` added to their times."""
        return Epochs(self.time + seconds, self.velocity, self.sigma, self.is_reported)


@dataclass(frozen=True, eq=False)
class Windows:
    """Motion of a receiver over m windows with half overlap.

    Parameters
    ----------
    start, stop : ndarray, shape (m,)
        Start and end of each window, s.
    course_rate, course_sigma : ndarray, shape (m,)
        Rate of the course, rad/s to the right, and its standard deviation. NaN if unknown.
    along, across : ndarray, shape (m,)
        Acceleration along the course, and acceleration to its right, m/s^2.
    climb : ndarray, shape (m,)
        Slope of the road. 0 if unknown.
    speed : ndarray, shape (m,)
        Horizontal speed, m/s.
    sigma : ndarray, shape (m,)
        Standard deviation of an acceleration, m/s^2.
    """

    start: Floats
    stop: Floats
    course_rate: Floats
    course_sigma: Floats
    along: Floats
    across: Floats
    climb: Floats
    speed: Floats
    sigma: Floats

    @classmethod
    def of(cls, epochs: Epochs) -> Windows:
        """Return the windows of velocities."""
        time = epochs.time
        width = max(_WIDTH_S, 1.0 if epochs.is_reported else 2.0 * epochs.interval)
        first, last = _pair_epochs(time, width, epochs.interval)
        v, s = epochs.velocity, epochs.sigma
        seconds = time[last] - time[first]
        speed = np.maximum(epochs.speed, 1e-9)
        course = np.arctan2(v[:, 1], v[:, 0])
        turn = np.remainder(course[last] - course[first] + np.pi, 2.0 * np.pi) - np.pi
        sigma_turn = np.hypot(s[first] / speed[first], s[last] / speed[last])
        known = sigma_turn < _MAX_TURN_SIGMA_RAD
        both = v[first] + v[last]
        size = np.maximum(np.hypot(both[:, 0], both[:, 1]), 1e-9)
        north, east = both[:, 0] / size, both[:, 1] / size
        a = (v[last] - v[first])[:, :2] / seconds[:, np.newaxis]
        climb = np.clip(-both[:, 2] / size, -1.0, 1.0)
        return cls(
            time[first],
            time[last],
            np.where(known, turn / seconds, np.nan),
            np.where(known, sigma_turn / seconds, np.nan),
            np.where(known, a[:, 0] * north + a[:, 1] * east, np.nan),
            np.where(known, a[:, 1] * north - a[:, 0] * east, np.nan),
            np.where(np.isfinite(climb), climb, 0.0),
            0.5 * size,
            np.hypot(s[first], s[last]) / seconds,
        )

    def select(self, mask: Booleans) -> Windows:
        """Return the windows selected by a mask."""
        return Windows(*(getattr(self, column.name)[mask] for column in fields(self)))

    @property
    def course_known(self) -> Booleans:
        """Mask of windows with a known course."""
        mask: Booleans = np.isfinite(self.course_rate)
        return mask


def _pair_epochs(time: Floats, width: float, interval: float) -> tuple[Integers, Integers]:
    """Return the first epoch and the last epoch of each window."""
    if len(time) < 2:
        return np.empty(0, np.int64), np.empty(0, np.int64)
    grid = np.arange(time[0], time[-1], 0.5 * width)
    slack = 0.25 * interval
    first = np.searchsorted(time, grid - slack)
    last = np.maximum(np.searchsorted(time, time[first] + width - slack), first + 1)
    pairs = np.unique(np.column_stack([first, last])[last < len(time)], axis=0)
    first, last = pairs.T.astype(np.int64)
    near = time[last] - time[first] <= _GAP_WIDTHS * max(width, interval)
    return first[near], last[near]


@dataclass(frozen=True, eq=False)
class Means:
    """Means of gyro and force between any two times, from their integrals."""

    time: Floats
    integral: Floats
    missing: Floats

    @classmethod
    def of(cls, samples: Samples) -> Means:
        """Return the means for the samples of a recording."""
        values = np.concatenate((samples.gyro, samples.accel), axis=1)
        there = np.isfinite(values.sum(axis=1))
        values = np.where(there[:, np.newaxis], values, 0.0)
        dt = np.diff(samples.time)[:, np.newaxis]
        steps = 0.5 * (values[1:] + values[:-1]) * dt
        integral = np.concatenate((np.zeros((1, 6)), np.cumsum(steps, axis=0)))
        return cls(samples.time, integral, np.cumsum(~there).astype(np.float64))

    def between(self, start: Floats, stop: Floats) -> Floats:
        """Return the means between pairs of times, shape (m, 6). NaN if samples are missing."""
        means = np.empty((len(start), 6))
        seconds = stop - start
        for i, column in enumerate(self.integral.T):
            means[:, i] = np.interp(stop, self.time, column) - np.interp(start, self.time, column)
        inside = (start >= self.time[0]) & (stop <= self.time[-1])
        lost = np.interp(stop, self.time, self.missing) - np.interp(start, self.time, self.missing)
        means[~inside | (lost > 0.0)] = np.nan
        return means / seconds[:, np.newaxis]

    def about(self, axis: Floats) -> RotationAngle:
        """Return the rotation angle about an axis of the sensor."""
        return RotationAngle(self.time, self.integral[:, :3] @ axis)


@dataclass(frozen=True, eq=False)
class RotationAngle:
    """Angle about an axis since the first sample, rad."""

    time: Floats
    angle: Floats

    def rate(self, start: Floats, stop: Floats) -> Floats:
        """Return the mean rates between pairs of times, shape (m,), rad/s."""
        angle = np.interp(stop, self.time, self.angle) - np.interp(start, self.time, self.angle)
        inside = (start >= self.time[0]) & (stop <= self.time[-1])
        return np.where(inside, angle / (stop - start), np.nan)
