"""Hard iron without a gyro: the centre of a sphere through samples in all directions."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np

from zerorate.types import Floats

_ITERATIONS: Final = 10
_MIN_DIRECTION_VARIANCE: Final = 0.10
"""Smallest variance of the directions along any axis; evenly spread directions have a third."""
_MIN_RADIUS: Final = 0.3
"""Smallest radius of a sphere, relative to the samples' size: below it only noise was fitted."""
_MAX_SCATTER_RATIO: Final = 0.40
_PRIOR_SIGMA: Final = 1.0
_MIN_SCATTER: Final = 0.01


@dataclass(frozen=True, eq=False)
class Sphere:
    """A sphere through samples, in units of their median size.

    Parameters
    ----------
    iron : ndarray, shape (3,)
        Centre of the sphere.
    radius
        Radius of the sphere.
    covariance : ndarray, shape (3, 3)
        Covariance of the centre.
    raw, left
        RMS of the samples' size about its mean: of raw samples, and of samples minus the centre.
    covered
        True if the samples point in all directions.
    norm
        Median size of the samples, in their unit.
    """

    iron: Floats
    radius: float
    covariance: Floats
    raw: float
    left: float
    covered: bool
    norm: float

    @property
    def applied(self) -> bool:
        """True if the sphere more than halves the scatter of the field's size."""
        return self.covered and self.left < _MAX_SCATTER_RATIO * self.raw


def fit_sphere(field: Floats, seconds: float) -> Sphere:
    """Return the sphere through complete samples, shape (n, 3), over a duration in s."""
    norm = float(np.median(np.linalg.norm(field, axis=1)))
    m = field / norm
    rows = np.column_stack([2.0 * m, np.ones(len(m))])
    weights = np.ones(len(m))
    iron, radius, residuals = np.zeros(3), 1.0, np.zeros(len(m))
    for _ in range(_ITERATIONS):
        solution = np.linalg.lstsq(
            rows * weights[:, None], (m**2).sum(axis=1) * weights, rcond=None
        )[0]
        iron = solution[:3]
        radius = float(np.sqrt(max(solution[3] + iron @ iron, 1e-12)))
        residuals = np.linalg.norm(m - iron, axis=1) - radius
        spread = max(float(np.median(np.abs(residuals))) / 0.6745, 1e-4)
        weights = np.sqrt(np.minimum(1.0, 2.5 * spread / np.maximum(np.abs(residuals), 1e-9)))
    unit_vectors = (m - iron) / np.maximum(np.linalg.norm(m - iron, axis=1), 1e-9)[:, None]
    shape = np.cov(unit_vectors.T, bias=True)
    count = min(max(seconds / 10.0, 0.5), 4.0)
    scatter = float(np.sqrt(np.mean(np.minimum(residuals**2, 50.0 * np.median(residuals**2)))))
    information = shape * count / max(scatter, _MIN_SCATTER) ** 2 + np.eye(3) / _PRIOR_SIGMA**2
    sizes = np.linalg.norm(m, axis=1)
    return Sphere(
        iron,
        radius,
        np.asarray(np.linalg.inv(information), dtype=np.float64),
        float(sizes.std()),
        scatter,
        bool(
            np.linalg.eigvalsh(shape)[0] > _MIN_DIRECTION_VARIANCE
            and _MIN_RADIUS < radius < 1.0 / _MIN_RADIUS
        ),
        norm,
    )
