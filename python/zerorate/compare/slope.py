"""From the angle of an encoder to its rate."""

from typing import Final

import numpy as np
import numpy.typing as npt

__all__ = ["slope"]

Floats = npt.NDArray[np.float64]

_HALF_WIDTH: Final = 0.05
"""Seconds: an encoder has steps, and one in one sample would be a rate of step times rate."""


def slope(angle: Floats, rate: float, turn: float) -> Floats:
    """Return the slope of the straight line through 0.1 s of angles around each sample.

    It is not late, and blunts what changes within a tenth of a second.

    Parameters
    ----------
    angle : ndarray, shape (n,)
        May jump by whole turns.
    rate : float
        Samples per second, Hz.
    turn : float
        A whole turn in the unit of the angle.

    Returns
    -------
    ndarray, shape (n,)
        Per second; NaN at both ends and near missing angles.
    """
    half = max(1, round(_HALF_WIDTH * rate))
    slopes = np.full(angle.size, np.nan)
    if angle.size > 2 * half:
        steps = np.arange(-half, half + 1) / rate
        # A convolution turns its second factor round.
        weights = -steps / np.dot(steps, steps)
        slopes[half:-half] = np.convolve(_unwrapped(angle, turn), weights, mode="valid")
    return slopes


def _unwrapped(angle: Floats, turn: float) -> Floats:
    there = np.isfinite(angle)
    whole = np.full(angle.size, np.nan)
    whole[there] = np.unwrap(angle[there], period=turn)
    return whole
