"""Attitude under single faults and on bodies that never rest: a scene for each.

Bodies that creep off, never rest, fly fast or speed up; sensors that give garbage, freeze or carry
a bias beyond what a good gyro has. Rates are in deg/s here, everything in a `Scene` in SI.
"""

import numpy as np
from scipy.spatial.transform import Rotation

from support.outside import DEG, RATE, G, Scene, times


def scene(gyro, accel, turned, where, mag=None, rate=RATE):
    """Gyro in deg/s; the orientation as a rotation."""
    truth = turned.as_quat(scalar_first=True)
    return Scene(rate, gyro * DEG, accel, mag, truth, where)


def about_up(yaw):
    return Rotation.from_euler("z", np.asarray(yaw)[:, None], degrees=True)


def creep(rest, rate, lasts, noise, seed):
    """A body that rests, turns slowly about the vertical for a while, and stands again."""
    rng = np.random.default_rng(seed)
    k = times(lasts)
    bend = rate * np.clip(np.minimum(k, lasts - k) / 1.6, 0.0, 1.0)
    yaw = np.concatenate([np.zeros(round(rest * RATE)), bend, np.zeros(600)])
    n = len(yaw)
    gyro = noise * np.array([1.0, 0.8, 0.3]) * rng.normal(size=(n, 3))
    gyro[:, 2] += yaw
    accel = np.array([0.0, 0.0, G]) + 0.05 * rng.normal(size=(n, 3))
    return scene(gyro, accel, about_up(np.cumsum(yaw) / RATE), times(n / RATE) >= 2.0)
