"""Quaternions as tuples of floats, the scalar first."""

import math

import numpy as np


def product(p, q):
    a, b, c, d = p
    w, x, y, z = q
    return (
        a * w - b * x - c * y - d * z,
        a * x + b * w + c * z - d * y,
        a * y - b * z + c * w + d * x,
        a * z + b * y - c * x + d * w,
    )


def unit(q):
    length = math.sqrt(sum(x * x for x in q))
    return tuple(x / length for x in q)


def about_up(angle):
    return (math.cos(0.5 * angle), 0.0, 0.0, math.sin(0.5 * angle))


def steps(r):
    """Of rotation vectors (n, 3): series to the sixth order up to half a radian, exact beyond."""
    square = np.sum(r * r, axis=1)
    half = 0.5 * np.sqrt(np.maximum(square, 0.25))
    cosine = 1.0 - square / 8.0 + square**2 / 384.0 - square**3 / 46_080.0
    sine = 0.5 - square / 48.0 + square**2 / 3_840.0 - square**3 / 645_120.0
    far = square > 0.25
    cosine = np.where(far, np.cos(half), cosine)
    sine = np.where(far, 0.5 * np.sin(half) / half, sine)
    return np.column_stack([cosine, r * sine[:, None]])


def matrices(q):
    """Rotation matrices (n, 3, 3) of quaternions (n, 4)."""
    w, x, y, z = np.asarray(q).T
    rows = [
        [1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - w * z), 2.0 * (x * z + w * y)],
        [2.0 * (x * y + w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - w * x)],
        [2.0 * (x * z - w * y), 2.0 * (y * z + w * x), 1.0 - 2.0 * (x * x + y * y)],
    ]
    return np.moveaxis(np.array(rows), -1, 0)
