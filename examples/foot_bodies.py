"""Simulated feet and other bodies, to test the rules for a foot's swings.

``foot(seed)`` and ``other(seed)`` return the kind, the sampling rate, Hz, times, rates and forces
of a sensor. The sensor has 48 to 400 Hz and any mounting. Each kind draws its size, speed and
noise.
"""

import math

import numpy as np

import zerorate as zr

GRAVITY = 9.81
UP = np.array([0.0, 0.0, 1.0])
RATES = (48.0, 50.0, 62.5, 100.0, 128.0, 200.0, 250.0, 400.0)
SECONDS = 40.0
FEET = {
    # Length and height of a stride, m, swing and stance, s, pitch, rad, shock at the heel, m/s².
    "slow": (0.7, 0.06, 0.7, 0.9, 0.5, 4.0),
    "walking": (1.3, 0.12, 0.55, 0.55, 0.8, 15.0),
    "fast": (1.7, 0.15, 0.45, 0.4, 1.0, 30.0),
    "running": (2.3, 0.25, 0.45, 0.25, 1.3, 60.0),
    "stairs": (0.6, 0.25, 0.6, 0.6, 0.5, 10.0),
    "shuffling": (0.4, 0.03, 0.45, 0.5, 0.25, 6.0),
    "dragging": (0.3, 0.01, 0.6, 0.7, 0.45, 3.0),
    "backwards": (-0.8, 0.08, 0.6, 0.6, -0.5, 8.0),
    "marching": (0.5, 0.35, 0.55, 0.5, 1.1, 25.0),
}


def eased(s):
    """Return a step from 0 to 1 with its first two derivatives, which are zero at the ends."""
    s = np.clip(s, 0.0, 1.0)
    return s**3 * (10.0 - 15.0 * s + 6.0 * s**2)


def turned(yaw, pitch, roll):
    """Return rotations from the body to the earth, (n, 3, 3)."""
    (cy, sy), (cp, sp), (cr, sr) = ((np.cos(a), np.sin(a)) for a in (yaw, pitch, roll))
    rows = [
        [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
        [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
        [-sp, cp * sr, cp * cr],
    ]
    return np.moveaxis(np.array(rows), 2, 0)


def sensed(pose, rate, seconds, draws, *, shake=None, gravity=GRAVITY):
    """Return times, rates and forces of a sensor with position and angles as functions of time.

    `pose` returns positions, (n, 3), and yaw, pitch, roll, (n,). `shake` returns additional force,
    (n, 3), m/s².
    """
    t, h = np.arange(round(seconds * rate)) / rate, 1e-3
    (before, a), (now, b), (after, c) = (pose(t + d) for d in (-h, 0.0, h))
    earlier, attitude, later = (turned(*angles) for angles in (a, b, c))
    acceleration = (before - 2.0 * now + after) / h**2
    change = np.einsum("nji,njk->nik", earlier, later)
    gyro = np.stack([change[:, 2, 1], change[:, 0, 2], change[:, 1, 0]], axis=1)
    gyro -= np.stack([change[:, 1, 2], change[:, 2, 0], change[:, 0, 1]], axis=1)
    gyro /= 4.0 * h
    force = np.einsum("nji,nj->ni", attitude, acceleration + gravity * UP)
    if shake is not None:
        force += shake(t)
    mount = turned(*draws.uniform(-math.pi, math.pi, (3, 1)))[0]
    noise = draws.uniform(0.02, 0.2), draws.uniform(0.02, 0.1)
    white = draws.standard_normal((2, len(t), 3))
    gyro = gyro @ mount.T + np.radians(noise[0] * white[0] + draws.normal(0.0, 0.3, 3))
    return t, gyro, force @ mount.T + noise[1] * white[1]


def shocks(at, size, draws):
    """Return a function of time: ringing of a shoe after each of these times, (n, 3), m/s²."""
    at = np.asarray(at)
    sizes = size * draws.uniform(0.5, 1.5, (len(at), 3))
    frequency, fades = draws.uniform(15.0, 30.0), draws.uniform(0.02, 0.04)

    def ringing(t):
        k = np.searchsorted(at, t, side="right") - 1
        since = np.where(k >= 0, t - at[np.maximum(k, 0)], 1e3)
        return (
            sizes[np.maximum(k, 0)]
            * (np.exp(-since / fades) * np.sin(2.0 * np.pi * frequency * since))[:, np.newaxis]
        )

    return ringing


def walked(kind, draws, seconds=SECONDS):
    """Return the pose of a foot as a function of time, and the times of heel strikes, s."""
    length, height, swing, stance, pitch, _ = FEET[kind]
    scale = draws.uniform(0.85, 1.15)
    rest = draws.choice([0.0, 2.0, 2.0, 2.0])
    n = int(seconds / (scale * (swing + stance))) + 2
    lengths = length * scale * draws.uniform(0.85, 1.15, n)
    turns = draws.normal(0.0, 0.1, n) + draws.normal(0.0, 0.05)
    swings = swing * scale * draws.uniform(0.9, 1.1, n)
    stances = stance * scale * draws.uniform(0.8, 1.2, n)
    begins = rest + np.concatenate([[0.0], np.cumsum(swings + stances)])[:-1]
    if rest == 0.0:
        begins -= draws.uniform(0.0, swing + stance)
    headings = np.concatenate([[0.0], np.cumsum(turns)])
    steps = lengths[:, np.newaxis] * np.column_stack([np.cos(headings[:-1]), np.sin(headings[:-1])])
    places = np.vstack([np.zeros(2), np.cumsum(steps, axis=0)])
    climb = 0.17 * (kind == "stairs")
    roll_over = draws.uniform(0.02, 0.08)

    def pose(t):
        k = np.clip(np.searchsorted(begins, t, side="right") - 1, 0, n - 1)
        s = np.clip((t - begins[k]) / swings[k], 0.0, 1.0)
        rolled = np.clip((t - begins[k] - swings[k]) / stances[k], 0.0, 1.0)
        part = eased(s)
        position = np.zeros((len(t), 3))
        position[:, :2] = places[k] + part[:, np.newaxis] * steps[k]
        position[:, 2] = climb * (k + part) + height * 64.0 * (s * (1.0 - s)) ** 3
        angle = pitch * 2.0 * 64.0 * (s * (1.0 - s)) ** 3 * np.sin(2.0 * np.pi * s)
        # The sole is flat in the middle of a stance. The foot rolls before and after.
        flat = eased((rolled - 0.7) / 0.3)
        angle = angle + roll_over * np.where(s < 1.0, 1.0 - eased(3.0 * s), flat) * (k > 0)
        return position, (headings[k] + turns[k] * part, angle, 0.1 * angle)

    return pose, begins + swings


def foot(seed, kind=None, rate=None, seconds=SECONDS, gravity=GRAVITY):
    """Return kind, rate, times, rates and forces of a simulated foot, with or without gravity."""
    draws = np.random.default_rng([1, seed])
    kind = kind or list(FEET)[seed % len(FEET)]
    rate = rate or float(draws.choice(RATES))
    pose, strikes = walked(kind, draws, seconds)
    ringing = shocks(strikes, FEET[kind][5], draws)
    return kind, rate, *sensed(pose, rate, seconds, draws, shake=ringing, gravity=gravity)


def waves(t, draws_of, amplitude, frequency):
    """Return a sum of three harmonics with given amplitudes and phases, (n,)."""
    sizes, phases = draws_of
    return sum(
        amplitude * sizes[i] * np.sin(2.0 * np.pi * (i + 1) * frequency * t + phases[i])
        for i in range(3)
    )


def harmonics(draws, fades=(1.0, 0.4, 0.2)):
    """Return amplitudes and phases of three harmonics."""
    return np.array(fades) * draws.uniform(0.5, 1.5, 3), draws.uniform(0.0, 2.0 * math.pi, 3)


def swinging(draws, amplitude, frequency, arm, bounce, speed):
    """Return the pose of a limb, m long, that swings about its upper end while this end bounces.

    Pace and amplitude vary by a few percent.
    """
    pitch, roll, yaw = (harmonics(draws) for _ in range(3))
    up, side = harmonics(draws, (0.3, 1.0, 0.3)), harmonics(draws)
    late, size = wander(draws, 6, 0.05, 0.4), wander(draws, 6, 0.05, 0.4)

    def pose(t):
        paced, sized = t + 0.03 / frequency * late(t), 1.0 + 0.08 * size(t)
        angle = sized * waves(paced, pitch, amplitude, frequency)
        tilt = sized * waves(paced, roll, 0.2 * amplitude, frequency)
        position = np.column_stack(
            [
                speed * t + arm * np.sin(angle),
                waves(paced, side, bounce, frequency),
                waves(paced, up, bounce, frequency) - arm * np.cos(angle),
            ]
        )
        return position, (waves(paced, yaw, 0.3 * amplitude, frequency), angle, tilt)

    return pose


def wander(draws, count, low, high):
    """Return a function of time: a sum of waves with random frequencies and amplitude 1."""
    frequency = draws.uniform(low, high, count)
    phase, size = draws.uniform(0.0, 2.0 * math.pi, count), draws.uniform(0.3, 1.0, count)
    size /= math.sqrt(0.5 * (size**2).sum())
    return lambda t: np.sin(2.0 * np.pi * np.outer(t, frequency) + phase) @ size


def drifting(draws, angle, distance, low, high):
    """Return a pose that varies by angles, rad, and distances, m, at some frequencies, Hz."""
    parts = [wander(draws, 8, low, high) for _ in range(6)]

    def pose(t):
        return (
            distance * np.column_stack([part(t) for part in parts[:3]]),
            tuple(angle * part(t) for part in parts[3:]),
        )

    return pose


def stick(draws):
    """Return the pose of a stick that rotates about its tip on the ground, then moves forward."""
    height, swing, stance = draws.uniform(0.5, 0.9), 0.4, draws.uniform(0.5, 0.8)
    reach, cycle = draws.uniform(0.25, 0.45), 0.4 + draws.uniform(0.5, 0.8)
    stance = cycle - swing

    def pose(t):
        k = np.floor(t / cycle)
        s = t - k * cycle
        planted = np.clip(s / stance, 0.0, 1.0)
        ahead = eased((s - stance) / swing)
        angle = reach * (-1.0 + 2.0 * (planted - ahead))
        tip = (k + ahead) * 2.0 * reach * height
        lift = 0.05 * 64.0 * (ahead * (1.0 - ahead)) ** 3
        position = np.column_stack(
            [tip + height * np.sin(angle), np.zeros(len(t)), lift + height * np.cos(angle)]
        )
        return position, (np.zeros(len(t)), angle, np.zeros(len(t)))

    return pose


def circling(draws):
    """Return the pose of a pedal, or of a shoe on it, in circular motion."""
    frequency, radius = draws.uniform(0.8, 1.6), 0.17
    tips, speed = harmonics(draws, (1.0, 0.2, 0.0)), draws.uniform(3.0, 7.0)

    def pose(t):
        a = 2.0 * np.pi * frequency * t
        position = np.column_stack([speed * t + radius * np.sin(a), 0 * t, radius * np.cos(a)])
        return position, (0 * t, waves(t, tips, 0.35, frequency), 0 * t)

    return pose


def door(draws):
    """Return the pose of a door that opens and closes fast, and stands in between like a foot."""
    width, cycle = draws.uniform(0.5, 0.9), draws.uniform(2.5, 4.0)
    moves, wide = draws.uniform(0.5, 0.9), draws.uniform(0.8, 1.5)

    def pose(t):
        s = np.mod(t, cycle)
        yaw = wide * (eased(s / moves) - eased((s - 0.5 * cycle) / moves))
        position = width * np.column_stack([np.cos(yaw), np.sin(yaw), 0 * t])
        return position, (yaw, 0 * t, 0 * t)

    return pose


def other(seed, kind=None, rate=None, seconds=SECONDS):
    """Return kind, rate, times, rates and forces of a body that is not a foot."""
    draws = np.random.default_rng([2, seed])
    kind = kind or OTHERS[seed % len(OTHERS)]
    rate = rate or float(draws.choice(RATES))
    if kind in MOTIONS:
        made = zr.simulate_motion(MOTIONS[kind], rate, seconds, seed=seed)
        return kind, rate, made.time, made.gyro, made.accel
    pace, shake = draws.uniform(0.8, 1.1), None
    strikes = np.arange(0.0, seconds, 0.5 / pace)
    if kind == "wrist":
        pose = swinging(draws, draws.uniform(0.3, 0.6), pace, 0.6, 0.03, 1.3)
    elif kind == "running arm":
        pose = swinging(draws, draws.uniform(0.6, 1.0), 1.4 * pace, 0.3, 0.05, 3.0)
    elif kind == "trousers":
        pose = swinging(draws, draws.uniform(0.3, 0.5), pace, 0.35, 0.03, 1.3)
        shake = shocks(strikes, draws.uniform(3.0, 12.0), draws)
    elif kind == "shank":
        pose = swinging(draws, draws.uniform(0.5, 0.7), pace, 0.7, 0.03, 1.3)
        shake = shocks(strikes[::2], draws.uniform(5.0, 20.0), draws)
    elif kind == "phone":
        pose = drifting(draws, draws.uniform(0.05, 0.3), 0.05, 0.3, 2.0)
        shake = shocks(strikes, draws.uniform(1.0, 4.0), draws)
    elif kind == "waist":
        pose = swinging(draws, draws.uniform(0.05, 0.12), pace, 0.0, 0.03, 1.3)
        shake = shocks(strikes, draws.uniform(2.0, 8.0), draws)
    elif kind == "head":
        pose = drifting(draws, draws.uniform(0.2, 0.5), 0.05, 0.1, 0.8)
    elif kind == "drone":
        pose = drifting(draws, draws.uniform(0.05, 0.25), 1.0, 0.1, 1.0)
        rotors, size = wander(draws, 8, 40.0, 120.0), draws.uniform(1.0, 6.0)
        shake = lambda t: size * np.column_stack([rotors(t), rotors(t + 1.0), rotors(t + 2.0)])  # noqa: E731
    else:
        pose = {"stick": stick, "pedal": circling, "door": door}[kind](draws)
    return kind, rate, *sensed(pose, rate, seconds, draws, shake=shake)


MOTIONS = {
    "arm": "arm",
    "hand": "hand",
    "pendulum": "pendulum",
    "spinning pendulum": "spinning pendulum",
    "car": "vehicle",
}
OTHERS = (
    "wrist",
    "running arm",
    "trousers",
    "shank",
    "phone",
    "waist",
    "head",
    "drone",
    "stick",
    "pedal",
    *MOTIONS,
)


def recording(time, rate, gyro, accel, source="simulated"):
    """Return gyro and accelerometer as a recording."""
    logs = {
        kind: zr.Log.at(
            time, rate, values, tuple(f"{kind}_{axis}" for axis in "xyz"), unit, {"source": source}
        )
        for kind, values, unit in (("gyro", gyro, "rad/s"), ("accel", accel, "m/s^2"))
    }
    return zr.Recording(logs, source)


def joined(*parts, rate):
    """Return times, rates and forces of several recordings in sequence."""
    gyro, accel = (np.vstack([part[i] for part in parts]) for i in (1, 2))
    return np.arange(len(gyro)) / rate, gyro, accel


def lift(seed, rate=100.0):
    """Return times, rates and forces of a walk with a lift ride, and the ride's height, m."""
    draws = np.random.default_rng([3, seed])
    speed, push = draws.uniform(0.6, 2.5), draws.uniform(0.4, 1.3)
    height = draws.uniform(3.0, 30.0)
    speed = min(speed, 0.8 * math.sqrt(height * push / 2.0))
    ramp = 15.0 / 8.0 * speed / push
    cruise = height / speed - ramp
    wait = draws.uniform(2.5, 5.0)
    stands = 2.0 * wait + 2.0 * ramp + cruise
    walks = [
        zr.simulate_walk(rate, 12, seed=seed + k, rest=0.5 * stands, turn=0.05, gyro_bias=0.0)
        for k in range(2)
    ]
    parts = [(walk.time, walk.gyro.copy(), walk.accel.copy()) for walk in walks]
    time, gyro, accel = joined(*parts, rate=rate)
    begin = walks[0].time[-1] - 0.5 * stands + wait
    step = 0.5 / rate

    def velocity(t):
        since = t - begin
        return speed * (eased(since / ramp) - eased((since - ramp - cruise) / ramp))

    sign = draws.choice([-1.0, 1.0])
    accel[:, 2] += sign * (velocity(time + step) - velocity(time - step)) / (2.0 * step)
    accel += 0.03 * np.column_stack([wander(draws, 6, 0.2, 1.0)(time) for _ in range(3)])
    gyro += np.radians(0.5) * np.column_stack([wander(draws, 6, 0.2, 1.0)(time) for _ in range(3)])
    return time, gyro, accel, sign * height


def spliced(seed, rate=100.0):
    """Return times, rates and forces of two walks with different mounting, and the seam, s."""
    kinds = [list(FEET)[k] for k in np.random.default_rng([4, seed]).integers(0, 4, 2)]
    parts = [foot(10 * seed + k, kinds[k], rate, 25.0)[2:] for k in range(2)]
    return *joined(*parts, rate=rate), 25.0
