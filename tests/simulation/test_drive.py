"""A simulated drive: truth against strapdown navigation, wheels, noise, biases and fixes."""

import functools

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import zerorate as zr
from oracle.strapdown import strapdown
from zerorate.geometry.earth import earth_rate, local_ned, normal_gravity, radii

SILENT = {"gyro": None, "accel": None, "gyro_bias": 0.0, "accel_bias": 0.0}
EXACT = {"position_sigma": 0.0, "velocity_sigma": 0.0}


@functools.cache
def silent(duration=400.0, seed=0, **more):
    return zr.simulate_drive(duration=duration, seed=seed, **SILENT, **EXACT, **more)


def matrices(drive):
    return Rotation.from_quat(drive.truth_quaternion, scalar_first=True).as_matrix()


def in_body(drive):
    return np.einsum("nji,nj->ni", matrices(drive), drive.truth_velocity)


def navigated(drive):
    """Position by the oracle less the truth, m, and its velocities and matrices."""
    start = drive.truth_position[0]
    r, v, C = strapdown(
        drive.gyro,
        drive.accel,
        drive.rate,
        [*np.radians(start[:2]), start[2]],
        drive.truth_velocity[0],
        matrices(drive)[0],
    )
    found = np.column_stack([np.degrees(r[:, :2]), r[:, 2]])
    return local_ned(found, drive.truth_position), v, C


class TestTruth:
    @pytest.mark.every(4)
    @pytest.mark.parametrize(
        "drive",
        [
            {"seed": 3, "rate": 250.0, "duration": 60.0, "rest": 5.0},
            {"seed": 1},
            {"seed": 2, "latitude": -70.0, "longitude": 179.999, "duration": 120.0},
            {"kind": "rest", "duration": 200.0},
        ],
        ids=lambda drive: str(drive),
    )
    def test_strapdown_returns_the_truth(self, drive):
        drive = silent(**drive)
        missed, velocity, C = navigated(drive)
        # A latitude is rounded at 7e-10 m in each of 40,000 steps.
        assert np.abs(missed).max() < 1e-6
        np.testing.assert_allclose(velocity, drive.truth_velocity, atol=1e-9)
        np.testing.assert_allclose(C, matrices(drive), atol=1e-12)

    def test_velocities_add_up_to_the_way(self):
        drive = silent()
        driven = local_ned(drive.truth_position, drive.truth_position[0])
        by_hand = np.cumsum(0.5 * (drive.truth_velocity[1:] + drive.truth_velocity[:-1]), axis=0)
        # Over 2.6 km, with the radii at one end.
        np.testing.assert_allclose(driven[1:], by_hand / drive.rate, atol=1.5)

    def test_wheels_do_not_slip(self):
        for seed in range(5):
            drive = silent(200.0, seed)
            ahead, aside, down = in_body(drive).T
            assert np.abs(aside).max() < 1e-3
            assert np.abs(down).max() < 1e-3
            assert ahead.min() > -1e-3
            assert 8.0 < ahead.max() < 18.1

    def test_rests(self):
        drive = silent()
        first = drive.time < 30.0 - 1e-9
        # Gravity of 9.8 m/s^2 against a force that is rounded.
        assert np.abs(drive.truth_velocity[first]).max() < 1e-9
        lat, h = np.radians(drive.truth_position[0, 0]), drive.truth_position[0, 2]
        C = matrices(drive)[0]
        np.testing.assert_allclose(C @ drive.gyro[0], earth_rate(lat), atol=1e-15)
        np.testing.assert_allclose(C @ drive.accel[0], [0, 0, -normal_gravity(lat, h)], atol=1e-13)
        speed = np.linalg.norm(drive.truth_velocity, axis=1)
        stops = np.count_nonzero(np.diff(speed < 1e-2) == 1)
        assert stops >= 6
        assert 0.1 < np.mean(speed < 1e-2) < 0.5

    def test_a_rest_that_lasts(self):
        drive = silent(60.0, kind="rest")
        assert np.abs(drive.truth_velocity).max() < 1e-10
        assert np.abs(local_ned(drive.truth_position, drive.truth_position[0])).max() < 1e-7

    def test_what_a_car_can_do(self):
        for seed in range(5):
            drive = silent(200.0, seed)
            assert np.abs(drive.gyro[:, 2]).max() < 0.9
            assert np.abs(drive.gyro[:, :2]).max() < 0.1
            # 3 m/s^2, and gravity by a slope or camber of some degrees.
            assert np.abs(drive.accel[:, :2]).max() < 4.0
            # Samples are smooth: no step of a tenth of what they reach.
            for values in (drive.gyro, drive.accel):
                assert np.abs(np.diff(values, axis=0)).max() < 0.05 * np.ptp(values, axis=0).max()

    def test_across_the_date_line(self):
        drive = silent(120.0, 2, longitude=179.9999, latitude=0.0)
        assert np.abs(drive.truth_position[:, 1]).max() <= 180.0
        steps = np.abs(np.diff(drive.truth_position[:, 1]))
        assert ((steps < 1e-5) | (steps > 359.9)).all()
        local = local_ned(drive.truth_position, drive.truth_position[0])
        assert np.abs(np.diff(local, axis=0)).max() < 0.2


class TestSeeds:
    def test_the_same_arguments_give_the_same_drive(self):
        first, again = (zr.simulate_drive(duration=20.0, seed=4, rest=2.0) for _ in range(2))
        for name in ("gyro", "accel", "truth_position", "truth_quaternion", "gyro_bias"):
            np.testing.assert_array_equal(getattr(first, name), getattr(again, name))
        np.testing.assert_equal(first.fixes.as_dict(), again.fixes.as_dict())
        other = zr.simulate_drive(duration=20.0, seed=5, rest=2.0)
        assert (other.gyro != first.gyro).any(axis=1).all()

    def test_errors_do_not_move_the_way(self):
        noisy = zr.simulate_drive(
            duration=20.0, seed=4, rest=2.0, fixes_rate=5.0, antenna=[1, 0, -1]
        )
        clean = silent(20.0, 4, rest=2.0)
        np.testing.assert_array_equal(noisy.truth_position, clean.truth_position)
        other = zr.simulate_drive(duration=20.0, seed=4, rest=2.0, gyro=None)
        np.testing.assert_array_equal(noisy.accel, other.accel)

    def test_a_shorter_drive_is_the_beginning_of_a_longer_one(self):
        long, short = silent(60.0, 3, rest=2.0), silent(20.0, 3, rest=2.0)
        # The approximation ends with the last round that moves it.
        missed = local_ned(long.truth_position[:2000], short.truth_position)
        assert np.abs(missed).max() < 1e-7


class TestErrors:
    def test_white_noise_has_its_density(self):
        model = zr.NoiseModel(angle_random_walk=3e-4)
        force = zr.NoiseModel(angle_random_walk=2e-3, quantity="acceleration")
        noisy = zr.simulate_drive(duration=100.0, seed=6, gyro=model, accel=force)
        clean = silent(100.0, 6)
        for name, density in (("gyro", 3e-4), ("accel", 2e-3)):
            bias = getattr(noisy, f"{name}_bias")
            assert (np.ptp(bias, axis=0) == 0.0).all()
            white = getattr(noisy, name) - bias - getattr(clean, name)
            # 10,000 samples an axis: the deviation is known to 0.7 %.
            np.testing.assert_allclose(white.std(axis=0), density * 10.0, rtol=0.03)
            assert np.abs(white.mean(axis=0)).max() < 4 * density * 10.0 / 100.0
            assert abs(np.corrcoef(white.T)[0, 1]) < 0.04

    @pytest.mark.slow
    def test_biases_walk(self):
        walk = zr.NoiseModel(rate_random_walk=1e-4)
        drives = [
            zr.simulate_drive(20.0, 10.0, seed=seed, rest=1.0, gyro=walk, accel=None)
            for seed in range(60)
        ]
        moves = np.array([drive.gyro_bias[-1] - drive.gyro_bias[0] for drive in drives])
        # K sqrt(t) after 199 steps; 180 values: to 5 %.
        assert moves.std() == pytest.approx(1e-4 * np.sqrt(9.95), rel=0.2)
        constants = np.array([drive.accel_bias[0] for drive in drives])
        assert constants.std() == pytest.approx(0.02, rel=0.2)

    def test_given_biases_are_taken(self):
        drive = zr.simulate_drive(
            duration=5.0,
            gyro=None,
            accel=None,
            gyro_bias=[1e-3, 2e-3, 3e-3],
            accel_bias=[0.1, 0.2, 0.3],
        )
        clean = silent(5.0)
        np.testing.assert_allclose(drive.gyro - clean.gyro, [[1e-3, 2e-3, 3e-3]] * 500, atol=1e-15)
        np.testing.assert_array_equal(drive.accel_bias, [[0.1, 0.2, 0.3]] * 500)

    def test_a_device(self):
        drive = zr.simulate_drive(duration=5.0, gyro=zr.simulation.device("MPU-6050"))
        assert drive.gyro.std() > 0.0


class TestFixes:
    def test_without_error_they_are_the_truth(self):
        drive = silent(100.0, 1, fixes_rate=4.0)
        assert len(drive.fixes) == 400
        at = np.arange(400) * 25
        np.testing.assert_array_equal(drive.fixes.time, drive.time[at])
        np.testing.assert_array_equal(drive.fixes.position, drive.truth_position[at])
        np.testing.assert_array_equal(drive.fixes.velocity, drive.truth_velocity[at])
        assert drive.fixes.position_sigma is None

    def test_the_antenna(self):
        antenna = np.array([1.5, -0.5, -1.2])
        drive = silent(100.0, 1, fixes_rate=10.0, antenna=tuple(antenna))
        at = np.arange(1000) * 10
        lever = matrices(drive)[at] @ antenna
        found = local_ned(drive.fixes.position, drive.truth_position[at])
        # A degree is rounded at 3 nm.
        np.testing.assert_allclose(found, lever, atol=1e-8)
        # Its velocity is how its position changes, but for curvature: a central difference.
        local = local_ned(drive.fixes.position, drive.truth_position[0])
        moving = (local[2:] - local[:-2]) * 5.0
        np.testing.assert_allclose(drive.fixes.velocity[1:-1], moving, atol=0.02)

    def test_noise_has_its_deviations(self):
        drive = zr.simulate_drive(
            duration=200.0,
            seed=2,
            fixes_rate=10.0,
            position_sigma=[1.0, 2.0, 4.0],
            velocity_sigma=0.1,
        )
        at = np.arange(2000) * 10
        place = local_ned(drive.fixes.position, drive.truth_position[at])
        speed = drive.fixes.velocity - drive.truth_velocity[at]
        # 2,000 values: to 1.6 %.
        np.testing.assert_allclose(place.std(axis=0), [1.0, 2.0, 4.0], rtol=0.07)
        np.testing.assert_allclose(speed.std(axis=0), 0.1, rtol=0.07)
        np.testing.assert_array_equal(drive.fixes.position_sigma, [[1.0, 2.0, 4.0]] * 2000)

    def test_rates_that_do_not_divide(self):
        drive = silent(10.0, 1, fixes_rate=3.0)
        np.testing.assert_allclose(drive.fixes.time, np.arange(30) / 3.0, atol=0.005)


class TestRecord:
    def test_as_a_recording(self):
        drive = zr.simulate_drive(duration=5.0, seed=2)
        recording = drive.recording()
        np.testing.assert_array_equal(recording.gyro.data, drive.gyro)
        assert (recording.gyro.unit, recording.accel.unit) == ("rad/s", "m/s^2")
        assert recording.gyro.rate == 100.0

    def test_its_truth_can_be_drawn(self, tmp_path):
        drive = silent(5.0)
        zr.navigation.write_gpx(tmp_path / "a.gpx", zr.Fixes(drive.time, drive.truth_position))

    @pytest.mark.parametrize(
        ("arguments", "message"),
        [
            ({"duration": 0.0}, "duration must be two samples or longer"),
            ({"duration": 4000.0}, "3600 s at most, got 4000"),
            ({"rate": 0.0}, "rate must be a positive"),
            ({"latitude": 86.0}, "latitude must be within 85 deg"),
            ({"kind": "flight"}, "kind must be 'drive' or 'rest', got 'flight'"),
            ({"rest": -1.0}, "rest must be finite and not negative"),
            ({"seed": -1}, "seed must be a whole number from 0"),
            ({"gyro": "best"}, "gyro must be a NoiseModel, a Device, 'consumer' or None"),
            ({"accel": 3.0}, "model must be a NoiseModel or a Device, got float"),
            ({"gyro_bias": [1.0, 2.0]}, r"gyro_bias must be finite, of shape \(3\)"),
            ({"fixes_rate": 200.0}, "fixes_rate must be above 0 and 100 Hz at most"),
            ({"position_sigma": -1.0}, "position_sigma must not be negative"),
            ({"velocity_sigma": [1.0]}, r"velocity_sigma must be finite, of shape \(3\)"),
            ({"antenna": [1.0, 2.0]}, r"antenna must be finite, of shape \(3\)"),
            ({"antenna": -1.0}, "antenna must be finite and not negative"),
            ({"wander": 0.5}, "wander must be from 0 to 0.2, got 0.5"),
            ({"body_from_sensor": "any"}, "body_from_sensor must be a rotation, 'random' or None"),
            ({"body_from_sensor": -np.eye(3)}, "body_from_sensor must be a rotation, got"),
            ({"time_offset": np.nan}, "time_offset must be a number of seconds, got nan"),
        ],
    )
    def test_refusals(self, arguments, message):
        with pytest.raises(ValueError, match=message):
            zr.simulate_drive(**{"duration": 2.0, **arguments})


class TestOutside:
    """What recordings have: mounts, clocks, a rate that wanders, an antenna somewhere."""

    def test_a_mount_turns_samples_and_nothing_else(self):
        plain, mounted = (
            zr.simulate_drive(50.0, 60.0, seed=2, body_from_sensor=mount, gyro=None, gyro_bias=0.0)
            for mount in (None, "random")
        )
        turn = mounted.body_from_sensor
        np.testing.assert_allclose(turn @ turn.T, np.eye(3), atol=1e-12)
        np.testing.assert_allclose(mounted.gyro @ turn.T, plain.gyro, atol=1e-12)
        np.testing.assert_array_equal(mounted.truth_quaternion, plain.truth_quaternion)
        np.testing.assert_allclose(mounted.rates(), plain.rates(), atol=1e-12)

    def test_clocks_are_put_right_by_their_offset(self):
        exact = {"position_sigma": 0.0, "velocity_sigma": 0.0}
        offset = zr.record.TimeOffset(-0.2, 0.0, 0.15, 0.0, 3e-4, 0.0, 30.0)
        plain = zr.simulate_drive(50.0, 60.0, seed=2, **exact)
        late = zr.simulate_drive(50.0, 60.0, seed=2, time_offset=offset, **exact)
        fixes = offset.applied(late.fixes)
        np.testing.assert_allclose(fixes.time, plain.fixes.time, atol=1e-9)
        np.testing.assert_allclose(fixes.position, plain.fixes.position, atol=1e-12)
        for axis in range(3):
            true = np.interp(fixes.velocity_time, plain.time, plain.truth_velocity[:, axis])
            np.testing.assert_allclose(fixes.velocity[:, axis], true, atol=2e-3)

    def test_a_rate_that_wanders_is_navigated_without_error(self):
        drive = zr.simulate_drive(
            50.0, 60.0, seed=2, wander=0.03, gyro=None, accel=None, gyro_bias=0.0, accel_bias=0.0
        )
        steps = np.diff(drive.time) * 50.0
        assert np.std(steps) == pytest.approx(0.03, rel=0.2)
        assert drive.time[-1] == pytest.approx(60.0 - 0.02)
        assert drive.recording().gyro.stamps is not None
        meridian, _ = radii(np.radians(drive.truth_position[:-1, 0]))
        north = 0.5 * (drive.truth_velocity[1:, 0] + drive.truth_velocity[:-1, 0])
        way = north * np.diff(drive.time) / (meridian + drive.truth_position[:-1, 2])
        np.testing.assert_allclose(np.diff(np.radians(drive.truth_position[:, 0])), way, atol=1e-12)

    def test_an_antenna_is_drawn(self):
        drives = [zr.simulate_drive(50.0, 20.0, seed=seed, antenna=1.0) for seed in (1, 2)]
        assert np.abs(drives[0].antenna - drives[1].antenna).max() > 0.1
