"""Metrics against closed forms, plain loops and their refusals."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from zerorate import metrics

RATE = 100.0


def white(n, *, seed=1, channels=None):
    return np.random.default_rng(seed).standard_normal(n if channels is None else (n, channels))


def smooth(t):
    return np.sin(2.0 * t) + 0.5 * np.cos(5.3 * t + 0.4)


TWO_ARRAYS = {
    "reduction": metrics.reduction,
    "mean_shift": metrics.mean_shift,
    "rmse": metrics.rmse,
    "regret": lambda x, y: metrics.regret(y, x, 1.1 * np.asarray(x)),
    "coasting_error": lambda x, y: metrics.coasting_error(x, y, RATE, 0.1),
    "delay": lambda x, y: metrics.delay(x, y, RATE, 0.1),
    "nis": lambda x, y: metrics.nis(x, np.asarray(y) ** 2 + 1.0),
    "coverage": lambda x, y: metrics.coverage(x, np.abs(y)),
    "settling_time": lambda x, y: metrics.settling_time(x, y, 0.4, RATE),
    "motion_error": lambda x, y: metrics.motion_error(x, y, RATE, 0.1, raw=x).rmse_lowpass,
    "best_ema": lambda x, y: metrics.best_ema(x, RATE, truth=y).error,
}
BY_NAME = pytest.mark.parametrize("metric", TWO_ARRAYS.values(), ids=TWO_ARRAYS)


@BY_NAME
def test_channels_are_measured_alone(metric):
    x = np.cumsum(white(500, channels=3), axis=0)
    y = x + 0.1 * white(500, seed=2, channels=3)
    together = metric(x, y)
    assert together.shape == (3,)
    assert together.tolist() == [metric(x[:, i], y[:, i]) for i in range(3)]
    assert type(metric(x[:, 0], y[:, 0])) is float


@BY_NAME
def test_any_array_like_and_layout(metric):
    x = np.cumsum(white(400)).round(1)
    y = np.roll(x, 2)
    expected = metric(x, y)
    assert metric(x.tolist(), y.tolist()) == expected
    assert metric(np.repeat(x, 2)[::2], y) == expected
    assert metric(x[:, None], y[:, None]).tolist() == [expected]


@BY_NAME
def test_shapes_must_agree(metric):
    with pytest.raises(ValueError, match="shape"):
        metric(np.ones((10, 2)), np.ones((10, 3)))
    with pytest.raises(ValueError, match="shape"):
        metric(np.ones((10, 2, 2)), np.ones((10, 2, 2)))


@BY_NAME
def test_empty_and_all_missing_are_refused(metric):
    with pytest.raises(ValueError, match="is empty"):
        metric([], [])
    with pytest.raises(ValueError, match=r"no sample is present|no window"):
        metric(np.full(100, np.nan), np.ones(100))


@BY_NAME
def test_infinite_is_missing(metric):
    x = np.cumsum(white(500))
    y = x + 0.1 * white(500, seed=2)
    as_nan, as_inf = x.copy(), x.copy()
    as_nan[[30, 200, 201]] = np.nan
    as_inf[[30, 200, 201]] = [np.inf, -np.inf, np.inf]
    assert metric(as_nan, y) == metric(as_inf, y)
    assert math.isfinite(metric(as_nan, y))


@pytest.mark.parametrize("factor", [0.0, 0.25, 1.0, -3.0])
def test_reduction_and_shift_of_a_scaled_signal(factor):
    z = white(1000) + 5.0
    # Two sums of 1000 terms each.
    assert metrics.reduction(z, factor * z) == pytest.approx(abs(factor), abs=1e-13)
    shift = (factor - 1.0) * z.mean() / z.std()
    assert metrics.mean_shift(z, factor * z) == pytest.approx(shift, rel=1e-12)


def test_missing_samples_leave_both_series():
    z, y = white(100), white(100, seed=2)
    z[3], y[7] = np.nan, np.inf
    keep = [i for i in range(100) if i not in (3, 7)]
    assert metrics.reduction(z, y) == metrics.reduction(z[keep], y[keep])
    assert metrics.mean_shift(z, y) == metrics.mean_shift(z[keep], y[keep])
    assert metrics.rmse(z, y) == metrics.rmse(z[keep], y[keep])


@pytest.mark.parametrize("metric", [metrics.reduction, metrics.mean_shift])
def test_a_constant_raw_signal_has_no_scale(metric):
    with pytest.raises(ValueError, match="raw is constant"):
        metric([0.1] * 30, white(30))


def test_rmse_of_an_offset_is_the_offset():
    x = white(100)
    assert metrics.rmse(x, x + 0.5) == pytest.approx(0.5, rel=1e-15 * 100)
    assert metrics.rmse(x, x) == 0.0


def test_regret_is_the_ratio_of_two_errors():
    truth, error = white(200), white(200, seed=2)
    # Differences of numbers near 1, and one square root.
    assert metrics.regret(truth + 3.0 * error, truth, truth + error) == pytest.approx(3, rel=1e-13)
    with pytest.raises(ValueError, match="optimal equals truth"):
        metrics.regret(truth + error, truth, truth)


def test_nis_of_an_honest_filter_is_one():
    n = 100_000
    variance = np.linspace(0.5, 4.0, n)
    # Deviation of the mean of n squared standard normals: sqrt(2/n) = 0.0045; five of them.
    assert metrics.nis(np.sqrt(variance) * white(n), variance) == pytest.approx(1.0, abs=0.023)


def test_nis_broadcasts_the_variance():
    e = white(50, channels=2)
    np.testing.assert_array_equal(metrics.nis(e, [1.0, 4.0]), metrics.nis(e, e * 0 + [1.0, 4.0]))
    with pytest.raises(ValueError, match="does not fit"):
        metrics.nis(e, np.ones(3))
    with pytest.raises(ValueError, match="must be positive"):
        metrics.nis(e, 0.0)


@pytest.mark.parametrize("error", [0.0, 0.25, -2.0])
def test_coasting_on_a_constant_bias_error(error):
    z = np.full(1000, 7.5)
    assert metrics.coasting_error(z, z + error, RATE, 2.0) == abs(error) * 2.0


def test_coasting_on_white_noise():
    sigma, horizon, n = 3.0, 0.5, 200_000
    measured = metrics.coasting_error(sigma * white(n), np.zeros(n), RATE, horizon)
    # Windows of 50 samples overlap: the mean square has the relative deviation of a triangular
    # correlation, sqrt(2 * 2/3 * 50 / n) = 0.018, its root half of that; five of them.
    assert measured == pytest.approx(sigma * math.sqrt(horizon / RATE), rel=0.046)


def test_coasting_on_a_ramp():
    slope, m, n = 0.5, 40, 500
    t = np.arange(n) / RATE
    # The held estimate of time t is right then; the ramp leaves slope dt^2 m (m + 1)/2.
    expected = slope / RATE**2 * m * (m + 1) / 2
    measured = metrics.coasting_error(3.0 + slope * t, 3.0 + slope * t, RATE, m / RATE)
    assert measured == pytest.approx(expected, rel=1e-10)


@pytest.mark.parametrize("gaps", [[], [0], [199], [50, 51, 52, 120]])
@pytest.mark.parametrize("lost_estimates", [[], [10, 60]])
def test_coasting_equals_the_plain_loop(gaps, lost_estimates):
    z, x, m = white(200) + 100.0, 100.0 + 0.1 * white(200, seed=2), 7
    z[gaps], x[lost_estimates] = np.nan, np.nan
    angles = [np.sum(z[t + 1 : t + m + 1] - x[t]) / RATE for t in range(200 - m)]
    expected = math.sqrt(np.nanmean(np.square(angles)))
    # Sums of 7 numbers near 100, against differences of sums of 200.
    assert metrics.coasting_error(z, x, RATE, m / RATE) == pytest.approx(expected, rel=1e-11)


def test_coasting_keeps_its_digits_far_from_zero():
    z, x = white(100_000), np.zeros(100_000)
    near = metrics.coasting_error(z, x, RATE, 1.0)
    # Adding 1e6 rounds each sample by 6e-11, random in sign.
    assert metrics.coasting_error(z + 1e6, x + 1e6, RATE, 1.0) == pytest.approx(near, rel=1e-9)


def test_coasting_without_a_complete_window():
    z = white(100)
    z[::5] = np.nan
    with pytest.raises(ValueError, match="no window"):
        metrics.coasting_error(z, np.zeros(100), RATE, 0.05)


@pytest.mark.parametrize(
    ("rate", "horizon", "message"),
    [
        (RATE, 1.0, "less than the record's 100"),
        (RATE, 0.004, "at least 1"),
        (RATE, -1.0, "horizon must be positive"),
        (RATE, math.nan, "horizon must be positive"),
        (0.0, 0.1, "rate must be positive"),
    ],
)
def test_coasting_refusals(rate, horizon, message):
    with pytest.raises(ValueError, match=message):
        metrics.coasting_error(white(100), white(100), rate, horizon)


@settings(derandomize=True)
@given(arrays(np.int64, 40, elements=st.integers(-(10**9), 10**9)), st.floats(1e-9, 1e9))
def test_coasting_scales_with_the_data(z, scale):
    once = metrics.coasting_error(z, np.zeros(40), 1.0, 5.0)
    scaled = metrics.coasting_error(scale * z, np.zeros(40), 1.0, 5.0)
    # Rounding is relative to the largest sample, not to a result that may cancel.
    assert scaled == pytest.approx(scale * once, rel=1e-9, abs=1e-11 * scale * np.abs(z).max())


@pytest.mark.parametrize("samples", [0.0, 0.3, 1.0, 12.5, 60.75, -20.4])
def test_delay_of_a_smooth_signal(samples):
    t = np.arange(5000) / RATE
    measured = metrics.delay(smooth(t), smooth(t - samples / RATE), RATE)
    # The misfit is a parabola to (5.3/100)^2/12 = 2e-4 of the part below a sample.
    assert measured * RATE == pytest.approx(samples, abs=2e-4)


@pytest.mark.parametrize("unit", [1.0, 1e-170, 1e150])
def test_delay_sees_neither_offset_nor_gain_nor_gaps(unit):
    t = np.arange(5000) / RATE
    reference, estimate = unit * smooth(t), unit * (3.0 + 0.4 * smooth(t - 0.08))
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
    reference = smooth(t)
    estimate = smooth(t - 0.07) + 0.1 * white(t.size)
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
        (smooth(np.arange(300) / RATE), -smooth(np.arange(300) / RATE), 0.1, "end of the range"),
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
