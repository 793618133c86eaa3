"""Lag polynomials: roots, modes, autocovariance and spectrum of an ARMA process."""

from __future__ import annotations

import math
from typing import Final, NamedTuple

import numpy as np
import numpy.typing as npt

from zerorate.faults import ArgumentError
from zerorate.types import Floats

Complexes = npt.NDArray[np.complex128]

# A double root is accurate to half of the digits, so closer roots count as equal.
_ROOT_TOLERANCE: Final = 1e-7
_EPS: Final = float(np.finfo(np.float64).eps)


def inverse_roots(coefficients: Floats) -> Complexes:
    """Return the reciprocal roots of 1 + c_1 x + ... + c_n x^n, largest first.

    They stay finite if the last coefficients are zero. They are inside the unit circle if the
    polynomial is stationary or invertible.
    """
    roots = np.roots(np.concatenate(([1.0], coefficients))).astype(np.complex128)
    return np.asarray(roots[np.argsort(-np.abs(roots), kind="stable")])


def at_one(coefficients: Floats) -> float:
    """Return 1 + c_1 + ... + c_n, rounded once.

    Near a unit root the sum is almost zero. A remainder that may come from the coefficients'
    rounding is set to 0.
    """
    value = math.fsum((1.0, *coefficients.tolist()))
    return value if abs(value) > _EPS * float(np.abs(coefficients).sum()) else 0.0


def is_stationary(phi: Floats) -> bool:
    """Return True if all reciprocal roots of 1 - phi_1 x - ... lie inside the unit circle."""
    if np.abs(phi).sum() < 1.0:  # sufficient and fast
        return True
    return at_one(-phi) > 0.0 and bool(np.all(np.abs(inverse_roots(-phi)) < 1.0))


def psi_weights(phi: Floats, theta: Floats, n: int) -> Floats:
    """Return the first n coefficients of theta(B) / phi(B), the response to one innovation."""
    psi = np.zeros(n)
    moving = np.concatenate(([1.0], theta))[:n]
    psi[: moving.size] = moving
    for k in range(1, n):
        past = psi[max(k - phi.size, 0) : k][::-1]
        psi[k] += phi[: past.size] @ past
    return psi


def ma_coefficients(phi: Floats, psi: Floats) -> Floats:
    """Return theta from the weights psi, the inverse of `psi_weights`."""
    product = np.convolve(np.concatenate(([1.0], -phi)), psi)[: psi.size]
    return np.asarray(product[1:])


def trim_zeros(coefficients: Floats, tolerance: float) -> Floats:
    """Return the coefficients without final zeros, to a tolerance."""
    large = np.flatnonzero(np.abs(coefficients) > tolerance)
    return coefficients[: int(large[-1]) + 1 if large.size else 0]


def cancel_common_roots(phi: Floats, theta: Floats) -> tuple[Floats, Floats]:
    """Return phi and theta without their common roots."""
    poles, zeros = list(inverse_roots(-phi)), list(inverse_roots(theta))
    common = 0
    for pole in tuple(poles):
        near = [zero for zero in zeros if abs(zero - pole) <= _ROOT_TOLERANCE]
        if near:
            poles.remove(pole)
            zeros.remove(near[0])
            common += 1
    if not common:
        return phi, theta
    return -_from_inverse_roots(poles), _from_inverse_roots(zeros)


def _from_inverse_roots(roots: list[np.complex128]) -> Floats:
    return np.asarray(np.real(np.atleast_1d(np.poly(roots)))[1:])


class Mode(NamedTuple):
    """One real root of an autoregression, or a pair of complex roots.

    Attributes
    ----------
    root : complex
        Root of 1 - phi_1 x - ...; of a pair, the root with an imaginary part >= 0.
    time_constant : float
        Time in which the mode decays by the factor e, s; infinite or negative if it does not decay.
    frequency : float
        Frequency of the oscillation, Hz: 0 for a positive real root, rate / 2 for a negative real
        root.
    damping : float
        Ratio to the critical damping: 1 for a plain decay, 0 for an undamped oscillation.
    """

    root: complex
    time_constant: float
    frequency: float
    damping: float


def modes(reciprocal: npt.NDArray[np.complex128], rate: float) -> tuple[Mode, ...]:
    """Return the modes of nonzero reciprocal roots, slowest decay first."""
    upper = [complex(pole) for pole in reciprocal if pole.imag >= 0.0 and pole != 0.0]
    return tuple(_mode(pole, rate) for pole in upper)


def _mode(pole: complex, rate: float) -> Mode:
    # A continuous pole s becomes exp(s / rate).
    s = complex(np.log(pole)) * rate
    time = -1.0 / s.real if s.real else np.inf
    damping = -s.real / abs(s) if s else 0.0
    return Mode((1.0 / pole).conjugate(), float(time), abs(s.imag) / (2.0 * np.pi), float(damping))


_Long = npt.NDArray[np.longdouble]


def autocovariance(phi: Floats, theta: Floats, sigma2: float, lags: int) -> Floats:
    """Return gamma_0 ... gamma_lags of a stationary ARMA(p, q) process.

    Multiplying the model by z_(k-j) and taking the mean gives gamma_j - sum_i phi_i gamma_|j-i| =
    sigma2 sum_(i>=j) theta_i psi_(i-j). These are p + 1 linear equations for the first lags, and a
    recursion for the rest (Brockwell and Davis, "Time Series: Theory and Methods", 1991, section
    3.3).
    """
    p, n = phi.size, max(lags, phi.size) + 1
    driven = np.zeros(n)
    moments = sigma2 * _cross_moments(phi, theta)[:n]
    driven[: moments.size] = moments
    gamma = np.zeros(n)
    solution = solve_refined(_equations(phi), driven[: p + 1].astype(np.longdouble))
    gamma[: p + 1] = solution[0] - np.concatenate(([0.0], solution[1:]))
    for k in range(p + 1, n):
        gamma[k] = phi @ gamma[k - p : k][::-1] + driven[k]
    return gamma[: lags + 1]


def solve_refined(matrix: _Long, target: _Long) -> Floats:
    """Solve a small linear system to full precision.

    Close to a unit root the matrix is nearly singular, although its elements are exact. Residuals
    in a wider type restore the digits that elimination loses.
    """
    narrow = matrix.astype(np.float64)
    solution = np.zeros(target.shape, dtype=np.longdouble)
    for _ in range(4):
        residual = (target - matrix @ solution).astype(np.float64)
        solution = solution + np.linalg.solve(narrow, residual)
    return np.asarray(solution, dtype=np.float64)


def _cross_moments(phi: Floats, theta: Floats) -> Floats:
    """Return the mean of (sum_i theta_i a_(k-i)) z_(k-j) for j = 0 ... q, with sigma2 = 1."""
    moving = np.concatenate(([1.0], theta))
    psi = psi_weights(phi, theta, moving.size)
    return np.array([moving[j:] @ psi[: moving.size - j] for j in range(moving.size)])


def _equations(phi: Floats) -> _Long:
    """Return the equations for gamma_0 and for the small differences gamma_0 - gamma_j.

    Close to a unit root gamma_0 is huge. Its factor 1 - phi_1 - ... must not be a sum of rounded
    numbers.
    """
    size = phi.size + 1
    matrix = np.eye(size, dtype=np.longdouble)
    for j in range(size):
        for i, coefficient in enumerate(phi, start=1):
            matrix[j, abs(j - i)] -= coefficient
    matrix[:, 0] = at_one(-phi)
    matrix[:, 1:] *= -1.0
    return matrix


def spectrum(
    phi: Floats, theta: Floats, sigma2: float, frequencies: npt.ArrayLike, rate: float
) -> Floats:
    """Return the one-sided density at frequencies in Hz."""
    if not 0.0 < rate < np.inf:
        raise ArgumentError("rate", f"must be a positive number of samples a second, got {rate}")
    f = np.asarray(frequencies, dtype=np.float64)
    wrong = f[~((f >= 0.0) & (f <= rate / 2.0))]
    if wrong.size:
        raise ArgumentError(
            "frequencies", f"must lie from 0 to rate / 2 = {rate / 2.0:g}, got {wrong[0]}"
        )
    moving, auto = (_squared_gain(c, f / rate) for c in (theta, -phi))
    with np.errstate(divide="ignore"):
        return np.asarray(2.0 * sigma2 / rate * moving / auto)


def _squared_gain(coefficients: Floats, cycles: Floats) -> Floats:
    """Return |1 + sum_i c_i exp(-2 pi i cycles)|^2."""
    lags = np.arange(1, coefficients.size + 1)
    angles = 2.0 * np.pi * cycles[..., np.newaxis] * lags
    real = 1.0 + np.cos(angles) @ coefficients
    imaginary = np.sin(angles) @ coefficients
    return np.asarray(real**2 + imaginary**2)
