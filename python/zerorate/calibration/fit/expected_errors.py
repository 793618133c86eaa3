"""Errors expected of a fit, from its covariance: size of gravity, and angle of a rotation."""

from __future__ import annotations

from typing import Final

import numpy as np

from zerorate.calibration.fit.joint_fit import LOWER_TRIANGLE, Fit
from zerorate.types import Floats

MAX_NORM_ERROR: Final = 10e-3
"""RMS of |f|/g - 1 at rests beyond which a calibration is not valid."""

MAX_MISS_SHARE: Final = 0.03
"""Miss of carried gravity, parts of the angle turned, likewise."""

MAX_POSE_SIGMA: Final = 5e-3
"""Standard error of |f|/g in a pose beyond which that pose is requested."""

MAX_TURN_SIGMA_RAD: Final = 10e-3
"""Standard error of a turn by a right angle, rad, likewise."""


def norm_jacobian(accel: Floats, up: Floats) -> Floats:
    """Return the derivatives of |f|/g by A and b_a in some directions, up to sign, shape (n, 9)."""
    levers = up @ np.linalg.inv(accel)
    return np.concatenate(
        (levers[:, LOWER_TRIANGLE[:, 0]] * up[:, LOWER_TRIANGLE[:, 1]], levers), axis=1
    )


def turn_sigmas(fit: Fit, size: float) -> Floats:
    """Return the standard errors of turns by a right angle about the gyro's axes, rad, (3,).

    `size` is the scale of M, rad/s per unit of the gyro.
    """
    sigmas = np.sqrt(np.diagonal(fit.covariance)[9:].clip(0.0)).reshape(3, 3)
    return np.asarray(0.5 * np.pi * sigmas.max(axis=0) / size)


def is_expected_valid(fit: Fit, up: Floats, size: float) -> bool:
    """Return True if a fit is expected to stay within half of a valid fit's largest errors.

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
    rows = norm_jacobian(fit.accel, up)
    variances = np.einsum("ij,jk,ik->i", rows, fit.covariance[:9, :9], rows)
    turns = turn_sigmas(fit, size) / (0.5 * np.pi)
    return bool(
        variances.max() <= (0.5 * MAX_NORM_ERROR) ** 2 and turns.max() <= 0.5 * MAX_MISS_SHARE
    )
