"""What a fit is expected to err by, from its covariance: the size of gravity, and a turn."""

from __future__ import annotations

from typing import Final

import numpy as np

from zerorate.calibration.fit.joint_fit import LOWER, Fit
from zerorate.types import Floats

MOST_NORM: Final = 10e-3
"""RMS of |f|/g - 1 at rests beyond which a calibration is not valid."""

MOST_MISS: Final = 0.03
"""Miss of carried gravity, parts of the angle turned, likewise."""

WEAK_NORM: Final = 5e-3
"""Standard error of |f|/g in a pose beyond which that pose is asked for."""

WEAK_TURN: Final = 10e-3
"""Standard error of a turn by a right angle, rad, likewise."""


def norm_rows(accel: Floats, up: Floats) -> Floats:
    """Return what A and b_a move |f|/g by in some directions, but for its sign, shape (n, 9)."""
    levers = up @ np.linalg.inv(accel)
    return np.concatenate((levers[:, LOWER[:, 0]] * up[:, LOWER[:, 1]], levers), axis=1)


def turn_sigmas(fit: Fit, size: float) -> Floats:
    """Return the standard errors of turns by a right angle about the gyro's axes, rad, (3,).

    `size` is the scale of M, rad/s per unit of the gyro.
    """
    sigmas = np.sqrt(np.diagonal(fit.covariance)[9:].clip(0.0)).reshape(3, 3)
    return np.asarray(0.5 * np.pi * sigmas.max(axis=0) / size)


def foretells(fit: Fit, up: Floats, size: float) -> bool:
    """Return whether a fit is expected to stay within half of what a valid one may err by.

    If not, its errors in other poses and turns say nothing of the sensors.

    Parameters
    ----------
    fit
        Of some of the rests and turns.
    up
        Directions in the poses that were left out, shape (n, 3).
    size
        Scale of M.
    """
    rows = norm_rows(fit.accel, up)
    variances = np.einsum("ij,jk,ik->i", rows, fit.covariance[:9, :9], rows)
    turns = turn_sigmas(fit, size) / (0.5 * np.pi)
    return bool(variances.max() <= (0.5 * MOST_NORM) ** 2 and turns.max() <= 0.5 * MOST_MISS)
