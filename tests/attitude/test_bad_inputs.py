"""What an attitude filter is given by mistake, by a broken sensor, or in free fall."""

import re

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import zerorate as zr

DEG = np.pi / 180.0
RATE = 100.0
N = 3000
STILL = np.zeros((N, 3))
LEVEL = np.tile([0.0, 0.0, 9.81], (N, 1))
FIELD = np.tile([0.0, 20.0, -40.0], (N, 1))


def all_finite(f):
    names = ("quaternion", "bias", "bias_sigma", "gyro_matrix", "tilt_sigma", "heading_sigma")
    return all(np.all(np.isfinite(getattr(f, name))) for name in names)


def filtered(gyro, accel, mag=None, **more):
    f = zr.Attitude(RATE, mag=mag is not None)
    q = f.process(gyro, accel, mag, **more)
    assert np.all(np.abs(np.sum(q**2, axis=1) - 1.0) < 1e-9)
    assert all_finite(f)
    assert zr.Attitude.from_bytes(f.to_bytes()).to_bytes() == f.to_bytes()
    return f


class TestSensors:
    def test_upside_down(self):
        """From the first sample on, and on the way there and through."""
        assert filtered(STILL, -LEVEL, FIELD).up == pytest.approx([0.0, 0.0, -1.0])
        angle = np.linspace(0.0, 2.5 * np.pi, N)
        rate = np.gradient(angle) * RATE
        way = Rotation.from_rotvec(angle[:, None] * [1.0, 0.0, 0.0]).inv()
        gyro = rate[:, None] * [1.0, 0.0, 0.0]
        f = filtered(gyro, way.apply(LEVEL), way.apply(FIELD))
        # The rate between two samples is that of their middle.
        assert f.up == pytest.approx([0.0, 1.0, 0.0], abs=5e-3)

    def test_no_force_is_a_missing_one(self):
        """As NaN: an accelerometer that is not there, or free fall."""
        silent = filtered(STILL, np.full((N, 3), np.nan))
        falling = filtered(STILL, STILL)
        assert falling.to_bytes() == silent.to_bytes()
        assert falling.status == "starting"
        assert np.all(np.isnan(falling.linear_acceleration))

    def test_free_fall_goes_by_the_gyro_alone(self):
        """Three seconds of it, in which the body turns by half a turn."""
        gyro, accel = np.tile([np.pi / 3.0, 0.0, 0.0], (300, 1)), np.zeros((300, 3))
        f = filtered(STILL, LEVEL, FIELD)
        known = f.tilt_sigma
        f.process(gyro, accel)
        # What the matrix of the gyro may be off by, and the bias.
        assert f.up == pytest.approx([0.0, 0.0, -1.0], abs=1e-2)
        assert known < f.tilt_sigma < 5.0 * DEG

    def test_a_stuck_sensor_turns_until_it_is_at_rest(self):
        """A rate that never changes while gravity and field stand still is a bias."""
        f = filtered(np.full((N, 3), 0.05), LEVEL, FIELD)
        np.testing.assert_allclose(f.bias, 0.05, atol=1e-3)
        assert f.at_rest
        assert f.up == pytest.approx([0.0, 0.0, 1.0], abs=5e-3)

    def test_a_stuck_accelerometer_does_not_hold_the_sensor(self):
        """A body that turns a quarter is known to do so, until it seems to rest, level."""
        gyro = np.zeros((650, 3))
        gyro[500:600, 0] = np.pi / 2.0
        f = filtered(gyro, LEVEL[:650])
        angle = np.arccos(f.up[2])
        assert 20.0 * DEG < angle < 91.0 * DEG
        assert f.tilt_sigma > 0.5 * DEG

    @pytest.mark.parametrize("size", [35.0, 900.0])
    def test_saturation(self, size):
        """Of all axes, of either sign, and a recovery once it is over."""
        rng = np.random.default_rng(1)
        gyro, accel = STILL.copy(), LEVEL.copy()
        gyro[500:1000] = size * rng.choice([-1.0, 1.0], (500, 3))
        accel[500:1000] = 0.17 * size * rng.choice([-1.0, 1.0], (500, 3))
        f = filtered(gyro, accel, FIELD)
        assert f.up == pytest.approx([0.0, 0.0, 1.0], abs=0.05)

    @pytest.mark.parametrize("size", [1e150, -1e150, 1e-150, 5e-324, 1e306])
    def test_of_every_size(self, size):
        """What no body feels is missing, what is next to nothing is nothing."""
        f = filtered(STILL + size, LEVEL * size, FIELD * size)
        assert f.status == ("starting" if abs(size) > 1.0 else f.status)
        g = filtered(STILL, LEVEL, FIELD)
        before = g.quaternion
        g.process(np.full((5, 3), size), np.full((5, 3), size), np.full((5, 3), size))
        np.testing.assert_allclose(g.quaternion, before, atol=1e-6)

    def test_a_field_that_turns_with_the_sensor(self):
        """A magnet on the case: the heading suffers, the tilt does not know of it."""
        gyro = np.tile([0.0, 0.0, 0.5], (N, 1))
        f = filtered(gyro, LEVEL, np.full((N, 3), 50.0))
        alone = zr.Attitude(RATE)
        alone.process(gyro, LEVEL, np.full((N, 3), np.nan))
        np.testing.assert_allclose(f.up, alone.up, atol=1e-14)
        np.testing.assert_array_equal(f.bias, alone.bias)
        assert f.tilt_sigma == alone.tilt_sigma

    @pytest.mark.parametrize("sign", [-1.0, 1.0])
    def test_a_field_along_gravity_tells_no_heading(self, sign):
        f = filtered(STILL, LEVEL, sign * 5.0 * LEVEL)
        assert f.heading_sigma > 3.0
        np.testing.assert_allclose(f.up, [0.0, 0.0, 1.0], atol=1e-12)

    @pytest.mark.filterwarnings("error")
    @pytest.mark.parametrize("call", ["process", "trace"])
    def test_a_warning_that_is_an_error_loses_no_samples(self, call):
        """Nobody gets the answers, so nothing has been asked."""
        f = zr.Attitude(RATE)
        f.process(STILL[:10], LEVEL[:10], FIELD[:10])
        before = f.to_bytes()
        with pytest.raises(UserWarning, match="is accel_unit right"):
            getattr(f, call)(STILL, LEVEL / 9.81, FIELD)
        assert f.to_bytes() == before

    def test_gravity_in_another_unit(self):
        f = zr.Attitude(RATE)
        with pytest.warns(UserWarning, match="shows 1.000 m/s.2 at rest, gravity is 9.81"):
            f.process(STILL, LEVEL / 9.81, FIELD)
        assert f.status == "wrong unit"
        with pytest.warns(UserWarning, match="is accel_unit right"):
            zr.Attitude(RATE, accel_unit="g").trace(STILL, LEVEL, FIELD)
        # Within what a poor accelerometer shows.
        filtered(STILL, LEVEL * 1.04, FIELD)


def message(text):
    return "^" + re.escape(text)


ONE = [0.0, 0.0, 1.0]


class TestCalls:
    @pytest.mark.parametrize(
        ("sensors", "words"),
        [
            ((np.zeros((5, 2)), np.zeros((5, 3))), "gyro must have shape (n, 3), got (5, 2)"),
            ((np.zeros((5, 3)), np.zeros((4, 3))), "accel must have as many samples as gyro, 5"),
            ((np.zeros((5, 3)), np.zeros(3)), "accel must have shape (n, 3), got (3,)"),
            ((np.zeros((5, 3)), np.zeros((5, 3)), np.zeros((5, 1))), "mag must have shape (n, 3)"),
            ((np.zeros((5, 3)), np.zeros((5, 3)), np.zeros((6, 3))), "mag must have as many"),
            ((np.zeros((5, 3)), "level"), "accel must hold real numbers"),
            ((np.zeros((5, 3), complex), np.zeros((5, 3))), "gyro must hold real numbers"),
        ],
    )
    def test_shapes(self, sensors, words):
        for call in (zr.Attitude(RATE).process, zr.Attitude(RATE).trace, zr.Attitude(RATE).smooth):
            with pytest.raises((ValueError, TypeError), match=message(words)):
                call(*sensors)

    def test_out(self):
        expected = zr.Attitude(RATE).process(STILL, LEVEL)
        f, out = zr.Attitude(RATE), np.empty((N, 8))[:, ::2]
        with pytest.raises(ValueError, match=message("out must be a writeable float64 array of")):
            f.process(STILL, LEVEL, out=np.empty((N, 3)))
        assert f.samples_seen == 0
        assert f.process(STILL, LEVEL, out=out) is out
        np.testing.assert_array_equal(out, expected)

    def test_shapes_of_one_sample(self):
        f = zr.Attitude(RATE)
        with pytest.raises(ValueError, match=message("accel must have shape (3,), got (2,)")):
            f.update(ONE, [1.0, 2.0])
        several = zr.Attitude(RATE, channels=2)
        with pytest.raises(ValueError, match=message("gyro must have shape (2, 3), got (3,)")):
            several.update(ONE, ONE)
        assert f.samples_seen == several.samples_seen == 0

    def test_six_or_nine_floats(self):
        one, other = zr.Attitude(RATE), zr.Attitude(RATE)
        gyro, accel, mag = [0.1, 0.2, 0.3], [0.4, 0.5, 9.7], [1.0, 20.0, -40.0]
        for _ in range(30):
            np.testing.assert_array_equal(
                one.update(*gyro, *accel, *mag, dt=0.02), other.update(gyro, accel, mag, dt=0.02)
            )
            np.testing.assert_array_equal(one.update(*gyro, *accel), other.update(gyro, accel))
        for count in (4, 5, 7, 8, 10):
            with pytest.raises(TypeError, match="six or nine floats, got"):
                one.update(*np.ones(count))

    def test_a_field_for_a_filter_without_magnetometer(self):
        f, rows = zr.Attitude(RATE, mag=False), np.ones((4, 3))
        for g in (f, f.copy(), zr.Attitude.from_bytes(f.to_bytes())):
            for call in (g.process, g.trace, g.smooth):
                with pytest.raises(ValueError, match="mag is given, but this Attitude has mag=F"):
                    call(rows, rows, rows)
            with pytest.raises(ValueError, match="mag is given"):
                g.update(ONE, ONE, ONE)

    @pytest.mark.parametrize("dt", [-0.25, -1.0, -12.0, -np.inf])
    def test_a_clock_that_is_set_back_is_a_gap(self, dt):
        rows = np.ones((4, 3))
        f = zr.Attitude(RATE)
        f.process(rows, rows)
        before = f.heading_sigma, f.tilt_sigma
        steps = [0.01, 0.01, dt, 0.01]
        g = f.copy()
        f.process(rows, rows, dt=steps)
        assert (f.heading_sigma, f.tilt_sigma) > before
        each = [g.update(rows[0], rows[0], dt=step) for step in steps]
        np.testing.assert_array_equal(each[-1], f.quaternion)
        assert np.isfinite(zr.Attitude(RATE).smooth(rows, rows, dt=steps)["quaternion"]).all()

    def test_as_many_times_as_samples(self):
        rows = np.ones((4, 3))
        with pytest.raises(ValueError, match=message("dt must have shape (4,), got (3,)")):
            zr.Attitude(RATE).process(rows, rows, dt=np.zeros(3))

    @pytest.mark.parametrize(
        ("arguments", "words"),
        [
            ({"rate": 0.0}, "rate must be a positive number"),
            ({"rate": np.nan}, "rate must be a positive number"),
            ({"frame": "xyz"}, "frame must be 'enu', 'ned' or 'nwu', got 'xyz'"),
            ({"gyro_unit": "m"}, "gyro_unit must be a unit such as 'rad/s', got 'm'"),
            ({"accel_unit": "deg"}, "accel_unit must be a unit such as 'm/s^2', got 'deg'"),
            ({"channels": 0}, "channels must be at least 1, got 0"),
            ({"bias": [1.0, 2.0]}, "bias must have shape (3,), got (2,)"),
            ({"bias_sigma": -1.0}, "bias_sigma must be a positive rate"),
            ({"bias": [11.0, 0.0, 0.0]}, "bias must be a rate of at most 10 rad/s, got 11.0"),
        ],
    )
    def test_arguments_of_the_class(self, arguments, words):
        with pytest.raises(ValueError, match=message(words)):
            zr.Attitude(**{"rate": RATE, **arguments})

    def test_an_unknown_method(self):
        with pytest.raises(ValueError, match=r"^method must be .*'auto'.*, got 'guess'$"):
            zr.Attitude(RATE, method="guess")

    @pytest.mark.parametrize(
        ("orientation", "sigmas", "words"),
        [
            ([1.0, 0.0, 0.0], {}, "orientation must have shape (4,), got (3,)"),
            ([0.0] * 4, {}, "orientation must be a quaternion of length 1"),
            ([np.nan, 0.0, 0.0, 1.0], {}, "orientation must be a quaternion of length 1"),
            ([1.0, 0.0, 0.0, 0.0], {"tilt_sigma": 0.0}, "tilt_sigma must be an angle above 0"),
            ([1.0, 0.0, 0.0, 0.0], {"heading_sigma": 4.0}, "heading_sigma must be an angle"),
        ],
    )
    def test_what_it_cannot_go_on_from(self, orientation, sigmas, words):
        f = zr.Attitude(RATE)
        with pytest.raises(ValueError, match=message(words)):
            f.align(orientation, **sigmas)


def hand(seed, **changed):
    motion = zr.simulate_motion("hand", RATE, 60.0, seed=seed, start="rest")
    sensors = {"gyro": motion.gyro, "accel": motion.accel, "mag": motion.mag}
    return motion, sensors | {name: change(sensors[name]) for name, change in changed.items()}


def off(motion, q):
    """Angle to the true orientation of each sample, deg."""
    return 2.0 * np.arccos(np.abs(np.sum(q * motion.quaternion, axis=1)).clip(0.0, 1.0)) / DEG


class TestZerosOfTheGyro:
    """They are missing samples where the sensor has others at rest, and a rate where it has not."""

    @pytest.mark.every(3)
    @pytest.mark.parametrize("method", ["auto", "mahony", "ekf"])
    @pytest.mark.parametrize("first", [2000, 3500])
    def test_in_motion_they_are_missing(self, method, first):
        def without(value):
            def change(gyro):
                gyro = gyro.copy()
                gyro[first : first + 200] = value
                return gyro

            return change

        (motion, zeros), (_, gap) = hand(1, gyro=without(0.0)), hand(1, gyro=without(np.nan))
        found, expected = (zr.Attitude(RATE, method=method).process(**one) for one in (zeros, gap))
        assert np.abs(motion.gyro[first - 1]).max() > 5.0 * DEG
        np.testing.assert_array_equal(found, expected)

    def test_of_a_perfect_gyro_they_are_a_rate(self):
        """A simulated sensor that rests, turns at once by a quarter, and rests."""
        gyro = STILL.copy()
        gyro[500:600, 2] = np.pi / 2.0
        f = filtered(gyro, LEVEL)
        assert f.euler == pytest.approx([0.0, 0.0, np.pi / 2.0], abs=1e-3)
        assert f.status == "at rest"

    def test_of_a_gyro_with_a_dead_band_they_are_a_rate(self):
        """It gives nothing below a degree per second: rests within and after a slow turn."""
        rate = np.maximum(np.sin(np.arange(N) / 200.0) * 20.0 * DEG, 0.0)
        band = np.where(rate < DEG, 0.0, rate)
        q = zr.Attitude(RATE, mag=False).process(np.outer(band, [0.0, 0.0, 1.0]), LEVEL)
        yaw = np.unwrap(2.0 * np.arctan2(q[:, 3], q[:, 0]))
        # It stands below a degree per second for a tenth of a second, at the edges of the turns.
        np.testing.assert_allclose(yaw, np.cumsum(rate) / RATE, atol=2.0 * DEG)

    def test_a_gyro_that_is_zero_for_ever_is_one_at_rest(self):
        f = filtered(STILL, LEVEL, FIELD)
        assert f.status == "at rest"
        assert f.heading_sigma < 5.0 * DEG


class TestSpikesOfTheMagnetometer:
    @pytest.mark.every(3)
    @pytest.mark.parametrize("seed", range(4))
    @pytest.mark.parametrize("strength", [800.0, 0.5])
    def test_a_hundredth_of_the_samples_moves_nothing(self, seed, strength):
        rng = np.random.default_rng(seed)

        def spikes(mag):
            mag, rows = mag.copy(), rng.random(len(mag)) < 0.01
            rows[seed] = True
            towards = rng.normal(size=(rows.sum(), 3))
            mag[rows] = strength * towards / np.linalg.norm(towards, axis=1, keepdims=True)
            return mag

        (motion, usual), (_, spoilt) = hand(seed), hand(seed, mag=spikes)
        clean, found = (zr.Attitude(RATE).process(**one) for one in (usual, spoilt))
        # From the first second on, as without them.
        assert off(motion, found)[100:].max() < max(1.2 * off(motion, clean)[100:].max(), 10.0)

    def test_a_magnet_that_comes_stays_disturbing(self):
        """What lasts is no spike: it is seen, and said."""
        motion, sensors = hand(2)
        sensors["mag"] = sensors["mag"].copy()
        sensors["mag"][4000:5000] += [0.0, 0.0, 300.0]
        trace = zr.Attitude(RATE).trace(**sensors)
        assert trace["disturbed"][4020:5000].all()
        assert off(motion, trace["quaternion"])[1000:].max() < 10.0
