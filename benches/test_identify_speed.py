"""pytest-benchmark rows; ``python benches/identify_ratios.py`` prints ratios in one run."""

import numpy as np
import pytest

from zerorate.identification import fit_ar, select_order

SAMPLES = np.random.default_rng(1).standard_normal(100_000)


@pytest.mark.benchmark(group="autoregressions")
@pytest.mark.parametrize("method", ["least-squares", "burg", "yule-walker"])
def test_order(benchmark, method):
    benchmark(lambda: select_order(SAMPLES, method=method).order)


@pytest.mark.benchmark(group="autoregressions")
@pytest.mark.parametrize("p", [2, 10, 20])
def test_fit(benchmark, p):
    benchmark(lambda: fit_ar(SAMPLES, p))


@pytest.mark.benchmark(group="autoregressions")
def test_fit_by_rows(benchmark):
    smooth = np.cumsum(np.cumsum(SAMPLES))
    benchmark(lambda: fit_ar(smooth, 10))
