"""A session of poses and turns by hand, of which all errors are known."""

from dataclasses import dataclass

import numpy as np

import zerorate as zr

DEG = np.pi / 180.0
GRAVITY = 9.80665


@dataclass(frozen=True, eq=False)
class Session:
    """What two sensors put out, SI, and the model that made it."""

    gyro: np.ndarray
    accel: np.ndarray
    rate: float
    gyro_matrix: np.ndarray
    gyro_bias: np.ndarray
    g_sensitivity: np.ndarray
    accel_matrix: np.ndarray
    accel_bias: np.ndarray

    def recording(self, gyro_unit="rad/s", accel_unit="m/s^2", start=0.0):
        gyro, accel = self.gyro, self.accel
        if gyro_unit != "unit":
            gyro = zr.units.convert(gyro, "rad/s", gyro_unit)
        if accel_unit != "unit":
            accel = zr.units.convert(accel, "m/s^2", accel_unit)
        return recorded(gyro, accel, self.rate, gyro_unit, accel_unit, start)


def recorded(gyro, accel, rate, gyro_unit="rad/s", accel_unit="m/s^2", start=0.0):
    def log(name, data, unit):
        time = start + np.arange(len(data)) / rate
        return zr.Log(time, rate, data, [f"{name}_{axis}" for axis in "xyz"], unit)

    logs = {"gyro": log("gyro", gyro, gyro_unit), "accel": log("accel", accel, accel_unit)}
    return zr.Recording(logs)


def rotations(axis, angles):
    """Rotations about one axis, shape (n, 3, 3)."""
    x, y, z = axis
    K = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    sine, cosine = np.sin(angles)[:, None, None], np.cos(angles)[:, None, None]
    return np.eye(3) + sine * K + (1 - cosine) * (K @ K)


def _unit(rng):
    v = rng.standard_normal(3)
    return v / np.linalg.norm(v)


def random_turns(rng, poses, least=60.0, most=170.0):
    """Axis, angle in rad, and an axis and angle of wobble, for each turn."""
    angles = rng.uniform(least, most, poses - 1) * DEG
    return [(_unit(rng), angle, _unit(rng), rng.normal(0.0, 10 * DEG)) for angle in angles]


def motion(turns, start, rate, rest=6.0, turn=2.0):
    """Rates and directions of the reaction to gravity in the body; the pose of each sample."""
    u = np.asarray(start, float) / np.linalg.norm(start)
    n_rest, n_turn = round(rest * rate), round(turn * rate)
    rates, ups, pose = [np.zeros((n_rest, 3))], [np.tile(u, (n_rest, 1))], [np.zeros(n_rest, int)]
    phase = (np.arange(n_turn) + 0.5) / n_turn
    for i, (axis, angle, other, wobble) in enumerate(turns):
        smooth, speed = (
            phase - np.sin(2 * np.pi * phase) / (2 * np.pi),
            1 - np.cos(2 * np.pi * phase),
        )
        # The second rotation comes back to where it was: the axis moves during the turn.
        bent, bending = (1 - np.cos(2 * np.pi * phase)) / 2, np.pi * np.sin(2 * np.pi * phase)
        first, second = rotations(axis, angle * smooth), rotations(other, wobble * bent)
        whole = first @ second
        rate_1 = np.einsum("nba,b->na", second, axis) * (angle * speed / turn)[:, None]
        rates.append(rate_1 + other * (wobble * bending / turn)[:, None])
        ups.append(np.einsum("nba,b->na", whole, u))
        pose.append(np.full(n_turn, -1))
        u = rotations(axis, np.array([angle]))[0].T @ u
        rates.append(np.zeros((n_rest, 3)))
        ups.append(np.tile(u, (n_rest, 1)))
        pose.append(np.full(n_rest, i + 1))
    return np.concatenate(rates), np.concatenate(ups), np.concatenate(pose)


def session(
    seed=0,
    poses=20,
    rate=100.0,
    turns=None,
    start=(0.1, -0.2, 0.95),
    rest=6.0,
    turn=2.0,
    scale=0.02,
    cross=0.01,
    g_sensitivity=0.05,
    pose_error=0.3e-3,
    walk=0.0,
    force=0.05,
):
    """A session with 2 % of scale, 10 mrad of cross terms, 0.3 mg a pose unless told otherwise."""
    rng = np.random.default_rng(seed)
    turns = random_turns(rng, poses) if turns is None else turns
    rates, ups, pose = motion(turns, start, rate, rest, turn)
    n = len(rates)
    A = np.diag(1 + scale * rng.standard_normal(3)) + np.tril(
        cross * rng.standard_normal((3, 3)), -1
    )
    off = ~np.eye(3, dtype=bool)
    W = np.diag(1 + scale * rng.standard_normal(3)) + off * cross * rng.standard_normal((3, 3))
    G = g_sensitivity * DEG * rng.standard_normal((3, 3))
    b_a, b_g = 20e-3 * rng.standard_normal(3), DEG * rng.standard_normal(3)
    at_pose = pose_error * rng.standard_normal((len(turns) + 1, 3))
    moving = pose < 0
    f = ups + np.where(moving[:, None], force * smooth_noise(rng, n, rate), at_pose[pose])
    accel = f @ A.T + b_a + 1.5e-3 * rng.standard_normal((n, 3))
    drift = walk * DEG * np.cumsum(rng.standard_normal((n, 3)), axis=0) / np.sqrt(rate)
    gyro = rates @ W.T + b_g + f @ G.T + drift + 0.05 * DEG * rng.standard_normal((n, 3))
    return Session(gyro, accel * GRAVITY, rate, W, b_g, G, A, b_a * GRAVITY)


def smooth_noise(rng, n, rate):
    """Accelerations of a hand, RMS about one."""
    width = max(2, round(0.2 * rate))
    kernel = np.hanning(width + 2)
    kernel /= np.sqrt((kernel**2).sum())
    return np.stack([np.convolve(rng.standard_normal(n), kernel, "same") for _ in range(3)], 1)
