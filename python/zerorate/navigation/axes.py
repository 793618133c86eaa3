"""Sensor axes of a vehicle, from the forces when it speeds up, brakes and turns."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final

import numpy as np

from zerorate.navigation.windows import GRAVITY_M_S2, Means, Windows
from zerorate.types import Floats

_ROAD_NOISE_M_S2: Final = 0.3
"""Standard deviation of a mean force by motion that the receiver does not measure, m/s^2."""
_HUBER_LIMIT: Final = 2.5
_BLOCK_S: Final = 10.0
_MIN_WINDOWS: Final = 20
_MAX_YAW_SIGMA_RAD: Final = math.radians(2.0)
_JACKKNIFE_FACTOR: Final = 1.15
"""Factor on the jackknife's sigma, so that two thirds of 40 drives are within one sigma."""
_GAIN_RANGE: Final = (0.7, 1.3)
_MIN_CORRELATION: Final = 0.6


@dataclass(frozen=True, eq=False)
class Axes:
    """Axes of a sensor, estimated from forces.

    Parameters
    ----------
    body_from_sensor : ndarray, shape (3, 3)
        Rotation from the sensor's axes to forward, right, down. The sensor is assumed right-handed.
    yaw : float
        Angle about down from the sensor's x axis to forward, rad.
    yaw_sigma : float
        Standard deviation of `yaw`, rad.
    skew : float
        Angle between the measured right axis and its expected direction, rad. It is about pi for
        mirrored axes.
    skew_sigma : float
        Standard deviation of `skew`, rad.
    certain : bool
        True if the axes are certain enough to be used without confirmation.

    Examples
    --------
    >>> import zerorate as zr
    >>> drive = zr.simulate_drive(duration=200.0, seed=1)
    >>> axes = zr.navigation.check_navigation(drive.recording(), drive.fixes).axes
    >>> axes.certain, axes.handedness, bool(abs(axes.yaw) < 4 * axes.yaw_sigma)
    (True, 'right', True)
    """

    body_from_sensor: Floats
    yaw: float
    yaw_sigma: float
    skew: float
    skew_sigma: float
    certain: bool

    @property
    def handedness(self) -> str:
        """Handedness of the axes: "right", "left", or "" if it is unknown."""
        size, sigma = abs(self.skew), self.skew_sigma
        if sigma > math.radians(30.0):
            return ""
        if size <= math.radians(60.0) and math.pi - size > 4.0 * sigma:
            return "right"
        return "left" if size >= max(math.radians(120.0), 4.0 * sigma) else ""

    @property
    def turn(self) -> float:
        """Angle of the rotation `body_from_sensor`, rad."""
        return math.acos(min(1.0, max(-1.0, 0.5 * (float(np.trace(self.body_from_sensor)) - 1.0))))


@dataclass(frozen=True, eq=False)
class _ForceSamples:
    """Mean forces, their expected values, and their weights."""

    force: Floats
    motion: Floats
    weight: Floats
    block: Floats

    def drop_block(self, block: float) -> _ForceSamples:
        mask = self.block != block
        return _ForceSamples(
            self.force[mask], self.motion[mask], self.weight[mask], self.block[mask]
        )


def find_axes(means: Means, windows: Windows, lag: float) -> Axes | None:
    """Estimate the axes of a sensor from forces. Returns None if there is almost no motion.

    Notes
    -----
    The mean force over a second is a linear function of three regressors. They are 1, the
    acceleration along the course (including the road's slope), and the acceleration across the
    course. The coefficients are the directions up, forward and right in the sensor's axes. A
    jackknife over blocks of ten seconds gives the standard deviations.
    """
    rows = _pair_forces(means, windows, lag)
    if len(rows.force) < _MIN_WINDOWS:
        return None
    fit = _fit_coefficients(rows)
    if fit is None:
        return None
    coefficients, rows = fit
    up, forward, right = coefficients
    down = -up / max(float(np.linalg.norm(up)), 1e-9)
    first, second = _level_axes(down)
    yaw, skew, procrustes = _fit_angles(rows, coefficients, first, second)
    blocks = np.unique(rows.block)
    replicates = []
    for block in blocks:
        subset = rows.drop_block(float(block))
        estimate = _solve(subset)
        if estimate is not None:
            replicates.append(_fit_angles(subset, estimate, first, second))
    if len(replicates) < 3:
        return None
    _, skew_sigma, sigma = (
        _jackknife_sigma(np.array(values), own)
        for values, own in zip(zip(*replicates, strict=True), (yaw, skew, procrustes), strict=True)
    )
    sizes = [float(np.linalg.norm(vector)) for vector in (forward, right)]
    certain = (
        sigma <= _MAX_YAW_SIGMA_RAD
        and abs(skew) <= max(math.radians(5.0), 4.0 * skew_sigma)
        and all(_GAIN_RANGE[0] <= size <= _GAIN_RANGE[1] for size in sizes)
        and _correlation(rows, coefficients) >= _MIN_CORRELATION
    )
    ahead = math.cos(procrustes) * first + math.sin(procrustes) * second
    matrix = np.array([ahead, np.cross(down, ahead), down])
    return Axes(matrix, procrustes, _JACKKNIFE_FACTOR * sigma, skew, skew_sigma, certain)


def _pair_forces(means: Means, windows: Windows, lag: float) -> _ForceSamples:
    force = means.between(windows.start + lag, windows.stop + lag)[:, 3:]
    motion = np.column_stack(
        [np.ones(len(force)), windows.along + GRAVITY_M_S2 * windows.climb, windows.across]
    )
    present = np.isfinite(force.sum(axis=1) + motion.sum(axis=1))
    weight = 1.0 / (_ROAD_NOISE_M_S2**2 + windows.sigma**2)
    block = np.floor((windows.start - windows.start.min(initial=0.0)) / _BLOCK_S)
    return _ForceSamples(force[present], motion[present], weight[present], block[present])


def _solve(rows: _ForceSamples) -> Floats | None:
    """Return a matrix with rows up, forward and right, in the sensor's axes."""
    normal = rows.motion.T @ (rows.weight[:, np.newaxis] * rows.motion)
    if len(rows.force) < 3 or np.linalg.cond(normal) > 1e10:
        return None
    return np.asarray(np.linalg.solve(normal, rows.motion.T @ (rows.weight[:, None] * rows.force)))


def _fit_coefficients(rows: _ForceSamples) -> tuple[Floats, _ForceSamples] | None:
    """Return the coefficients, and the samples with Huber weights against outliers."""
    own = rows
    for _ in range(5):
        solution = _solve(own)
        if solution is None:
            return None
        off = np.linalg.norm(rows.force - rows.motion @ solution, axis=1)
        limit = _HUBER_LIMIT * max(float(np.median(off)), 1e-9)
        factor = np.minimum(1.0, limit / np.maximum(off, 1e-12))
        own = _ForceSamples(rows.force, rows.motion, rows.weight * factor, rows.block)
    solution = _solve(own)
    return None if solution is None else (solution, own)


def _level_axes(down: Floats) -> tuple[Floats, Floats]:
    """Return two level axes: x, or y if x is vertical, made level; and the axis to its right."""
    x = np.eye(3)[0 if abs(down[0]) < 0.9 else 1]
    first = x - (x @ down) * down
    first /= np.linalg.norm(first)
    return first, np.cross(down, first)


def _fit_angles(
    rows: _ForceSamples, coefficients: Floats, first: Floats, second: Floats
) -> tuple[float, float, float]:
    """Return the angle of forward, the skew of the right axis, and the yaw, rad."""
    _, forward, right = coefficients
    ahead = math.atan2(forward @ second, forward @ first)
    aside = math.atan2(right @ second, right @ first) - 0.5 * math.pi
    centre = rows.weight / rows.weight.sum()
    x = rows.motion[:, 1:] - centre @ rows.motion[:, 1:]
    force = rows.force - centre @ rows.force
    y = np.column_stack([force @ first, force @ second])
    m = x.T @ (rows.weight[:, np.newaxis] * y)
    return ahead, _wrap(ahead - aside), math.atan2(m[0, 1] - m[1, 0], m[0, 0] + m[1, 1])


def _jackknife_sigma(values: Floats, own: float) -> float:
    n = len(values)
    off = np.remainder(values - own + math.pi, 2.0 * math.pi) - math.pi
    return math.sqrt((n - 1.0) / n * float(((off - off.mean()) ** 2).sum()))


def _correlation(rows: _ForceSamples, coefficients: Floats) -> float:
    level = rows.force - (rows.weight / rows.weight.sum()) @ rows.force
    fitted = rows.motion[:, 1:] @ coefficients[1:]
    fitted -= (rows.weight / rows.weight.sum()) @ fitted
    w = rows.weight[:, np.newaxis]
    both = float((w * level * fitted).sum())
    size = math.sqrt(float((w * level**2).sum()) * float((w * fitted**2).sum()))
    return both / size if size > 0.0 else 0.0


def _wrap(angle: float) -> float:
    return math.remainder(angle, 2.0 * math.pi)
