"""Rest of a gyro where an accelerometer knows of motion: MotionDetector, and `moving` of others."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import oracle
import zerorate as zr
from support.checks import assert_same_bits
from support.records import moving_records, turning_records

RATE = 100.0
RATES = st.sampled_from([1.0, 7.5, 20.0, 62.5])
BIAS = np.array([0.5, -0.3, 0.2])


def turned(degrees_a_second, tilt, *, before=0.0, seconds=120.0, after=0.0, force=0.03, seed=1):
    """A body that turns about an axis so many degrees off the vertical: gyro, accel, turning."""
    rng = np.random.default_rng(seed)
    t = np.arange(round((before + seconds + after) * RATE)) / RATE
    turning = (t >= before) & (t < before + seconds)
    axis = np.array([np.sin(np.radians(tilt)), 0.0, np.cos(np.radians(tilt))])
    angle = -np.radians(degrees_a_second) * np.cumsum(turning)[:, np.newaxis] / RATE
    gravity = np.array([0.0, 0.0, 9.81])
    # The formula of Rodrigues.
    accel = gravity * np.cos(angle) + np.cross(axis, gravity) * np.sin(angle)
    accel = accel + axis * (axis @ gravity) * (1.0 - np.cos(angle))
    gyro = BIAS + degrees_a_second * turning[:, np.newaxis] * axis
    noise = rng.standard_normal((2, len(t), 3))
    return gyro + 0.1 * noise[0], accel + force * noise[1], turning


def moving_of(accel, rate=RATE):
    return zr.noise.MotionDetector(rate).process(accel)


@given(RATES, turning_records())
def test_the_twin_agrees(rate, accel):
    twin = oracle.MotionDetector(rate)
    expected = np.array([twin.update(sample) for sample in accel], dtype=bool)
    np.testing.assert_array_equal(moving_of(accel, rate), expected)


@given(RATES, moving_records(), st.integers(0, 2**32))
def test_the_twin_of_a_gyro_that_is_told_agrees(rate, z, seed):
    rng = np.random.default_rng(seed)
    moving = np.repeat(rng.random(len(z) // 40 + 1) < 0.3, 40)[: len(z)]
    twin = oracle.RestDetector(rate)
    expected = [twin.update(*one) for one in zip(z.tolist(), moving.tolist(), strict=True)]
    got = zr.RestDetector(rate).process(z, moving=moving)
    np.testing.assert_array_equal(got, np.array(expected, dtype=bool))


@given(moving_records(), st.integers(0, 2**32), st.sampled_from(["auto", "kf", "robust"]))
def test_told_by_the_sample_or_by_the_batch(z, seed, method):
    moving = np.random.default_rng(seed).random(len(z)) < 0.5
    one_by_one, batch, traced = (
        zr.DriftFilter(20.0, method=method, motion="hold") for _ in range(3)
    )
    expected = [one_by_one.update(*one) for one in zip(z.tolist(), moving.tolist(), strict=True)]
    assert_same_bits(batch.process(z, moving=moving), np.array(expected))
    traced.trace(z, moving=moving)
    assert batch.to_bytes() == one_by_one.to_bytes() == traced.to_bytes()


@given(moving_records())
def test_told_of_no_motion_nothing_changes(z):
    none = np.zeros(len(z), dtype=bool)
    for kind in (zr.DriftFilter, zr.RestDetector):
        plain, told = kind(20.0), kind(20.0)
        assert_same_bits(plain.process(z), told.process(z, moving=none))
        assert plain.to_bytes() == told.to_bytes()


@pytest.mark.parametrize("limits", [{}, {"rest_limit": 10.0, "bias_limit": 20.0}])
@pytest.mark.parametrize(("speed", "tilt"), [(0.5, 90.0), (2.0, 30.0), (10.0, 30.0), (50.0, 10.0)])
def test_a_steady_turn_is_no_bias(speed, tilt, limits):
    gyro, accel, turning = turned(speed, tilt, before=30.0, after=30.0)
    trace = zr.DriftFilter(RATE, channels=3, **limits).trace(gyro, moving=moving_of(accel))
    # What 30 s of 0.1 deg/s a sample leave is 0.002; what a turn leaves before it is seen is more.
    error = np.abs(trace.bias[3000:] - BIAS).max()
    assert error < 0.02
    # The second axis does not turn, and may be known to rest.
    assert not trace.at_rest[turning][800:, ::2].any()
    # The last turn was seen within a second, and the gyro is back in 1.5 s.
    assert trace.at_rest[-2000:].all()


def test_without_it_the_turn_is_one():
    gyro, _, _ = turned(2.0, 30.0, before=30.0, after=0.0)
    plain = zr.DriftFilter(RATE, channels=3, rest_limit=10.0, bias_limit=20.0)
    plain.process(gyro)
    assert np.abs(plain.bias - BIAS).max() > 1.5


@pytest.mark.parametrize("speed", [2.0, 10.0])
def test_a_record_that_begins_in_a_turn(speed):
    gyro, accel, turning = turned(speed, 30.0, seconds=60.0, after=30.0)
    filters = zr.DriftFilter(RATE, channels=3, rest_limit=10.0)
    trace = filters.trace(gyro, moving=moving_of(accel))
    assert not trace.at_rest[turning].any()
    np.testing.assert_array_equal(trace.bias[turning], 0.0)
    np.testing.assert_allclose(filters.bias, BIAS, atol=0.02)


@pytest.mark.parametrize(
    ("force", "step", "rate"),
    [
        (0.02, 0.0, 100.0),
        (0.3, 0.0, 100.0),
        (0.1, 0.15, 100.0),
        (0.02, 0.15, 62.5),
        (0.1, 0.0, 8.0),
    ],
)
def test_rest_is_never_motion(force, step, rate):
    """Noise, coarse steps, a low rate: an hour, five hundred of which have one chance in thirty."""
    rng = np.random.default_rng(3)
    accel = np.array([1.0, -3.0, 9.2]) + force * rng.standard_normal((round(3600 * rate), 3))
    accel = np.round(accel / step) * step if step else accel
    assert not moving_of(accel, rate).any()


def test_neighbours_that_are_alike_are_no_motion():
    """A sensor's own filter of 5 Hz, at 100 Hz."""
    white = np.random.default_rng(4).standard_normal((360_000, 3))
    kernel = np.exp(-np.arange(40) * 2.0 * np.pi * 5.0 / RATE)
    alike = np.stack([np.convolve(x, kernel / kernel.sum(), "same") for x in white.T], axis=1)
    assert not moving_of(np.array([0.0, 0.0, 1.0]) + 0.01 * alike).any()


def test_a_turn_about_the_vertical_is_not_known():
    _, accel, _ = turned(20.0, 0.0)
    assert not moving_of(accel).any()


def test_outliers_are_no_motion():
    _, accel, _ = turned(0.0, 0.0, seconds=600.0)
    accel[::997] *= 5.0
    assert not moving_of(accel).any()


@given(turning_records(), st.integers(0, 2**32))
def test_axes_do_not_matter(accel, seed):
    """Rotated by right angles, which rounds nothing but the order of sums."""
    order = np.random.default_rng(seed).permutation(3)
    sign = np.random.default_rng(seed).choice([-1.0, 1.0], 3)
    np.testing.assert_array_equal(moving_of(accel[:, order] * sign, 20.0), moving_of(accel, 20.0))


def test_shaking_prolongs_a_motion_but_is_none():
    rng = np.random.default_rng(5)
    accel = np.array([0.0, 0.0, 9.81]) + 0.02 * rng.standard_normal((18_000, 3))
    # An engine that starts while the car stands.
    accel[3000:6000] += 0.2 * rng.standard_normal((3000, 3))
    assert not moving_of(accel).any()
    # The same while it drives straight on, after it has pulled away.
    accel[3000:3200, 0] += 2.0
    moving = moving_of(accel)
    assert moving[3100:6000].all()
    assert not moving[6200:].any()


def test_refused():
    with pytest.raises(ValueError, match="moving is for motion='hold'"):
        zr.DriftFilter(RATE, method="kf").process(np.zeros(8), moving=np.zeros(8, bool))
    with pytest.raises(ValueError, match=r"moving must have shape \(8,\), got \(7,\)"):
        zr.DriftFilter(RATE).process(np.zeros(8), moving=np.zeros(7, bool))
    with pytest.raises(TypeError, match="moving must be a bool array, got one of dtype float64"):
        zr.RestDetector(RATE).process(np.zeros(8), moving=np.zeros(8))
