"""Delay, the low-pass filter of the same delay, and errors in motion: closed forms, plain loops."""

import math

import numpy as np
import pytest

from support.signals import RATE, motion, white
from zerorate import metrics
from zerorate.metrics.motion import shift_samples

T = np.arange(0.0, 60.0, 1.0 / RATE)


@pytest.mark.parametrize("samples", [0.0, 0.3, 1.0, 12.5, 60.75, -20.4])
def test_delay_of_a_smooth_signal(samples):
    t = np.arange(5000) / RATE
    measured = metrics.delay(motion(t), motion(t - samples / RATE), RATE)
    # The misfit is a parabola to (5.3/100)^2/12 = 2e-4 of the part below a sample.
    assert measured * RATE == pytest.approx(samples, abs=2e-4)


@pytest.mark.parametrize("unit", [1.0, 1e-170, 1e150])
def test_delay_sees_neither_offset_nor_gain_nor_gaps(unit):
    t = np.arange(5000) / RATE
    reference, estimate = unit * motion(t), unit * (3.0 + 0.4 * motion(t - 0.08))
    reference[100:130], estimate[[900, 2000]] = np.nan, np.inf
    # Gaps cover other samples at other lags: the parabola's two sides differ by 1 in 1000.
    assert metrics.delay(reference, estimate, RATE) * RATE == pytest.approx(8.0, abs=2e-3)


def test_delay_of_a_series_that_moves_only_outside_the_overlap():
    reference, estimate = white(100), np.zeros(100)
    estimate[0] = 1.0
    with pytest.raises(ValueError, match=r"end of the range|no lag fits"):
        metrics.delay(reference, estimate, RATE, 0.1)


def test_delay_of_series_never_present_together():
    reference, estimate = white(100), white(100)
    reference[50:], estimate[:90] = np.nan, np.nan
    with pytest.raises(ValueError, match=r"end of the range|no lag fits"):
        metrics.delay(reference, estimate, RATE, 0.1)


def test_delay_in_noise():
    t = np.arange(20_000) / RATE
    reference = motion(t)
    estimate = motion(t - 0.07) + 0.1 * white(t.size)
    # Cramer-Rao: 0.1/sqrt(n * mean square of the slope, 5.5) = 3e-4 s; five of them.
    assert metrics.delay(reference, estimate, RATE) == pytest.approx(0.07, abs=1.5e-3)


@pytest.mark.parametrize("max_delay", [0.02, 0.3, 5.0, 30.0])
def test_delay_does_not_depend_on_the_search(max_delay):
    # 30 s need longer blocks than the rest, 20000 samples need several of the short ones.
    t = np.arange(20_000) / RATE
    reference = np.cumsum(white(t.size))
    assert metrics.delay(reference, np.roll(reference, 1), RATE, max_delay) == pytest.approx(
        1.0 / RATE,
        abs=1e-4,  # The curvature's two sides differ by the chance of 20000 steps, 1/sqrt(20000).
    )


def test_delay_of_the_equal_delay_lowpass():
    t = np.arange(20_000) / RATE
    slow = np.sin(0.5 * t)
    filtered = metrics.equal_delay_lowpass(slow, RATE, 0.05)
    # A one-pole's delay falls by (w D)^2/3 = 2e-4 of itself at this frequency.
    assert metrics.delay(slow, filtered, RATE) == pytest.approx(0.05, rel=1e-3)


@pytest.mark.parametrize(
    ("reference", "estimate", "max_delay", "message"),
    [
        (np.ones(100), white(100), 0.1, "reference is constant"),
        (white(100), np.ones(100), 0.1, "estimate is constant"),
        (white(100), white(100), 0.5, "less than half the record's 100"),
        (white(100), white(100), 0.004, "at least 1"),
        (white(100), white(100), -1.0, "max_delay must be positive"),
        (np.arange(100.0), np.arange(100.0), 0.1, "no lag fits clearly|end of the range"),
        (motion(np.arange(300) / RATE), -motion(np.arange(300) / RATE), 0.1, "end of the range"),
    ],
)
def test_delay_refusals(reference, estimate, max_delay, message):
    with pytest.raises(ValueError, match=message):
        metrics.delay(reference, estimate, RATE, max_delay)


@pytest.mark.parametrize("delay", [0.0, 0.003, 0.05, 2.0])
def test_lowpass_of_a_ramp_lags_by_the_delay(delay):
    ramp = np.arange(20_000) / RATE
    lag = ramp - metrics.equal_delay_lowpass(ramp, RATE, delay)
    # What is left of the start, exp(-100), and rounding of times up to 200.
    assert lag[-1] == pytest.approx(delay, abs=1e-11)


@pytest.mark.parametrize("delay", [0.0, 1e-5, 0.01, 0.5, 100.0])
def test_lowpass_equals_the_plain_recursion(delay):
    z = white(3000, channels=2) + 10.0
    a = delay * RATE / (1.0 + delay * RATE)
    expected = np.empty_like(z)
    y = z[0]
    for k, sample in enumerate(z):
        y = a * y + (1.0 - a) * sample
        expected[k] = y
    # Rounding of numbers near 10, summed with weights that add to 1.
    np.testing.assert_allclose(
        metrics.equal_delay_lowpass(z, RATE, delay), expected, rtol=0.0, atol=1e-12
    )


def test_lowpass_holds_through_missing_samples():
    z = white(50)
    z[[0, 1, 20, 21, 49]] = [np.nan, np.inf, np.nan, -np.inf, np.nan]
    there = np.isfinite(z)
    y = metrics.equal_delay_lowpass(z, RATE, 0.05)
    assert np.isnan(y[:2]).all()
    np.testing.assert_array_equal(y[there], metrics.equal_delay_lowpass(z[there], RATE, 0.05))
    assert y[20] == y[21] == y[19]
    assert y[49] == y[48]
    assert np.isnan(metrics.equal_delay_lowpass([np.nan, np.nan], RATE, 0.05)).all()


@pytest.mark.parametrize("delay", [0.0, 0.1])
def test_lowpass_keeps_a_constant_and_the_input(delay):
    z = np.full((20, 2), 0.1)
    y = metrics.equal_delay_lowpass(z, RATE, delay)
    np.testing.assert_array_equal(y, z)
    assert y.shape == z.shape
    assert not np.shares_memory(y, z)


@pytest.mark.parametrize("delay", [-0.1, math.nan, math.inf])
def test_lowpass_refuses_a_delay_that_is_none(delay):
    with pytest.raises(ValueError, match="delay must be finite and not negative"):
        metrics.equal_delay_lowpass(white(10), RATE, delay)


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
            ((motion(T), motion(T), -1.0), "rate must be a positive finite number"),
            ((motion(T), motion(T), RATE, 1.0, np.zeros(5)), "reference and raw"),
        ],
    )
    def test_refusals(self, arguments, match):
        with pytest.raises(ValueError, match=match):
            metrics.motion_error(*arguments)

    @pytest.mark.parametrize("samples", [-2.7, -1.0, 0.0, 0.25, 3.0])
    def test_a_cubic_is_moved_exactly(self, samples):
        t = np.arange(20.0)
        later = shift_samples(t**3 - 5.0 * t, samples)
        inside = np.isfinite(later)
        assert inside.sum() >= 14
        expected = (t - samples) ** 3 - 5.0 * (t - samples)
        # Weights near 1 of numbers up to 7000.
        np.testing.assert_allclose(later[inside], expected[inside], atol=1e-11)
