"""Errors expected of a fit, from its covariance: length of gravity, and angle of a rotation."""

from __future__ import annotations

from typing import Final

import numpy as np

from zerorate.calibration.fit.joint_fit import LOWER_TRIANGLE, Fit
from zerorate.types import Floats

MAX_NORM_ERROR: Final = 10e-3
"""Largest RMS of |f|/g - 1 at rests of a valid calibration."""

MAX_MISS_SHARE: Final = 0.03
"""Largest error angle of propagated gravity in a valid calibration, as a share of the rotation."""

MAX_POSE_SIGMA: Final = 5e-3
"""Standard error of |f|/g in a pose above which that pose is advised."""

MAX_TURN_SIGMA_RAD: Final = 10e-3
"""Standard error of a rotation by a right angle above which it is advised, rad."""


def norm_jacobian(accel: Floats, up: Floats) -> Floats:
    """Return the derivatives of |f|/g by A and b_a, up to sign, shape (n, 9)."""
    levers = up @ np.linalg.inv(accel)
    return np.concatenate(
        (levers[:, LOWER_TRIANGLE[:, 0]] * up[:, LOWER_TRIANGLE[:, 1]], levers), axis=1
    )


def turn_sigmas(fit: Fit, size: float) -> Floats:
    """Return the standard errors of right-angle rotations about the gyro's axes, rad, (3,).

    `size` is the scale of M, rad/s per unit of the gyro.
    """
    sigmas = np.sqrt(np.diagonal(fit.covariance)[9:].clip(0.0)).reshape(3, 3)
    return np.asarray(0.5 * np.pi * sigmas.max(axis=0) / size)


def is_expected_valid(fit: Fit, up: Floats, size: float) -> bool:
    """Return True if the expected errors are at most half of the limits of a valid fit.

    If False, errors in other poses and rotations do not characterise the sensors.

    Parameters
    ----------
    fit
        Fit of some of the rests and rotations.
    up
        Directions of the poses that were left out, shape (n, 3).
    size
        Scale of M, rad/s per unit of the gyro.
    """
    rows = norm_jacobian(fit.accel, up)
    variances = np.einsum("ij,jk,ik->i", rows, fit.covariance[:9, :9], rows)
    turns = turn_sigmas(fit, size) / (0.5 * np.pi)
    return bool(
        variances.max() <= (0.5 * MAX_NORM_ERROR) ** 2 and turns.max() <= 0.5 * MAX_MISS_SHARE
    )
