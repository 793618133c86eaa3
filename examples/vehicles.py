"""Simulated robots, boats, drones and walkers: sensors and fixes on a known path.

The path is a closed form of time. The truth is the strapdown navigation of its samples, as in
``zr.simulate_drive``.
"""

from functools import partial

import numpy as np

import zerorate as zr
from zerorate.geometry.earth import earth_rate, normal_gravity, transport_rate
from zerorate.geometry.rotations import inverse, rotate
from zerorate.simulation import drive as road

H = 1e-3
DEG = np.radians(1.0)
GRAVITY = 9.81


def waves(random, rms, low, high, lines=5):
    """Return a function of time: a sum of sines between two frequencies, Hz."""
    frequency = random.uniform(low, high, lines) * 2.0 * np.pi
    phase = random.uniform(0.0, 2.0 * np.pi, lines)
    size = rms * np.sqrt(2.0 / lines)
    return lambda t: size * np.sin(np.multiply.outer(t, frequency) + phase).sum(axis=-1)


def turns(random, apart, length, until=700.0):
    """Return the angle of random turns, ``apart`` seconds apart on average, rad."""
    begin = np.cumsum(random.exponential(apart, int(until / apart)) + 0.7 * length)
    angle = random.choice([-1.0, 1.0], len(begin)) * random.uniform(0.3, 1.9, len(begin))
    seconds = length * random.uniform(0.7, 1.5, len(begin))

    def at(t):
        part = np.clip((np.asarray(t)[..., np.newaxis] - begin) / seconds, 0.0, 1.0)
        return (angle * part**3 * (10.0 - part * (15.0 - 6.0 * part))).sum(axis=-1)

    return at


def robot(random, speed):
    """Return the motion of a wheeled robot, with varying speed, turns, and uneven ground."""
    turn = turns(random, 8.0, 4.0)
    pace, roll, pitch = (
        waves(random, rms, low, high)
        for rms, low, high in ((0.3, 0.02, 0.12), (1.5 * DEG, 0.1, 1.0), (1.5 * DEG, 0.1, 1.0))
    )
    heading = random.uniform(0.0, 2.0 * np.pi)

    def at(t):
        ahead = speed * (1.0 + np.clip(pace(t), -0.8, 0.8))
        yaw = heading + turn(t)
        tilt = np.stack([roll(t), pitch(t), yaw], axis=-1)
        return tilt, ahead, 0.0 * t, -ahead * np.sin(pitch(t))

    return at


def boat(random, speed):
    """Return the motion of a boat, which rolls, heaves and slips sideways."""
    roll, pitch = waves(random, 4 * DEG, 0.15, 0.4), waves(random, 2 * DEG, 0.1, 0.3)
    turn, pace = turns(random, 20.0, 12.0), waves(random, 0.25, 0.01, 0.05)
    slip, heave = waves(random, 0.05, 0.005, 0.05), waves(random, 0.2, 0.1, 0.3)
    heading = random.uniform(0.0, 2.0 * np.pi)

    def at(t):
        ahead = speed * (1.0 + np.clip(pace(t), -0.8, 0.8))
        tilt = np.stack([roll(t), pitch(t), heading + turn(t)], axis=-1)
        return tilt, ahead, slip(t) * speed, heave(t)

    return at


def drone(random, speed):
    """Return the motion of a multirotor, which flies in any direction and tilts to accelerate."""
    north, east = waves(random, 0.7 * speed, 0.01, 0.08), waves(random, 0.7 * speed, 0.01, 0.08)
    turn, climb = turns(random, 15.0, 4.0), waves(random, 0.4, 0.02, 0.1)
    heading = random.uniform(0.0, 2.0 * np.pi)

    def at(t):
        yaw = heading + turn(t)

        def level(time):
            c, s = np.cos(yaw), np.sin(yaw)
            return c * north(time) + s * east(time), c * east(time) - s * north(time)

        (ahead, right), (later, later_right) = level(t), level(t + H)
        drag = 0.03
        pitch = -np.arctan(((later - ahead) / H + drag * ahead) / GRAVITY)
        roll = np.arctan(((later_right - right) / H + drag * right) / GRAVITY)
        return np.stack([roll, pitch, yaw], axis=-1), ahead, right, climb(t)

    return at


def walker(random, speed):
    """Return the motion of a person with a backpack."""
    step = random.uniform(1.7, 2.0)
    sway, bob = waves(random, 1.0, 0.5 * step, 0.5 * step, 1), waves(random, 1.0, step, step, 1)
    turn, pace = turns(random, 12.0, 3.0), waves(random, 0.15, 0.01, 0.1)
    heading = random.uniform(0.0, 2.0 * np.pi)

    def at(t):
        ahead = speed * (1.0 + pace(t) + 0.1 * bob(t))
        tilt = np.stack(
            [3 * DEG * sway(t), 3 * DEG * bob(t), heading + turn(t) + 3 * DEG * sway(t)], axis=-1
        )
        return tilt, ahead, 0.1 * sway(t), 0.3 * bob(t)

    return at


KINDS = {
    "robot": (robot, 0.7, {"gyro": 3e-3, "accel": 0.05}),
    "boat": (boat, 4.0, {"gyro": 1e-3, "accel": 0.02}),
    "drone": (drone, 5.0, {"gyro": 2e-3, "accel": 0.05}),
    "walker": (walker, 1.4, {"gyro": 2e-3, "accel": 0.05}),
}
"""Motion, usual speed, m/s, and a tenth of the sensors' white noise, rad/s and m/s^2 per root
hertz."""


def simulate_vehicle(kind, duration=300.0, *, seed=0, rest=20.0, speed=None, rate=50.0, **receiver):
    """Return a simulated drive of a vehicle; ``kind`` is a key of `KINDS` or "car".

    ``receiver`` has arguments of `zr.simulate_drive`: fixes_rate, position_sigma, velocity_sigma,
    antenna, time_offset. gyro and accel are noise models.
    """
    if kind == "car":
        return zr.simulate_drive(rate, duration, seed=seed, rest=rest, **receiver)
    motion, usual, noise = KINDS[kind]
    random = np.random.default_rng([seed, *kind.encode()])
    at = motion(random, usual if speed is None else speed)
    models = {
        "gyro": zr.NoiseModel(angle_random_walk=0.1 * noise["gyro"], rate_random_walk=2e-6),
        "accel": zr.NoiseModel(
            angle_random_walk=0.1 * noise["accel"],
            rate_random_walk=2e-5,
            quantity="acceleration",
        ),
    }
    sampled = partial(_sample, at, rest)
    return _simulate_with(sampled, rate, duration, seed=seed, rest=rest, **models | receiver)


def _simulate_with(sampled, rate, duration, **arguments):
    """Run the simulator of drives with the samples of another motion."""
    usual = road._sample_road
    road._sample_road = lambda _, seconds, hertz, start: sampled(seconds, hertz, start)
    try:
        return zr.simulate_drive(rate, duration, **arguments)
    finally:
        road._sample_road = usual


def _begun(rest, t):
    """Return the time of the motion, which starts at rest, and its rate."""
    ease = 3.0
    s = np.clip((t - rest) / ease, 0.0, None) if rest > 0.0 else t / ease + 1.0
    early = s < 1.0
    passed = np.where(early, s**3 - 0.5 * s**4, s - 0.5) * ease
    return passed, np.where(early, 3.0 * s**2 - 2.0 * s**3, 1.0)


def _sample(at, rest, seconds, rate, start):
    def state(t):
        passed, pace = _begun(rest, t)
        tilt, ahead, right, down = at(passed)
        c, s = np.cos(tilt[:, 2]), np.sin(tilt[:, 2])
        velocity = np.column_stack([c * ahead - s * right, s * ahead + c * right, down])
        return tilt, velocity * pace[:, np.newaxis]

    (tilt, velocity), (before, v0), (after, v1) = (state(seconds + h) for h in (0.0, -H, H))
    turning = road._body_rates(tilt, (after - before) / (2.0 * H))
    attitude = road._attitudes(tilt)
    position = road._integrate_position(velocity, rate, start, np.tile(start, (len(seconds), 1)))
    latitude, _, height = position.T
    earth, way = earth_rate(latitude), transport_rate(latitude, height, velocity)
    down = np.zeros_like(velocity)
    down[:, 2] = normal_gravity(latitude, height)
    to_body = inverse(attitude)
    rates = turning + rotate(to_body, earth + way)
    gained = (v1 - v0) / (2.0 * H) + np.cross(2.0 * earth + way, velocity) - down
    return rates, rotate(to_body, gained), road._Trajectory(position, velocity, attitude)
