"""Orientation by integration of rates, one quaternion after the other."""

import numpy as np


def product(p, q):
    a, b, c, d = p
    w, x, y, z = q
    return np.array(
        [
            a * w - b * x - c * y - d * z,
            a * x + b * w + c * z - d * y,
            a * y - b * z + c * w + d * x,
            a * z + b * y - c * x + d * w,
        ]
    )


def of_rotation_vector(phi):
    angle = float(np.linalg.norm(phi))
    if angle == 0.0:
        return np.array([1.0, 0.0, 0.0, 0.0])
    return np.concatenate(([np.cos(angle / 2)], np.sin(angle / 2) * phi / angle))


def step(before, after, dt, method):
    if method == "backward-euler":
        return after * dt
    mean = 0.5 * (before + after) * dt
    if method == "trapezoid":
        return mean
    return mean + np.cross(before, after) * dt**2 / 12.0


def integrate_rates(rates, steps, method):
    """Quaternions w, x, y, z from the body at each sample to the body at the first."""
    found = [np.array([1.0, 0.0, 0.0, 0.0])]
    for before, after, dt in zip(rates[:-1], rates[1:], steps, strict=True):
        q = product(found[-1], of_rotation_vector(step(before, after, dt, method)))
        found.append(q / np.linalg.norm(q))
    return np.array(found)
