"""Measures at rest: closed forms, plain loops, refusals."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from support.signals import RATE, white
from zerorate import allan, metrics


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
        (0.0, 0.1, "rate must be a positive finite number"),
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


class TestAllanRatio:
    def test_of_a_low_pass_filter_is_one_beyond_its_memory(self):
        z = white(400_000)
        found = metrics.allan_ratio(z, metrics.equal_delay_lowpass(z, RATE, 0.2), RATE, 0.2)
        assert found.taus[0] == 2.56
        # At tau the filter keeps 1 - 3 memory / (2 tau) of the variance; the longer, the nearer to
        # one. Both series are of one noise, so their ratio is far surer than either.
        assert found.ratio[0] == pytest.approx(math.sqrt(1.0 - 0.3 / 2.56), abs=0.01)
        assert found.ratio[3] == pytest.approx(1.0, abs=0.02)

    def test_it_is_the_ratio_of_two_curves(self):
        z = white(5000, channels=2)
        y = np.cumsum(z, axis=0)
        found = metrics.allan_ratio(z, y, RATE, 0.0)
        before, after = allan(z, RATE, taus=found.taus), allan(y, RATE, taus=found.taus)
        np.testing.assert_array_equal(found.ratio, after.deviation / before.deviation)
        assert found.ratio.shape == (found.taus.size, 2)

    def test_samples_missing_in_one_are_left_out_of_both(self):
        z, y = white(1000), 2.0 * white(1000)
        y[300] = np.nan
        # A factor of two is exact in every operation.
        assert metrics.allan_ratio(z, y, RATE, 0.1).ratio.tolist() == [2.0]

    @pytest.mark.parametrize("memory", [0.3, math.inf])
    def test_a_memory_too_long_for_the_record_is_refused(self, memory):
        with pytest.raises(ValueError, match="must not exceed a quarter"):
            metrics.allan_ratio(white(1000), white(1000), RATE, memory)

    @pytest.mark.parametrize("memory", [-1.0, math.nan])
    def test_other_refusals(self, memory):
        with pytest.raises(ValueError, match="time_constant must not be negative"):
            metrics.allan_ratio(white(1000), white(1000), RATE, memory)
