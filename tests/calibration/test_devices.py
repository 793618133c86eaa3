"""Devices and motions that are not ordinary: what is said of them is true, or nothing is said."""

import numpy as np
import pytest

import zerorate as zr
from support.calibrated import deviations, session, sigmas, with_data

DEG = np.pi / 180.0
G = 9.80665


class TestRounding:
    """Noise below the step does not average rounding away."""

    @pytest.mark.parametrize("seed", [1, 2])
    def test_a_coarse_gyro_is_known_to_no_more_than_its_step(self, seed):
        # 0.05 deg/s RMS of noise, steps of 1 deg/s: a rest of any length reads one value.
        coarse = zr.simulation.GyroErrors(resolution=1.0 * DEG, bias=3.0 * DEG)
        one = zr.simulation.simulate_session(16, seed=seed, gyro=coarse)
        found = zr.calibration.calibrate(one.recording)
        assert np.abs(deviations(found, one.truth)).max() < 4.0
        bias = sigmas(found)[21:24]
        assert (bias > 0.2).all()
        assert (bias < 0.4).all()
        assert not found.identifiable[24:].any()

    def test_a_coarse_accelerometer_has_larger_errors(self):
        quiet = zr.NoiseModel(angle_random_walk=20e-6 * G, quantity="acceleration")
        one = zr.simulation.simulate_session(
            20, seed=4, accel=zr.simulation.AccelErrors(resolution=0.01 * G, noise=quiet)
        )
        found = zr.calibration.calibrate(one.recording)
        assert found.valid
        assert np.abs(deviations(found, one.truth)).max() < 4.0

    def test_noise_above_the_step_averages_it_away(self):
        # The MPU-6050 rounds to 1/131 deg/s and has seven times that in noise.
        exact = zr.simulation.simulate_session(
            20, seed=5, gyro=zr.simulation.GyroErrors(resolution=0.0)
        )
        rounded = zr.simulation.simulate_session(20, seed=5)
        first, second = (
            sigmas(zr.calibration.calibrate(one.recording)) for one in (exact, rounded)
        )
        np.testing.assert_allclose(first, second, rtol=0.1)


class TestClippedAccelerometer:
    def test_rests_at_the_end_of_its_range_are_left_out(self):
        one = zr.simulation.simulate_session(
            30, seed=2, accel=zr.simulation.AccelErrors(range=0.9 * G)
        )
        found = zr.calibration.calibrate(one.recording)
        reasons = [rest.reason for rest in found.rests if not rest.used]
        assert 0 < len(reasons) < 15
        assert all(text.startswith("clipped: ") for text in reasons)
        assert found.valid
        assert np.abs(deviations(found, one.truth)).max() < 4.0

    def test_one_value_of_a_coarse_sensor_is_not_the_end_of_its_range(self):
        quiet = zr.NoiseModel(angle_random_walk=20e-6 * G, quantity="acceleration")
        one = zr.simulation.simulate_session(
            12, seed=4, accel=zr.simulation.AccelErrors(resolution=0.01 * G, noise=quiet)
        )
        assert all(rest.used for rest in zr.calibration.calibrate(one.recording).rests)


def swayed(one, degrees):
    """Raw samples of a session of which every rest sways by an angle, and back, about one axis."""
    gyro, accel = one.recording.gyro.data.copy(), one.recording.accel.data.copy()
    rate, axis = one.recording.gyro.rate, np.array([0.6, 0.0, 0.8])
    W, A = one.truth.values[12:21].reshape(3, 3), one.truth.values[:9].reshape(3, 3)
    for first, last in one.rests:
        along = np.sin(np.pi * np.arange(last - first) / (last - first)) ** 2 * degrees * DEG
        gyro[first:last] += np.degrees((np.gradient(along) * rate)[:, np.newaxis] * axis) @ W.T
        # In the body, a small rotation about the axis moves gravity the other way.
        moved = -np.cross(axis, one.force[first:last]) / G * np.sin(along)[:, np.newaxis]
        accel[first:last] += moved @ A.T
    return with_data(one.recording, gyro, accel)


def test_what_most_rests_have_in_common_is_seen_in_each():
    """Residuals do not show it: it looks like another rotation between the sensors."""
    found = zr.calibration.calibrate(swayed(session(), 3.0))
    assert not found.valid
    assert any(text.startswith("the sensor moved in ") for text in found.problems)
    assert np.abs(deviations(found, session().truth)).max() > 4.0


def test_poses_along_six_directions_are_judged_as_a_whole():
    """A quarter of the poses is missed by the others, not by all."""
    about = np.eye(3)[[0, 1, 2, 0, 1, 0, 1, 0, 1, 2, 0, 1]]
    signs = np.array([1, 1, 1, 1, -1, 1, 1, -1, 1, 1, 1, 1])[:, np.newaxis]
    one = zr.simulation.simulate_session(seed=3, turns=0.5 * np.pi * signs * about, wobble=0.0)
    found = zr.calibration.calibrate(one.recording)
    assert found.valid, found.problems
    assert not found.held_out
    assert np.abs(deviations(found, one.truth)).max() < 4.0


def test_turns_that_do_not_turn_are_not_said_to_miss():
    rests = zr.simulation.simulate_session(
        12, seed=3, axis=(1, 0, 0), angles=(0.1 * DEG, 0.2 * DEG)
    )
    found = zr.calibration.calibrate(
        rests.recording, rests=[(8.0 * k, 8.0 * k + 6.0) for k in range(12)]
    )
    assert not found.valid
    assert not any("is off by" in text for text in found.problems)


@pytest.mark.parametrize("factors", [(131.0, 16384.0), (1e-3, 1e-3)])
def test_counts_of_any_size_are_the_same_sensor(factors):
    """What is not known of a unit cannot matter."""
    recording = zr.simulation.simulate_session(12, seed=2).recording
    gyro, accel = recording.gyro.data, recording.accel.data
    one = zr.calibration.calibrate(gyro=gyro, accel=accel, rate=100.0)
    other = zr.calibration.calibrate(gyro=factors[0] * gyro, accel=factors[1] * accel, rate=100.0)
    assert one.valid
    assert other.valid
    scale = np.repeat(factors, [21, 12])[::-1]
    np.testing.assert_allclose(other.values / scale, one.values, rtol=1e-4, atol=1e-6)
    np.testing.assert_allclose(sigmas(other) / scale, sigmas(one), rtol=1e-2)


def test_a_rest_that_is_given_has_two_times():
    for rests in ("ab", [(1.0, 2.0, 3.0)], [5.0]):
        with pytest.raises(TypeError, match=r"must be Rest or \(start, stop\) in seconds"):
            zr.calibration.calibrate(session().recording, rests=rests)
    for rests in ([(5.0, 1.0)], [(float("nan"), 1.0)]):
        with pytest.raises(ValueError, match="a rest must stop after its start"):
            zr.calibration.calibrate(session().recording, rests=rests)
