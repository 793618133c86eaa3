"""A hard iron learned while the attitude is estimated, against its twin, sample by sample.

The twin contains the whole filter, so orientation and heading have what learning does to them.
"""

import math

import numpy as np
import pytest

import oracle
import zerorate as zr

RATE = 100.0
IRON = np.array([9.0, -14.0, 6.0])
# A filter's covariance falls from 1 to the variance of a tick, 0.005 squared at least: rounding of
# 1e-16 is 1e-11 of it. Over the ticks of a span 1.2e-10 is seen.
TOLERANCE = 1e-9
NAMES = (
    "quaternion",
    "bias",
    "bias_sigma",
    "tilt_sigma",
    "heading_sigma",
    "at_rest",
    "disturbed",
    "hard_iron",
    "hard_iron_sigma",
    "magnetometer_state",
)


def moved(duration=60.0, seed=100):
    """A hand in a room whose field wanders."""
    errors = zr.simulation.MotionErrors(field_wander=math.radians(4.5))
    return zr.simulate_motion("hand", RATE, duration, seed=seed, errors=errors)


def by_core(gyro, accel, mag, dt=None):
    """What is known after each sample."""
    f, told = zr.Attitude(RATE, learn_magnetometer=True), []
    dt = np.full(len(gyro), 1.0 / RATE) if dt is None else dt
    for sample in zip(gyro, accel, mag, dt, strict=True):
        f.update(*sample[:3], dt=sample[3])
        told.append([getattr(f, name) for name in NAMES])
    return dict(zip(NAMES, map(np.array, zip(*told, strict=True)), strict=True))


def assert_near(got, expected, name):
    """Relative to the length of a vector; NaN where the other is, and zero too."""
    np.testing.assert_array_equal(np.isnan(got), np.isnan(expected), err_msg=name)
    n = len(got)
    apart = np.linalg.norm(np.nan_to_num(got - expected).reshape(n, -1), axis=1)
    size = np.linalg.norm(np.nan_to_num(expected).reshape(n, -1), axis=1)
    assert np.all(apart <= TOLERANCE * size), (name, np.max(apart / np.maximum(size, 1e-9)))


def assert_equal_to_twin(gyro, accel, mag, dt=None):
    """Returns the twin, and the states in the order in which they came."""
    got, twin = by_core(gyro, accel, mag, dt), oracle.LearningAttitude(RATE)
    expected = twin.run(gyro, accel, mag, dt)
    for name, values in got.items():
        if values.dtype.kind in "bU":
            np.testing.assert_array_equal(values, expected[name], err_msg=name)
        else:
            assert_near(values, expected[name], name)
    states = got["magnetometer_state"]
    return twin, states[np.append(True, states[1:] != states[:-1])].tolist()


def test_iron_from_the_start_on():
    motion = moved(40.0)
    _, states = assert_equal_to_twin(motion.gyro, motion.accel, motion.mag + IRON)
    assert states[:2] == ["raw", "known"]


@pytest.mark.slow
def test_undisturbed():
    motion = moved(30.0)
    _, states = assert_equal_to_twin(motion.gyro, motion.accel, motion.mag)
    assert states == ["raw"]


def test_magnets_that_come_and_go():
    """One, then none, then more than are remembered: each is withheld until it is known."""
    motion, rng = moved(104.0, seed=102), np.random.default_rng(1)
    mag = motion.mag.copy()
    mag[1000:2500] += [30.0, -10.0, 40.0]
    for first in range(3500, 10400, 1150):
        mag[first : first + 1150] += rng.uniform(-50.0, 50.0, 3)
    twin, states = assert_equal_to_twin(motion.gyro, motion.accel, mag)
    assert states[:3] == ["raw", "known", "kept"]
    assert states.count("withheld") >= 3
    assert len(twin.choice.remembered) == 5


def test_missing_samples_and_a_slower_magnetometer():
    """Also a gap, and noise that no iron explains, first while none is known."""
    motion, rng = moved(seed=101), np.random.default_rng(4)
    gyro, accel, mag = motion.gyro.copy(), motion.accel.copy(), motion.mag + IRON
    mag[np.arange(len(mag)) % 3 > 0] = np.nan
    mag[rng.random(len(mag)) < 0.2] = np.nan
    mag[2500:2800] = np.nan
    gyro[rng.random(len(gyro)) < 0.01] = np.nan
    accel[rng.random(len(accel)) < 0.1] = np.nan
    for first, last in ((500, 900), (4400, 5200)):
        mag[first:last] += rng.normal(0.0, 40.0, (last - first, 3))
    dt = motion.dt * rng.uniform(0.9, 1.1, len(motion.dt))
    dt[3500] = 2.0
    _, states = assert_equal_to_twin(gyro, accel, mag, dt)
    assert states[:2] == ["raw", "known"]
    assert "withheld" in states


def test_a_stuck_magnetometer():
    """From some time on: what is held says nothing of iron."""
    motion = moved(30.0, seed=103)
    mag = motion.mag.copy()
    mag[1200:] = mag[1200]
    _, states = assert_equal_to_twin(motion.gyro, motion.accel, mag)
    assert states == ["raw"]


@pytest.mark.every(2)
@pytest.mark.parametrize("seed", [201, 204])
def test_weak_irons(seed):
    """Up to a quarter of the field, another one every twelve seconds: some may be the room's."""
    motion, rng = moved(seed=seed), np.random.default_rng(seed)
    mag = motion.mag.copy()
    for first in range(0, len(mag), 1200):
        direction = rng.normal(size=3)
        size = rng.uniform(3.0, 14.0)
        mag[first : first + 1200] += direction * (size / np.linalg.norm(direction))
    _, states = assert_equal_to_twin(motion.gyro, motion.accel, mag)
    assert states[:3] == ["raw", "known", "kept"]


@pytest.mark.slow
def test_noise_that_stays():
    """No iron explains it: for a minute no field is used, then the last iron again."""
    motion, rng = moved(82.0, seed=104), np.random.default_rng(5)
    mag = motion.mag + IRON
    mag[1500:] += rng.normal(0.0, 60.0, (len(mag) - 1500, 3))
    _, states = assert_equal_to_twin(motion.gyro, motion.accel, mag)
    assert states == ["raw", "known", "withheld", "kept"]


@pytest.mark.slow
def test_one_span_all_along():
    """Until as many observations count as ever do."""
    motion = zr.simulate_motion("spinning pendulum", RATE, 50.0, seed=100)
    twin, states = assert_equal_to_twin(motion.gyro, motion.accel, motion.mag + IRON)
    assert states == ["raw", "known"]
    assert max(start.age for start in twin.learner.running) > 44.0
