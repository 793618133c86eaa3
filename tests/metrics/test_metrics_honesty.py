"""Consistency, settling and slow noise, against hand-made cases."""

import math

import numpy as np
import pytest

from zerorate import allan, metrics

RATE = 100.0


def white(n, channels=None):
    return np.random.default_rng(1).standard_normal(n if channels is None else (n, channels))


class TestNis:
    def test_rest_and_motion_apart(self):
        innovation = np.concatenate((white(500), 10.0 * white(500)))
        resting = np.arange(1000) < 500
        parts = [metrics.nis(innovation, 2.0, where=mask) for mask in (resting, ~resting)]
        assert parts[0] == metrics.nis(innovation[:500], 2.0)
        assert parts[1] == metrics.nis(innovation[500:], 2.0)

    def test_one_mask_for_all_channels_or_one_each(self):
        e = white(100, channels=3)
        shared = np.arange(100) % 2 == 0
        own = np.column_stack((shared, ~shared, shared))
        assert metrics.nis(e, 1.0, where=shared).tolist() == metrics.nis(e[::2], 1.0).tolist()
        assert metrics.nis(e, 1.0, where=own)[1] == metrics.nis(e[1::2, 1], 1.0)

    @pytest.mark.parametrize(
        ("where", "match"),
        [
            (np.zeros(10, dtype=bool), "no sample is present"),
            (np.ones(9, dtype=bool), "must have the same shape"),
            (np.ones(10), "where must hold true and false"),
        ],
    )
    def test_refusals(self, where, match):
        with pytest.raises(ValueError, match=match):
            metrics.nis(white(10), 1.0, where=where)


class TestCoverage:
    def test_of_a_normal_distribution(self):
        # Of 40 000 independent errors the share's deviation is 0.0023: four of them.
        share = metrics.coverage(3.0 * white(40_000), np.full(40_000, 3.0))
        assert share == pytest.approx(math.erf(math.sqrt(0.5)), abs=0.0095)

    def test_missing_samples_are_left_out(self):
        error = [1.0, np.nan, 3.0, -1.0, 0.0]
        assert metrics.coverage(error, [2.0, 2.0, 2.0, np.inf, 0.0]) == 2.0 / 3.0

    def test_channels(self):
        assert metrics.coverage([[1.0, 3.0]], [[2.0, 2.0]]).tolist() == [1.0, 0.0]

    def test_a_negative_sigma_is_refused(self):
        with pytest.raises(ValueError, match="sigma must not be negative"):
            metrics.coverage([1.0], [-1.0])


class TestSettlingTime:
    def test_of_an_exponential(self):
        t = np.arange(1000) / RATE
        # exp(-t/0.5) falls below 0.01 after 2.303 s, seen at the next sample.
        settled = metrics.settling_time(1.0 - np.exp(-t / 0.5), 1.0, 0.01, RATE)
        assert settled == 2.31

    def test_the_last_exit_counts(self):
        assert metrics.settling_time([0.0, 0.0, 5.0, np.nan, 0.0, 0.0], 0.0, 1.0, 1.0) == 4.0

    def test_at_once_and_never(self):
        assert metrics.settling_time([np.nan, 0.5, 0.5], 0.0, 1.0, 1.0) == 1.0
        assert metrics.settling_time([0.5, 0.5, 2.0, np.nan], 0.0, 1.0, 1.0) == math.inf

    def test_channels_and_a_moving_target(self):
        drift = np.cumsum(white(50, channels=2), axis=0)
        wrong = drift.copy()
        wrong[:7, 0] += 3.0
        assert metrics.settling_time(wrong, drift, 1.0, 10.0).tolist() == [0.7, 0.0]

    @pytest.mark.parametrize(
        ("arguments", "match"),
        [
            (([1.0], [[1.0, 2.0]], 1.0, 1.0), "target of shape"),
            (([1.0], 1.0, 0.0, 1.0), "tolerance must be positive"),
            (([1.0], 1.0, 1.0, np.nan), "rate must be positive"),
            (([1.0], np.nan, 1.0, 1.0), "no sample is present"),
        ],
    )
    def test_refusals(self, arguments, match):
        with pytest.raises(ValueError, match=match):
            metrics.settling_time(*arguments)


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
        with pytest.raises(ValueError, match="memory must not be negative"):
            metrics.allan_ratio(white(1000), white(1000), RATE, memory)
