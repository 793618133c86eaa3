"""Correlations and the tests of whiteness, against statsmodels and by hand."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.stats import chi2
from statsmodels.stats.diagnostic import acorr_ljungbox
from statsmodels.tsa.stattools import acf, pacf

from zerorate._native import chi_squared_survival
from zerorate.identification.correlogram import (
    autocorrelation,
    ljung_box,
    partial_autocorrelations,
    whiteness,
)

NOISE = np.random.default_rng(1).standard_normal(3000)
COLOURED = np.convolve(NOISE, [1.0, 0.6, -0.3, 0.2], mode="valid")

# Sums of some thousand products about 1 in size, over one as large.
ROUNDING = 1e-12


@pytest.mark.parametrize("z", [NOISE, COLOURED, NOISE[:31]])
def test_correlations_equal_statsmodels(z):
    found = autocorrelation(z, 30)
    assert found.lags.tolist() == list(range(1, 31))
    np.testing.assert_allclose(found.acf, acf(z, nlags=30)[1:], rtol=0, atol=ROUNDING)
    if z.size > 60:  # statsmodels stops at half the length
        expected = pacf(z, nlags=30, method="ldb")[1:]
        np.testing.assert_allclose(found.pacf, expected, rtol=0, atol=ROUNDING)
    assert found.bound == pytest.approx(1.959963984540054 / np.sqrt(z.size), rel=1e-15)
    assert found.n == z.size


def test_no_product_reaches_across_a_gap():
    z = COLOURED.copy()
    z[[0, 500, 501, 1700]] = [np.nan, np.inf, np.nan, -np.inf]
    found = autocorrelation(z, 5)
    there = np.isfinite(z)
    level = z - z[there].mean()
    n = there.sum()
    for lag, r in enumerate(found.acf, start=1):
        whole = np.lib.stride_tricks.sliding_window_view(there, lag + 1).all(axis=1)
        products = (level[:-lag] * level[lag:])[whole]
        expected = products.mean() * (n - lag) / np.sum(level[there] ** 2)
        assert r == pytest.approx(expected, abs=ROUNDING)
    assert found.n == n
    # 5 lags lose at most 5 products at each of 3 gaps and 1 end more than a whole record does.
    whole = 1.959963984540054 / np.sqrt(n)
    assert whole < found.bound < whole * (1.0 + 20 / n)


@given(st.floats(-1e6, 1e6), st.floats(1e-100, 1e100))
def test_correlations_do_not_depend_on_offset_or_unit(offset, unit):
    found = autocorrelation(unit * (offset + COLOURED), 3)
    # The offset itself is rounded to 1e6 * 1e-16 = 1e-10 of the noise.
    np.testing.assert_allclose(found.acf, autocorrelation(COLOURED, 3).acf, rtol=0, atol=1e-9)


def test_an_ar_model_ends_after_its_order():
    z = NOISE.copy()
    for k in range(2, z.size):
        z[k] += 0.5 * z[k - 1] - 0.3 * z[k - 2]
    found = autocorrelation(z, 10)
    # 1/sqrt(n) is the standard error of each; 4 of them.
    assert found.pacf[1] == pytest.approx(-0.3, abs=4 / np.sqrt(z.size))
    assert np.abs(found.pacf[2:]).max() < 4 / np.sqrt(z.size)


def test_where_nothing_is_left_partial_correlation_ends():
    found = partial_autocorrelations(np.array([1.0, 1.0, 1.0]))
    assert found[0] == 1.0
    assert np.isnan(found[1:]).all()


@pytest.mark.parametrize("z", [NOISE, COLOURED])
@pytest.mark.parametrize(("lags", "fitted"), [(1, 0), (20, 0), (20, 3), (40, 5)])
def test_ljung_box_equals_statsmodels(z, lags, fitted):
    found = ljung_box(z, lags, fitted)
    expected = acorr_ljungbox(z, [lags], model_df=fitted).iloc[0]
    # Both sum lags squares; statsmodels' chi-squared is SciPy's.
    assert found.statistic == pytest.approx(expected.lb_stat, rel=1e-11)
    assert found.p_value == pytest.approx(expected.lb_pvalue, rel=1e-9)
    assert found.upper == pytest.approx(chi2.ppf(0.95, lags - fitted), rel=1e-9)
    assert found.accepted == (found.p_value >= 0.05)
    assert found.n == z.size


def test_ljung_box_keeps_its_level_with_gaps():
    rejected = 0
    for seed in range(400):
        z = np.random.default_rng(seed).standard_normal(600)
        z[::20] = np.nan
        rejected += not ljung_box(z, 10).accepted
    # 20 of 400 expected, standard error 4.4.
    assert 7 <= rejected <= 34


def test_white_noise_is_white():
    found = whiteness(np.random.default_rng(5).standard_normal(100_000), lags=40)
    assert found.white
    assert found.ljung_box.accepted
    assert found.correlogram.acf.shape == (40,)
    # 2 of 40 lags are expected beyond the bound, more than 6 once in 200.
    assert found.outside_count <= 6
    # Chi-squared with 20 degrees of freedom over n: at most 45 but for once in 1000.
    assert 0.0 <= found.predictable < 45 / 100_000


def test_how_much_is_predictable():
    z = np.random.default_rng(6).standard_normal(200_000)
    for k in range(1, z.size):
        z[k] += 0.6 * z[k - 1]
    found = whiteness(z)
    assert not found.white
    # phi^2 of the variance; its standard error is 2 phi sqrt((1 - phi^2)/n) = 0.002.
    assert found.predictable == pytest.approx(0.36, abs=0.01)
    assert found.outside_count >= 3


def test_faint_correlation_of_a_long_record_hardly_matters():
    z = np.random.default_rng(7).standard_normal(1_000_001)
    found = whiteness(z[1:] + 0.01 * z[:-1])
    assert not found.white
    # 1e-4 of correlation squared, and 20/n by chance.
    assert found.predictable < 2e-4


def test_the_share_is_found_by_few_lags_and_in_short_records():
    assert whiteness(COLOURED, lags=1).predictable == whiteness(COLOURED, lags=30).predictable
    assert 0.0 <= whiteness(NOISE[:12], lags=2).predictable <= 1.0


@pytest.mark.parametrize("freedom", [0.5, 1.0, 2.0, 19.0, 40.0, 1000.0])
def test_chi_squared_survival_equals_scipy_far_into_the_tail(freedom):
    values = freedom * np.geomspace(1e-3, 30.0, 40)
    expected = chi2.sf(values, freedom)
    found = np.array([chi_squared_survival(value, freedom) for value in values])
    normal = expected > 1e-290
    assert expected[normal].min() < 1e-3
    # Logarithms of probabilities down to 1e-290, with all their digits but three.
    np.testing.assert_allclose(found[normal], expected[normal], rtol=1e-11)
    assert np.all(found[~normal] < 1e-280)


def test_chi_squared_survival_at_its_ends():
    assert chi_squared_survival(0.0, 3.0) == 1.0
    assert chi_squared_survival(-1.0, 3.0) == 1.0
    assert chi_squared_survival(np.inf, 3.0) == 0.0


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: autocorrelation(NOISE, 0), "lags must be a whole number from 1 on, got 0"),
        (lambda: autocorrelation(NOISE, 3000), "less than the number of samples, 3000, got 3000"),
        (
            lambda: autocorrelation([1.0, 2.0, np.nan, 1.0, 0.0, 3.0], 3),
            "less than the longest stretch, 3, got 3",
        ),
        (lambda: autocorrelation(np.ones(9), 1), "needs samples that differ, all 9 are 1"),
        (lambda: ljung_box(NOISE, 5, 5), "fitted must be from 0 to less than lags, 5, got 5"),
        (lambda: whiteness(NOISE, 5, -1), "fitted must be from 0 to less than lags, 5, got -1"),
        (lambda: whiteness([1.0]), "whiteness needs at least 2 samples, got 1"),
        (lambda: chi_squared_survival(1.0, 0.0), "positive finite degrees of freedom, got 1 and 0"),
        (lambda: chi_squared_survival(np.nan, 1.0), "degrees of freedom, got NaN and 1"),
    ],
)
def test_wrong_input_is_refused_in_a_sentence(call, message):
    with pytest.raises(ValueError, match=message):
        call()
