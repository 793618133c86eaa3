"""The optimal filter of simulated gyros: closed forms, the best linear predictor, its errors."""

import math

import numpy as np
import pytest
from scipy.stats import chi2

from zerorate.simulation.models import MODELS, GyroModel, simulate_records
from zerorate.simulation.optimal_filter import optimum

RATE = 100.0
every_model = pytest.mark.parametrize("model", MODELS, ids=lambda model: model.name)


def covariance(part, n):
    """Covariance of n samples of a part, from powers of its transition."""
    F, Q, P, H = part.block(RATE)
    matrix = np.empty((n, n))
    for i in range(n):
        shown = P.copy()
        for j in range(i, n):
            matrix[i, j] = matrix[j, i] = H @ shown @ H
            shown = F @ shown
        P = F @ P @ F.T + Q
    return matrix


def walk_covariance(model, n):
    steps = np.minimum.outer(np.arange(n), np.arange(n))
    return model.rate_random_walk**2 / RATE * steps


def best_prediction(model, signal):
    """Best linear unbiased prediction of the last drift, and its variance.

    The level is an unknown mean, by generalised least squares: no recursion, no prior.
    """
    n = len(signal)
    drift = walk_covariance(model, n) + sum(
        (covariance(part, n) for part in model.drift), np.zeros((n, n))
    )
    noise = model.angle_random_walk**2 * RATE + model.resolution**2 / 12.0
    total = drift + noise * np.eye(n)
    total += sum((covariance(part, n) for part in model.disturbances), np.zeros((n, n)))
    ones, last = np.ones(n), drift[-1]
    information = ones @ np.linalg.solve(total, ones)
    level = ones @ np.linalg.solve(total, signal) / information
    estimate = level + last @ np.linalg.solve(total, signal - level)
    missing = 1.0 - ones @ np.linalg.solve(total, last)
    variance = drift[-1, -1] - last @ np.linalg.solve(total, last) + missing**2 / information
    return estimate, variance


@every_model
def test_it_is_the_best_linear_unbiased_predictor(model):
    for n in (1, 2, 3, 30):
        signal, _ = simulate_records(model, RATE, n, [7])
        best = optimum(model, RATE, n)
        estimate, variance = best_prediction(model, signal[:, 0])
        # Solving 30 equations of condition up to 1e4 (the hump's density) loses four digits or
        # five.
        assert best.filtered(signal)[0][-1, 0] == pytest.approx(estimate, rel=1e-10), n
        assert best.variance[-1] == pytest.approx(variance, rel=1e-10), n


def test_a_constant_is_found_by_the_mean():
    best = optimum(GyroModel("constant"), RATE, 1000)
    n = np.arange(1.0, 1001.0)
    # A thousand steps, each rounded.
    np.testing.assert_allclose(best.gains[:, 0], 1.0 / n, rtol=1e-13)
    np.testing.assert_allclose(best.variance, 0.01 / n, rtol=1e-13)


@pytest.mark.parametrize("walk", [pytest.param(3e-4, marks=pytest.mark.slow), 3e-3, 0.1])
def test_the_gain_for_a_walk_settles_at_the_closed_form(walk):
    R, q = 0.01, walk**2 / RATE
    ahead = (q + math.sqrt(q**2 + 4.0 * q * R)) / 2.0
    # The distance shrinks by (1 - gain)^2 a step.
    steps = math.ceil(15.0 / (ahead / (ahead + R)))
    best = optimum(GyroModel("walk", rate_random_walk=walk), RATE, steps)
    assert best.gains[-1, 0] == pytest.approx(ahead / (ahead + R), rel=1e-11)
    assert best.variance[-1] == pytest.approx(R * ahead / (ahead + R), rel=1e-11)


@pytest.mark.every(3)
@every_model
def test_its_errors_have_the_variance_that_it_claims(model):
    n, gyros, instants = 2000, 150, [0, 49, 499, 1999]
    signal, truth = simulate_records(model, RATE, n, range(gyros))
    best = optimum(model, RATE, n)
    error = (best.filtered(signal)[0] - truth)[instants]
    scaled = np.sum(error**2, axis=1) / best.variance[instants]
    # Independent gyros: chi-squared with as many degrees of freedom. 60 draws (15 models of 4)
    # at 1e-5 two-sided fail by chance once in 1700. Errors of rounding and the sign of a warm-up
    # are narrower than Gaussian ones of their variance, so vary less.
    low, high = chi2.ppf([5e-6, 1.0 - 5e-6], gyros)
    assert np.all((low < scaled) & (scaled < high))


@every_model
def test_its_innovations_are_white_and_of_the_variance_that_it_claims(model):
    n, gyros = 400, 100
    signal, _ = simulate_records(model, RATE, n, range(gyros))
    best = optimum(model, RATE, n)
    scaled = best.filtered(signal)[1][1:] / np.sqrt(best.innovation_variance[1:, np.newaxis])
    # Independent innovations: the sum of squares is chi-squared, and the mean product of
    # neighbours has deviation 1/sqrt(pairs). 15 models at 1e-5 fail once in 3000 by chance, five
    # deviations less often. Rounding noise is narrower than Gaussian noise of its variance.
    low, high = chi2.ppf([5e-6, 1.0 - 5e-6], scaled.size)
    assert low < np.sum(scaled**2) < high
    products = scaled[1:] * scaled[:-1]
    assert abs(products.mean()) < 5.0 / math.sqrt(products.size)


def test_the_bias_is_no_matter():
    model = next(model for model in MODELS if model.name == "flicker + walk")
    signal, _ = simulate_records(model, RATE, 300, [1])
    best = optimum(model, RATE, 300)
    # 1000 deg/s leave 13 digits of 1e-3 below them, and a hundred steps are rounded.
    np.testing.assert_allclose(
        best.filtered(signal + 1000.0)[0] - 1000.0, best.filtered(signal)[0], rtol=0.0, atol=1e-10
    )


def test_a_gyro_without_noise_has_no_optimum():
    with pytest.raises(ValueError, match="the optimum of 'silent' needs white noise or rounding"):
        optimum(GyroModel("silent", 0.0), RATE, 10)
