"""Error of an integrated rate: noise, bias and gaps, propagated through the orientation."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np

from zerorate.geometry.rotations import to_matrices
from zerorate.types import Floats

_BLOCK_SAMPLES: Final = 1 << 16
"""Number of samples processed at once: a day at 1 kHz must not fill the memory with matrices."""


@dataclass(frozen=True, eq=False)
class RateErrors:
    """Errors of a rate about each axis of the body, shape (k,), SI units.

    Parameters
    ----------
    white
        Angle random walk N.
    bias
        Standard deviation of the constant bias.
    walk
        Rate random walk K; the walk starts at zero at the first sample.
    """

    white: Floats
    bias: Floats
    walk: Floats


def angle_sigma(
    orientation: Floats | None, steps: Floats, errors: RateErrors, gaps: Floats
) -> Floats:
    """Return the standard deviation of the angle about each axis of the first sample.

    A rate error w in the body rotates the result by the integral of R w; R is the orientation. Let
    C be the integral of R. A constant bias b contributes C b. A step of the random walk at time s
    contributes C(t) - C(s). Without rotation the errors are N sqrt(t), b t and K sqrt(t^3/3).

    Parameters
    ----------
    orientation
        Quaternions, shape (n, 4), or None for a single axis.
    steps
        Time from each sample to the next, s, shape (n - 1,).
    errors
        Rate errors of k axes.
    gaps
        Variance of the angle added by a gap at each sample, shape (n, k), rad^2.

    Returns
    -------
    ndarray, shape (n, k)
        Standard deviation, rad.
    """
    n, k = gaps.shape
    variance = np.empty((n, k))
    state = _Integrals(k)
    for first in range(0, n, _BLOCK_SAMPLES):
        part = slice(first, min(first + _BLOCK_SAMPLES, n))
        before = steps[max(first - 1, 0) : part.stop - 1]
        dt = before if first else np.concatenate(([0.0], before))
        R = np.ones((len(dt), 1, 1)) if orientation is None else to_matrices(orientation[part])
        variance[part] = state.advance(R, dt, errors, gaps[part])
    return np.sqrt(np.maximum(variance, 0.0))


class _Integrals:
    """Integrals of R, C, their elementwise squares, and gaps up to a sample."""

    def __init__(self, k: int) -> None:
        zeros = np.zeros((k, k))
        self._R: Floats | None = None
        self._C = self._R2 = self._C1 = self._C2 = zeros
        self._gaps, self._time = np.zeros(k), 0.0

    def advance(self, R: Floats, dt: Floats, errors: RateErrors, gaps: Floats) -> Floats:
        """Return the variances at the next samples, shape (m, k)."""
        before = R[:1] if self._R is None else self._R
        after_R = np.concatenate((before, R))
        C = _cumulative_integral(after_R, dt, self._C)
        after_C = np.concatenate((self._C[None], C))
        R2 = _cumulative_integral(after_R**2, dt, self._R2)
        C1, C2 = (
            _cumulative_integral(after_C, dt, self._C1),
            _cumulative_integral(after_C**2, dt, self._C2),
        )
        time = self._time + np.cumsum(dt)
        of_gaps = self._gaps + np.cumsum(_multiply_variances(R**2, gaps), axis=0)
        self._R, self._C, self._R2, self._C1, self._C2 = R[-1:], C[-1], R2[-1], C1[-1], C2[-1]
        self._time, self._gaps = float(time[-1]), of_gaps[-1]
        walk = C**2 * time[:, None, None] - 2.0 * C * C1 + C2
        total: Floats = R2 @ errors.white**2 + C**2 @ errors.bias**2 + walk @ errors.walk**2
        return total + of_gaps


def _multiply_variances(squares: Floats, variances: Floats) -> Floats:
    """Return squares @ variances for each sample; zero times infinity is infinite."""
    if np.isfinite(variances).all():
        products: Floats = np.einsum("nij,nj->ni", squares, variances)
        return products
    known = _multiply_variances(squares, np.where(np.isfinite(variances), variances, 0.0))
    known[~np.isfinite(variances).all(axis=1)] = np.inf
    return known


def _cumulative_integral(values: Floats, dt: Floats, start: Floats) -> Floats:
    means = 0.5 * (values[1:] + values[:-1]) * dt[:, None, None]
    return start + np.cumsum(means, axis=0)
