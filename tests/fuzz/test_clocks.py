"""Timestamps of any rate and unit, late, coarse, in bursts, with gaps: no sample lost or moved."""

import numpy as np
import pytest

from support.arrivals import arrived, packets, polls, stalls
from zerorate.io import read_log

UNITS = {"s": 1.0, "ms": 1e3, "us": 1e6, "ns": 1e9}


def read_of(stamps, unit):
    """Return a log of samples that are numbered from 1."""
    column = np.round(stamps * UNITS[unit]).astype(np.int64) if unit != "s" else stamps
    return read_log({f"time_{unit}": column, "gyro_x_dps": np.arange(1.0, len(stamps) + 1)})


def numbers(log):
    """Return the samples that are there, and their places."""
    values = log.data[:, 0]
    places = np.flatnonzero(np.isfinite(values))
    return values[places], places


def gaps(rng, n, most):
    """Return rows before which samples were lost, away from each other, and how many."""
    rows = np.arange(n // 10, n - n // 10, n // 10) + rng.integers(-n // 40, n // 40)
    rows = rng.choice(rows, rng.integers(0, 4), replace=False)
    return [(int(row), int(rng.integers(20, most))) for row in np.sort(rows)]


def test_clocks_with_jitter_and_gaps(search):
    def case(rng):
        n, rate = int(rng.integers(300, 4000)), 10.0 ** rng.uniform(0.5, 3.9)
        unit = rng.choice([u for u in UNITS if UNITS[u] >= 20 * rate or u == "s"])
        made = np.arange(n)
        for row, lost in gaps(rng, n, 20 + n // 10):
            made[row:] += lost
        start = rng.choice([0.0, 5.5, 1.7e9]) if unit != "s" or rate < 1000 else 0.0
        jitter = rng.choice([0.0, 0.02, 0.1]) * rng.uniform(-1, 1, n)
        log = read_of(start + (made + jitter) / rate, unit)
        samples, places = numbers(log)
        np.testing.assert_array_equal(samples, np.arange(1, n + 1))
        assert log.rate == pytest.approx(rate, rel=2e-3)
        np.testing.assert_array_equal(places, made)

    search(case, 60)


def test_clocks_of_arrivals(search):
    def case(rng):
        n, rate = int(rng.integers(20_000, 40_000)), 10.0 ** rng.uniform(1.7, 2.5)
        wake = packets(rng, int(rng.integers(4, 40))) if rng.random() < 0.5 else polls(rng)
        wake = stalls(rng, wake) if rng.random() < 0.3 else wake
        lost = gaps(rng, n, 2000)
        arrivals = arrived(rng, wake, n=n, rate=rate, gaps=lost)
        log = read_of(arrivals.stamps, rng.choice(["s", "ms", "us"]))
        samples, _ = numbers(log)
        np.testing.assert_array_equal(samples, np.arange(1, n + 1))
        clock = log.meta["clock"]
        if not clock.burst_count:
            # Too few or too weak to be told from a sensor switched on and off, which is said.
            assert clock.missing_count > 0
            return
        assert log.rate == pytest.approx(rate, rel=2e-2)
        assert log.n == pytest.approx(arrivals.made[-1] + 1, rel=0.05)

    search(case, 4)
