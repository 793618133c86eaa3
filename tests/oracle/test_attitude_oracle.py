"""The default attitude filter against its twin of plain matrices.

Both round each of some thousand operations a tick to 1e-16, and forget old errors: 1e-13 is seen.
"""

import numpy as np
import pytest

import oracle
import zerorate as zr
from support import faults, outside

TOLERANCE = 1e-10
DEG = np.pi / 180.0
# What each deviation is relative to; all else has the size of one.
BIASES = ("bias", "bias_sigma")


def assert_equal_to_twin(rate, gyro, accel, mag=None, dt=None):
    """All that is known after each sample; returns it."""
    with_field = mag is not None
    got = zr.Attitude(rate, mag=with_field).trace(gyro, accel, mag, dt=dt)
    expected = oracle.Attitude(rate, mag=with_field).run(gyro, accel, mag, dt)
    for name, values in expected.items():
        if values.dtype == bool:
            np.testing.assert_array_equal(got[name], values, err_msg=name)
            continue
        scale = np.abs(values) if name.endswith("sigma") else 1.0
        scale = expected["bias_sigma"] if name in BIASES else scale
        assert np.max(np.abs(got[name] - values) / scale) <= TOLERANCE, name
    return got


def moved(kind, rate, duration, **more):
    return zr.simulate_motion(kind, rate, duration, seed=3, **more)


def without(vectors, share, rng, several=1):
    """Some of the samples missing, one after the other."""
    gone = np.repeat(rng.random(len(vectors) // several + 1) < share, several)[: len(vectors)]
    return np.where(gone[:, None], np.nan, vectors)


@pytest.mark.slow
def test_a_hand_and_magnets():
    """Learned fields, rejected ones, and one that lasts until it is accepted or merely doubted."""
    motion = moved("hand", 250.0, 140.0, magnet=[(25.0, 30.0), (40.0, 125.0)])
    got = assert_equal_to_twin(250.0, motion.gyro, motion.accel, motion.mag)
    assert got["disturbed"].any()
    # It was trusted before, again between the two magnets, and after.
    assert np.sum(np.diff(got["disturbed"].astype(int)) == 1) >= 2


def test_six_axes_begun_in_motion():
    motion = moved("arm", 285.7, 40.0, start="motion")
    got = assert_equal_to_twin(285.7, motion.gyro, motion.accel)
    assert not got["at_rest"].any()


def test_lost_samples_without_times():
    """The gyro's noise is raised to many times its least: the second mend."""
    motion = moved("hand", 100.0, 60.0, errors=zr.simulation.MotionErrors(lost=0.05))
    got = assert_equal_to_twin(100.0, motion.gyro, motion.accel, motion.mag)
    whole = zr.Attitude(100.0).trace(motion.gyro, motion.accel, motion.mag, dt=motion.dt)
    assert np.median(got["tilt_sigma"]) > 1.5 * np.median(whole["tilt_sigma"])


def test_garbage_samples():
    """Alone, two in a row, at the end of a tick and after a gap."""
    motion = moved("hand", 100.0, 30.0)
    gyro, dt = motion.gyro.copy(), np.full(3000, 0.01)
    for row in (0, 700, 709, 1200, 1201, 1500, 2001):
        gyro[row, row % 3] = 40.0
    dt[2000] = 3.0
    assert_equal_to_twin(100.0, gyro, motion.accel, motion.mag, dt)


@pytest.mark.parametrize("mag", [True, False])
def test_a_bias_beyond_the_limit(mag):
    """Gravity or the field proves it, or nobody can tell: about the vertical, of six axes."""
    scene = faults.big_bias(15.0, (0.1, 0.1, 1.0), 10.0)
    assert_equal_to_twin(100.0, scene.gyro, scene.accel, scene.mag if mag else None)
    scene = faults.big_bias(15.0, (1.0, 0.5, 0.4), 10.0)
    assert_equal_to_twin(100.0, scene.gyro, scene.accel, scene.mag if mag else None)


def test_a_field_that_is_held():
    """Between updates of 1 Hz, and for ever."""
    scene = faults.held_field(faults.hand(100.0, 30.0), 100, 2000)
    assert_equal_to_twin(100.0, scene.gyro, scene.accel, scene.mag)


def test_times_of_their_own_and_gaps():
    """Jitter, steps of several periods, gaps, one of them so long that the start begins anew."""
    motion = moved("hand", 200.0, 60.0, errors=zr.simulation.MotionErrors(lost=0.02))
    dt = motion.dt * np.random.default_rng(1).uniform(0.8, 1.2, len(motion.dt))
    dt[[2000, 5003, 5004, 7001, 9000]] = [1.0, 3.0, 1.2, 0.4, 1e7]
    dt[100:103] = [0.0, np.nan, 0.07]
    got = assert_equal_to_twin(200.0, motion.gyro, motion.accel, motion.mag, dt)
    assert got["tilt_sigma"][9000] > 0.5


def test_missing_samples():
    """Of each sensor: single ones, some in a row, seconds, and none of any for a while."""
    rng = np.random.default_rng(2)
    motion = moved("spinning pendulum", 200.0, 60.0)
    gyro = without(without(motion.gyro, 0.02, rng), 0.01, rng, 30)
    accel = without(without(motion.accel, 0.2, rng), 0.02, rng, 90)
    mag = without(motion.mag, 0.9, rng)
    gyro[:3], accel[:5], mag[:150] = np.nan, np.nan, np.nan
    accel[4000:4500], gyro[4400:4800], mag[3000:5000] = 0.0, np.inf, np.nan
    # An axis is enough, and so is what no body feels.
    gyro[6000, 1], gyro[6010], accel[6020], mag[6030] = np.nan, 1001.0, -900.0, 1e300
    assert_equal_to_twin(200.0, gyro, accel, mag)


def resting(rate, seconds, level, rng):
    n = round(rate * seconds)
    gyro = np.asarray(level) * DEG + 0.05 * DEG * rng.standard_normal((n, 3))
    accel = [0.3, -0.2, 9.8] + 0.02 * rng.standard_normal((n, 3))
    return gyro, accel, [10.0, 18.0, -40.0] + 0.3 * rng.standard_normal((n, 3))


@pytest.mark.slow
@pytest.mark.parametrize("mag", [True, False])
def test_rest_at_a_far_level(mag):
    """What was learned in motion is forgotten after ten seconds at a rate that is no bias."""
    rng, motion = np.random.default_rng(3), moved("hand", 100.0, 30.0)
    parts = [resting(100.0, 5.0, [0.1, 0.3, 0.0], rng), (motion.gyro, motion.accel, motion.mag)]
    parts += [
        resting(100.0, 14.0, [5.0, -4.0, 3.0], rng),
        resting(100.0, 3.0, [0.1, 0.0, 0.0], rng),
    ]
    gyro, accel, field = (np.concatenate(part) for part in zip(*parts, strict=True))
    got = assert_equal_to_twin(100.0, gyro, accel, field if mag else None)
    far = got["bias"][4850] / DEG
    np.testing.assert_allclose(far, [5.0, -4.0, 3.0], atol=0.1)
    # All but what the rest itself says of it.
    np.testing.assert_allclose(got["gyro_matrix"][4700], np.eye(3), atol=1e-4)
    assert np.max(np.abs(got["gyro_matrix"][3500] - np.eye(3))) > 1e-3


def test_a_drift_and_a_rest_after_it():
    """One that a field shows to a car that swerves."""
    scene = outside.swerve(1.0, 0, rest=(100.0, 115.0), seconds=120.0)
    got = assert_equal_to_twin(100.0, scene.gyro, scene.accel, scene.mag)
    assert got["at_rest"][10000:11500].any()


@pytest.mark.slow
def test_a_drift_that_is_told_from_iron():
    scene = outside.with_iron(outside.drive(4, jump=1.0, seconds=160.0), [0.0, 9.0, 0.0])
    assert_equal_to_twin(100.0, scene.gyro, scene.accel, scene.mag)


@pytest.mark.every(3)
@pytest.mark.parametrize("rate", [1.0, 5.0, 20.0, 8000.0])
def test_other_rates(rate):
    """A tick has one sample, or eight hundred."""
    motion = moved("pendulum", rate, 20.0 if rate < 8000.0 else 2.5)
    assert_equal_to_twin(rate, motion.gyro, motion.accel, motion.mag)


def test_upside_down():
    """Exactly: the first tilt is half a turn, about any level axis."""
    gyro, accel = np.zeros((300, 3)), np.tile([0.0, 0.0, -9.81], (300, 1))
    got = assert_equal_to_twin(100.0, gyro, accel)
    np.testing.assert_array_equal(np.abs(got["quaternion"][-1]), [0.0, 1.0, 0.0, 0.0])
