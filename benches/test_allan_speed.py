"""pytest-benchmark rows; ``python benches/allan_ratios.py`` prints ratios in one run."""

import numpy as np
import pytest

from zerorate._native import allan_deviations

SAMPLES = np.random.default_rng(1).standard_normal(100_000)
OCTAVES = [1 << i for i in range(15)]


@pytest.mark.benchmark(group="deviations")
@pytest.mark.parametrize("kind", ["oadev", "ohdev", "mdev", "totdev", "pdev"])
def test_octaves(benchmark, kind):
    benchmark(lambda: allan_deviations(SAMPLES, OCTAVES, kind, threads=1))


@pytest.mark.benchmark(group="deviations")
def test_three_axes_on_all_cores(benchmark):
    rows = SAMPLES[:99_999].reshape(-1, 3)
    benchmark(lambda: allan_deviations(rows, OCTAVES))
