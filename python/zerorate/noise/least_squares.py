"""Non-negative least squares with weights that follow from the fit."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

import numpy as np

from zerorate._native import chi_squared_quantile
from zerorate.types import Booleans, Floats

Weighting = Callable[[Floats], Floats]
"""Covariance of the data, shape (t, t), or (t,) if independent, given the strengths (p,)."""

_MAX_ROUNDS: Final = 12
_STRENGTH_TOLERANCE: Final = 1e-7
# Relative accuracy of a bound, finer than its printed digits.
_BOUND_TOLERANCE: Final = 1e-3
# Smallest reliable eigenvalue of a correlation matrix: the computed correlations of neighbouring
# averaging times have about this error.
_MIN_EIGENVALUE: Final = 1e-4
_ONE_SIDED_95: Final = 1.6448536269514722


@dataclass(frozen=True)
class Solution:
    """Strengths with the best fit to the data.

    Attributes
    ----------
    strengths : ndarray, shape (p,)
        Strengths; none is negative.
    sigmas : ndarray, shape (p,)
        Standard errors on the condition that zero strengths are zero; NaN for zero strengths.
    chi_squared : float
        Weighted sum of squared residuals.
    degrees_of_freedom : int
        Number of data minus number of positive strengths.
    """

    strengths: Floats
    sigmas: Floats
    chi_squared: float
    degrees_of_freedom: int


def solve(basis: Floats, data: Floats, start: Floats, weighting: Weighting) -> Solution:
    """Fit ``data = basis @ strengths``, with the covariance of the data from the fit.

    Parameters
    ----------
    basis : ndarray, shape (t, p)
        Expected data of unit strengths.
    data : ndarray, shape (t,)
        Estimates to fit.
    start : ndarray, shape (t, t) or (t,)
        Covariance for the first iteration.
    weighting : callable
        Function from strengths to the covariance of the next iteration.
    """
    both = np.column_stack((basis, data))
    strengths = _fit_whitened(_whiten(start, both))
    for _ in range(_MAX_ROUNDS):
        before, white = strengths, _whiten(weighting(strengths), both)
        strengths = _fit_whitened(white, strengths > 0.0)
        if np.allclose(strengths, before, rtol=_STRENGTH_TOLERANCE, atol=0.0):
            break
    sigmas, active = np.full(strengths.size, np.nan), strengths > 0.0
    sigmas[active] = np.sqrt(np.diag(_inverse_gram(white[:, :-1][:, active])))
    residual = white[:, -1] - white[:, :-1] @ strengths
    return Solution(strengths, sigmas, float(residual @ residual), data.size - int(active.sum()))


def residual_chi_squared(basis: Floats, data: Floats, scatter: Floats) -> float:
    """Return the chi-squared of the best fit for a given covariance of the data."""
    white = _whiten(scatter, np.column_stack((basis, data)))
    residual = white[:, -1] - white[:, :-1] @ _fit_whitened(white)
    return float(residual @ residual)


def upper_bound(basis: Floats, solution: Solution, i: int, weighting: Weighting) -> float:
    """Return the 95 % upper bound of the strength of process i, infinite if there is none.

    A larger strength increases the scatter of the data. The search for the bound includes this
    scatter.
    """
    estimate, bound = solution.strengths[i], solution.strengths.copy()
    active = solution.strengths > 0.0
    active[i] = True
    index, visible = int(active[:i].sum()), basis[:, i] > 0.0
    bound[i] = max(estimate, np.min((basis @ bound)[visible] / basis[visible, i]))
    for _ in range(4 * _MAX_ROUNDS):
        white = _whiten(weighting(bound), basis[:, active])
        sigma = np.sqrt(_inverse_gram(white)[index, index])
        before, bound[i] = bound[i], estimate + _ONE_SIDED_95 * sigma
        if not np.isfinite(bound[i]):
            break
        if abs(bound[i] - before) <= _BOUND_TOLERANCE * bound[i]:
            return float(bound[i])
    return float("inf")


def bound_by_single(column: Floats, data: Floats, edf: Floats) -> float:
    """Return the strength at which the clearest single estimate would be too low at 95 %."""
    visible = column > 0.0
    largest = data * edf / chi_squared_quantile(0.05, edf)
    return float(np.min(largest[visible] / column[visible]))


def _inverse_gram(factor: Floats) -> Floats:
    """Return the inverse of factorᵀ factor, computed with columns of unit length."""
    lengths = np.linalg.norm(factor, axis=0)
    inverse = np.linalg.pinv(factor / lengths)
    product: Floats = inverse @ inverse.T / np.outer(lengths, lengths)
    return product


def _whiten(covariance: Floats, columns: Floats) -> Floats:
    """Return columns multiplied by a square root of the inverse of a covariance."""
    if covariance.ndim == 1:
        return columns / np.sqrt(covariance)[:, None]
    sigmas = np.sqrt(np.diag(covariance))
    values, vectors = np.linalg.eigh(covariance / np.outer(sigmas, sigmas))
    rotated = vectors.T @ (columns / sigmas[:, None])
    scaled: Floats = rotated / np.sqrt(np.maximum(values, _MIN_EIGENVALUE))[:, None]
    return scaled


def _fit_whitened(white: Floats, guess: Booleans | None = None) -> Floats:
    """Return the strengths for whitened columns; the last column is the data."""
    return solve_non_negative(white[:, :-1], white[:, -1], guess)


def solve_non_negative(matrix: Floats, target: Floats, guess: Booleans | None = None) -> Floats:
    """Return the x >= 0 with the smallest distance of ``matrix @ x`` from the target.

    C. L. Lawson, R. J. Hanson, "Solving Least Squares Problems", 1974, chapter 23. The iteration
    starts with the elements that are expected to be positive.
    """
    lengths = np.linalg.norm(matrix, axis=0)
    lengths[lengths == 0.0] = 1.0
    free = np.zeros(lengths.size, dtype=bool) if guess is None else guess.copy()
    matrix = matrix / lengths
    x = _move_to_feasible(matrix, target, np.zeros(free.size), free)
    tolerance = 1e-12 * float(np.linalg.norm(target))
    for _ in range(3 * x.size):
        slope = np.where(free, -np.inf, matrix.T @ (target - matrix @ x))
        best = int(np.argmax(slope))
        if not slope[best] > tolerance:
            break
        free[best] = True
        x = _move_to_feasible(matrix, target, x, free)
    strengths: Floats = x / lengths
    return strengths


def _move_to_feasible(matrix: Floats, target: Floats, x: Floats, free: Booleans) -> Floats:
    """Move x towards the least squares of its free part, and fix parameters that reach zero."""
    while free.any():
        goal = np.zeros_like(x)
        goal[free] = np.linalg.lstsq(matrix[:, free], target, rcond=None)[0]
        passing = free & (goal <= 0.0)
        if not passing.any():
            return goal
        x = x + np.min(x[passing] / (x[passing] - goal[passing])) * (goal - x)
        free &= ~(passing & (x <= 1e-15 * x.max(initial=0.0)))
        x = np.where(free, x, 0.0)
    return np.zeros_like(x)
