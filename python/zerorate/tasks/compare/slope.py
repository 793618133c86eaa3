"""Rate from the angle of an encoder."""

from typing import Final

import numpy as np

from zerorate.types import Floats

_HALF_WINDOW_S: Final = 0.03
"""Seconds: wide enough for the steps of an encoder, narrow enough for a shaft that vibrates."""

_MIN_HALF_WINDOW: Final = 2
_POLYNOMIAL_DEGREE: Final = 3


def slope(angle: Floats, rate: float) -> Floats:
    """Return the slope of the best cubic through 60 ms of angles around each sample.

    The slope has no delay, and keeps nearly all of an oscillation up to 10 Hz.

    Parameters
    ----------
    angle : ndarray, shape (n,)
        In rad; it may jump by whole turns.
    rate : float
        Samples per second, Hz.

    Returns
    -------
    ndarray, shape (n,)
        In rad/s; NaN at both ends and near missing angles.
    """
    half = max(_MIN_HALF_WINDOW, round(_HALF_WINDOW_S * rate))
    slopes = np.full(angle.size, np.nan)
    if angle.size > 2 * half:
        # A convolution turns its second factor round.
        weights = _slope_weights(half)[::-1] * rate
        slopes[half:-half] = np.convolve(_unwrap_present(angle), weights, mode="valid")
    return slopes


def _slope_weights(half: int) -> Floats:
    """Return the weights of 2 half + 1 samples in the slope of their cubic."""
    steps = np.arange(-half, half + 1)
    weights: Floats = np.linalg.pinv(np.vander(steps, _POLYNOMIAL_DEGREE + 1, increasing=True))[1]
    return weights


def _unwrap_present(angle: Floats) -> Floats:
    present = np.isfinite(angle)
    unwrapped = np.full(angle.size, np.nan)
    unwrapped[present] = np.unwrap(angle[present])
    return unwrapped
