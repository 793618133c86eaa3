"""Attitude under single faults and on bodies that never rest: a scene for each.

Bodies that creep off, never rest, fly fast or speed up; sensors that give garbage, freeze or carry
a bias beyond what a good gyro has. Rates are in deg/s here, everything in a `Scene` in SI.
"""

from dataclasses import replace

import numpy as np
from scipy.spatial.transform import Rotation

import zerorate as zr
from support.outside import (
    DEG,
    FIELD,
    RATE,
    G,
    Scene,
    gauss_markov,
    level,
    road,
    smoothed,
    times,
)

UP = np.array([0.0, 0.0, G])


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


LEGS = {
    # Share of the legs up to this one, seconds, rates; then speeds, and how smooth each is, s.
    "robot": (
        ((0.35, (2, 8), (0, 0)), (0.75, (2, 10), (1, 12)), (1.0, (1, 3), (20, 60))),
        ((0.5, 3.0), (0.25, 0.7), (1.5, 1.0, 0.8)),
    ),
    "car": (
        ((0.5, (5, 25), (0, 0)), (0.8, (3, 15), (0.5, 6)), (1.0, (3, 6), (10, 25))),
        ((5.0, 15.0), (0.7, 2.0), (0.4, 2.5, 0.5)),
    ),
}


def under_way(kind, seed, bias=0.3, seconds=180.0):
    """A level robot or car that never rests: straights, arcs and turns, and a bias of that size."""
    rng, n = np.random.default_rng(seed), round(seconds * RATE)
    kinds, (speeds, smooth, (noise, sway, shaken)) = LEGS[kind]
    yaw, speed, k = np.zeros(n), np.zeros(n), 0
    while k < n:
        share = rng.random()
        lasts, rates = next(leg[1:] for leg in kinds if share < leg[0])
        leg = slice(k, k + round(rng.uniform(*lasts) * RATE))
        yaw[leg] = rng.uniform(*rates) * rng.choice((-1.0, 1.0))
        speed[leg] = rng.uniform(*speeds)
        k = leg.stop
    yaw, speed = (smoothed(smoothed(z, s), s) for z, s in zip((yaw, speed), smooth, strict=True))
    t = times(seconds)
    gyro = noise * rng.normal(size=(n, 3)) + bias * rng.normal(size=3)
    for axis in range(2):
        swing = smoothed(rng.normal(size=n), 0.5) * np.sqrt(50.0)
        gyro[:, axis] += sway * swing * np.sin(2.0 * np.pi * rng.uniform(1.0, 3.0) * t)
    gyro[:, 2] += yaw
    accel = np.column_stack([np.gradient(speed) * RATE, speed * yaw * DEG, np.full(n, G)])
    accel += shaken * rng.normal(size=(n, 3))
    return scene(gyro, accel, about_up(np.cumsum(yaw) / RATE), np.ones(n, bool))


def pushed(push, lasts, *, ramp=1.5, shaken=0.05, noise=0.3, seed=2, rate=RATE):
    """A body that rests for a minute and then speeds up for so long, as an aircraft that takes off.

    What counts is the second half of that and the half minute after it.
    """
    rng, t = np.random.default_rng(seed), times(120.0 + lasts, rate)
    n = len(t)
    force = push * ((t > 60.0) & (t < 60.0 + lasts))
    on = ((t > 55.0) & (t < 95.0 + lasts))[:, None]
    gyro = np.array([0.3, -0.2, 0.5]) + (0.1 + noise * on) * rng.normal(size=(n, 3))
    accel = np.array([0.0, 0.0, G]) + (0.03 + shaken * on) * rng.normal(size=(n, 3))
    accel[:, 0] += smoothed(force, ramp, rate)
    where = (t > 60.0 + lasts / 2.0) & (t < 90.0 + lasts)
    return scene(gyro, accel, about_up(np.zeros(n)), where, rate=rate)


def fast_drone(tilt, seed, *, lift=0.0, seconds=90.0, rate=200.0, drag=0.25):
    """A rotor craft that holds tilts of up to so many deg for seconds, after 12 s of rest.

    Its force is along its own z axis, and drag; ``lift``: vertical accelerations, m/s^2.
    """
    rng, t = np.random.default_rng(seed), times(seconds, rate)
    n, flies = len(t), t >= 14.0
    lean, k = np.zeros((n, 2)), round(14.0 * rate)
    while k < n:
        leg = slice(k, k + round(rng.uniform(2.0, 5.0) * rate))
        way = rng.uniform(0.0, 2.0 * np.pi)
        lean[leg] = rng.uniform(0.3, 1.0) * tilt * np.array([np.cos(way), np.sin(way)])
        k = leg.stop
    roll, pitch = (smoothed(smoothed(z, 0.4, rate), 0.4, rate) for z in lean.T)
    yaw = np.cumsum(np.where(flies, 20.0 * np.sin(0.3 * t + seed), 0.0)) / rate
    turned = Rotation.from_euler("ZYX", np.column_stack([yaw, pitch, roll]), degrees=True)
    gyro = np.vstack([(turned[:-1].inv() * turned[1:]).as_rotvec() * rate, np.zeros(3)]) / DEG
    up = lift * gauss_markov(rng, n, 1.0, 1.0 * rate / RATE, 1)[:, 0] * flies
    matrix, v, accel = turned.as_matrix(), np.zeros(3), np.zeros((n, 3))
    for k in range(n):
        a, M = np.zeros(3), matrix[k]
        if flies[k]:
            through = M.T @ v
            a = M @ [-drag * through[0], -drag * through[1], G / M[2, 2]] - UP
            a[2] = up[k]
        v = v + a / rate
        accel[k] = M.T @ (a + UP)
    on = (t > 13.0)[:, None]
    gyro += (0.1 + 2.0 * on) * rng.normal(size=(n, 3)) + [0.3, -0.2, 0.2]
    accel += (0.05 + 3.0 * on) * rng.normal(size=(n, 3))
    return scene(gyro, accel, turned, flies, rate=rate)


def hand(rate, seconds, *, kind="hand", seed=4, **more):
    """A simulated motion of which all counts."""
    motion = zr.simulate_motion(kind, rate, seconds, seed=seed, **more)
    where = np.ones(len(motion.gyro), bool)
    return Scene(rate, motion.gyro, motion.accel, motion.mag, motion.quaternion, where)


def garbage(scene, row, value, axis):
    """One axis of one sample is a number of its own, deg/s."""
    gyro = scene.gyro.copy()
    gyro[row, axis] = value * DEG
    return replace(scene, gyro=gyro)


def passing(angle, lasts, seed, *, seconds=150.0):
    """A car that rests for 45 s and drives on; for so long a minute the field points elsewhere."""
    rng, t = np.random.default_rng([seed, 5]), times(seconds)
    yaw, k = np.zeros(len(t)), 5000
    while k < len(t):
        yaw[k : k + 500] = rng.choice((-1.0, 1.0)) * rng.uniform(5.0, 18.0)
        k += round(rng.uniform(8.0, 25.0) * RATE)
    elsewhere = np.zeros(len(t))
    for at in np.arange(90.0, seconds - 30.0, 60.0):
        aside = np.clip(np.minimum(t - at, at + lasts - t), 0.0, 1.0)
        elsewhere += rng.choice((-1.0, 1.0)) * angle * aside
    field = about_up(-elsewhere).apply(FIELD) - FIELD
    return level(smoothed(yaw, 1.0), seed, shaken=road(len(t), seed), field=field, where=t > 50.0)


def held_field(scene, every, last=None):
    """A magnetometer that gives one value for so many samples, and from ``last`` on for ever."""
    row = np.arange(len(scene.mag)) // every * every
    mag = scene.mag[row if last is None else np.minimum(row, last)]
    return replace(scene, mag=mag)


def big_bias(size, axis, seconds=20.0, seed=3):
    """A gyro with a bias along an axis lies still, and a hand moves it for as long."""
    errors = zr.simulation.MotionErrors.none()
    moved, rng = hand(RATE, seconds, seed=seed, errors=errors), np.random.default_rng(seed)
    n = round(seconds * RATE)
    first = Rotation.from_quat(moved.truth[0], scalar_first=True)
    accel = np.vstack([np.tile(first.inv().apply([0.0, 0.0, G]), (n, 1)), moved.accel])
    mag = np.vstack([np.tile(moved.mag[0], (n, 1)), moved.mag])
    way = first.inv().apply(np.asarray(axis) / np.linalg.norm(axis))
    gyro = np.vstack([np.zeros((n, 3)), moved.gyro]) + size * DEG * way
    noise = [scale * rng.normal(size=(2 * n, 3)) for scale in (0.1 * DEG, 0.03, 0.3)]
    truth = np.vstack([np.tile(moved.truth[0], (n, 1)), moved.truth])
    where = np.arange(2 * n) >= n
    return Scene(RATE, gyro + noise[0], accel + noise[1], mag + noise[2], truth, where)
