"""Bias of the gyro and its sensitivity to acceleration, from the means at rests."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np

from zerorate.types import Booleans, Floats

G_PRIOR_RAD_S: Final = 0.2 * np.pi / 180.0
"""Prior standard deviation of an element of G, rad/s per gravity: data sheets of MEMS gyros state
up to 0.1 deg/s/g, and some sensors exceed this.
"""

_MAX_SIGMA_RATIO: Final = 0.3
_MIN_NOISE_RAD_S: Final = 1e-9
_PINNED_SIGMA_RATIO: Final = 1e-6
_WALK_VARIANCES: Final = np.concatenate(([0.0], np.geomspace(0.01, 1e4, 13)))
"""Variances of the walk within the mean time between rests, over the variance of a rest's mean."""


@dataclass(frozen=True, eq=False)
class RestEstimate:
    """Gyro bias and g-sensitivity, estimated at rest.

    Parameters
    ----------
    bias, sensitivity
        Mean bias of the record, unit of the gyro, shape (3,); and G, unit of the gyro per gravity,
        shape (3, 3).
    covariance
        Covariance of each axis' bias and its row of G, shape (3, 4, 4).
    spread
        Standard deviation of the bias about its mean over the record, shape (3,).
    identifiable
        Mask of the elements of G that the record determines, shape (3, 3).
    sigmas
        Standard errors of G, shape (3, 3); the prior's where the record has no information.
    """

    bias: Floats
    sensitivity: Floats
    covariance: Floats
    spread: Floats
    identifiable: Booleans
    sigmas: Floats

    @property
    def bias_sigma(self) -> Floats:
        """Return the standard error of the bias at any time of the record, shape (3,)."""
        return np.asarray(np.sqrt(self.covariance[:, 0, 0] + self.spread**2))

    def covariance_of(self, axis: int) -> Floats:
        """Return the covariance of an axis's bias at any time and its row of G, shape (4, 4)."""
        covariance = self.covariance[axis].copy()
        covariance[0, 0] += self.spread[axis] ** 2
        pinned = np.append(False, covariance[1:, 1:].diagonal() < self.sigmas[axis] ** 2 / 4.0)
        fixed = np.append(False, self.sigmas[axis] == 0.0)
        covariance[pinned | fixed] = 0.0
        covariance[:, pinned | fixed] = 0.0
        covariance[pinned, pinned] = self.sigmas[axis][pinned[1:]] ** 2
        return np.asarray(covariance)


def estimate_at_rest(
    means: Floats,
    variances: Floats,
    rounding: Floats,
    times: Floats,
    directions: Floats,
    size: float,
    with_g: bool,
) -> RestEstimate:
    """Return the bias and G with the best fit to the means at rest.

    Parameters
    ----------
    means, variances
        Means of the gyro at rests, and variances of their white noise, shape (n, 3).
    rounding
        Variance that rounding leaves in each mean, shape (3,). At one rate all means are rounded in
        the same way, so more rests do not reduce it.
    times
        Times of the middles of the rests, s, shape (n,).
    directions
        Directions of the reaction to gravity, shape (n, 3).
    size
        Unit of the gyro per rad/s.
    with_g
        True to estimate G; otherwise G is zero.

    Notes
    -----
    Generalised least squares of ``mean = b + G u + random walk + white noise``. Ten rests determine
    the strength of the walk to a decade at best, so it is integrated over its restricted
    likelihood.
    """
    walk = _centred_walk_covariance(times)
    # A constant has no noise and would give zero errors.
    variances = np.maximum(variances, (_MIN_NOISE_RAD_S * size) ** 2)
    free = np.full((3, 3), with_g)
    prior = np.where(free, G_PRIOR_RAD_S * size, _PINNED_SIGMA_RATIO * G_PRIOR_RAD_S * size)
    axes = [_fit_axis(means[:, k], variances[:, k], directions, walk, prior[k]) for k in range(3)]
    sigmas = np.sqrt([np.diagonal(covariance)[1:] for _, covariance, _ in axes])
    known = sigmas <= _MAX_SIGMA_RATIO * G_PRIOR_RAD_S * size
    if with_g and not known.all():
        # The other elements are estimated with these elements at zero.
        pinned = np.where(known, prior, _PINNED_SIGMA_RATIO * prior)
        axes = [
            _fit_axis(means[:, k], variances[:, k], directions, walk, pinned[k]) for k in range(3)
        ]
    values = np.array([value for value, _, _ in axes])
    return RestEstimate(
        bias=values[:, 0],
        sensitivity=np.where(known & free, values[:, 1:], 0.0),
        covariance=np.array([covariance for _, covariance, _ in axes]),
        spread=np.sqrt(np.array([spread for _, _, spread in axes]) + rounding),
        identifiable=known | ~free,
        sigmas=np.where(free, sigmas, 0.0),
    )


def _centred_walk_covariance(times: Floats) -> Floats:
    """Return the covariance of a random walk about its mean, with unit mean step, shape (n, n)."""
    since = times - times[0]
    step = max(float(since[-1]) / max(len(times) - 1, 1), 1e-300)
    covariance = np.minimum.outer(since, since) / step
    row = covariance.mean(axis=0)
    return np.asarray(covariance - row - row[:, np.newaxis] + row.mean())


def _fit_axis(
    mean: Floats, variance: Floats, directions: Floats, walk: Floats, prior: Floats
) -> tuple[Floats, Floats, float]:
    """Return bias and row of G, their covariance, and the variance of the bias about its mean."""
    n, level = len(mean), float(np.median(mean))
    white = float(variance.mean())
    design = np.column_stack((np.ones(n), directions))
    known = np.diag(np.append(0.0, prior**-2.0))
    noise = np.diag(variance) + _WALK_VARIANCES[:, np.newaxis, np.newaxis] * white * walk
    weighted = np.linalg.solve(noise, np.column_stack((design, mean - level))[np.newaxis])
    normal = design.T @ weighted[:, :, :4] + known
    right = np.einsum("ij,kil->kjl", design, weighted[:, :, 4:])
    values = np.linalg.solve(normal, right)[:, :, 0]
    squares = np.einsum("i,ki->k", mean - level, weighted[:, :, 4])
    squares -= np.einsum("kj,kj->k", values, right[:, :, 0])
    logarithm = np.linalg.slogdet(noise)[1] + np.linalg.slogdet(normal)[1] + squares
    probability = np.exp(-0.5 * (logarithm - logarithm.min()))
    probability /= probability.sum()
    mean_values = probability @ values
    offsets = values - mean_values
    covariance = np.einsum("k,kij->ij", probability, np.linalg.inv(normal))
    covariance = covariance + np.einsum("k,ki,kj->ij", probability, offsets, offsets)
    spread = float(probability @ _WALK_VARIANCES) * white * float(np.trace(walk)) / n
    return mean_values + np.array([level, 0.0, 0.0, 0.0]), covariance, spread
