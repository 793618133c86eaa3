"""Attitude outside the laboratory: bodies that most rules take for a resting one, or not for one.

Level bodies that turn (bends, rate tables, swerves, a car in a city) in a field, a quadrotor that
hovers, and changes to recordings. Rates are in deg/s here, everything in a `Scene` in SI.
"""

from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial.transform import Rotation

import zerorate as zr

RATE = 100.0
DEG = np.pi / 180.0
FIELD = np.array([0.0, 20.0, -43.0])
G = 9.81
EARTH = 48.0
"""Strength of the field of `zerorate.simulate_motion`, uT."""


@dataclass(frozen=True, eq=False)
class Scene:
    """What sensors give, and the true orientation, w first, from sensor to east, north, up."""

    rate: float
    gyro: np.ndarray
    accel: np.ndarray
    mag: np.ndarray | None
    truth: np.ndarray
    # The samples that count.
    where: np.ndarray

    def cropped(self, first):
        """From a sample on."""
        mag = None if self.mag is None else self.mag[first:]
        parts = (z[first:] for z in (self.gyro, self.accel))
        return replace(
            self,
            **dict(zip(("gyro", "accel"), parts, strict=True)),
            mag=mag,
            truth=self.truth[first:],
            where=self.where[first:],
        )


def times(seconds, rate=RATE):
    return np.arange(round(seconds * rate)) / rate


def smoothed(z, seconds, rate=RATE):
    length = round(seconds * rate)
    return np.convolve(z, np.full(length, 1.0 / length), mode="same")


# Level bodies.


def level(yaw, seed, *, shaken=None, field=None, iron=(0.0, 0.0, 0.0), jump=None, where=None):
    """A level body of this yaw rate, deg/s, after some rest.

    ``shaken`` is the accelerometer's further output, ``field`` what a place adds to the earth's in
    the earth's axes, ``iron`` what turns with the body, ``jump`` a bias along z by sample, deg/s.
    """
    rng = np.random.default_rng(seed)
    n = len(yaw)
    gyro = 0.1 * rng.standard_normal((n, 3)) + 0.02 * np.array([1.0, -1.0, 1.0])
    gyro[:, 2] += yaw + (0.0 if jump is None else jump)
    accel = 0.02 * rng.standard_normal((n, 3)) + [0.0, 0.0, G]
    if shaken is None:
        shaken = 0.12 * rng.standard_normal((n, 3)) * (times(n / RATE) >= 10.0)[:, None]
    angle = np.cumsum(yaw) / RATE * DEG
    turned = Rotation.from_euler("z", angle[:, None])
    mag = turned.inv().apply(np.broadcast_to(FIELD, (n, 3)) + (0.0 if field is None else field))
    mag = mag + iron + 0.4 * rng.standard_normal((n, 3))
    where = np.ones(n, bool) if where is None else where
    return Scene(RATE, gyro * DEG, accel + shaken, mag, turned.as_quat(scalar_first=True), where)


def bends(r, seed):
    """Turns of five seconds, either way, with pauses."""
    rng, yaw, t = np.random.default_rng([seed, 1]), np.zeros(30000), 15.0
    while t < 290.0:
        yaw[round(t * RATE) : round((t + 5.0) * RATE)] = r * rng.choice((-1.0, 1.0))
        t += 5.0 + rng.uniform(3.0, 8.0)
    return level(smoothed(yaw, 0.5), seed)


def turntable(r, seed, *, still=False, rest=15.0):
    """A rate table at ``r`` for a minute, and at rest again; ``still``: nothing shakes."""
    t = times(rest + 62.0 + 30.0)
    # One that turns from the first sample on has no ramp there.
    ramp = np.minimum(t - rest if rest else 1.0, rest + 62.0 - t)
    yaw = r * np.clip(ramp, 0.0, 1.0)
    return level(yaw, seed, shaken=0.0 if still else None)


def jumped(seconds=20.0):
    """A turn of 5 deg/s between two rests, each of 20 s."""
    yaw = 5.0 * ((times(3.0 * seconds) >= seconds) & (times(3.0 * seconds) < 2.0 * seconds))
    return level(yaw, 0, shaken=0.0)


def road(n, seed):
    """How a car shakes its accelerometer."""
    t = times(n / RATE)[:, None]
    rng = np.random.default_rng([seed, 2])
    waves = np.hstack([np.sin(1.9 * t), np.cos(1.4 * t), 0.5 * np.sin(19.0 * t)])
    return (0.32 * rng.standard_normal((n, 3)) + 0.4 * waves) * (t >= 10.0)


def swerve(r, seed, *, grows=None, share=1.0, rest=None, seconds=600.0):
    """A car that swerves without end, whose gyro's bias jumps by ``r`` at 60 s."""
    t = times(seconds)
    yaw = share * (22.9 * np.sin(0.31 * t + seed) + 17.2 * np.sin(0.082 * t)) * (t >= 10.0)
    jump = r * (t >= 60.0) if grows is None else np.clip(grows * (t - 60.0), 0.0, r)
    shaken = road(len(t), seed)
    if rest is not None:
        still = (t >= rest[0]) & (t < rest[1])
        yaw, shaken = yaw * ~still, shaken * ~still[:, None]
    return level(yaw, seed, shaken=shaken, jump=jump, where=t >= 10.0)


def city(seed, *, r=0.0, room=0.0, iron=(0.0, 0.0, 0.0), seconds=600.0):
    """A car in a town: straight for 20 to 60 s, a right angle in four; streets may bend a field."""
    rng, t = np.random.default_rng([seed, 3]), times(seconds)
    yaw, at = np.zeros(len(t)), 10.0
    while at < seconds - 4.0:
        at += rng.uniform(20.0, 60.0)
        yaw[(t >= at) & (t < at + 4.0)] = rng.choice((-1.0, 1.0)) * 90.0 / 4.0
        at += 4.0
    field = gauss_markov(rng, len(t), room, 20.0) if room else None
    return level(
        smoothed(yaw, 0.5),
        seed,
        shaken=road(len(t), seed),
        field=field,
        iron=iron,
        jump=r * (t >= 60.0),
        where=t >= 10.0,
    )


def gauss_markov(rng, n, sigma, seconds, axes=3):
    """Noise that keeps its value for so many seconds."""
    from scipy.signal import lfilter

    keep = np.exp(-1.0 / (seconds * RATE))
    white = rng.standard_normal((n, axes)) * sigma * np.sqrt(1.0 - keep**2)
    white[0] = sigma * rng.standard_normal(axes)
    return lfilter([1.0], [1.0, -keep], white, axis=0)


# A car near iron.


def drive(seed, *, iron=0.0, cars=False, jump=0.0, seconds=300.0):
    """A car in a town, of `zerorate.simulate_motion`, whose magnetometer carries iron.

    ``iron`` is a share of the earth's field, in a direction that the seed draws; ``cars``: every
    ten seconds in the mean another passes within one to four, with 0.1 to 0.5 of the field at its
    nearest; ``jump``: the gyro's bias along z jumps by so much after a hundred seconds, deg/s.
    """
    errors = zr.simulation.MotionErrors(field_wander=4.5 * DEG)
    motion = zr.simulate_motion("vehicle", RATE, seconds, seed=seed, errors=errors)
    t, rng = motion.time, np.random.default_rng([seed, 4])
    way = rng.standard_normal(3)
    mag = motion.mag + iron * EARTH * way / np.linalg.norm(way)
    if cars:
        turned = Rotation.from_quat(motion.quaternion, scalar_first=True)
        mag = mag + turned.inv().apply(_passing(t, rng))
    gyro = motion.gyro + np.outer(t >= 100.0, [0.0, 0.0, jump * DEG])
    return Scene(RATE, gyro, motion.accel, mag, motion.quaternion, t >= 10.0)


def _passing(t, rng):
    """The field of cars that pass, in the earth's axes, uT."""
    field, at = np.zeros((len(t), 3)), 5.0
    while at < t[-1]:
        at += rng.exponential(10.0)
        near, way = rng.uniform(1.0, 4.0), rng.standard_normal(3)
        bell = np.exp(-0.5 * ((t - at) / (0.25 * near)) ** 2)[:, None]
        field += bell * rng.uniform(0.1, 0.5) * EARTH * way / np.linalg.norm(way)
    return field


# A quadrotor.

FLIGHTS = ((5.0, 4.0), (5.0, 3.0), (5.0, 5.0), (10.0, 4.0), (0.3, 4.0), (5.0, 2.0))
"""Bias of the gyro, deg/s, and seconds of rest before the flight, of seeds 0 to 5."""


def hover(seed, bias, rest, *, shift=0.05, flight=100.0):
    """A quadrotor that hovers, its motors on since before it leaves."""
    rate = 200.0
    rng, t = np.random.default_rng(seed), times(rest + flight + 3.0, rate)
    dt, n = 1.0 / rate, len(t)
    lands = rest + flight
    s = smoothstep((t - rest) / 2.0) * smoothstep((lands - t) / 2.0)
    f = np.column_stack([_drift(rng, s, dt), _drift(rng, s, dt), np.full(n, G)])
    yaw = np.cumsum(s * _ou(rng, n, dt, 0.3, 3.0)) * dt
    # The body's z axis along the force, by the least turn, then yaw and mount.
    up = f / np.linalg.norm(f, axis=1)[:, None]
    lean = np.column_stack([-up[:, 1], up[:, 0], np.zeros(n)])
    size = np.linalg.norm(lean, axis=1)
    scale = np.divide(np.arcsin(np.clip(size, 0.0, 1.0)), size, out=np.ones(n), where=size > 0)
    mount = Rotation.from_euler("yx", [20.0, 3.0], degrees=True)
    turned = (
        Rotation.from_rotvec(lean * scale[:, None]) * Rotation.from_euler("z", yaw[:, None]) * mount
    )
    rates = np.vstack([np.zeros(3), (turned[:-1].inv() * turned[1:]).as_rotvec() * rate])
    on = np.clip(np.minimum((t - 1.0) / 1.0, (lands + 1.0 - t) / 1.0), 0.0, 1.0)[:, None]
    way, moved = rng.standard_normal(3), rng.standard_normal(3)
    offset = bias * way / np.linalg.norm(way)
    offset = offset + s[:, None] * shift * moved / np.linalg.norm(moved)
    walk = 1e-3 * np.sqrt(dt) * np.cumsum(rng.standard_normal((n, 3)), axis=0)
    white = 0.012 * np.sqrt(rate) * rng.standard_normal((n, 3))
    gyro = rates + (offset + walk + white + on * 2.5 * rng.standard_normal((n, 3))) * DEG
    accel = turned.inv().apply(f) + 0.03 + (0.02 + 0.8 * on) * rng.standard_normal((n, 3))
    where = np.arange(n) >= 10
    return Scene(rate, gyro, accel, None, turned.as_quat(scalar_first=True), where)


def smoothstep(x):
    x = np.clip(x, 0.0, 1.0)
    return x * x * (3.0 - 2.0 * x)


def _ou(rng, n, dt, sigma, seconds):
    from scipy.signal import lfilter

    keep = np.exp(-dt / seconds)
    white = sigma * np.sqrt(1.0 - keep**2) * rng.standard_normal(n)
    return lfilter([1.0], [1.0, -keep], white)


def _drift(rng, s, dt):
    """The body's level acceleration along one axis: it is blown about, and comes back."""
    blown = _ou(rng, len(s), dt, 0.8, 0.5)
    w = v = p = 0.0
    found = np.empty(len(s))
    for k in range(len(s)):
        a = s[k] * (blown[k] - 0.5 * p - 1.0 * v)
        w += dt / 0.15 * (a - w)
        w = w if s[k] > 0.0 else 0.0
        v = (v + w * dt) if s[k] > 0.0 else 0.0
        p = (p + v * dt) if s[k] > 0.0 else 0.0
        found[k] = w
    return found


# Changes to a scene.


def knocked(scene, row, degrees=30.0):
    """From a sample on the sensor is turned by so much about (1, 1, 0), and no sensor saw it."""
    turn = Rotation.from_rotvec(degrees * DEG * np.array([1.0, 1.0, 0.0]) / np.sqrt(2.0))
    gyro, accel, truth = scene.gyro.copy(), scene.accel.copy(), scene.truth.copy()
    gyro[row:], accel[row:] = turn.inv().apply(gyro[row:]), turn.inv().apply(accel[row:])
    fine = np.flatnonzero(np.isfinite(truth).all(axis=1))
    fine = fine[fine >= row]
    after = Rotation.from_quat(truth[fine], scalar_first=True) * turn
    truth[fine] = after.as_quat(scalar_first=True)
    return replace(scene, gyro=gyro, accel=accel, mag=None, truth=truth)


def biased(scene, bias, row=0):
    """With a bias more, deg/s, from a sample on."""
    gyro = scene.gyro.copy()
    gyro[row:] += np.asarray(bias) * DEG
    return replace(scene, gyro=gyro)


def silenced(scene, row, seconds=3.0):
    """The gyro gives zeros for a while."""
    gyro = scene.gyro.copy()
    gyro[row : row + round(seconds * scene.rate)] = 0.0
    return replace(scene, gyro=gyro)


def clipped(scene, limit=250.0):
    """A gyro of a small range, deg/s."""
    return replace(scene, gyro=np.clip(scene.gyro, -limit * DEG, limit * DEG))


def held(scene, seconds=0.3, every=10.0, value=None):
    """The last sample of all sensors, again and again, for a while every ten seconds."""
    t = np.arange(len(scene.gyro)) / scene.rate
    gone = (t % every < seconds) & (t >= every)
    last = np.maximum.accumulate(np.where(gone, 0, np.arange(len(t))))
    take = lambda z: None if z is None else z[last]  # noqa: E731
    if value is not None:
        take = lambda z: None if z is None else np.where(gone[:, None], value, z)  # noqa: E731
    return replace(scene, gyro=take(scene.gyro), accel=take(scene.accel), mag=take(scene.mag))


def with_iron(scene, iron):
    """With a magnet that turns with the body, uT."""
    return replace(scene, mag=scene.mag + iron)


# Errors.


def parts(quaternions, truth):
    """Angle about up and angle of up, rad, of each sample."""
    apart = (
        Rotation.from_quat(quaternions, scalar_first=True)
        * Rotation.from_quat(truth, scalar_first=True).inv()
    )
    w, x, y, z = np.moveaxis(apart.as_quat(scalar_first=True), -1, 0)
    heading = 2.0 * np.arctan2(z, w)
    heading = np.mod(heading + np.pi, 2.0 * np.pi) - np.pi
    return heading, 2.0 * np.arctan2(np.hypot(x, y), np.hypot(w, z))


def judged(scene, quaternions, relative=None):
    """Errors of heading and inclination where samples count; against that of a sample, if given."""
    fine = scene.where & np.isfinite(scene.truth).all(axis=1)
    heading, inclination = np.full(len(fine), np.nan), np.full(len(fine), np.nan)
    known = np.isfinite(scene.truth).all(axis=1)
    heading[known], inclination[known] = parts(quaternions[known], scene.truth[known])
    if relative is not None:
        base = heading[np.flatnonzero(known & (np.arange(len(known)) >= relative))[0]]
        heading = np.mod(heading - base + np.pi, 2.0 * np.pi) - np.pi
    return heading[fine], inclination[fine], fine


def rms(x):
    return float(np.degrees(np.sqrt(np.nanmean(np.square(x)))))
