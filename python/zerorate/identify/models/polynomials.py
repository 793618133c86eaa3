"""Lag polynomials 1 - phi_1 B - ... and 1 + theta_1 B + ..., and what follows from them."""

import math
from typing import Final

import numpy as np
import numpy.typing as npt

__all__ = [
    "at_one",
    "cancelled",
    "inverse_roots",
    "is_stationary",
    "ma_coefficients",
    "psi_weights",
    "trimmed",
]

Floats = npt.NDArray[np.float64]
Complexes = npt.NDArray[np.complex128]

# A double root is found to half of the digits: closer roots than this are the same.
_SAME: Final = 1e-7
_EPS: Final = float(np.finfo(np.float64).eps)


def inverse_roots(coefficients: Floats) -> Complexes:
    """Return the reciprocal roots of 1 + c_1 x + ... + c_n x^n, largest first.

    They stay finite where the last coefficients are zero, and inside the unit circle where the
    polynomial is stationary or invertible.
    """
    found = np.roots(np.concatenate(([1.0], coefficients))).astype(np.complex128)
    return np.asarray(found[np.argsort(-np.abs(found), kind="stable")])


def at_one(coefficients: Floats) -> float:
    """Return 1 + c_1 + ... + c_n, rounded once: near a unit root nothing else is left.

    What the coefficients' own rounding may have left of a unit root is 0.
    """
    value = math.fsum((1.0, *coefficients.tolist()))
    return value if abs(value) > _EPS * float(np.abs(coefficients).sum()) else 0.0


def is_stationary(phi: Floats) -> bool:
    """Return whether all reciprocal roots of 1 - phi_1 x - ... lie inside the unit circle."""
    if np.abs(phi).sum() < 1.0:  # sufficient, and quick
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
    """Return theta of the weights psi, the inverse of `psi_weights`."""
    product = np.convolve(np.concatenate(([1.0], -phi)), psi)[: psi.size]
    return np.asarray(product[1:])


def trimmed(coefficients: Floats, tolerance: float) -> Floats:
    """Return the coefficients without the last ones that are zero to a tolerance."""
    large = np.flatnonzero(np.abs(coefficients) > tolerance)
    return coefficients[: int(large[-1]) + 1 if large.size else 0]


def cancelled(phi: Floats, theta: Floats) -> tuple[Floats, Floats]:
    """Return phi and theta without the roots that both have."""
    poles, zeros = list(inverse_roots(-phi)), list(inverse_roots(theta))
    common = 0
    for pole in tuple(poles):
        near = [zero for zero in zeros if abs(zero - pole) <= _SAME]
        if near:
            poles.remove(pole)
            zeros.remove(near[0])
            common += 1
    if not common:
        return phi, theta
    return -_of_inverse_roots(poles), _of_inverse_roots(zeros)


def _of_inverse_roots(found: list[np.complex128]) -> Floats:
    return np.asarray(np.real(np.atleast_1d(np.poly(found)))[1:])
