"""pytest-benchmark rows; ``python benches/ratios.py`` prints ratios in one run."""

import numpy as np
import pytest

import zerorate as zr

SAMPLES = np.random.default_rng(1).standard_normal(100_000)


@pytest.mark.benchmark(group="batch")
@pytest.mark.parametrize("method", ["kf", "akf", "fading"])
def test_batch(benchmark, method):
    benchmark(lambda: zr.DriftFilter(rate=100.0, method=method, output="estimate").process(SAMPLES))


@pytest.mark.benchmark(group="batch")
@pytest.mark.parametrize("channels", [3, 8])
def test_channels(benchmark, channels):
    rows = np.random.default_rng(1).standard_normal((20_000, channels))
    benchmark(
        lambda: zr.DriftFilter(
            rate=100.0, method="fading", channels=channels, output="estimate"
        ).process(rows)
    )


@pytest.mark.benchmark(group="call")
def test_update(benchmark):
    drift = zr.DriftFilter(rate=100.0, method="fading", output="estimate")
    drift.process(SAMPLES)
    benchmark(drift.update, 0.5)


@pytest.mark.benchmark(group="batch")
def test_trace(benchmark):
    benchmark(lambda: zr.DriftFilter(rate=100.0, method="fading").trace(SAMPLES[:10_000]))
