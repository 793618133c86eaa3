"""Errors in motion and in orientation, against closed forms."""

import math

import numpy as np
import pytest

from zerorate import metrics
from zerorate.metrics import rotations
from zerorate.metrics.motion import moved

RATE = 100.0
T = np.arange(0.0, 60.0, 1.0 / RATE)


def motion(t):
    return np.sin(2.0 * t) + 0.5 * np.cos(5.3 * t + 0.4)


def quaternion(axis, angle):
    return np.array([math.cos(angle / 2.0), *(math.sin(angle / 2.0) * np.array(axis))])


class TestMotionError:
    def test_a_delayed_motion(self):
        found = metrics.motion_error(motion(T), motion(T - 0.073), RATE)
        # The lag is that of a parabola through three misfits of a curve that is not quite one.
        assert found.delay == pytest.approx(0.073, abs=1e-4)
        assert found.rmse == pytest.approx(metrics.rmse(motion(T), motion(T - 0.073)), rel=1e-15)
        # The motion's slope of some 3 a second, times the error of the lag.
        assert found.rmse_undelayed < 3e-4
        assert math.isnan(found.rmse_lowpass)

    def test_noise_is_not_averaged_by_removing_the_delay(self):
        noise = 0.1 * np.random.default_rng(1).standard_normal(T.size)
        found = metrics.motion_error(motion(T), motion(T - 0.075) + noise, RATE)
        # Half a sample between two: a straight line through the estimate would leave 0.07. The
        # deviation of a deviation of 6000 samples is 1 %, and the lag's error adds less.
        assert found.rmse_undelayed == pytest.approx(0.1, rel=0.03)

    def test_the_low_pass_has_the_same_delay(self):
        raw = motion(T) + 0.1 * np.random.default_rng(1).standard_normal(T.size)
        found = metrics.motion_error(
            motion(T), metrics.equal_delay_lowpass(raw, RATE, 0.03), RATE, raw=raw
        )
        smooth = metrics.equal_delay_lowpass(raw, RATE, found.delay)
        assert found.rmse_lowpass == metrics.rmse(motion(T), smooth)
        # The one-pole filter delays fast motion a little less than slow motion.
        assert found.delay == pytest.approx(0.03, rel=0.05)

    def test_an_estimate_that_leads_is_compared_with_the_raw_signal(self):
        found = metrics.motion_error(motion(T), motion(T + 0.05), RATE, raw=motion(T) + 0.5)
        assert found.delay == pytest.approx(-0.05, abs=1e-4)  # as above
        assert found.rmse_lowpass == pytest.approx(0.5, rel=1e-12)

    def test_no_delay_can_be_seen_in_a_constant(self):
        found = metrics.motion_error(motion(T), np.zeros(T.size), RATE, raw=motion(T))
        assert found.rmse == pytest.approx(math.sqrt(np.mean(motion(T) ** 2)), rel=1e-12)
        assert np.isnan([found.delay, found.rmse_undelayed, found.rmse_lowpass]).all()

    def test_channels_are_measured_alone(self):
        x = np.column_stack((motion(T), motion(1.1 * T)))
        y = np.column_stack((motion(T - 0.02), np.zeros(T.size)))
        both = metrics.motion_error(x, y, RATE, raw=x)
        for i in range(2):
            alone = metrics.motion_error(x[:, i], y[:, i], RATE, raw=x[:, i])
            for name in ("rmse", "delay", "rmse_undelayed", "rmse_lowpass"):
                np.testing.assert_array_equal(getattr(both, name)[i], getattr(alone, name))

    def test_missing_samples_are_left_out(self):
        x, y = motion(T), motion(T - 0.073)
        y[100:150] = np.nan
        x[3000] = np.inf
        found = metrics.motion_error(x, y, RATE)
        assert found.delay == pytest.approx(0.073, abs=1e-4)  # as above
        assert found.rmse_undelayed < 3e-4

    @pytest.mark.parametrize(
        ("arguments", "match"),
        [
            ((np.zeros(9), np.zeros(8), RATE), "must have the same shape"),
            ((motion(T), motion(T), RATE, 1e-5), "max_delay"),
            ((motion(T), motion(T), RATE, 50.0), "max_delay"),
            ((motion(T), motion(T), -1.0), "rate must be positive"),
            ((motion(T), motion(T), RATE, 1.0, np.zeros(5)), "reference and raw"),
        ],
    )
    def test_refusals(self, arguments, match):
        with pytest.raises(ValueError, match=match):
            metrics.motion_error(*arguments)

    @pytest.mark.parametrize("samples", [-2.7, -1.0, 0.0, 0.25, 3.0])
    def test_a_cubic_is_moved_exactly(self, samples):
        t = np.arange(20.0)
        later = moved(t**3 - 5.0 * t, samples)
        inside = np.isfinite(later)
        assert inside.sum() >= 14
        expected = (t - samples) ** 3 - 5.0 * (t - samples)
        # Weights near 1 of numbers up to 7000.
        np.testing.assert_allclose(later[inside], expected[inside], atol=1e-11)


def turning(rates, rate=RATE):
    """Return the exact orientation of body rates that are constant over each sample."""
    q, path = np.array([1.0, 0.0, 0.0, 0.0]), []
    for w in rates:
        size = np.linalg.norm(w)
        step = quaternion(w / size, size / rate) if size else np.array([1.0, 0.0, 0.0, 0.0])
        q = rotations.product(q, step)
        path.append(q)
    return np.array(path)


def body_rates(n=3000):
    t = np.arange(n) / RATE
    return np.column_stack((np.sin(t), 0.7 * np.cos(1.7 * t), 0.3 + 0.0 * t))


class TestOrientationErrorGrowth:
    def test_perfect_rates_have_no_error(self):
        rates = body_rates()
        growth = metrics.orientation_error_growth(rates, turning(rates), RATE, (1.0, 10.0))
        # Thousands of products, each rounded.
        assert (growth < 1e-12).all()

    def test_a_bias_about_the_axis_of_turning_grows_with_time(self):
        rates = np.tile([0.0, 0.0, 1.2], (3000, 1))
        growth = metrics.orientation_error_growth(
            rates + np.array([0.0, 0.0, 0.01]), turning(rates), RATE, (1.0, 20.0)
        )
        # Thousands of products, each rounded.
        np.testing.assert_allclose(growth, [0.01, 0.2], rtol=1e-11)

    def test_the_world_of_the_reference_does_not_matter(self):
        rates = body_rates()
        north = quaternion([0.6, 0.0, 0.8], 2.0)
        path = turning(rates)
        wrong = rates + np.array([0.01, -0.02, 0.005])
        here = metrics.orientation_error_growth(wrong, path, RATE, (10.0,))
        there = metrics.orientation_error_growth(
            wrong, -3.0 * rotations.product(north, path), RATE, (10.0,)
        )
        np.testing.assert_allclose(here, there, rtol=1e-10)  # as above
        # No angle can grow faster than the size of the wrong rate.
        assert 0.0 < here[0] <= 10.0 * np.linalg.norm([0.01, -0.02, 0.005])

    def test_windows_with_gaps_are_left_out(self):
        rates = body_rates()
        path = turning(rates)
        wrong = rates + np.array([0.0, 0.0, 0.01])
        clean = metrics.orientation_error_growth(wrong[:2000], path[:2000], RATE, (1.0,))
        wrong[2000:] = 50.0
        wrong[2000] = np.nan
        path[2001:] = np.nan
        gappy = metrics.orientation_error_growth(wrong, path, RATE, (1.0,))
        np.testing.assert_allclose(gappy, clean, rtol=1e-10)  # as above

    def test_long_records_equal_a_loop(self):
        rates = body_rates(700)
        steps = rotations.of_rotation_vectors(rates / RATE)
        # Seven hundred products, each rounded.
        np.testing.assert_allclose(rotations.cumulative_product(steps), turning(rates), atol=1e-13)

    @pytest.mark.parametrize(
        ("change", "match"),
        [
            ({"rates": np.zeros((10, 2))}, r"rates must have shape \(n, 3\)"),
            ({"quaternions": np.zeros((10, 3))}, r"quaternions must have shape \(n, 4\)"),
            ({"quaternions": np.zeros((9, 4))}, "of one length, got 10 and 9"),
            ({"horizons": (60.0,)}, "less than the record's 10"),
            ({"horizons": (-1.0,)}, "horizon must be positive"),
            ({"every": 0.0}, "every must be positive"),
            ({"quaternions": np.zeros((10, 4))}, "no window of 0.05 s"),
        ],
    )
    def test_refusals(self, change, match):
        arguments = {
            "rates": np.zeros((10, 3)),
            "quaternions": np.tile([1.0, 0.0, 0.0, 0.0], (10, 1)),
            "rate": RATE,
            "horizons": (0.05,),
        }
        with pytest.raises(ValueError, match=match):
            metrics.orientation_error_growth(**arguments | change)
