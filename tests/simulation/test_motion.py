"""Simulated motions: orientation, rate, velocity and force against each other and closed forms."""

import math

import numpy as np
import pytest

import zerorate as zr
from zerorate.geometry import rotations
from zerorate.simulation.trajectories import TRAJECTORIES
from zerorate.tasks.compare import Trial

DEG = math.radians(1.0)
G = 9.80665
NONE = zr.simulation.MotionErrors.none()


def clean(kind, **more):
    return zr.simulate_motion(kind, errors=NONE, **{"duration": 30.0, "seed": 2, **more})


def in_earth(motion, vectors):
    return rotations.rotate(motion.quaternion, vectors)


@pytest.mark.parametrize("start", ["rest", "motion"])
@pytest.mark.parametrize("kind", TRAJECTORIES)
class TestConsistency:
    def test_rates_turn_each_orientation_into_the_next(self, kind, start):
        motion = clean(kind, start=start)
        steps = motion.rates / motion.rate
        steps[1:] += np.cross(steps[:-1], steps[1:]) / 12.0
        turns = rotations.from_rotation_vectors(steps[1:])
        followed = rotations.product(motion.quaternion[:-1], turns)
        missed = rotations.angle(
            rotations.product(rotations.inverse(followed), motion.quaternion[1:])
        )
        # The next term of the coning series is of the fifth power of a step of up to 0.05 rad.
        assert missed.max() < 3e-7

    @pytest.mark.every(3)
    def test_force_and_gravity_change_the_velocity(self, kind, start):
        motion = clean(kind, start=start, rate=400.0)
        pull = in_earth(motion, motion.force) - np.array([0.0, 0.0, G])
        # Simpson's rule over two samples.
        gained = (pull[:-2] + 4.0 * pull[1:-1] + pull[2:]) / (3.0 * motion.rate)
        change = motion.velocity[2:] - motion.velocity[:-2]
        # Its error is h^5/90 of the fourth derivative of some m/s^2 at up to 8 Hz. A hand's jerk
        # jumps by some 5 m/s^3 where a turn begins or ends: h^2/6 of that.
        np.testing.assert_allclose(gained, change, atol=1.5e-5 if kind == "hand" else 5e-8)


class TestMotions:
    def test_a_rest_is_still(self):
        for kind in TRAJECTORIES:
            motion = clean(kind, duration=9.0)
            rest = motion.time < 5.0 - 1e-9
            assert motion.at_rest[rest].all()
            assert not motion.at_rest[motion.time > 5.1].any()
            assert (motion.rates[rest] == 0.0).all()
            assert (motion.velocity[rest] == 0.0).all()
            up = in_earth(motion, motion.force)[rest]
            # Rounding of the rotation.
            np.testing.assert_allclose(up, np.tile([0.0, 0.0, G], (rest.sum(), 1)), atol=1e-13)
            assert np.abs(motion.rates[motion.time > 7.0]).max() > 0.01

    def test_what_starts_in_motion_has_no_rest(self):
        for kind in TRAJECTORIES:
            motion = clean(kind, duration=9.0, start="motion")
            assert not motion.at_rest.any()
            assert np.linalg.norm(motion.velocity[0]) + np.linalg.norm(motion.rates[0]) > 0.01

    def test_a_pendulum_pulls_along_its_rod(self):
        motion = clean("pendulum", start="motion", rate=1000.0)
        force = motion.force[:-1]
        # From means over intervals to the time between two.
        rates = 0.5 * (motion.rates[1:, 1] + motion.rates[:-1, 1])
        lean = in_earth(motion, np.tile([0.0, 0.0, 1.0], (len(motion.time), 1)))[:-1, 2]
        # It swings about its y axis, and nothing pulls along that.
        assert np.abs(motion.rates[:, (0, 2)]).max() < 1e-13
        assert np.abs(force[:, 1]).max() < 1e-6
        fast = np.abs(rates) > 0.5 * np.abs(rates).max()
        lengths = (force[:, 2] - G * lean)[fast] / rates[fast] ** 2
        # That mean misses (2 pi 0.8 Hz 1 ms)^2/6 of the rate.
        assert np.ptp(lengths) < 2e-5 * lengths.mean()
        assert 0.2 <= lengths.mean() <= 1.1

    def test_a_circle_pulls_inwards(self):
        motion = clean("circle", start="motion")
        pull = in_earth(motion, motion.force) - np.array([0.0, 0.0, G])
        speed, size = np.linalg.norm(motion.velocity, axis=1), np.linalg.norm(pull, axis=1)
        # Differences of the velocity, as the docstring says.
        assert np.ptp(size) < 1e-6
        assert np.abs(pull[:, 2]).max() < 1e-6
        assert np.abs(np.sum(pull * motion.velocity, axis=1)).max() < 1e-6
        assert 0.5 <= speed[0] ** 2 / size[0] <= 1.5

    def test_a_car_heads_where_it_goes(self):
        motion = clean("vehicle", duration=60.0)
        ahead = in_earth(motion, np.tile([1.0, 0.0, 0.0], (len(motion.time), 1)))
        moving = motion.time > 14.0
        (a, b), (v, w) = ahead[moving, :2].T, motion.velocity[moving, :2].T
        across, along = a * w - b * v, a * v + b * w
        # The body pitches and rolls by degrees, which does not turn its nose from the way.
        assert np.abs(across).max() < 1e-9
        assert 1.0 < along.min() < along.max() < 16.0


class TestErrors:
    def test_sensors_without_error_show_the_truth(self):
        motion = clean("hand")
        np.testing.assert_array_equal(motion.gyro, motion.rates)
        np.testing.assert_array_equal(motion.accel, motion.force)
        np.testing.assert_allclose(np.linalg.norm(motion.mag, axis=1), 48.0, rtol=1e-14)
        earth = in_earth(motion, motion.mag)
        # Rounding of rotations of 48 uT; to the north, and down by the dip.
        np.testing.assert_allclose(
            earth,
            np.tile([0.0, 48.0 * math.cos(65 * DEG), -48.0 * math.sin(65 * DEG)], (3000, 1)),
            atol=1e-12,
        )

    def test_errors_are_of_the_same_motion(self):
        real = zr.simulate_motion("arm", duration=30.0, seed=2)
        np.testing.assert_array_equal(real.rates, clean("arm").rates)
        assert np.abs(real.gyro - real.rates).max() > 0.3 * DEG

    def test_the_matrix_and_the_bias_undo_the_errors(self):
        errors = zr.simulation.MotionErrors(gyro_noise=0.0, accel_noise=0.0)
        motion = zr.simulate_motion("hand", duration=30.0, seed=5, errors=errors)
        undone = (motion.gyro - motion.bias) @ motion.gyro_matrix.T
        # Rounding of a few rad/s.
        np.testing.assert_allclose(undone, motion.rates, atol=1e-14)
        np.testing.assert_allclose(motion.accel - motion.accel_bias, motion.force, atol=1e-14)
        assert (np.diff(motion.bias, axis=0) != 0.0).all()

    def test_given_values_are_taken(self):
        M = np.eye(3) + 0.1 * np.arange(9.0).reshape(3, 3) / 9.0
        errors = zr.simulation.MotionErrors(
            gyro_bias=[0.1, 0.2, 0.3], gyro_walk=0.0, gyro_matrix=M, accel_bias=[1.0, 2.0, 3.0]
        )
        motion = zr.simulate_motion("circle", duration=5.0, errors=errors)
        np.testing.assert_array_equal(motion.gyro_matrix, M)
        np.testing.assert_array_equal(motion.bias, np.tile([0.1, 0.2, 0.3], (500, 1)))
        np.testing.assert_array_equal(motion.accel_bias, [1.0, 2.0, 3.0])

    @pytest.mark.slow
    def test_what_is_drawn_has_the_deviations_asked_for(self):
        drawn = [zr.simulate_motion("circle", duration=0.03, seed=seed) for seed in range(300)]
        S = np.array([motion.gyro_matrix for motion in drawn]) - np.eye(3)
        diagonal = S[:, range(3), range(3)]
        across = S[:, ~np.eye(3, dtype=bool)]
        # 900 and 1800 independent draws: 3 sigma of their deviation is 7 and 5 %.
        assert diagonal.std() == pytest.approx(0.008, rel=0.07)
        assert across.std() == pytest.approx(0.005, rel=0.05)
        assert np.std([one.bias[0] for one in drawn]) == pytest.approx(0.5 * DEG, rel=0.07)
        assert np.std([one.accel_bias for one in drawn]) == pytest.approx(0.05, rel=0.07)

    def test_noise_has_its_density_at_any_rate(self):
        for rate in (50.0, 400.0):
            motion = zr.simulate_motion("pendulum", rate, 100.0, seed=4)
            noise = motion.gyro - motion.bias - motion.rates @ np.linalg.inv(motion.gyro_matrix).T
            # Of 15000 draws or more: 3 sigma is 2 %; of 15000 steps likewise.
            assert noise.std() == pytest.approx(0.01 * DEG * math.sqrt(rate), rel=0.02)
            steps = np.diff(motion.bias, axis=0)
            assert steps.std() == pytest.approx(0.01 * DEG / math.sqrt(rate), rel=0.02)
            shaken = motion.accel - motion.force - motion.accel_bias
            assert shaken.std() == pytest.approx(0.004 * math.sqrt(rate), rel=0.02)

    @pytest.mark.parametrize("duration", [600.0, pytest.param(6000.0, marks=pytest.mark.slow)])
    def test_the_field_of_a_room_wanders(self, duration):
        """By its angle, and with the memory of 15 s; at rest it stays."""
        errors = zr.simulation.MotionErrors(mag_noise=0.0)
        motion = zr.simulate_motion("circle", 10.0, duration, seed=3, errors=errors)
        field = in_earth(motion, motion.mag)
        # One sample may belong to either side of the start.
        assert np.ptp(field[motion.time < 4.9], axis=0).max() < 1e-12
        size = 48.0 * math.cos(65 * DEG) * math.tan(4.5 * DEG)
        level = field[100:, 0]
        # Of 200 independent stretches of twice 15 s the deviation is known to 15 % (3 sigma).
        known = 0.15 * math.sqrt(6000.0 / duration)
        assert level.std() == pytest.approx(size, rel=known)
        later = np.mean(level[150:] * level[:-150]) / np.mean(level**2)
        # e^-1 within what so many stretches tell.
        assert later == pytest.approx(math.exp(-1.0), abs=known)

    @pytest.mark.every(3)
    @pytest.mark.parametrize("seed", range(12))
    def test_a_magnet_changes_norm_and_dip(self, seed):
        motion = zr.simulate_motion(
            "hand", duration=12.0, seed=seed, errors=NONE, magnet=[(4.0, 8.0)]
        )
        field = in_earth(motion, motion.mag)
        norm = np.linalg.norm(field, axis=1)
        dip = np.arctan2(-field[:, 2], np.hypot(field[:, 0], field[:, 1]))
        inside = (motion.time > 4.3) & (motion.time < 7.7)
        outside = (motion.time <= 4.0) | (motion.time >= 8.0)
        np.testing.assert_array_equal(motion.disturbed, ~outside)
        np.testing.assert_allclose(norm[outside], 48.0, rtol=1e-12)
        far = np.abs(norm / 48.0 - 1.0) > 0.1
        assert (far | (np.abs(dip - 65 * DEG) > 10 * DEG))[inside].all()

    def test_lost_samples_leave_their_stamps(self):
        errors = zr.simulation.MotionErrors(lost=0.05)
        whole = zr.simulate_motion("arm", duration=60.0, seed=6)
        motion = zr.simulate_motion("arm", duration=60.0, seed=6, errors=errors)
        kept = np.isin(whole.time, motion.time)
        # 6000 draws: 3 sigma is 0.8 %.
        assert 1.0 - kept.mean() == pytest.approx(0.05, abs=0.009)
        np.testing.assert_array_equal(motion.gyro, whole.gyro[kept])
        np.testing.assert_array_equal(motion.quaternion, whole.quaternion[kept])
        assert motion.dt[0] == 0.01
        assert motion.dt.sum() == pytest.approx(motion.time[-1] + 0.01)
        log = motion.recording().gyro
        assert log.missing_count == log.n - len(motion.time)
        np.testing.assert_array_equal(log.data[np.isfinite(log.data[:, 0])], motion.gyro)


class TestUse:
    def test_a_seed_is_a_motion(self):
        one, same, other = (zr.simulate_motion("hand", duration=2.0, seed=s) for s in (1, 1, 2))
        np.testing.assert_array_equal(one.mag, same.mag)
        assert not np.allclose(one.mag, other.mag)

    def test_a_recording_of_it_has_a_reference(self):
        motion = zr.simulate_motion("circle", duration=5.0)
        recording = motion.recording()
        assert Trial.of(recording).kind == "orientation"
        np.testing.assert_array_equal(recording.reference.data, motion.quaternion)
        assert [log.unit for log in recording.values()] == ["rad/s", "m/s^2", "uT", "1"]

    @pytest.mark.parametrize(
        ("change", "match"),
        [
            ({"kind": "swing"}, "kind must be one of pendulum, spinning pendulum, arm, .*'swing'"),
            ({"start": "now"}, "start must be 'rest' or 'motion', got 'now'"),
            ({"rate": 0.0}, "rate must be a positive finite number"),
            ({"duration": 0.01}, "two samples or longer, got 0.01 s"),
            ({"seed": -1}, "seed must be a whole number from 0"),
            ({"field": -1.0}, "field must be finite and not negative"),
            ({"dip": math.nan}, "dip must be"),
            ({"magnet": [(3.0, 2.0)]}, "each from less to more"),
            ({"magnet": [3.0, 2.0]}, r"magnet must be finite, of shape \(m, 2\), got \(2,\)"),
            ({"errors": zr.simulation.MotionErrors(lost=1.0)}, "lost must be from 0 to below 1"),
            (
                {"errors": zr.simulation.MotionErrors(gyro_bias=-1.0)},
                "gyro_bias must be finite and not neg",
            ),
            (
                {"errors": zr.simulation.MotionErrors(gyro_noise=math.inf)},
                "gyro_noise must be finite",
            ),
            (
                {"errors": zr.simulation.MotionErrors(gyro_matrix=np.zeros((3, 3)))},
                "must have an inverse",
            ),
        ],
    )
    def test_refusals(self, change, match):
        with pytest.raises(ValueError, match=match):
            zr.simulate_motion(**{"kind": "hand", "duration": 1.0, **change})
