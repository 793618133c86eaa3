"""A simulated calibration: its motion against quaternions, its output against its truth."""

import math

import numpy as np
import pytest

import zerorate as zr
from zerorate.geometry import rotations

EXACT = {
    "gyro": zr.simulation.GyroErrors(noise=None, resolution=0.0),
    "accel": zr.simulation.AccelErrors(noise=None, resolution=0.0, disturbance=0.0),
}
PERFECT = {
    "gyro": zr.simulation.GyroErrors(
        noise=None, resolution=0.0, scale=0.0, misalignment=0.0, bias=0.0, g_sensitivity=0.0
    ),
    "accel": zr.simulation.AccelErrors(
        noise=None, resolution=0.0, disturbance=0.0, scale=0.0, misalignment=0.0, bias=0.0
    ),
}
UP = np.array([0.0, 0.0, 1.0])


def steps(session):
    """Rotations from each sample to the next, in the axes of the body, as vectors."""
    q = session.quaternion
    step = rotations.product(rotations.inverse(q[:-1]), q[1:])
    return 2.0 * np.sign(step[:, :1]) * step[:, 1:]


def directions(session):
    """Which direction of the body is up in each rest."""
    q = session.quaternion[session.rests[:, 0] + 5]
    return rotations.rotate(rotations.inverse(q), np.tile(UP, (len(q), 1)))


class TestMotion:
    def test_the_rates_are_the_derivative_of_the_orientation(self):
        session = zr.simulation.simulate_session(4, seed=5, rate=2000.0, tremor=0.05)
        mean = 0.5 * (session.rates[1:] + session.rates[:-1])
        # A step's trapezoid misses dt^3/12 of the second derivative: some 100 rad/s^3 here.
        np.testing.assert_allclose(steps(session) * 2000.0, mean, atol=100.0 / 12.0 / 2000.0**2 * 3)

    def test_a_rest_is_still_and_a_turn_is_within_its_angles(self):
        session = zr.simulation.simulate_session(12, seed=3)
        for first, stop in session.rests:
            assert (session.rates[first:stop] == 0.0).all()
            still = session.quaternion[first:stop]
            assert (
                rotations.angle(rotations.product(rotations.inverse(still[:1]), still)).max()
                < 1e-12
            )
        q = session.quaternion[session.rests[:, 0]]
        turns = rotations.angle(rotations.product(rotations.inverse(q[:-1]), q[1:]))
        assert math.radians(60.0) <= turns.min() <= turns.max() <= math.radians(170.0)
        moving = [np.abs(session.rates[a + 1 : b - 1]).max(axis=1).min() for a, b in session.turns]
        assert min(moving) > 0.0

    def test_rests_and_turns_share_their_ends_and_cover_all(self):
        session = zr.simulation.simulate_session(5, seed=1, rate=62.5, rest=1.3, turn=0.7)
        assert session.rests[0, 0] == 0
        assert session.rests[-1, 1] == session.recording.gyro.n == len(session.rates)
        assert (session.turns[:, 0] == session.rests[:-1, 1] - 1).all()
        assert (session.turns[:, 1] == session.rests[1:, 0] + 1).all()

    def test_six_poses_have_each_axis_up_and_down(self):
        found = directions(zr.simulation.simulate_session("six"))
        expected = [[0, 0, 1], [1, 0, 0], [0, 1, 0], [0, 0, -1], [-1, 0, 0], [0, -1, 0]]
        np.testing.assert_allclose(found, expected, atol=1e-12)

    def test_turns_about_the_vertical_show_the_accelerometer_nothing(self):
        session = zr.simulation.simulate_session(8, axis=(0.0, 0.0, 2.0))
        np.testing.assert_allclose(directions(session), np.tile(UP, (8, 1)), atol=1e-12)
        assert (session.rates[:, :2] == 0.0).all()
        assert {-1.0, 1.0} == set(np.sign(session.rates[session.turns.mean(axis=1).astype(int), 2]))

    def test_given_poses_are_held(self):
        q = rotations.unit(np.random.default_rng(4).standard_normal((7, 4)))
        as_quaternions = zr.simulation.simulate_session(q, **PERFECT)
        matrices = np.stack([rotations.rotate(q, np.tile(e, (7, 1))) for e in np.eye(3)], axis=2)
        as_matrices = zr.simulation.simulate_session(matrices, **PERFECT)
        held = as_quaternions.quaternion[as_quaternions.rests[:, 0]]
        np.testing.assert_allclose(np.abs(np.sum(held * q, axis=1)), 1.0, atol=1e-12)
        np.testing.assert_allclose(as_matrices.rates, as_quaternions.rates, atol=1e-9)

    def test_a_turn_may_be_a_whole_revolution(self):
        vectors = 2.0 * math.pi * np.eye(3)
        session = zr.simulation.simulate_session(turns=vectors, turn=4.0, wobble=0.0)
        np.testing.assert_allclose(directions(session), np.tile(UP, (4, 1)), atol=1e-12)
        turned_by = [steps(session)[a : b - 1].sum(axis=0) for a, b in session.turns]
        # Vectors of quaternions are sines: of 3 deg they miss x^3/24 of the angle.
        np.testing.assert_allclose(turned_by, vectors, rtol=2e-4, atol=1e-9)

    def test_a_hand_leaves_the_axis_and_comes_back(self):
        steady, shaky = (zr.simulation.simulate_session(4, seed=3, wobble=w) for w in (0.0, 0.1))
        for one in (steady, shaky):
            axes = one.rates / np.maximum(np.linalg.norm(one.rates, axis=1, keepdims=True), 1e-9)
            middle = axes[one.turns[:, 0] + 60], axes[one.turns[:, 0] + 140]
            moved = np.linalg.norm(middle[1] - middle[0], axis=1)
            assert (moved < 1e-9).all() if one is steady else (moved > 1e-3).all()
        np.testing.assert_allclose(directions(steady), directions(shaky), atol=1e-12)

    def test_a_hand_trembles_as_asked(self):
        session = zr.simulation.simulate_session(3, seed=2, rest=60.0, tremor=0.02)
        at_rest = np.concatenate([session.rates[a:b] for a, b in session.rests])
        # Eight lines in 180 s: their squares average out to 1/(1 Hz 180 s).
        assert math.sqrt(float((at_rest**2).sum(axis=1).mean())) == pytest.approx(0.02, rel=0.02)


class TestOutput:
    @pytest.mark.parametrize(
        ("gyro_unit", "accel_unit"), [("deg/s", "g"), ("rad/s", "m/s^2"), ("unit", "unit")]
    )
    def test_the_truth_takes_the_errors_away(self, gyro_unit, accel_unit):
        # Counts are rounded: steps so fine that they stay below the tolerance.
        fine = 1e-9 if gyro_unit == "unit" else 0.0
        session = zr.simulation.simulate_session(
            5,
            seed=2,
            gravity=9.79,
            gyro=zr.simulation.GyroErrors(noise=None, resolution=fine, unit=gyro_unit),
            accel=zr.simulation.AccelErrors(
                noise=None, resolution=fine, disturbance=0.0, unit=accel_unit
            ),
        )
        truth, log = session.truth, session.recording
        si = {"g": 9.80665, "deg/s": math.radians(1.0)}
        force = (log.accel.data - np.array(truth.accel.bias)) @ truth.accel.correction.T
        force *= si.get(truth.accel_units[1], 1.0)
        np.testing.assert_allclose(force, session.force, atol=3e-9)
        sensitive = session.force / 9.80665 @ np.array(truth.gyro.g_sensitivity).T
        raw = log.gyro.data - np.array(truth.gyro.bias) - sensitive
        rates = raw @ truth.gyro.correction.T * si.get(truth.gyro_units[1], 1.0)
        np.testing.assert_allclose(rates, session.rates, atol=3e-9)
        assert (log.gyro.unit, log.accel.unit) == (gyro_unit, accel_unit)

    def test_force_at_rest_is_gravity(self):
        session = zr.simulation.simulate_session(6, seed=4, gravity=9.79)
        first = session.rests[:, 0] + 5
        np.testing.assert_allclose(session.force[first], 9.79 * directions(session), atol=1e-12)
        middle = session.turns.mean(axis=1).astype(int)
        assert np.abs(np.linalg.norm(session.force[middle], axis=1) - 9.79).min() > 1e-3

    def test_the_accelerometer_defines_the_axes(self):
        matrix = np.array(zr.simulation.simulate_session(2).truth.accel.matrix)
        assert (np.triu(matrix, 1) == 0.0).all()
        assert (np.tril(matrix, -1) != 0.0).sum() == 3

    def test_drawn_errors_have_the_deviations_asked_for(self):
        many = [zr.simulation.simulate_session(1, seed=i, rest=0.1).truth for i in range(100)]
        spread = np.std([m.values for m in many], axis=0)
        expected = {
            "accel.matrix.xx": 0.02,
            "accel.matrix.zx": 0.01,
            "accel.bias.y": 0.02,
            "gyro.matrix.zz": 0.02,
            "gyro.matrix.xz": 0.01,
            "gyro.bias.x": 0.5,
            "gyro.g_sensitivity.yx": 0.05,
        }
        found = dict(zip(many[0].parameters, spread, strict=True))
        # Four deviations of a deviation of 100 draws.
        assert {n: found[n] for n in expected} == pytest.approx(expected, rel=4 / math.sqrt(200))

    def test_noise_is_that_of_the_models(self):
        gyro, accel = zr.NoiseModel(1e-4), zr.NoiseModel(2e-3, quantity="acceleration")
        session = zr.simulation.simulate_session(
            2,
            rest=30.0,
            gyro=zr.simulation.GyroErrors(noise=gyro, unit="rad/s"),
            accel=zr.simulation.AccelErrors(noise=accel, resolution=0.0, unit="m/s^2"),
        )
        first, stop = session.rests[0]
        # Five deviations of a deviation of 3000 samples.
        rtol = 5.0 / math.sqrt(2 * 3000)
        np.testing.assert_allclose(session.recording.gyro.data[first:stop].std(0), 1e-3, rtol=rtol)
        np.testing.assert_allclose(session.recording.accel.data[first:stop].std(0), 2e-2, rtol=rtol)

    def test_poses_are_disturbed(self):
        accel = zr.simulation.AccelErrors(
            noise=None, resolution=0.0, scale=0.0, misalignment=0.0, bias=0.0
        )
        session = zr.simulation.simulate_session(60, rest=0.5, accel=accel)
        first = session.rests[:, 0] + 5
        off = session.recording.accel.data[first] - session.force[first] / 9.80665
        # Four deviations of a deviation of 180 numbers.
        assert off.std() == pytest.approx(0.3e-3, rel=4.0 / math.sqrt(360))

    def test_range_and_resolution(self):
        session = zr.simulation.simulate_session(
            6,
            gyro=zr.simulation.GyroErrors(noise=None, resolution=0.001, range=1.0, unit="rad/s"),
            accel=zr.simulation.AccelErrors(range=9.0, unit="m/s^2"),
        )
        gyro, accel = session.recording.gyro.data, session.recording.accel.data
        assert np.abs(gyro).max() == 1.0 < np.abs(session.rates).max()
        assert (np.abs(gyro) == 1.0).sum() > 10
        np.testing.assert_allclose(gyro, np.round(gyro / 0.001) * 0.001, atol=1e-12)
        assert np.abs(accel).max() == 9.0

    def test_counts_are_whole(self):
        counts = zr.simulation.GyroErrors(unit="unit"), zr.simulation.AccelErrors(unit="unit")
        session = zr.simulation.simulate_session(3, gyro=counts[0], accel=counts[1])
        for log in session.recording.values():
            np.testing.assert_allclose(log.data, np.round(log.data), atol=1e-9)
        # 131 counts per deg/s, 16384 per g.
        assert session.truth.gyro.scale[0] == pytest.approx(131 * 180 / math.pi, rel=0.1)
        assert session.truth.accel.scale[0] == pytest.approx(16384 / 9.80665, rel=0.1)

    def test_temperature(self):
        by_temperature = np.radians([[0.2, 0.0, -0.1], [0.01, 0.02, 0.0]])
        session = zr.simulation.simulate_session(
            4,
            temperature=(20.0, 45.0),
            gyro=zr.simulation.GyroErrors(
                noise=None, bias=(0.0, 0.0, 0.0), temperature=by_temperature
            ),
        )
        warm = session.recording.temperature.data
        assert warm[0, 0] == 20.0
        assert warm[-1, 0] == pytest.approx(45.0 - 25.0 * math.exp(-3.0))
        tens = (warm - 25.0) / 10.0
        expected = tens * [0.2, 0.0, -0.1] + tens**2 * [0.01, 0.02, 0.0]
        np.testing.assert_allclose(session.bias, expected, atol=1e-12)
        np.testing.assert_allclose(session.truth.gyro.bias, expected.mean(axis=0), atol=1e-12)
        assert session.truth.temperature == pytest.approx(warm.mean())

    def test_temperature_as_a_function(self):
        session = zr.simulation.simulate_session(2, temperature=lambda t: 20.0 + 0.1 * t)
        log = session.recording.temperature
        np.testing.assert_allclose(log.data[:, 0], 20.0 + 0.1 * log.time)


class TestSeeds:
    def test_the_same_arguments_give_the_same_session(self):
        one, two, other = (zr.simulation.simulate_session(4, seed=s) for s in (7, 7, 8))
        for name in ("gyro", "accel"):
            np.testing.assert_array_equal(one.recording[name].data, two.recording[name].data)
        assert not np.array_equal(one.truth.values, other.truth.values)

    def test_what_is_drawn_does_not_depend_on_what_is_given(self):
        plain, exact = (
            zr.simulation.simulate_session(4, seed=7),
            zr.simulation.simulate_session(4, seed=7, **EXACT),
        )
        np.testing.assert_array_equal(plain.rates, exact.rates)
        np.testing.assert_array_equal(plain.truth.values[:21], exact.truth.values[:21])
        given = zr.simulation.simulate_session(
            4, seed=7, gyro=zr.simulation.GyroErrors(matrix=np.eye(3))
        )
        np.testing.assert_array_equal(plain.truth.values[21:], given.truth.values[21:])


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"poses": 0}, "poses must be a whole number from 1"),
        ({"poses": "seven"}, "a number, 'six' or orientations"),
        ({"poses": np.zeros((3, 4))}, "a length above 0"),
        ({"poses": np.zeros((3, 5))}, r"of shape \(m, 4\)"),
        ({"poses": 2.0 * np.eye(3)[None]}, "must be rotation matrices"),
        ({"poses": -np.eye(3)[None]}, "must be rotation matrices"),
        ({"seed": -1}, "seed must be a whole number"),
        ({"rate": 0.0}, "rate must be a positive"),
        ({"rest": 0.01}, "two samples or longer"),
        ({"turn": math.nan}, "turn must be positive"),
        ({"gravity": -9.8}, "gravity must be positive"),
        ({"angles": (1.0, 0.5)}, "angles must rise"),
        ({"axis": (0, 0, 0)}, "axis must have a length"),
        ({"turns": np.ones(3)}, r"turns must be finite, of shape \(m, 3\)"),
        ({"tremor": -1.0}, "tremor must be"),
        ({"wobble": -1.0}, "wobble must be"),
        ({"temperature": (1.0, 2.0, 3.0)}, r"temperature must be finite, of shape \(2\)"),
        ({"accel": zr.simulation.AccelErrors(matrix=np.ones((3, 3)))}, "must be lower triangular"),
        ({"accel": zr.simulation.AccelErrors(unit="mg")}, "unit must be one of g, m/s"),
        ({"accel": zr.simulation.AccelErrors(range=0.0)}, "range must be positive"),
        (
            {"gyro": zr.simulation.GyroErrors(unit="unit", resolution=0.0)},
            "need a resolution above 0",
        ),
        (
            {"gyro": zr.simulation.GyroErrors(bias=(1.0, 2.0))},
            r"bias must be finite, of shape \(3\)",
        ),
        ({"gyro": zr.simulation.GyroErrors(scale=-0.1)}, "scale must be finite and not negative"),
        ({"gyro": zr.simulation.GyroErrors(temperature=(0.1,))}, "needs the session's temperature"),
    ],
)
def test_refusals(arguments, message):
    with pytest.raises(ValueError, match=message):
        zr.simulation.simulate_session(**{"poses": 3, "rest": 1.0, **arguments})
