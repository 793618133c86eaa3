"""Turns and orientation by matrices, and sensitivities of a turn by finite differences."""

import math

import numpy as np


def cross_matrix(v):
    x, y, z = v
    return np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])


def exponential(phi):
    """Rodrigues' formula, whose two terms keep their digits for small angles."""
    angle = float(np.linalg.norm(phi))
    if angle == 0.0:
        return np.eye(3)
    half = math.sin(angle / 2.0) / angle
    x = cross_matrix(phi)
    return np.eye(3) + math.sin(angle) / angle * x + 2.0 * half**2 * x @ x


def logarithm(rotation):
    """The rotation vector of a small rotation: its sine is found from the matrix."""
    r = rotation
    sine = np.array([r[2, 1] - r[1, 2], r[0, 2] - r[2, 0], r[1, 0] - r[0, 1]]) / 2.0
    size = float(np.linalg.norm(sine))
    return sine if size == 0.0 else sine * (math.asin(size) / size)


def rotation_vector(before, after, dt, method="coning"):
    if method == "backward-euler":
        return after * dt
    mean = (before + after) / 2.0 * dt
    return mean if method == "trapezoid" else mean + dt**2 / 12.0 * np.cross(before, after)


def orientations(rates, steps, method="coning"):
    """Matrices that turn vectors of the body at each sample into its axes at the first one."""
    found = [np.eye(3)]
    for k, dt in enumerate(steps):
        found.append(found[-1] @ exponential(rotation_vector(rates[k], rates[k + 1], dt, method)))
    return np.array(found)


def rotation_matrix(q):
    """Of a quaternion, scalar first."""
    w, v = q[0], np.asarray(q[1:])
    return np.eye(3) + 2.0 * w * cross_matrix(v) + 2.0 * cross_matrix(v) @ cross_matrix(v)


def turn(rates, steps, bias, matrix, error=0.0):
    """P of v_start = P v_end; `error` is added to the corrected rate."""
    return orientations((rates - bias) @ matrix.T + error, steps)[-1]


def sensitivities(rates, steps, bias, matrix, h=1e-5):
    """By central differences: psi by elements of the matrix, (3, 3, 3), and by the rate, (3, 3)."""
    here = turn(rates, steps, bias, matrix)

    def psi(change, error):
        ahead = turn(rates, steps, bias, matrix + change, error)
        behind = turn(rates, steps, bias, matrix - change, -error)
        return (logarithm(here.T @ ahead) - logarithm(here.T @ behind)) / (2.0 * h)

    by_matrix, by_rate = np.zeros((3, 3, 3)), np.zeros((3, 3))
    for b in range(3):
        by_rate[:, b] = psi(0.0, h * np.eye(3)[b])
        for c in range(3):
            by_matrix[:, b, c] = psi(h * np.outer(np.eye(3)[b], np.eye(3)[c]), 0.0)
    return by_matrix, by_rate
