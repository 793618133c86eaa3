"""Averages as baselines, against plain loops."""

import numpy as np
import pytest

from support.recordings import RECORDINGS, needs_recordings
from support.signals import white
from zerorate import metrics, read_log
from zerorate._native import exponential_mean

RATE = 10.0


def loop(z, gain):
    averages, mean, count = [], np.nan, 0
    for sample in z:
        if np.isfinite(sample):
            count += 1
            mean = sample if count == 1 else mean + max(1.0 / count, gain) * (sample - mean)
        averages.append(mean)
    return np.array(averages)


@pytest.mark.parametrize("gain", [0.0, 1e-3, 0.2, 1.0])
def test_exponential_mean_is_its_recursion(gain):
    z = white(500) + 3.0
    z[[0, 1, 70, 71]] = [np.nan, np.inf, np.nan, -np.inf]
    # The step is written as a difference of products: a rounding or two in each of 500.
    np.testing.assert_allclose(exponential_mean(z, gain), loop(z, gain), rtol=1e-13)


def test_exponential_mean_refuses_other_gains():
    with pytest.raises(ValueError, match="gain must be a number from 0 to 1"):
        exponential_mean([1.0], 1.5)


def test_running_mean_is_the_mean_so_far():
    z = white(300, channels=2) + 5.0
    expected = np.cumsum(z, axis=0) / np.arange(1, 301)[:, None]
    # Three hundred roundings, of numbers near 5.
    np.testing.assert_allclose(metrics.running_mean(z), expected, rtol=1e-13)
    np.testing.assert_array_equal(metrics.running_mean(z[:, 0]), metrics.running_mean(z)[:, 0])


def test_running_mean_holds_and_does_not_count_missing_samples():
    averages = metrics.running_mean([np.nan, 2.0, np.nan, 4.0, np.inf])
    np.testing.assert_array_equal(averages, [np.nan, 2.0, 2.0, 3.0, 3.0])


def test_the_best_ema_is_the_least_of_the_grid():
    z = np.cumsum(0.05 * white(2000)) + white(2000)
    best = metrics.best_ema(z, RATE, horizon=2.0, start=20.0)
    gains = np.geomspace(1.0 / 2000, 1.0, 25)
    errors = [
        metrics.coasting_error(z[200:], exponential_mean(z, min(g, 1.0))[200:], RATE, 2.0)
        for g in gains
    ]
    assert best.error == min(errors)
    assert best.gain == gains[np.argmin(errors)]
    np.testing.assert_array_equal(best.estimate, exponential_mean(z, best.gain))


def test_the_best_ema_of_a_random_walk_has_the_steady_kalman_gain():
    walk = np.cumsum(0.1 * white(100_000))
    z = walk + np.random.default_rng(2).standard_normal(100_000)
    # Of noise ratio q = 0.01 the gain is (sqrt(q^2 + 4q) - q) / 2 = 0.0951; the grid's ratio is
    # 1.62, so the nearest gain is off by at most its root.
    assert metrics.best_ema(z, RATE, truth=walk).gain == pytest.approx(0.0951, rel=0.3)


def test_every_channel_has_its_own_best_gain():
    z = white(1000, channels=2)
    z[:, 1] = np.cumsum(z[:, 1])
    both = metrics.best_ema(z, RATE, horizon=1.0)
    for i in range(2):
        alone = metrics.best_ema(z[:, i], RATE, horizon=1.0)
        assert (both.gain[i], both.error[i]) == (alone.gain, alone.error)
        np.testing.assert_array_equal(both.estimate[:, i], alone.estimate)
    assert both.gain[0] < both.gain[1]


@pytest.mark.parametrize(
    ("arguments", "match"),
    [
        ({}, "either a horizon or a truth"),
        ({"horizon": 1.0, "truth": np.zeros(100)}, "either a horizon or a truth"),
        ({"horizon": 1.0, "start": 10.0}, "start must be 0 or more"),
        ({"horizon": 1.0, "start": -1.0}, "start must be 0 or more"),
        ({"horizon": 20.0}, "less than the record's 100"),
        ({"truth": np.zeros(99)}, "must have the same shape"),
    ],
)
def test_refusals(arguments, match):
    with pytest.raises(ValueError, match=match):
        metrics.best_ema(white(100), RATE, **arguments)


@needs_recordings
def test_the_best_ema_beats_the_running_mean_where_the_bias_moves():
    path = RECORDINGS / "adis16405_static_100hz_run1.parquet"
    log = read_log(path, rate=100.0, columns="gyro_x_dps")
    z = log.data[:200_000, 0]
    best = metrics.best_ema(z, log.rate, horizon=60.0, start=120.0)
    mean = metrics.coasting_error(
        z[12_000:], metrics.running_mean(z)[12_000:], log.rate, horizon=60.0
    )
    assert best.error < mean
