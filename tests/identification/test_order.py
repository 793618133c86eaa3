"""Criteria and the choice of an order, against their formulas, R and statsmodels."""

from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from statsmodels.tsa.ar_model import ar_select_order

from oracle.autoregression import least_squares
from support.autoregressions import LH, simulated, stationary_records
from zerorate.identification import OrderSelection, select_order
from zerorate.identification import order as criteria

NAMES = ("fpe", "aic", "aicc", "bic", "hq")


def selection(sigma2, orders=None, criterion="aic", margin=10.0, n=1000):
    """A selection of given variances."""
    orders = orders or tuple((p, 0) for p in range(len(sigma2)))
    k = np.array([p + q + 1.0 for p, q in orders])
    return OrderSelection("ar", criterion, margin, n, orders, np.array(sigma2), k)


def test_criteria_are_their_formulas():
    # One variance by hand: n = 100, k = 4, ln sigma2 = 0.5.
    arguments = (np.exp(0.5), 100, 4)
    expected = {
        "fpe": np.exp(0.5) * 104.0 / 96.0,
        "aic": 50.0 + 8.0,
        "aicc": 50.0 + 8.0 + 2.0 * 4.0 * 5.0 / 95.0,
        "bic": 50.0 + 4.0 * np.log(100.0),
        "hq": 50.0 + 8.0 * np.log(np.log(100.0)),
    }
    for name, value in expected.items():
        # A handful of operations, each rounded once.
        assert float(getattr(criteria, name)(*arguments)) == pytest.approx(value, rel=1e-14)


@pytest.mark.parametrize("p", [0, 1, 5])
def test_both_forms_of_the_final_prediction_error(p):
    n, sigma2 = 200, 0.7
    # Without a constant, and with the mean taken off; a few roundings.
    without = sigma2 * (n + p) / (n - p)
    with_mean = sigma2 * (n + p + 1) / (n - p - 1)
    assert float(criteria.fpe(sigma2, n, p)) == pytest.approx(without, rel=1e-15)
    assert float(criteria.fpe(sigma2, n, p + 1)) == pytest.approx(with_mean, rel=1e-15)


def test_aicc_is_infinite_where_every_residual_has_a_coefficient():
    assert np.isinf(criteria.aicc(1.0, 5, np.array([4, 5]))).all()


@pytest.mark.parametrize("name", NAMES)
def test_criteria_of_arrays_are_those_of_numbers(name):
    function, k = getattr(criteria, name), np.arange(1, 5)
    sigma2 = np.array([4.0, 2.0, 1.5, 1.4])
    numbers = [float(function(s, 50, int(j))) for s, j in zip(sigma2, k, strict=True)]
    np.testing.assert_array_equal(function(sigma2, 50, k), numbers)


@pytest.mark.parametrize("method", ["burg", "yule-walker"])
def test_order_of_luteinizing_hormone_as_in_r(method):
    # R's ar(lh) and ar(lh, method = "burg"): the least AIC is at 3.
    chosen = select_order(LH, criterion="aic", max_order=16, method=method)
    assert (chosen.minimum, chosen.n) == ((3, 0), 48)


@given(stationary_records(), st.integers(1, 12))
def test_differences_are_those_of_statsmodels(record, highest):
    z, _ = record
    chosen = select_order(z, max_order=highest)
    peer = ar_select_order(z, highest, "aic", trend="c")
    lags = [0 if p == 0 else tuple(range(1, p + 1)) for p in range(highest + 1)]
    for ours, theirs in [(chosen.aic, peer.aic), (chosen.bic, peer.bic), (chosen.hq, peer.hqic)]:
        expected = np.array([theirs[lag] for lag in lags])
        # Differences of sums of about n that are precise to 1e-9.
        tolerance = 1e-9 * z.size
        np.testing.assert_allclose(ours - ours[0], expected - expected[0], atol=tolerance)


@given(stationary_records())
def test_variances_are_those_of_rows_common_to_all(record):
    z, _ = record
    chosen = select_order(z, max_order=4)
    each = [least_squares(z, p, start=4).sigma2 for p in range(5)]
    # Normal equations of a condition below 1e6.
    np.testing.assert_allclose(chosen.sigma2, each, rtol=1e-9)
    assert chosen.n == z.size - 4
    assert chosen.orders == tuple((p, 0) for p in range(5))


@pytest.mark.parametrize("name", NAMES)
def test_arrays_are_the_criteria(name):
    chosen = select_order(LH, criterion=name)
    k = np.arange(1, 12)
    values = getattr(chosen, name)
    np.testing.assert_array_equal(values, getattr(criteria, name)(chosen.sigma2, chosen.n, k))
    assert chosen.minimum == chosen.orders[int(np.argmin(values))]
    assert chosen.order == chosen.clear


@pytest.mark.parametrize("name", NAMES)
def test_the_order_of_a_clear_model_is_found(name):
    chosen = select_order(simulated([0.6, -0.3, 0.2], 20_000), criterion=name)
    assert chosen.order == (3, 0)


def test_the_final_prediction_error_counts_as_akaike_does():
    by_fpe, by_aic = (select_order(LH, criterion=name) for name in ("fpe", "aic"))
    # n ln((n + k) / (n - k)) is 2 k + 2 k^3 / (3 n^2) + ...: below 0.8 for k = 11 and n = 38.
    np.testing.assert_allclose(by_fpe.scores - by_aic.scores, 0.0, atol=0.8)


def test_a_higher_order_must_gain_more_than_the_margin():
    # Gains in AIC by the step: 98, 8, 8, -2.
    gains = np.array([0.0, 100.0, 10.0, 10.0, 0.0])
    sigma2 = np.exp(-np.cumsum(gains) / 1000.0)
    assert selection(sigma2).minimum == (3, 0)
    assert selection(sigma2, margin=0.0).clear == (3, 0)
    assert selection(sigma2, margin=7.0).clear == (3, 0)
    assert selection(sigma2, margin=10.0).clear == (2, 0)
    assert selection(sigma2, margin=17.0).clear == (1, 0)
    assert selection(sigma2, margin=1000.0).clear == (0, 0)


def test_among_equally_many_coefficients_the_better_is_taken():
    orders = ((0, 0), (1, 0), (0, 1), (1, 1))
    assert selection([9.0, 1.002, 1.001, 1.0], orders).clear == (0, 1)
    assert selection([9.0, 1.001, 1.002, 1.0], orders).clear == (1, 0)


def test_mixed_models_come_from_their_grid(monkeypatch):
    # The search itself has tests of its own.
    sigma2 = np.array([[5.0, 4.0, 3.9], [2.0, 1.0, 0.999]])
    grid = SimpleNamespace(sigma2=sigma2, n=500, coefficients=())
    asked = []

    def arma_grid(z, max_p, max_q):
        asked.append((len(z), max_p, max_q))
        return grid

    monkeypatch.setattr("zerorate.identification.order.arma_grid", arma_grid)
    chosen = select_order(np.zeros(10), "arma", "bic", max_p=1, max_q=2)
    assert asked == [(10, 1, 2)]
    assert chosen.orders == ((0, 0), (0, 1), (0, 2), (1, 0), (1, 1), (1, 2))
    np.testing.assert_array_equal(chosen.sigma2, sigma2.ravel())
    assert (chosen.kind, chosen.criterion, chosen.n) == ("arma", "bic", 500)
    assert chosen.order == (1, 1)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"kind": "ma"}, "kind must be one of 'ar', 'arma', got 'ma'"),
        ({"criterion": "mdl"}, "criterion must be one of 'fpe', 'aic', .* got 'mdl'"),
        ({"margin": -1.0}, "margin must not be negative, got -1.0"),
        ({"margin": np.nan}, "margin must not be negative, got nan"),
        ({"max_order": 100}, "max_order must be 0 to 64, got 100"),
        ({"max_order": 40}, "order 40 needs at least 42 residuals, z gives 8"),
        ({"max_order": 48}, "order 48 needs more than 48 samples in a row, z has at most 48"),
        ({"method": "ols"}, "method must be one of 'least-squares', .* got 'ols'"),
    ],
)
def test_what_cannot_be_chosen_is_refused(options, message):
    with pytest.raises(ValueError, match=message):
        select_order(LH, **options)


@pytest.mark.parametrize(
    ("z", "message"),
    [
        (np.full(9, np.nan), "z holds no finite sample"),
        (np.full(50, 0.3), "all 50 are 0.3"),
        (np.where(np.arange(60) % 4 == 3, np.nan, simulated([0.5], 60)), "at most 3"),
    ],
)
def test_records_without_an_order_are_refused(z, message):
    with pytest.raises(ValueError, match=message):
        select_order(z)
