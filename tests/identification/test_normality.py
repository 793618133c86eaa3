"""Tests of normality against SciPy and statsmodels."""

import numpy as np
import pytest
from scipy import stats
from scipy.special import log_ndtr
from statsmodels.stats.diagnostic import normal_ad

from zerorate._native import log_normal_cdf
from zerorate.identification.normality import anderson_darling, jarque_bera

RNG = np.random.default_rng(1)
RECORDS = {
    "gaussian": RNG.standard_normal(3000),
    "short": RNG.standard_normal(8),
    "uniform": RNG.uniform(size=200),
    "heavy": RNG.standard_t(6, 500),
    "skewed": RNG.gamma(9.0, size=100),
    "coarse": np.round(3.0 * RNG.standard_normal(5000)),
    "far": 5.0 + 1e-3 * RNG.standard_normal(400),
}
EACH = pytest.mark.parametrize("z", RECORDS.values(), ids=RECORDS)


@EACH
def test_jarque_bera_equals_scipy(z):
    found, expected = jarque_bera(z), stats.jarque_bera(z)
    # The offset of "far" takes four digits from SciPy's sums of fourth powers.
    assert found.statistic == pytest.approx(expected.statistic, rel=1e-9)
    assert found.p_value == pytest.approx(expected.pvalue, rel=1e-9, abs=1e-300)
    assert found.accepted == (found.p_value >= 0.05)


@EACH
def test_anderson_darling_equals_statsmodels(z):
    found = anderson_darling(z)
    squared, p_value = normal_ad(z)
    n = z.size
    # A^2 is what is left of n; statsmodels' logarithm of 1 - F loses digits in the upper tail.
    assert found.statistic == pytest.approx(squared * (1 + 0.75 / n + 2.25 / n**2), rel=1e-8)
    if found.p_bound == "":
        assert found.p_value == pytest.approx(p_value, rel=1e-6)
    assert found.accepted == (found.statistic <= 0.752)


@pytest.mark.parametrize(("statistic", "p_value"), [(0.631, 0.10), (0.752, 0.05), (1.035, 0.01)])
def test_probabilities_are_those_of_the_published_points(statistic, p_value):
    from zerorate.identification.normality import _probability

    # Stephens' fit to his own table.
    assert _probability(statistic)[0] == pytest.approx(p_value, rel=0.03)


@pytest.mark.parametrize("test", [jarque_bera, anderson_darling])
def test_missing_samples_are_left_out_and_the_unit_is_none(test):
    z = RECORDS["heavy"]
    gappy = np.insert(z, [0, 100, 100, 500], [np.nan, np.inf, np.nan, -np.inf])
    assert test(gappy) == test(z)
    assert test(z).n == 500
    # Powers of two round nothing.
    assert test(2.0**300 * z).statistic == test(z).statistic


@pytest.mark.parametrize("test", [jarque_bera, anderson_darling])
def test_the_level_is_5_percent(test):
    records = np.random.default_rng(2).standard_normal((1000, 500))
    rejected = sum(not test(z).accepted for z in records)
    # Standard error 6.9 of 50; Jarque-Bera is known to stay below at n = 500, near 4.3 %.
    assert 28 <= rejected <= 70


@pytest.mark.parametrize("test", [jarque_bera, anderson_darling])
def test_one_wild_sample_is_no_fault(test):
    z = RECORDS["gaussian"].copy()
    z[7] = 1e12
    found = test(z)
    assert np.isfinite(found.statistic)
    assert not found.accepted


def test_beyond_the_fit_there_is_a_bound():
    found = anderson_darling(np.repeat([0.0, 1.0], 500))
    assert found.p_bound == "<"
    assert 0.0 < found.p_value < 1e-25
    assert anderson_darling(RECORDS["gaussian"]).p_bound == ""


def test_coarse_records_are_noted():
    z = RECORDS["coarse"]
    found = anderson_darling(z)
    assert not found.accepted
    assert jarque_bera(z).accepted
    count = np.unique(z).size
    assert found.note == (
        f"only {count} different values among 5000 samples: their steps alone may make the test "
        "reject"
    )
    assert anderson_darling(RECORDS["gaussian"]).note == ""


def test_normal_tails_equal_scipy():
    x = np.concatenate((np.linspace(-60.0, 37.0, 20_001), [-1e150, -1e4, -20.0]))
    expected = log_ndtr(x)
    # The series leaves off below 1e-13 of the probability at -20; elsewhere a few roundings.
    np.testing.assert_allclose(log_normal_cdf(x), expected, rtol=1e-12)
    assert log_normal_cdf([np.inf])[0] == 0.0
    assert log_normal_cdf([-np.inf])[0] == -np.inf


@pytest.mark.parametrize("test", [jarque_bera, anderson_darling])
def test_wrong_input_is_refused_in_a_sentence(test):
    with pytest.raises(ValueError, match="test needs at least 8 samples, got 7"):
        test(np.arange(7.0))
    with pytest.raises(ValueError, match="test needs samples that differ, all 9 are 2"):
        test(np.full(9, 2.0))
    with pytest.raises(ValueError, match="z must be one axis of shape"):
        test(np.ones((9, 2)))
    with pytest.raises(TypeError, match="z must hold real numbers"):
        test([1j] * 9)
