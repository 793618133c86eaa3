"""Which way the axes of the sensors look, by the force when a vehicle speeds up, brakes, turns."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final

import numpy as np

from zerorate.navigation.windows import GRAVITY, Means, Windows
from zerorate.types import Floats

_ROAD: Final = 0.3
"""Deviation of a mean force by what a receiver does not see, m/s^2."""
_HUBER: Final = 2.5
_BLOCK: Final = 10.0
_FEWEST: Final = 20
_YAW_SURE: Final = math.radians(2.0)
_ROUND: Final = 1.15
"""By how much the jackknife is too small: two thirds of 40 drives are within it so."""
_SIZE: Final = (0.7, 1.3)
_CORRELATION: Final = 0.6


@dataclass(frozen=True, eq=False)
class Axes:
    """What forces say of the axes of a sensor.

    Parameters
    ----------
    body_from_sensor : ndarray, shape (3, 3)
        Rotation from its axes to forward, right, down, as if they were right-handed.
    yaw : float
        Angle of forward from its x axis about down, rad.
    yaw_sigma : float
        Its deviation, rad.
    apart : float
        Of the right from where it should be beside forward, rad; about pi in mirrored axes.
    apart_sigma : float
        Its deviation, rad.
    certain : bool
        Whether the axes may be used without being asked.

    Examples
    --------
    >>> import zerorate as zr
    >>> drive = zr.simulate_drive(duration=200.0, seed=1)
    >>> axes = zr.navigation.check_navigation(drive.recording(), drive.fixes).axes
    >>> axes.certain, axes.handed, bool(abs(axes.yaw) < 4 * axes.yaw_sigma)
    (True, 'right', True)
    """

    body_from_sensor: Floats
    yaw: float
    yaw_sigma: float
    apart: float
    apart_sigma: float
    certain: bool

    @property
    def handed(self) -> str:
        """Handedness: "right", "left", or "" where it is not known."""
        size, sigma = abs(self.apart), self.apart_sigma
        if sigma > math.radians(30.0):
            return ""
        if size <= math.radians(60.0) and math.pi - size > 4.0 * sigma:
            return "right"
        return "left" if size >= max(math.radians(120.0), 4.0 * sigma) else ""

    @property
    def turn(self) -> float:
        """Angle of the whole rotation, rad."""
        return math.acos(min(1.0, max(-1.0, 0.5 * (float(np.trace(self.body_from_sensor)) - 1.0))))


@dataclass(frozen=True, eq=False)
class _Rows:
    """Mean forces with what they should be, and weights."""

    force: Floats
    motion: Floats
    weight: Floats
    block: Floats

    def without(self, block: float) -> _Rows:
        kept = self.block != block
        return _Rows(self.force[kept], self.motion[kept], self.weight[kept], self.block[kept])


def find_axes(means: Means, windows: Windows, lag: float) -> Axes | None:
    """Return what forces say of the axes, None if there is next to nothing to go by.

    Notes
    -----
    One regression of the mean force over a second on 1, the acceleration along the course with the
    slope of the way, and that across: its coefficients are up, forward and right in the sensor's
    axes. Deviations are by leaving out blocks of ten seconds.
    """
    rows = _rows(means, windows, lag)
    if len(rows.force) < _FEWEST:
        return None
    found = _coefficients(rows)
    if found is None:
        return None
    coefficients, rows = found
    up, forward, right = coefficients
    down = -up / max(float(np.linalg.norm(up)), 1e-9)
    first, second = _level(down)
    yaw, apart, procrustes = _angles(rows, coefficients, first, second)
    blocks = np.unique(rows.block)
    others = []
    for block in blocks:
        kept = rows.without(float(block))
        less = _solved(kept)
        if less is not None:
            others.append(_angles(kept, less, first, second))
    if len(others) < 3:
        return None
    _, apart_sigma, sigma = (
        _jackknife(np.array(values), own)
        for values, own in zip(zip(*others, strict=True), (yaw, apart, procrustes), strict=True)
    )
    sizes = [float(np.linalg.norm(one)) for one in (forward, right)]
    certain = (
        sigma <= _YAW_SURE
        and abs(apart) <= max(math.radians(5.0), 4.0 * apart_sigma)
        and all(_SIZE[0] <= size <= _SIZE[1] for size in sizes)
        and _correlation(rows, coefficients) >= _CORRELATION
    )
    ahead = math.cos(procrustes) * first + math.sin(procrustes) * second
    matrix = np.array([ahead, np.cross(down, ahead), down])
    return Axes(matrix, procrustes, _ROUND * sigma, apart, apart_sigma, certain)


def _rows(means: Means, windows: Windows, lag: float) -> _Rows:
    force = means.between(windows.start + lag, windows.stop + lag)[:, 3:]
    motion = np.column_stack(
        [np.ones(len(force)), windows.along + GRAVITY * windows.climb, windows.across]
    )
    there = np.isfinite(force.sum(axis=1) + motion.sum(axis=1))
    weight = 1.0 / (_ROAD**2 + windows.sigma**2)
    block = np.floor((windows.start - windows.start.min(initial=0.0)) / _BLOCK)
    return _Rows(force[there], motion[there], weight[there], block[there])


def _solved(rows: _Rows) -> Floats | None:
    """Return up, forward and right in the sensor's axes, the rows of a matrix."""
    normal = rows.motion.T @ (rows.weight[:, np.newaxis] * rows.motion)
    if len(rows.force) < 3 or np.linalg.cond(normal) > 1e10:
        return None
    return np.asarray(np.linalg.solve(normal, rows.motion.T @ (rows.weight[:, None] * rows.force)))


def _coefficients(rows: _Rows) -> tuple[Floats, _Rows] | None:
    """Return them with weights that outliers have lost (Huber)."""
    own = rows
    for _ in range(5):
        found = _solved(own)
        if found is None:
            return None
        off = np.linalg.norm(rows.force - rows.motion @ found, axis=1)
        limit = _HUBER * max(float(np.median(off)), 1e-9)
        factor = np.minimum(1.0, limit / np.maximum(off, 1e-12))
        own = _Rows(rows.force, rows.motion, rows.weight * factor, rows.block)
    found = _solved(own)
    return None if found is None else (found, own)


def _level(down: Floats) -> tuple[Floats, Floats]:
    """Return level axes: the first is the sensor's x where it is level, the second right of it."""
    x = np.eye(3)[0 if abs(down[0]) < 0.9 else 1]
    first = x - (x @ down) * down
    first /= np.linalg.norm(first)
    return first, np.cross(down, first)


def _angles(
    rows: _Rows, coefficients: Floats, first: Floats, second: Floats
) -> tuple[float, float, float]:
    """Return the angle of forward, how far the right is from where it should be, and the yaw."""
    _, forward, right = coefficients
    ahead = math.atan2(forward @ second, forward @ first)
    aside = math.atan2(right @ second, right @ first) - 0.5 * math.pi
    centre = rows.weight / rows.weight.sum()
    x = rows.motion[:, 1:] - centre @ rows.motion[:, 1:]
    force = rows.force - centre @ rows.force
    y = np.column_stack([force @ first, force @ second])
    m = x.T @ (rows.weight[:, np.newaxis] * y)
    return ahead, _wrapped(ahead - aside), math.atan2(m[0, 1] - m[1, 0], m[0, 0] + m[1, 1])


def _jackknife(values: Floats, own: float) -> float:
    n = len(values)
    off = np.remainder(values - own + math.pi, 2.0 * math.pi) - math.pi
    return math.sqrt((n - 1.0) / n * float(((off - off.mean()) ** 2).sum()))


def _correlation(rows: _Rows, coefficients: Floats) -> float:
    level = rows.force - (rows.weight / rows.weight.sum()) @ rows.force
    fitted = rows.motion[:, 1:] @ coefficients[1:]
    fitted -= (rows.weight / rows.weight.sum()) @ fitted
    w = rows.weight[:, np.newaxis]
    both = float((w * level * fitted).sum())
    size = math.sqrt(float((w * level**2).sum()) * float((w * fitted**2).sum()))
    return both / size if size > 0.0 else 0.0


def _wrapped(angle: float) -> float:
    return math.remainder(angle, 2.0 * math.pi)
