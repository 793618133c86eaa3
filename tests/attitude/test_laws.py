"""Symmetries that an attitude has, and its conventions: each in a case where a mistake shows."""

from functools import cache
from itertools import permutations, product

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

import zerorate as zr
from support.checks import assert_same_bits, named
from support.records import hostile_records, wide_records

DEG = np.pi / 180.0
RATE = 100.0
# Rounding of some hundred operations in each of some hundred ticks, where nothing is divided by
# what is small.
ROUNDING = 1e-10
KNOWN_WITHOUT_FIELD = (
    "bias",
    "bias_sigma",
    "gyro_matrix",
    "gyro_matrix_sigma",
    "tilt_sigma",
    "at_rest",
)
# Rotation of east, north and up into the axes of each frame, as matrix.
FRAMES = {
    "enu": np.eye(3),
    "ned": np.array([[0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, -1.0]]),
    "nwu": np.array([[0.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]),
}
BY_FRAME = pytest.mark.parametrize("frame", FRAMES)
# Of the earth, east, north and up.
NORTHWARD = np.array([0.0, 20.0, -40.0])
GRAVITY = np.array([0.0, 0.0, 9.81])


@cache
def hand():
    return zr.simulate_motion("hand", RATE, 40.0, seed=4, magnet=[(25.0, 28.0)])


def assert_same_rotation(got, expected, atol=ROUNDING):
    """Of quaternions w first, of either sign."""
    sign = np.sign(np.sum(got * expected, axis=-1, keepdims=True))
    np.testing.assert_allclose(got * sign, expected, rtol=0.0, atol=atol)


def assert_same_angle(got, expected):
    assert abs(np.exp(1j * got) - np.exp(1j * expected)) < ROUNDING


def rotations(q):
    return Rotation.from_quat(q, scalar_first=True)


def quaternions(rotation):
    return rotation.as_quat(scalar_first=True)


@pytest.mark.parametrize("angle", [0.3, -2.5, np.pi])
def test_a_turned_field_turns_the_heading_alone(angle):
    """As if the whole motion had taken place towards another direction."""
    motion = hand()
    mag = motion.mag.copy()
    # The last sample of a tick is told after the tick's correction, but used before it.
    mag[9::10] = np.nan
    level = rotations(zr.Attitude(RATE, mag=False).process(motion.gyro, motion.accel))
    about_up = Rotation.from_rotvec([0.0, 0.0, angle])
    turned = level.inv().apply(about_up.apply(level.apply(mag)))
    expected = zr.Attitude(RATE).trace(motion.gyro, motion.accel, mag)
    got = zr.Attitude(RATE).trace(motion.gyro, motion.accel, turned)
    for name in KNOWN_WITHOUT_FIELD:
        assert_same_bits(got[name], expected[name])
    np.testing.assert_array_equal(got["disturbed"], expected["disturbed"])
    assert expected["disturbed"].any()
    back = quaternions(about_up.inv() * rotations(expected["quaternion"]))
    assert_same_rotation(got["quaternion"], back)


def right_angles():
    """The 24 rotations of a cube."""
    for order in permutations(range(3)):
        for signs in product([1.0, -1.0], repeat=3):
            turn = np.diag(signs)[list(order)]
            if np.linalg.det(turn) > 0.0:
                yield turn


@pytest.mark.parametrize("begun", ["aligned", "levelled"])
def test_other_axes_of_the_sensor_give_the_same_answer_in_them(begun):
    """Levelled by itself, each begins with another heading, and so with other level axes."""
    motion = hand()
    first = rotations(motion.quaternion[0])
    turns = list(right_angles())
    assert len(turns) == 24

    def traced(turn):
        f = zr.Attitude(RATE)
        if begun == "aligned":
            f.align(first * Rotation.from_matrix(turn).inv())
        return f.trace(*(vectors @ turn.T for vectors in (motion.gyro, motion.accel, motion.mag)))

    expected = traced(np.eye(3))
    for turn in turns:
        got, permuted = traced(turn), np.abs(turn)
        with named(turn):
            turned_back = rotations(expected["quaternion"]) * Rotation.from_matrix(turn).inv()
            assert_same_rotation(got["quaternion"], quaternions(turned_back))
            for name, axes in (
                ("bias", expected["bias"] @ turn.T),
                ("bias_sigma", expected["bias_sigma"] @ permuted.T),
                ("linear_acceleration", expected["linear_acceleration"] @ turn.T),
                ("gyro_matrix", turn @ expected["gyro_matrix"] @ turn.T),
                ("gyro_matrix_sigma", permuted @ expected["gyro_matrix_sigma"] @ permuted.T),
            ):
                scale = ROUNDING * np.max(np.abs(axes))
                np.testing.assert_allclose(got[name], axes, rtol=0.0, atol=scale, err_msg=name)
            for name in ("at_rest", "disturbed"):
                np.testing.assert_array_equal(got[name], expected[name])


@given(wide_records(hostile_records(), 3), st.integers(0, 3500))
def test_a_magnet_touches_the_heading_only(field, first):
    """Any field, none, and what is no field; of a rest alone it is asked whether it is one."""
    motion = zr.simulate_motion("hand", RATE, 40.0, seed=4, start="motion")
    field = field[:500]
    mag = motion.mag.copy()
    mag[first : first + len(field)] = field
    expected = zr.Attitude(RATE).trace(motion.gyro, motion.accel, np.full((4000, 3), np.nan))
    got = zr.Attitude(RATE).trace(motion.gyro, motion.accel, mag)
    for name in KNOWN_WITHOUT_FIELD:
        assert_same_bits(got[name], expected[name])
    # The vertical, as it is told: the heading costs it roundings.
    np.testing.assert_allclose(
        got["linear_acceleration"], expected["linear_acceleration"], atol=1e-12
    )
    assert np.all(np.isfinite(got["quaternion"]))
    assert not expected["at_rest"].any()
    # Ten is the variance of a heading that nothing is known of.
    assert np.all(got["heading_sigma"] <= np.sqrt(10.0))


def at_rest(orientation, frame="enu", n=50):
    """A filter that rests in an orientation, from sensor to the earth's axes in that frame."""
    up, field = (FRAMES[frame] @ vector for vector in (GRAVITY, NORTHWARD))
    f = zr.Attitude(RATE, frame=frame)
    rows = [np.tile(orientation.inv().apply(v), (n, 1)) for v in (np.zeros(3), up, field)]
    f.process(*rows)
    return f


class TestConventions:
    @BY_FRAME
    def test_from_sensor_to_earth_the_scalar_first(self, frame):
        """Any orientation is its own answer; its inverse, or w last, is another rotation."""
        for orientation in Rotation.random(20, rng=1):
            f = at_rest(orientation, frame)
            assert_same_rotation(f.quaternion, quaternions(orientation))
            turned_back = (f.rotation * orientation.inv()).magnitude()
            assert turned_back < ROUNDING

    @pytest.mark.parametrize(
        ("frame", "z", "mag", "heading"),
        [
            ("enu", 9.81, [0.0, 20.0, -40.0], 90.0),
            ("ned", -9.81, [20.0, 0.0, 40.0], 0.0),
            ("nwu", 9.81, [20.0, 0.0, -40.0], 0.0),
        ],
    )
    def test_level_and_along_the_axes_of_the_earth(self, frame, z, mag, heading):
        """No rotation, whose x axis points east or north."""
        f = zr.Attitude(RATE, frame=frame)
        for _ in range(20):
            q = f.update([0.0, 0.0, 0.0], [0.0, 0.0, z], mag)
        assert_same_rotation(q, np.array([1.0, 0.0, 0.0, 0.0]), atol=1e-15)
        np.testing.assert_allclose(f.up, [0.0, 0.0, np.sign(z)], atol=1e-15)
        np.testing.assert_allclose(f.gravity, [0.0, 0.0, z], atol=1e-14)
        np.testing.assert_allclose(f.linear_acceleration, 0.0, atol=1e-14)
        assert f.heading == pytest.approx(heading * DEG, abs=1e-15)

    @pytest.mark.parametrize(
        ("frame", "before", "after"), [("enu", 90, 60), ("ned", 0, 30), ("nwu", 0, 330)]
    )
    def test_a_turn_about_z(self, frame, before, after):
        """By 30 degrees and the right hand: against the clock about up, with it about down."""
        f = zr.Attitude(RATE, frame=frame, mag=False)
        f.align([1.0, 0.0, 0.0, 0.0])
        assert_same_angle(f.heading, before * DEG)
        force = FRAMES[frame] @ GRAVITY
        f.process(np.tile([0.0, 0.0, 120.0 * DEG], (25, 1)), np.tile(force, (25, 1)))
        # No correction: the force is what is expected.
        assert_same_angle(f.heading, after * DEG)
        yaw = Rotation.from_rotvec([0.0, 0.0, 30.0 * DEG])
        assert_same_rotation(f.quaternion, quaternions(yaw))

    @BY_FRAME
    def test_a_frame_is_a_constant_rotation(self, frame):
        motion = hand()
        sensors = (motion.gyro, motion.accel, motion.mag)
        enu, there = (zr.Attitude(RATE, frame=name) for name in ("enu", frame))
        turn = Rotation.from_matrix(FRAMES[frame])
        expected = quaternions(turn * rotations(enu.process(*sensors)))
        assert_same_rotation(there.process(*sensors), expected, atol=1e-14)
        for name in ("heading", "up", "gravity", "linear_acceleration", "bias", "heading_sigma"):
            assert_same_bits(getattr(there, name), getattr(enu, name))

    def test_angles_are_yaw_then_pitch_then_roll(self):
        for orientation in Rotation.random(20, rng=2):
            f = at_rest(orientation, "ned")
            yaw, pitch, roll = orientation.as_euler("ZYX")
            np.testing.assert_allclose(f.euler, [roll, pitch, yaw], atol=1e-9)

    @BY_FRAME
    @pytest.mark.parametrize(
        ("east", "north", "azimuth"),
        [
            (0.0, 1.0, 0.0),
            (1.0, 0.0, 90.0),
            (0.0, -1.0, 180.0),
            (-1.0, 0.0, 270.0),
            (-1.0, 1.0, 315.0),
        ],
    )
    def test_heading_is_the_azimuth_of_the_x_axis(self, frame, east, north, azimuth):
        """Whatever the frame, and however steep the axis points."""
        x = np.array([east, north, 0.7])
        axes = FRAMES[frame] @ np.linalg.qr(np.column_stack([x, GRAVITY, [0.3, 0.2, 0.1]]))[0]
        axes *= np.sign(axes[:, 0] @ FRAMES[frame] @ x)
        axes[:, 2] *= np.sign(np.linalg.det(axes))
        f = at_rest(Rotation.from_matrix(axes), frame)
        assert_same_angle(f.heading, azimuth * DEG)
        assert 0.0 <= f.heading < 2.0 * np.pi

    @BY_FRAME
    def test_up_and_gravity_are_in_the_axes_of_the_sensor(self, frame):
        orientation = Rotation.random(rng=3)
        f = at_rest(orientation, frame, 200)
        up = orientation.inv().apply(FRAMES[frame] @ [0.0, 0.0, 1.0])
        np.testing.assert_allclose(f.up, up, atol=ROUNDING)
        np.testing.assert_allclose(f.gravity, 9.81 * up, atol=10.0 * ROUNDING)
        # A push of 1 m/s^2 along the sensor's x axis.
        f.update([0.0, 0.0, 0.0], f.gravity + np.array([1.0, 0.0, 0.0]))
        np.testing.assert_allclose(f.linear_acceleration, [1.0, 0.0, 0.0], atol=1e-9)


class TestUnits:
    def test_deg_and_g_answer_the_same(self):
        motion = hand()
        plain = zr.Attitude(RATE)
        other = zr.Attitude(RATE, gyro_unit="deg/s", accel_unit="g")
        expected = plain.trace(motion.gyro, motion.accel, motion.mag)
        g = zr.units.convert(1.0, "g", "m/s^2")
        got = other.trace(motion.gyro / DEG, motion.accel / g, motion.mag / 48.0)
        for name, unit in {"bias": DEG, "bias_sigma": DEG, "linear_acceleration": g}.items():
            scale = np.max(np.abs(expected[name]))
            np.testing.assert_allclose(
                got[name] * unit, expected[name], atol=scale * ROUNDING, err_msg=name
            )
        for name in ("quaternion", "gyro_matrix", "tilt_sigma", "heading_sigma"):
            np.testing.assert_allclose(got[name], expected[name], atol=ROUNDING, err_msg=name)
        np.testing.assert_array_equal(got["at_rest"], expected["at_rest"])
        np.testing.assert_array_equal(got["disturbed"], expected["disturbed"])
        np.testing.assert_allclose(other.gravity * g, plain.gravity, rtol=0.0, atol=1e-9)

    def test_bias_is_in_the_unit_of_the_gyro(self):
        given = zr.Attitude(RATE, gyro_unit="deg/s", bias=[1.0, -2.0, 3.0], bias_sigma=0.1)
        np.testing.assert_allclose(given.bias, [1.0, -2.0, 3.0], rtol=1e-15)
        np.testing.assert_allclose(given.bias_sigma, 0.1, rtol=1e-14)


class TestTime:
    """Time between samples is an argument of its own: what the laws say holds with it, too."""

    def test_pieces_and_single_samples(self):
        motion, rng = hand(), np.random.default_rng(5)
        dt = rng.uniform(0.0, 0.02, 4000)
        dt[rng.random(4000) < 0.01] = 0.3
        dt[[700, 2000]], dt[900:910] = [1.5, 1e5], np.nan
        sensors = (motion.gyro, motion.accel, motion.mag)
        whole, parts, single = (zr.Attitude(RATE) for _ in range(3))
        expected = whole.process(*sensors, dt=dt)
        for first in range(0, 4000, 333):
            part = slice(first, first + 333)
            answers = parts.process(*(v[part] for v in sensors), dt=dt[part])
            assert_same_bits(answers, expected[part])
            parts = zr.Attitude.from_bytes(parts.to_bytes())
        rows = zip(*sensors, dt.tolist(), strict=True)
        got = np.array([single.update(g, a, m, dt=t) for g, a, m, t in rows])
        assert_same_bits(got, expected)
        assert single.to_bytes() == parts.to_bytes() == whole.to_bytes()

    @given(wide_records(hostile_records(), 10))
    def test_nothing_finite_breaks_it(self, z):
        f, dt = zr.Attitude(RATE), np.abs(z[:, 9])
        q = f.process(z[:, :3], z[:, 3:6], z[:, 6:9], dt=dt)
        np.testing.assert_allclose(np.sum(q**2, axis=1), 1.0, rtol=1e-6)
        assert zr.Attitude.from_bytes(f.to_bytes()).to_bytes() == f.to_bytes()

    def test_the_period_is_what_no_time_means(self):
        motion = hand()
        plain, told, untold = (zr.Attitude(RATE) for _ in range(3))
        expected = plain.process(motion.gyro, motion.accel, motion.mag)
        assert_same_bits(
            told.process(motion.gyro, motion.accel, motion.mag, dt=1.0 / RATE), expected
        )
        missing = np.full(4000, np.nan)
        assert_same_bits(
            untold.process(motion.gyro, motion.accel, motion.mag, dt=missing), expected
        )
