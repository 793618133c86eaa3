"""Strapdown navigation step by step: radii, gravity and rates anew at every sample."""

import numpy as np
from scipy.spatial.transform import Rotation

A, E2, ROTATION = 6_378_137.0, 6.6943799901413e-3, 7.292115e-5
EQUATOR, POLE = 9.7803253359, 9.8321849378


def skew(v):
    x, y, z = v
    return np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])


def turn(vector):
    """The matrix of a rotation vector."""
    return Rotation.from_rotvec(vector).as_matrix()


def radii(latitude):
    s = 1.0 - E2 * np.sin(latitude) ** 2
    return A * (1.0 - E2) / s**1.5, A / np.sqrt(s)


def gravity(latitude, height):
    s2, c2 = np.sin(latitude) ** 2, np.cos(latitude) ** 2
    b = A * np.sqrt(1.0 - E2)
    on_ellipsoid = (A * EQUATOR * c2 + b * POLE * s2) / np.sqrt(A**2 * c2 + b**2 * s2)
    return np.array([0.0, 0.0, on_ellipsoid * (1.0 - 2.0 * height / A)])


def rates(latitude, height, velocity):
    """Of the earth, and of the local axes on the way round it."""
    M, N = radii(latitude)
    north, east, _ = velocity
    earth = ROTATION * np.array([np.cos(latitude), 0.0, -np.sin(latitude)])
    way = np.array(
        [
            east / (N + height),
            -north / (M + height),
            -east * np.tan(latitude) / (N + height),
        ]
    )
    return earth, way


def increments(gyro, accel, dt, gyro_bias, accel_bias):
    """Rotation vectors and changes of velocity, in the axes of the body, from samples."""
    w0, w1, f0, f1 = gyro[:-1], gyro[1:], accel[:-1], accel[1:]
    w, f = 0.5 * (w0 + w1), 0.5 * (f0 + f1)
    theta = (w - gyro_bias) * dt + np.cross(w0, w1) * dt**2 / 12.0
    delta = (f - accel_bias) * dt + 0.5 * np.cross(w * dt, f * dt)
    delta += (np.cross(w0, f1 - f0) + np.cross(f0, w1 - w0)) * dt**2 / 12.0
    return theta, delta


def strapdown(gyro, accel, rate, position, velocity, C, gyro_bias=0.0, accel_bias=0.0):
    """Positions (rad, rad, m), velocities and matrices at every sample, the first being given."""
    dt = 1.0 / rate
    n = len(gyro)
    r, v, Cs = np.empty((n, 3)), np.empty((n, 3)), np.empty((n, 3, 3))
    r[0], v[0], Cs[0] = position, velocity, C
    theta, delta = increments(gyro, accel, dt, gyro_bias, accel_bias)
    for k, turned in enumerate(turn(theta)):
        latitude, longitude, height = r[k]
        earth, way = rates(latitude, height, v[k])
        pushed = Cs[k] @ delta[k]
        slow = gravity(latitude, height) - skew(2.0 * earth + way) @ v[k]
        v[k + 1] = v[k] + pushed + (slow - 0.5 * skew(earth + way) @ pushed) * dt
        M, N = radii(latitude)
        north, east, down = 0.5 * (v[k] + v[k + 1]) * dt
        r[k + 1] = (
            latitude + north / (M + height),
            longitude + east / ((N + height) * np.cos(latitude)),
            height - down,
        )
        C = turn(-(earth + way) * dt) @ Cs[k] @ turned
        # One step of Newton's towards an orthonormal matrix: rounding adds up to 1e-12 else.
        Cs[k + 1] = 0.5 * C @ (3.0 * np.eye(3) - C.T @ C)
    return r, v, Cs
