"""Spectral density of an ARMA model."""

import numpy as np
import numpy.typing as npt

__all__ = ["spectrum"]

Floats = npt.NDArray[np.float64]


def spectrum(
    phi: Floats, theta: Floats, sigma2: float, frequencies: npt.ArrayLike, rate: float
) -> Floats:
    """Return the one-sided density at frequencies in Hz."""
    if not 0.0 < rate < np.inf:
        raise ValueError(f"rate must be a positive number of samples a second, got {rate}")
    f = np.asarray(frequencies, dtype=np.float64)
    wrong = f[~((f >= 0.0) & (f <= rate / 2.0))]
    if wrong.size:
        raise ValueError(
            f"frequencies must lie from 0 to rate / 2 = {rate / 2.0:g}, got {wrong[0]}"
        )
    moving, auto = (_power(c, f / rate) for c in (theta, -phi))
    with np.errstate(divide="ignore"):
        return np.asarray(2.0 * sigma2 / rate * moving / auto)


def _power(coefficients: Floats, cycles: Floats) -> Floats:
    """Return |1 + sum_i c_i exp(-2 pi i cycles)|^2."""
    lags = np.arange(1, coefficients.size + 1)
    angles = 2.0 * np.pi * cycles[..., np.newaxis] * lags
    real = 1.0 + np.cos(angles) @ coefficients
    imaginary = np.sin(angles) @ coefficients
    return np.asarray(real**2 + imaginary**2)
