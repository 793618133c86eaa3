"""Errors against the truth, consistency and settling: closed forms and hand-made cases."""

import math

import numpy as np
import pytest

from support.signals import RATE, white
from zerorate import metrics


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
            (([1.0], 1.0, 1.0, np.nan), "rate must be a positive finite number"),
            (([1.0], np.nan, 1.0, 1.0), "no sample is present"),
        ],
    )
    def test_refusals(self, arguments, match):
        with pytest.raises(ValueError, match=match):
            metrics.settling_time(*arguments)
