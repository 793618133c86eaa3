"""Rates that no gyro measures: the batch and the check of a stream agree; motion is kept."""

import numpy as np
import pytest

from zerorate.checks.impossible import GYRO_RANGE_DPS, ImpossibleRateDetector, find_impossible_rates


def as_it_comes(rates, **given):
    """What a stream leaves out once the sample after has come."""
    check, found = ImpossibleRateDetector(**given), []
    for row in rates.tolist():
        found.append(check.take(row))
        if check.revised:
            found[-2] = False
    assert check.beyond_count + check.spike_count == sum(found)
    return np.array(found)


@pytest.mark.parametrize("seed", range(20))
def test_a_stream_decides_as_the_batch(seed):
    rng = np.random.default_rng(seed)
    rates = rng.normal(size=(2000, 3)) * 10.0 ** rng.uniform(-3.0, 1.5)
    some = rng.choice(1999, 300, replace=False)
    rates[some, rng.integers(3, size=300)] *= 10.0 ** rng.uniform(0.0, 4.0, size=300)
    rates[rng.choice(1999, 100)] = np.nan
    for given in ({}, {"rate": 100.0}, {"rate": 20.0}, {"limit": 30.0}):
        np.testing.assert_array_equal(
            as_it_comes(rates, **given)[:-1], find_impossible_rates(rates, **given)[:-1]
        )


@pytest.mark.parametrize("rate", [50.0, 100.0, 1000.0])
@pytest.mark.parametrize("seed", range(10))
def test_fast_motion_within_the_range_is_kept(seed, rate):
    """Swings as short as four samples, at any phase, with the noise of a gyro."""
    rng = np.random.default_rng(seed)
    n = np.arange(4000)
    rates = np.radians(0.2) * rng.normal(size=(4000, 3))
    for first in range(50, 3950, 50):
        width, phase = rng.uniform(4.0, 30.0), rng.uniform()
        x = (n - first - phase) / width
        pulse = np.where((x > 0) & (x < 1), np.sin(np.pi * x) ** 2, 0.0)
        rates += np.outer(pulse, np.radians(rng.uniform(-2000.0, 2000.0, size=3)))
    size = np.abs(rates).max()
    assert size < np.radians(GYRO_RANGE_DPS)
    assert not find_impossible_rates(rates, rate=rate).any()


def test_clipped_turns_and_steps_are_kept():
    rates = np.zeros((300, 3))
    rates[100:102, 0] = np.radians(2000.0)
    rates[200:, 1] = np.radians(1500.0)
    assert not find_impossible_rates(rates).any()
    assert not as_it_comes(rates).any()
