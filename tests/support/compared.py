"""Small logs with and without references, as files."""

import numpy as np

from support.logs import RATE, write_table
from zerorate.geometry import rotations

BIAS = np.array([0.5, -0.3, 0.2])
"""deg/s."""


def noise(n, axes=3, seed=1):
    return 0.05 * np.random.default_rng(seed).standard_normal((n, axes))


def motion(t):
    """Return an angle in deg and its rate in deg/s."""
    angle = 60.0 * np.sin(0.9 * t) + 10.0 * np.sin(3.1 * t)
    return angle, 54.0 * np.cos(0.9 * t) + 31.0 * np.cos(3.1 * t)


def gyros(z, unit="dps"):
    return {f"gyro_{axis}_{unit}": z[:, i] for i, axis in enumerate("xyz"[: z.shape[1]])}


def resting(path, n=6000, axes=3):
    return write_table(path, gyros(BIAS[:axes] + noise(n, axes)))


def turning(path, n=6000, scale=-0.98, late=0.02, step=0.0):
    """Write gyros of which z follows minus an encoder, late, in steps of so many deg."""
    t = np.arange(n) / RATE
    z = BIAS + noise(n)
    z[:, 2] += scale * motion(t - late)[1]
    angle = motion(t)[0]
    encoder = np.round(angle / step) * step if step else angle
    return write_table(path, gyros(z) | {"encoder_deg": encoder})


def oriented(path, n=6000, rest=1500):
    """Write gyros and quaternions of a sensor that turns after a rest."""
    t = np.maximum(np.arange(n) - rest, 0) / RATE
    rates = np.column_stack((np.sin(t), 0.5 * np.sin(1.7 * t), np.zeros(n)))
    q = rotations.cumulative_product(rotations.from_rotation_vectors(rates / RATE))
    z = np.degrees(rates) + BIAS + noise(n)
    return write_table(path, gyros(z) | {f"ref_quat_{x}": q[:, i] for i, x in enumerate("wxyz")})
