"""Autocovariance of an ARMA process, exact to rounding also close to a unit root."""

import numpy as np
import numpy.typing as npt

from zerorate.identify.models.polynomials import at_one, psi_weights

__all__ = ["autocovariance", "refined"]

Floats = npt.NDArray[np.float64]
_Long = npt.NDArray[np.longdouble]


def autocovariance(phi: Floats, theta: Floats, sigma2: float, lags: int) -> Floats:
    """Return gamma_0 ... gamma_lags of a stationary ARMA(p, q) process.

    Multiplying the model by z_(k-j) and taking the mean gives gamma_j - sum_i phi_i gamma_|j-i| =
    sigma2 sum_(i>=j) theta_i psi_(i-j), p + 1 linear equations for the first lags and a recursion
    for the rest (Brockwell and Davis, "Time Series: Theory and Methods", 1991, section 3.3).
    """
    p, n = phi.size, max(lags, phi.size) + 1
    driven = np.zeros(n)
    moments = sigma2 * _cross_moments(phi, theta)[:n]
    driven[: moments.size] = moments
    gamma = np.zeros(n)
    solution = refined(_equations(phi), driven[: p + 1].astype(np.longdouble))
    gamma[: p + 1] = solution[0] - np.concatenate(([0.0], solution[1:]))
    for k in range(p + 1, n):
        gamma[k] = phi @ gamma[k - p : k][::-1] + driven[k]
    return gamma[: lags + 1]


def refined(matrix: _Long, target: _Long) -> Floats:
    """Solve a small linear system to the last digits, where double precision would lose some.

    Close to a unit root the matrix is nearly singular although its elements are exact: residuals
    in the wider type give back the digits that elimination loses.
    """
    narrow = matrix.astype(np.float64)
    solution = np.zeros(target.shape, dtype=np.longdouble)
    for _ in range(4):
        residual = (target - matrix @ solution).astype(np.float64)
        solution = solution + np.linalg.solve(narrow, residual)
    return np.asarray(solution, dtype=np.float64)


def _cross_moments(phi: Floats, theta: Floats) -> Floats:
    """Return the mean of (sum_i theta_i a_(k-i)) z_(k-j) for j = 0 ... q, sigma2 being 1."""
    moving = np.concatenate(([1.0], theta))
    psi = psi_weights(phi, theta, moving.size)
    return np.array([moving[j:] @ psi[: moving.size - j] for j in range(moving.size)])


def _equations(phi: Floats) -> _Long:
    """Return the equations of gamma_0 and of the small gamma_0 - gamma_j.

    Close to a unit root gamma_0 is huge, and its factor 1 - phi_1 - ... must not be a sum of
    rounded ones.
    """
    size = phi.size + 1
    matrix = np.eye(size, dtype=np.longdouble)
    for j in range(size):
        for i, coefficient in enumerate(phi, start=1):
            matrix[j, abs(j - i)] -= coefficient
    matrix[:, 0] = at_one(-phi)
    matrix[:, 1:] *= -1.0
    return matrix
