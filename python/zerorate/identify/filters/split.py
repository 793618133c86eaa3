"""What of an ARMA process is drift, and what white noise on it."""

from typing import Final, NamedTuple

import numpy as np
import numpy.typing as npt

from zerorate.identify.models.autocovariance import autocovariance
from zerorate.identify.models.polynomials import at_one, is_stationary
from zerorate.noise.least_squares import solve

__all__ = ["Split", "split"]

Floats = npt.NDArray[np.float64]

# Of the variance of phi(B) z: less than this is rounding.
_ROUNDING: Final = 1e-9


class Split(NamedTuple):
    """An AR(p) drift driven by noise of variance g, and white measurement noise of variance R."""

    g: float
    R: float


def split(
    phi: Floats, theta: Floats, sigma2: float, measurement_noise: float | None = None
) -> Split:
    """Return the drift and the white noise whose sum is the process, or comes closest to it.

    w = phi(B) z has the autocovariance of theta(B) a, and must have that of a white g and of
    phi(B) v: gamma_w(j) = g [j = 0] + R sum_i phi'_i phi'_(i+j), phi' = [1, -phi]. Where this has
    a solution it is taken (ARMA(1, 1): R = -theta sigma2 / phi). Else the likeliest non-negative g
    and R are taken: least squares of gamma_w itself would find drift of four times the variance
    of the whole process in Fu and Han's own ARMA(2, 1), whose spectrum has no drift at all.

    A model without an autoregression has no drift, and all of it is R. Without a white part R is
    the Allan variance at tau0, gamma_0 - gamma_1, to which the recursion of Fu & Han (2019),
    equation 18, converges. A `measurement_noise` that is given takes the place of R.
    """
    if not np.any(phi):
        white = float(sigma2 * (1.0 + theta @ theta))
        return Split(0.0, white if measurement_noise is None else measurement_noise)
    auto, moving = np.concatenate(([1.0], -phi)), np.concatenate(([1.0], theta))
    found = _exact(auto, moving) or _closest(auto, moving)
    if measurement_noise is not None:
        return Split(found.g * sigma2, measurement_noise)
    if found.R > _ROUNDING:
        return Split(found.g * sigma2, found.R * sigma2)
    return Split(found.g * sigma2, _first_difference(phi, theta, sigma2))


def _exact(auto: Floats, moving: Floats) -> Split | None:
    lags = max(auto.size, moving.size)
    moved = _products(moving, lags)
    basis = np.column_stack((np.eye(lags)[0], _products(auto, lags)))
    found = np.linalg.lstsq(basis, moved, rcond=None)[0]
    if np.any(np.abs(basis @ found - moved) > _ROUNDING * moved[0]) or np.any(found < 0.0):
        return None
    return Split(*found.tolist())


def _products(coefficients: Floats, lags: int) -> Floats:
    full = np.correlate(coefficients, coefficients, "full")[coefficients.size - 1 :]
    return np.concatenate((full, np.zeros(lags)))[:lags]


def _closest(auto: Floats, moving: Floats) -> Split:
    """Return the g + R |phi|^2 that is likeliest for |theta|^2, by Whittle's likelihood.

    Its maximum is least squares with each frequency weighed by the fit itself.
    """
    frequencies = np.union1d(np.linspace(0.0, np.pi, 4097)[1:], np.geomspace(1e-7, np.pi, 401))
    density = np.gradient(frequencies)
    data, white = _power(moving, frequencies), _power(auto, frequencies)
    basis = np.column_stack((np.ones_like(white), white))
    start = np.full_like(density, np.mean(data) ** 2) / density
    return Split(
        *solve(basis, data, start, lambda s: (basis @ s) ** 2 / density).strengths.tolist()
    )


def _power(coefficients: Floats, frequencies: Floats) -> Floats:
    return np.asarray(np.abs(np.polyval(coefficients[::-1], np.exp(-1j * frequencies))) ** 2)


def _first_difference(phi: Floats, theta: Floats, sigma2: float) -> float:
    """Return half the variance of z_k - z_(k-1), also of a walk, whose difference is stationary."""
    if not at_one(-phi):
        # phi(B) = (1 - B) rest(B): the difference has rest in the place of phi.
        rest = -np.cumsum(np.concatenate(([1.0], -phi)))[1:-1]
        return 0.5 * float(autocovariance(rest, theta, sigma2, 0)[0])
    if not is_stationary(phi):
        raise ValueError(
            "an explosive model has no variance of differences: give measurement_noise"
        )
    gamma = autocovariance(phi, theta, sigma2, 1)
    return float(gamma[0] - gamma[1])
