"""Records for hypothesis: what a gyro gives, and what it should never give."""

from functools import cache

import numpy as np
from hypothesis import strategies as st

from zerorate.simulation.motion import simulate_motion
from zerorate.simulation.walk import simulate_walk


def white(rng, n):
    return rng.standard_normal(n)


def autoregressive(rng, n):
    """ARMA(2, 1)."""
    noise = rng.standard_normal(n + 2)
    y = np.zeros(n + 2)
    for k in range(2, n + 2):
        y[k] = 1.5 * y[k - 1] - 0.6 * y[k - 2] + noise[k] - 0.4 * noise[k - 1]
    return y[2:]


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


@st.composite
def ordinary_records(draw, max_size=600):
    """What a gyro gives: noise or drift on an offset, in any unit."""
    signal = draw(st.sampled_from(list(SIGNALS.values())))
    rng = np.random.default_rng(draw(st.integers(0, 2**32)))
    size = draw(st.integers(200, max_size))
    offset = draw(st.sampled_from([0.0, -0.35, 5.0]))
    return offset + signal(rng, size) * draw(st.sampled_from([0.1, 1.0, 300.0]))


@st.composite
def moving_records(draw, steps=(0.0, 0.5, 3.0)):
    """Rest, turning, steps, louder noise and gaps one after the other."""
    rng = np.random.default_rng(draw(st.integers(0, 2**32)))
    parts = []
    for kind in draw(
        st.lists(st.sampled_from(["rest", "turn", "level", "loud", "gap"]), max_size=6)
    ):
        n = draw(st.integers(1, 900))
        part = rng.standard_normal(n)
        if kind == "turn":
            part += 20.0 * np.sin(np.arange(n) / draw(st.floats(1.0, 100.0)))
        elif kind == "level":
            part += draw(st.sampled_from([0.3, 1.0, 30.0]))
        elif kind == "loud":
            part *= 4.0
        elif kind == "gap":
            part[rng.random(n) < 0.9] = np.nan
        parts.append(part)
    z = np.concatenate([rng.standard_normal(draw(st.integers(0, 1500))), *parts])
    step = draw(st.sampled_from(steps))
    return np.round(z / step) * step if step else z


FINITE = st.floats(allow_nan=False, allow_infinity=False)
ANY = st.one_of(FINITE, st.sampled_from([np.nan, np.inf, -np.inf]))
EDGES = st.sampled_from(
    [0.0, -0.0, 5e-324, 1e-310, 1e-150, 1e-4, 1.0, 1e7, 1e12, 1e150, 1e300, np.finfo(float).max]
)


@st.composite
def segments(draw):
    """A stretch of one kind of misbehaviour."""
    n = draw(st.integers(1, 120))
    size = draw(st.one_of(EDGES, FINITE))
    k = np.arange(n)
    with np.errstate(over="ignore", invalid="ignore", under="ignore"):
        return draw(st.sampled_from(SHAPES))(k, size)


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


@st.composite
def hostile_records(draw):
    """Stretches of misbehaviour, one after the other, and single wild samples among them."""
    stretches = draw(st.lists(segments(), min_size=1, max_size=6))
    loose = np.array(draw(st.lists(ANY, max_size=12)), dtype=float)
    stretches.insert(draw(st.integers(0, len(stretches))), loose)
    return np.concatenate(stretches)


def records():
    return st.one_of(ordinary_records(), hostile_records())


def wide_records(records, width):
    """Several such records as columns, as long as the shortest."""
    columns = st.lists(records, min_size=width, max_size=width)
    return columns.map(lambda z: np.stack([c[: min(map(len, z))] for c in z], axis=1))


@st.composite
def warm_records(draw):
    """A gyro that warms up, with its temperature, fine, coarse or now and then missing."""
    rng = np.random.default_rng(draw(st.integers(0, 2**32)))
    z = draw(moving_records())
    temperature = 25.0 + 10.0 * (1.0 - np.exp(-np.arange(z.size) / 500.0))
    temperature += 0.02 * rng.standard_normal(z.size)
    step = draw(st.sampled_from([0.0, 0.1, 1.0]))
    temperature = np.round(temperature / step) * step if step else temperature
    temperature[rng.random(z.size) < draw(st.sampled_from([0.0, 0.2, 1.0]))] = np.nan
    return np.stack([z + draw(st.sampled_from([0.0, 0.3])) * temperature, temperature], axis=1)


@cache
def hand_and_magnet():
    """Field, gyro and accelerometer of a hand, with a magnet near now and then: (n, 9)."""
    motion = simulate_motion("hand", 100.0, 90.0, seed=5, magnet=[(20.0, 24.0), (50.0, 70.0)])
    return np.hstack([motion.mag, motion.gyro, motion.accel])


@st.composite
def imu_records(draw, width):
    """Stretches of a moved IMU, with samples of its sensors missing now and then."""
    rng = np.random.default_rng(draw(st.integers(0, 2**32)))
    first, n = draw(st.integers(0, 6000)), draw(st.integers(1, 3000))
    z = hand_and_magnet()[first : first + n, 9 - width :].copy()
    for sensor in range(0, width, 3):
        share = draw(st.sampled_from([0.0, 0.0, 0.1, 0.9]))
        z[rng.random(len(z)) < share, sensor : sensor + 3] = np.nan
    return z


@st.composite
def foot_records(draw):
    """Stretches of a walk, its gyro clipped, with samples of its sensors missing now and then."""
    rng = np.random.default_rng(draw(st.integers(0, 2**32)))
    first, n = draw(st.integers(0, 1500)), draw(st.integers(1, 1500))
    z = a_walk()[first : first + n].copy()
    for sensor in (0, 3):
        share = draw(st.sampled_from([0.0, 0.0, 0.1, 0.9]))
        z[rng.random(len(z)) < share, sensor : sensor + 3] = np.nan
    return z


@cache
def a_walk():
    """Fifteen strides and the rests around them, at 100 Hz."""
    walk = simulate_walk(100.0, strides=15, seed=1, gyro_range=6.5)
    return np.column_stack([walk.gyro, walk.accel])


@st.composite
def driven_records(draw):
    """A vehicle that rolls and shakes, its fixes and rests, as support/feeding.py reads them."""
    rng = np.random.default_rng(draw(st.integers(0, 2**32)))
    n, share = draw(st.integers(1, 1500)), draw(st.sampled_from([0.0, 0.02, 0.3]))
    speed = draw(st.sampled_from([0.0, 3.0, 30.0]))
    z = rng.standard_normal((n, 14)) * np.repeat(
        [0.05, 0.3, 1.0, 2.0, 0.1, 1.0], [3, 3, 1, 3, 3, 1]
    )
    z[:, 3:6] -= [0.0, 0.0, 9.81]
    z[:, 6], z[:, 13] = rng.random(n) < share, rng.random(n) < share
    # Northwards.
    z[:, 7] += 0.02 * speed * np.arange(n)
    z[:, 10] += speed
    z[rng.random(n) < draw(st.sampled_from([0.0, 0.1])), rng.integers(6)] = np.nan
    z[rng.random(n) < draw(st.sampled_from([0.0, 0.1])), 7 + rng.integers(6)] = np.nan
    return z


@st.composite
def turning_records(draw):
    """Gravity in the axes of a body that rests, turns slowly or fast, and shakes, by turns."""
    rng = np.random.default_rng(draw(st.integers(0, 2**32)))
    parts = draw(st.lists(st.integers(1, 800), min_size=1, max_size=5))
    turns = [np.full(n, rng.choice([0.0, 0.0, 1e-4, 1e-2, 0.3])) for n in parts]
    loud = [np.full(n, rng.choice([0.01, 0.01, 1.0])) for n in parts]
    angle, noise = np.cumsum(np.concatenate(turns)), np.concatenate(loud)
    axes = np.linalg.qr(rng.standard_normal((3, 3)))[0]
    gravity = np.stack((np.sin(angle), np.cos(angle), np.zeros(len(angle))), axis=1) @ axes
    z = 9.81 * gravity + noise[:, np.newaxis] * rng.standard_normal((len(angle), 3))
    z[rng.random(len(z)) < draw(st.sampled_from([0.0, 0.1])), rng.integers(3)] = np.nan
    return z


def mixed_record():
    """One record of all that a filter treats differently: start-up, gaps, motion and the rest."""
    rng = np.random.default_rng(5)
    signals = [signal(rng, 140) for signal in SIGNALS.values()]
    motion = 30.0 * np.sin(np.arange(200) / 9.0) + white(rng, 200)
    return np.concatenate([*signals, motion, white(rng, 200)])
