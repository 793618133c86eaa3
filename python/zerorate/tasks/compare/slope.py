"""Rate from the angles of an encoder."""

from typing import Final

import numpy as np

from zerorate.types import Floats

_HALF_WINDOW_S: Final = 0.03
"""Half the window of the fit, s: longer than an encoder's step, shorter than vibrations."""

_MIN_HALF_WINDOW: Final = 2
_POLYNOMIAL_DEGREE: Final = 3


def slope(angle: Floats, rate: float) -> Floats:
    """Return the slope of the best cubic through 60 ms of angles around each sample.

    The slope has no delay, and hardly reduces oscillations up to 10 Hz.

    Parameters
    ----------
    angle : ndarray, shape (n,)
        Angles, rad; they may jump by whole turns.
    rate : float
        Samples per second, Hz.

    Returns
    -------
    ndarray, shape (n,)
        Slope, rad/s; NaN at both ends and near missing angles.
    """
    half = max(_MIN_HALF_WINDOW, round(_HALF_WINDOW_S * rate))
    slopes = np.full(angle.size, np.nan)
    if angle.size > 2 * half:
        # A convolution reverses its second factor.
        weights = _slope_weights(half)[::-1] * rate
        slopes[half:-half] = np.convolve(_unwrap_present(angle), weights, mode="valid")
    return slopes


def _slope_weights(half: int) -> Floats:
    """Return the weights of 2 half + 1 samples for the slope of their cubic."""
    steps = np.arange(-half, half + 1)
    weights: Floats = np.linalg.pinv(np.vander(steps, _POLYNOMIAL_DEGREE + 1, increasing=True))[1]
    return weights


def _unwrap_present(angle: Floats) -> Floats:
    present = np.isfinite(angle)
    unwrapped = np.full(angle.size, np.nan)
    unwrapped[present] = np.unwrap(angle[present])
    return unwrapped
