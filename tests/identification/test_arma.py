"""ARMA fits: published numbers, oracles, truth, and what is refused."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import least_squares
from scipy.signal import lfilter
from statsmodels.tsa.statespace.sarimax import SARIMAX

from support.autoregressions import LH
from zerorate import _native
from zerorate.identification.arma import arma_grid, fit_arma
from zerorate.identification.order import select_order


def simulate(phi, theta, n, seed, constant=0.0):
    """Return n samples after the start is forgotten."""
    a = np.random.default_rng(seed).standard_normal(n + 2000)
    z = lfilter([1.0, *theta], [1.0, *np.negative(phi)], a)[2000:]
    return z + constant / (1.0 - np.sum(phi))


def from_partials(partials):
    """Return coefficients with all roots outside the unit circle."""
    phi = np.zeros(0)
    for r in partials:
        phi = np.append(phi - r * phi[::-1], r)
    return phi


def conditional_residuals(parameters, z, p, q, level=None):
    """All from the first on, with samples at the level and no innovations before."""
    phi, theta, constant = np.split(parameters, [p, p + q])
    level = z.mean() if level is None else level
    regular = lfilter([1.0, *-phi], [1.0], z - level) - (constant - level * (1.0 - phi.sum()))
    return lfilter([1.0], [1.0, *theta], regular)[p:]


@pytest.mark.parametrize(
    ("order", "coefficients", "errors", "mean", "mean_sigma", "sigma2", "log_likelihood", "aic"),
    [
        ((1, 0), [0.5739], [0.1161], 2.4133, 0.1466, 0.1975, -29.38, 64.76),
        (
            (3, 0),
            [0.6448, -0.0634, -0.2198],
            [0.1394, 0.1668, 0.1421],
            2.3931,
            0.0963,
            0.1787,
            -27.09,
            64.18,
        ),
        ((1, 1), [0.4522, 0.1982], [0.1769, 0.1705], 2.4101, 0.1358, 0.1923, -28.76, 65.52),
    ],
)
def test_exact_fits_are_those_that_r_prints(
    order, coefficients, errors, mean, mean_sigma, sigma2, log_likelihood, aic
):
    model = fit_arma(LH, *order, method="exact")
    assert model.converged
    # Half a unit of the last printed digit, and as much for the end of R's own search.
    close = {"rtol": 0.0, "atol": 1e-4}
    np.testing.assert_allclose([*model.phi, *model.theta], coefficients, **close)
    # R differences about where its search stops: its 0.1161 is 0.11621 by differences of
    # statsmodels' likelihood.
    np.testing.assert_allclose(model.standard_errors[:-1], errors, rtol=0.0, atol=1.2e-4)
    np.testing.assert_allclose([model.mean, model.mean_sigma], [mean, mean_sigma], **close)
    np.testing.assert_allclose(model.sigma2, sigma2, **close)
    np.testing.assert_allclose(
        [model.log_likelihood, model.aic], [log_likelihood, aic], rtol=0.0, atol=5.1e-3
    )


def test_exact_aic_finds_order_three():
    criteria = [fit_arma(LH, p, 0, method="exact").aic for p in range(8)]
    assert int(np.argmin(criteria)) == 3


@pytest.mark.parametrize("p", range(4))
def test_without_moving_average_it_is_least_squares(p):
    z = simulate([0.5, -0.3], [], 500, 1, constant=2.0)
    columns = [z[p - i : z.size - i] for i in range(1, p + 1)]
    design = np.column_stack([*columns, np.ones(z.size - p)])
    solution, rss, *_ = np.linalg.lstsq(design, z[p:])
    model = fit_arma(z, p, 0)
    # Rounding times the condition, which is below 100.
    np.testing.assert_allclose([*model.phi, model.constant], solution, rtol=0.0, atol=1e-12)
    assert model.n == z.size - p
    np.testing.assert_allclose(model.sigma2, rss[0] / model.n, rtol=1e-12)
    covariance = model.sigma2 * np.linalg.inv(design.T @ design)
    np.testing.assert_allclose(model.covariance, covariance, rtol=1e-9, atol=1e-15)


ORDERS = [(0, 1), (1, 1), (2, 1), (1, 2), (2, 2), (3, 3), (0, 4), (5, 1)]


@pytest.mark.parametrize("order", ORDERS)
def test_conditional_fits_equal_a_general_optimiser(order):
    p, q = order
    rng = np.random.default_rng([p, q])
    signs = np.where(rng.random(p + q) < 0.5, -1.0, 1.0)
    partials = signs * rng.uniform(0.3, 0.7, p + q)
    z = simulate(from_partials(partials[:p]), -from_partials(partials[p:]), 2000, [p, q], 0.3)
    model = fit_arma(z, p, q)
    found = np.array([*model.phi, *model.theta, model.constant])
    oracle = least_squares(
        conditional_residuals,
        found,
        jac="3-point",
        args=(z, p, q),
        xtol=1e-15,
        ftol=1e-15,
        gtol=1e-15,
    )
    assert model.converged
    # Both stop a millionth of a standard error or less, about 0.03, from the minimum; differences
    # of the oracle's residuals cost it more.
    np.testing.assert_allclose(found, oracle.x, rtol=0.0, atol=1e-6)
    np.testing.assert_allclose(model.sigma2, 2.0 * oracle.cost / model.n, rtol=1e-11)
    # Its derivatives are central differences: 1e-10, times the condition.
    covariance = model.sigma2 * np.linalg.inv(oracle.jac.T @ oracle.jac)
    np.testing.assert_allclose(
        model.standard_errors, np.sqrt(np.diag(covariance)), rtol=1e-10 * model.condition
    )


@pytest.mark.parametrize("missing", [False, True])
@pytest.mark.parametrize("order", ORDERS)
def test_likelihood_equals_statsmodels(order, missing):
    p, q = order
    rng = np.random.default_rng([p, q, 1])
    phi, theta = from_partials(rng.uniform(-0.8, 0.8, p)), from_partials(rng.uniform(-0.8, 0.8, q))
    z = simulate(phi, theta, 400, 3)
    if missing:
        z[[0, 7, 100, 101, 102, 399]] = np.nan
    sum_of_squares, log_determinant, count = _native.arma_likelihood(z, phi, theta, 0.1)
    ours = -0.5 * (count * np.log(2.0 * np.pi * 1.3) + log_determinant + sum_of_squares / 1.3)
    peer = SARIMAX(z - 0.1, order=(p, 0, q))
    # Their filter stops at a steady state that is good to 1e-9 unless told otherwise.
    peer.ssm.tolerance = 0.0
    assert count == np.isfinite(z).sum()
    np.testing.assert_allclose(ours, peer.loglike([*phi, *theta, 1.3]), rtol=1e-8)


@pytest.mark.parametrize("order", [(1, 0), (1, 1), (2, 1), (0, 2)])
def test_exact_fits_are_no_less_likely_than_those_of_statsmodels(order):
    p, q = order
    z = simulate(from_partials([0.6, -0.4][:p]), from_partials([0.5, 0.3][:q]), 500, 5, 1.0)
    z[200:203] = np.nan
    model = fit_arma(z, p, q, method="exact")
    peer = SARIMAX(z, order=(p, 0, q), trend="c").fit(disp=False)
    # Their search ends at a relative gain of 1e-9 or so.
    assert model.log_likelihood >= peer.llf - 1e-6
    found = np.array([model.constant, *model.phi, *model.theta])
    errors = model.standard_errors[[-1, *range(p + q)]]
    # ... which leaves them a hundredth of a standard error off: half its square in likelihood.
    assert np.all(np.abs(found - peer.params[:-1]) < 0.02 * errors)


@pytest.mark.parametrize("order", [(1, 0), (1, 1), (2, 1)])
def test_both_methods_agree_within_their_errors(order):
    p, q = order
    z = simulate(from_partials([0.7, -0.2][:p]), from_partials([0.5][:q]), 3000, 9)
    css, exact = fit_arma(z, p, q), fit_arma(z, p, q, method="exact")
    # They differ in a few of 3000 residuals: sqrt(few / 3000) standard errors.
    difference = np.concatenate([css.phi - exact.phi, css.theta - exact.theta])
    assert np.all(np.abs(difference) < 0.2 * css.standard_errors[:-1])
    np.testing.assert_allclose(css.standard_errors, exact.standard_errors, rtol=0.05)


@pytest.mark.parametrize("method", ["css", "exact"])
def test_standard_errors_cover_the_truth(method):
    phi, theta = [0.7], [0.4]
    hits = np.zeros(2)
    runs = 200
    for seed in range(runs):
        model = fit_arma(simulate(phi, theta, 400, seed), 1, 1, method)
        errors = np.abs([model.phi[0] - phi[0], model.theta[0] - theta[0]])
        hits += errors < model.standard_errors[:2]
    # 68 %, give or take two and a half binomial deviations of 3.3 %.
    assert np.all((0.60 * runs <= hits) & (hits <= 0.76 * runs))


def test_a_slow_drift_under_white_noise_is_found():
    for seed in range(10):
        model = fit_arma(simulate([0.999], [-0.99], 12000, seed), 1, 1)
        errors = np.abs([model.phi[0] - 0.999, model.theta[0] + 0.99]) / model.standard_errors[:2]
        # Twelve time constants of the drift: its coefficients lean to the short side.
        assert np.all(errors < 5.0)
        assert model.phi[0] > 0.98


@pytest.mark.parametrize("seed", range(5))
def test_a_model_that_nearly_cancels_is_ill_conditioned(seed):
    # The model that FH identify for the MTi-100: its drift carries 4e-4 of the variance.
    phi, theta = [1.0202, -0.0267], [-0.9955]
    z = simulate(phi, theta, 12000, seed)
    model = fit_arma(z, 2, 1)
    at_truth = np.mean(conditional_residuals(np.array([*phi, *theta, 0.0]), z, 2, 1) ** 2)
    assert np.isfinite([*model.phi, *model.covariance.ravel(), model.condition]).all()
    assert model.sigma2 < at_truth
    assert model.condition > 100.0


@pytest.mark.parametrize("order", [(1, 1), (2, 1), (3, 3)])
@pytest.mark.parametrize("method", ["css", "exact"])
def test_white_noise_is_finite_and_ill_conditioned(order, method):
    model = fit_arma(np.random.default_rng(4).standard_normal(1000), *order, method=method)
    numbers = [*model.phi, *model.theta, *model.covariance.ravel(), model.log_likelihood]
    assert np.isfinite([*numbers, model.sigma2, model.mean_sigma]).all()
    assert model.condition > 100.0


def test_what_white_noise_makes_of_a_model_too_large_is_said():
    significant, noted, refused = 0, 0, 0
    for seed in range(50):
        z = np.random.default_rng(seed).standard_normal(1000)
        model = fit_arma(z, 1, 1)
        significant += abs(model.phi[0]) > 3.0 * model.standard_errors[0]
        noted += any("common factor" in note or "unit circle" in note for note in model.notes)
        refused += select_order(z, "arma", "aic").clear == (0, 0)
    # Of 200 such records 68 %, 96 % and 94 %; less three binomial deviations of 50.
    assert significant >= 24
    assert noted >= 44
    assert refused >= 42


@pytest.mark.parametrize("missing", [False, True])
@pytest.mark.parametrize("seed", [1, 2])
def test_no_order_fits_worse_than_one_that_it_contains(seed, missing):
    z = simulate([0.999], [-0.99], 3000, seed)
    if missing:
        z[[500, 501, 2000]] = np.nan
    grid = arma_grid(z, 3, 3)
    assert grid.sigma2.shape == grid.converged.shape == (4, 4)
    assert grid.n == 3000 - 3 - missing * (3 + 3 + 3)
    # Steps are taken if they rise by no more than 1e-12, and few do.
    assert np.all(np.diff(grid.sigma2, axis=0) <= 1e-11 * grid.sigma2[0, 0])
    assert np.all(np.diff(grid.sigma2, axis=1) <= 1e-11 * grid.sigma2[0, 0])
    np.testing.assert_allclose(grid.sigma2[0, 0], fit_arma(z[3:], 0, 0).sigma2, rtol=1e-2)


def test_a_grid_holds_the_fits_on_common_residuals():
    z = simulate([0.6, -0.3], [0.4], 1500, 7)
    grid = arma_grid(z, 2, 2)
    for p, q in [(2, 0), (2, 1), (2, 2)]:
        model = fit_arma(z, p, q)
        assert model.n == grid.n
        # A grid is good to 1e-4 in N ln sigma^2.
        assert abs(grid.n * np.log(grid.sigma2[p, q] / model.sigma2)) < 1e-4


LONG = [([0.6, -0.3], [0.4]), ([0.9995], [-0.99]), ([1.2, -0.5, 0.1], [0.5, 0.3])]


@pytest.mark.parametrize("missing", [False, True])
@pytest.mark.parametrize(("phi", "theta"), LONG)
def test_long_records_are_searched_by_their_spectrum_and_end_where_the_record_has_it(
    phi, theta, missing
):
    z = simulate(phi, theta, 40_000, 19)
    if missing:
        z[[500, 501, 20_000]] = np.nan
    grid = arma_grid(z, 3, 3)
    assert np.all(np.diff(grid.sigma2, axis=0) <= 1e-11 * grid.sigma2[0, 0])
    assert np.all(np.diff(grid.sigma2, axis=1) <= 1e-11 * grid.sigma2[0, 0])
    p, q = len(phi), len(theta)
    model = fit_arma(z, p, q)
    # From the truth itself, on the record alone.
    searched = fit_arma(z, p, q, start=[*phi, *theta, 0.0])
    assert model.converged
    assert searched.converged
    errors = searched.standard_errors[:-1]
    found = np.abs(np.concatenate([model.phi - searched.phi, model.theta - searched.theta]))
    # Both stop a millionth of a standard error from the minimum, to first order.
    assert np.all(found < 1e-4 * errors)
    if p == 3 or not missing:
        at = grid.coefficients[4 * p + q]
        # A grid is good to a hundredth of a standard error, and leaves out two residuals more.
        assert np.all(np.abs(at[:-1] - [*model.phi, *model.theta]) < 0.1 * errors)


@pytest.mark.parametrize("method", ["css", "exact"])
@pytest.mark.parametrize(("scale", "offset"), [(3e-7, 0.0), (1e8, 0.0), (1e-4, 1e7), (1e150, 0.0)])
def test_units_and_offsets_do_not_matter(method, scale, offset):
    z = simulate([0.8], [-0.4], 2000, 11)
    model, other = (fit_arma(x, 1, 1, method) for x in (z, scale * z + offset))
    # An offset of 1e11 deviations leaves five digits of the samples themselves.
    close = {"rtol": 1e-8} if offset == 0.0 else {"rtol": 1e-4}
    np.testing.assert_allclose(other.phi, model.phi, **close)
    np.testing.assert_allclose(other.theta, model.theta, **close)
    np.testing.assert_allclose(other.sigma2, scale**2 * model.sigma2, **close)
    np.testing.assert_allclose(other.mean_sigma, scale * model.mean_sigma, **close)
    np.testing.assert_allclose(other.mean, scale * model.mean + offset, rtol=1e-7)
    moved = model.log_likelihood - model.n * np.log(scale)
    np.testing.assert_allclose(other.log_likelihood, moved, **close)


def test_stretches_start_anew():
    z = simulate([0.7, -0.2], [0.5], 1000, 13)
    z[[300, 301, 302, 700]] = np.nan
    model = fit_arma(z, 2, 1)
    parameters = np.array([*model.phi, *model.theta, model.constant])
    parts = [z[:300], z[303:700], z[701:]]

    def residuals(parameters):
        level = np.nanmean(z)
        found = [conditional_residuals(parameters, part, 2, 1, level) for part in parts]
        return np.concatenate(found)

    oracle = least_squares(residuals, parameters, xtol=1e-15, ftol=1e-15, gtol=1e-15)
    # As without gaps.
    np.testing.assert_allclose(parameters, oracle.x, rtol=0.0, atol=1e-6)
    assert model.n == 996 - 3 * 2
    found = model.residuals(z)
    # Sums of a few products.
    np.testing.assert_allclose(found[np.isfinite(found)], residuals(parameters), atol=1e-12)


@given(st.integers(0, 2**32), st.integers(0, 3), st.integers(0, 3), st.booleans())
@settings(max_examples=25, deadline=None)
def test_every_fit_is_finite_and_invertible(seed, p, q, constant):
    rng = np.random.default_rng(seed)
    z = np.cumsum(rng.standard_normal(60)) * rng.choice([0.0, 1.0]) + rng.standard_normal(60)
    z[rng.integers(0, 60, rng.integers(0, 4))] = np.nan
    for method in ("css", "exact"):
        try:
            model = fit_arma(z, p, q, method, constant)
        except ValueError as error:
            assert "residuals" in str(error)  # noqa: PT017
            continue
        numbers = [
            *model.phi,
            *model.theta,
            model.constant,
            model.sigma2,
            *model.covariance.ravel(),
        ]
        assert np.isfinite(numbers).all()
        roots = np.roots([*model.theta[::-1], 1.0])
        # On the circle, a root of multiplicity 3 is found to a third of the digits.
        assert np.all(np.abs(roots) > 1.0 - 1e-4)
        assert constant or model.constant == 0.0


@pytest.mark.parametrize("method", ["css", "exact"])
def test_an_overdifferenced_record_ends_on_the_circle(method):
    z = np.diff(np.random.default_rng(5).standard_normal(3000))
    model = fit_arma(z, 0, 1, method, constant=False)
    # The likelihood piles up there; the conditional sum of squares has its minimum within a few
    # 1/sqrt(n) of it.
    assert model.theta[0] < (-0.995 if method == "exact" else 3.0 / np.sqrt(z.size) - 1.0)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ((np.ones(100), 1, 1), r"ARMA\(1, 1\) needs samples that differ, all 100 are 1"),
        ((LH[:5], 1, 1), r"ARMA\(1, 1\) needs at least 7 samples, got 5"),
        ((LH, -1, 0), "p must be a whole number from 0 to 8, got -1"),
        ((LH, 0, 9), "q must be a whole number from 0 to 8, got 9"),
        ((LH, 1.5, 0), r"p must be a whole number from 0 to 8, got 1\.5"),
        ((LH, 1, 0, "ml"), "method must be 'css' or 'exact', got 'ml'"),
        ((np.where(np.arange(48) % 3, LH, np.nan), 2, 0), "each stretch between missing samples"),
        ((LH.reshape(2, -1), 1, 0), r"z must be one axis of shape \(n,\), got shape \(2, 24\)"),
        ((np.full(9, np.nan), 1, 0), "z holds no finite sample"),
    ],
)
def test_what_cannot_be_fitted_is_said(arguments, message):
    with pytest.raises(ValueError, match=message):
        fit_arma(*arguments)


def test_grids_refuse_the_same():
    with pytest.raises(ValueError, match="p must be a whole number"):
        arma_grid(LH, -1, 0)
    with pytest.raises(ValueError, match="needs samples that differ"):
        arma_grid(np.zeros(100), 1, 1)
    with pytest.raises(TypeError, match="z must hold real numbers"):
        arma_grid(LH.astype(complex), 1, 1)


def test_models_without_a_constant_have_mean_zero():
    z = simulate([0.7], [0.3], 2000, 17)
    for method in ("css", "exact"):
        model = fit_arma(z, 1, 1, method, constant=False)
        assert (model.constant, model.mean, model.mean_sigma) == (0.0, 0.0, 0.0)
        assert not model.covariance[-1].any()
        assert not model.has_constant
