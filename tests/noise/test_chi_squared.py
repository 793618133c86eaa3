"""Quantiles of chi-squared against SciPy."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.stats import chi2

from zerorate._native import chi_squared_quantile

PROBABILITIES = [1e-4, 0.005, 0.05, 0.1585, 0.5, 0.8415, 0.95, 0.99, 1.0 - 1e-6]
FREEDOMS = np.concatenate(([0.5, 0.7, 1.0, 1.5], np.geomspace(2.0, 1e7, 60)))

# The incomplete gamma functions of both are good to some 1e-13, and to less of it in the far tail.
TOLERANCE = 1e-9


@pytest.mark.parametrize("p", PROBABILITIES)
def test_equals_scipy(p):
    found = chi_squared_quantile(p, FREEDOMS)
    np.testing.assert_allclose(found, chi2.ppf(p, FREEDOMS), rtol=TOLERANCE)


@given(st.floats(0.05, 1.0 - 1e-4), st.floats(1.0, 1e7))
def test_equals_scipy_anywhere(p, edf):
    assert chi_squared_quantile(p, [edf])[0] == pytest.approx(chi2.ppf(p, edf), rel=TOLERANCE)


@given(st.floats(0.5, 1e7))
def test_rises_with_the_probability(edf):
    quantiles = [float(chi_squared_quantile(p, [edf])[0]) for p in PROBABILITIES]
    assert quantiles == sorted(quantiles)


@pytest.mark.parametrize("edf", [np.nan, np.inf, 0.0, -1.0])
def test_without_freedom_there_is_no_quantile(edf):
    found = chi_squared_quantile(0.5, [edf, 2.0])
    assert np.isnan(found[0])
    assert found[1] == pytest.approx(chi2.ppf(0.5, 2.0), rel=TOLERANCE)


@pytest.mark.parametrize("p", [0.0, 1.0, -0.1, 1.1, np.nan])
def test_probabilities_lie_between_0_and_1(p):
    with pytest.raises(ValueError, match="probability must lie between 0 and 1"):
        chi_squared_quantile(p, [1.0])


def test_wrong_shapes_are_refused():
    with pytest.raises(ValueError, match="shape"):
        chi_squared_quantile(0.5, np.ones((2, 2)))
