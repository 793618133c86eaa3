"""Records for hypothesis: what a gyro gives, and what it should never give."""

from functools import cache

import numpy as np
from hypothesis import strategies as st
from scipy.signal import lfilter

from zerorate.simulation.motion import simulate_motion
from zerorate.simulation.walk import simulate_walk


def white(rng, n):
    return rng.standard_normal(n)


def autoregressive(rng, n):
    """ARMA(2, 1)."""
    noise = rng.standard_normal(n + 2)
    return lfilter([1.0], [1.0, -1.5, 0.6], noise[2:] - 0.4 * noise[1:-1])


def walk(rng, n):
    return rng.standard_normal(n) + np.cumsum(0.05 * rng.standard_normal(n))


def quantised(rng, n):
    """Most samples repeat the one before."""
    return np.round(0.5 * rng.standard_normal(n))


def with_missing(rng, n):
    """At the start, at random and in one long gap."""
    z = autoregressive(rng, n)
    z[rng.random(n) < 0.1] = np.nan
    z[:7] = np.inf
    z[n // 2 : n // 2 + n // 10] = np.nan
    return z


SIGNALS = {f.__name__: f for f in (white, autoregressive, walk, quantised, with_missing)}


def seeded(make):
    """A strategy of what ``make`` returns with a generator, whose seed alone is drawn.

    Drawing number by number takes longer than the filters do with a record.
    """

    @cache
    def strategy(*arguments):
        return SEEDS.map(lambda seed: make(np.random.default_rng(seed), *arguments))

    return strategy


SEEDS = st.integers(0, 2**32)


def one_of(rng, choices):
    """An element of any type."""
    return choices[rng.integers(len(choices))]


@seeded
def ordinary_records(rng, max_size=600):
    """What a gyro gives: noise or drift on an offset, in any unit."""
    signal, size = one_of(rng, [*SIGNALS.values()]), rng.integers(200, max_size + 1)
    offset = one_of(rng, [0.0, -0.35, 5.0])
    return offset + signal(rng, size) * one_of(rng, [0.1, 1.0, 300.0])


@seeded
def moving_records(rng, steps=(0.0, 0.5, 3.0)):
    return moving(rng, steps)


def moving(rng, steps=(0.0, 0.5, 3.0)):
    """Rest, turning, steps, louder noise and gaps one after the other; nothing now and then."""
    rest = rng.integers(1501) * one_of(rng, [0, 1, 1])
    parts = [stretch_of_motion(rng) for _ in range(rng.integers(7))]
    z = np.concatenate([rng.standard_normal(rest), *parts])
    step = one_of(rng, steps)
    return np.round(z / step) * step if step else z


def stretch_of_motion(rng):
    n, kind = rng.integers(1, 901), one_of(rng, ["rest", "turn", "level", "loud", "gap"])
    part = rng.standard_normal(n)
    if kind == "turn":
        part += 20.0 * np.sin(np.arange(n) / rng.uniform(1.0, 100.0))
    elif kind == "level":
        part += one_of(rng, [0.3, 1.0, 30.0])
    elif kind == "loud":
        part *= 4.0
    elif kind == "gap":
        part[rng.random(n) < 0.9] = np.nan
    return part


EDGES = [
    0.0, -0.0, 5e-324, 1e-310, 1e-150, 1e-4, 1.0, 1e7, 1e12, 1e150, 1e300, np.finfo(float).max,
]  # fmt: skip
MISSING = [np.nan, np.inf, -np.inf]


def finite(rng):
    """Any finite number: each exponent as often as another."""
    while not np.isfinite(number := np.frombuffer(rng.bytes(8))[0]):
        pass
    return float(number)


def wild(rng):
    """Any number, finite, small and whole, or none."""
    kind = rng.integers(4)
    if kind == 0:
        return one_of(rng, MISSING)
    return float(rng.integers(-9, 10)) if kind == 1 else finite(rng)


def stretch_of_misbehaviour(rng):
    """Of one kind."""
    k = np.arange(rng.integers(1, 121))
    size = one_of(rng, EDGES) if rng.random() < 0.5 else finite(rng)
    with np.errstate(over="ignore", invalid="ignore", under="ignore"):
        return one_of(rng, SHAPES)(k, size)


def constant(k, size):
    return np.full(len(k), size)


def alternating(k, size):
    return size * (-1.0) ** k


def ramp(k, size):
    return size * (k / len(k))


def growth(k, size):
    return size * 10.0**k


def decay(k, size):
    return size / 10.0**k


def noise(k, size):
    return size * np.random.default_rng(len(k)).uniform(-1.0, 1.0, len(k))


def tiny_noise(k, size):
    return size + 1e-4 * np.random.default_rng(len(k)).standard_normal(len(k))


def outlier(k, size):
    return np.where(k == len(k) // 2, size, noise(k, 1.0))


def gap(k, size):
    return np.full(len(k), np.nan)


SHAPES = [constant, alternating, ramp, growth, decay, noise, tiny_noise, outlier, gap]


@seeded
def hostile_records(rng):
    """Stretches of misbehaviour, one after the other, and single wild samples among them."""
    stretches = [stretch_of_misbehaviour(rng) for _ in range(rng.integers(1, 7))]
    loose = np.array([wild(rng) for _ in range(rng.integers(13))])
    stretches.insert(rng.integers(len(stretches) + 1), loose)
    return np.concatenate(stretches)


@cache
def records():
    return st.one_of(ordinary_records(), hostile_records())


@cache
def wide_records(records, width):
    """Several such records as columns, as long as the shortest."""
    columns = st.lists(records, min_size=width, max_size=width)
    return columns.map(lambda z: np.stack([c[: min(map(len, z))] for c in z], axis=1))


@seeded
def warm_records(rng):
    """A gyro that warms up, with its temperature, fine, coarse or now and then missing."""
    z = moving(rng)
    temperature = 25.0 + 10.0 * (1.0 - np.exp(-np.arange(z.size) / 500.0))
    temperature += 0.02 * rng.standard_normal(z.size)
    step = one_of(rng, [0.0, 0.1, 1.0])
    temperature = np.round(temperature / step) * step if step else temperature
    temperature[rng.random(z.size) < one_of(rng, [0.0, 0.2, 1.0])] = np.nan
    return np.stack([z + one_of(rng, [0.0, 0.3]) * temperature, temperature], axis=1)


@cache
def hand_and_magnet():
    """Field, gyro and accelerometer of a hand, with a magnet near now and then: (n, 9)."""
    motion = simulate_motion("hand", 100.0, 90.0, seed=5, magnet=[(20.0, 24.0), (50.0, 70.0)])
    return np.hstack([motion.mag, motion.gyro, motion.accel])


@seeded
def imu_records(rng, width):
    """Stretches of a moved IMU, with samples of its sensors missing now and then."""
    first, n = rng.integers(6001), rng.integers(1, 3001)
    z = hand_and_magnet()[first : first + n, 9 - width :].copy()
    for sensor in range(0, width, 3):
        share = one_of(rng, [0.0, 0.0, 0.1, 0.9])
        z[rng.random(len(z)) < share, sensor : sensor + 3] = np.nan
    return z


@seeded
def foot_records(rng):
    """Stretches of a walk, its gyro clipped, with samples of its sensors missing now and then."""
    first, n = rng.integers(1501), rng.integers(1, 1501)
    z = a_walk()[first : first + n].copy()
    for sensor in (0, 3):
        share = one_of(rng, [0.0, 0.0, 0.1, 0.9])
        z[rng.random(len(z)) < share, sensor : sensor + 3] = np.nan
    return z


@cache
def a_walk():
    """Fifteen strides and the rests around them, at 100 Hz."""
    walk = simulate_walk(100.0, strides=15, seed=1, gyro_range=6.5)
    return np.column_stack([walk.gyro, walk.accel])


def driven(rng):
    """A vehicle that rolls and shakes, its fixes and rests, as support/feeding.py reads them."""
    n, share = rng.integers(1, 1501), one_of(rng, [0.0, 0.02, 0.3])
    speed = one_of(rng, [0.0, 3.0, 30.0])
    z = rng.standard_normal((n, 14)) * np.repeat(
        [0.05, 0.3, 1.0, 2.0, 0.1, 1.0], [3, 3, 1, 3, 3, 1]
    )
    z[:, 3:6] -= [0.0, 0.0, 9.81]
    z[:, 6], z[:, 13] = rng.random(n) < share, rng.random(n) < share
    # Northwards.
    z[:, 7] += 0.02 * speed * np.arange(n)
    z[:, 10] += speed
    z[rng.random(n) < one_of(rng, [0.0, 0.1]), rng.integers(6)] = np.nan
    z[rng.random(n) < one_of(rng, [0.0, 0.1]), 7 + rng.integers(6)] = np.nan
    return z


driven_records = seeded(driven)


@seeded
def aided_records(rng):
    """The same with readings of a barometer and a compass, some of them wrong."""
    z = driven(rng)
    n, share = len(z), one_of(rng, [0.02, 0.5, 1.0])
    aids = rng.standard_normal((n, 4)) * [1.0, 0.3, 0.03, 1.0]
    aids[:, 0] = rng.random(n) < share
    for k in (1, 2):
        first = rng.integers(n)
        aids[first : first + rng.integers(1, 500), k] = one_of(rng, [0.0, 3.0, np.nan, 1e150])
    return np.hstack([z, aids])


@seeded
def turning_records(rng):
    """Gravity in the axes of a body that rests, turns slowly or fast, and shakes, by turns."""
    parts = rng.integers(1, 801, rng.integers(1, 6))
    turns = [np.full(n, rng.choice([0.0, 0.0, 1e-4, 1e-2, 0.3])) for n in parts]
    loud = [np.full(n, rng.choice([0.01, 0.01, 1.0])) for n in parts]
    angle, noise = np.cumsum(np.concatenate(turns)), np.concatenate(loud)
    axes = np.linalg.qr(rng.standard_normal((3, 3)))[0]
    gravity = np.stack((np.sin(angle), np.cos(angle), np.zeros(len(angle))), axis=1) @ axes
    z = 9.81 * gravity + noise[:, np.newaxis] * rng.standard_normal((len(angle), 3))
    z[rng.random(len(z)) < one_of(rng, [0.0, 0.1]), rng.integers(3)] = np.nan
    return z


def mixed_record():
    """One record of all that a filter treats differently: start-up, gaps, motion and the rest."""
    rng = np.random.default_rng(5)
    signals = [signal(rng, 140) for signal in SIGNALS.values()]
    motion = 30.0 * np.sin(np.arange(200) / 9.0) + white(rng, 200)
    return np.concatenate([*signals, motion, white(rng, 200)])
