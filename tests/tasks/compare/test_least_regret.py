"""The example's regret that no method can undercut: its likelihoods, its limits, its draws."""

import runpy
from pathlib import Path

import numpy as np
import pytest
from scipy.stats import multivariate_normal

from zerorate.simulation.models import MODELS, GaussMarkov, GyroModel, simulate_records
from zerorate.simulation.optimal_filter import optimum

EXAMPLE = runpy.run_path(str(Path(__file__).parents[3] / "examples" / "least_regret.py"))
least_regret, filtered_by_all = EXAMPLE["least_regret"], EXAMPLE["filtered_by_all"]

RATE = 0.5
NONE = GyroModel("none")
WALK = GyroModel("walk", rate_random_walk=1e-4)
MARKOV = GyroModel("Markov", rate_random_walk=1e-3, drift=(GaussMarkov(0.02, 7.0),))
TIMES = np.array([0, 1, 7])


def covariance(model, n):
    """Covariance of n samples from closed forms, without the level."""
    lags = np.abs(np.subtract.outer(np.arange(n), np.arange(n))) / RATE
    steps = np.minimum.outer(np.arange(n), np.arange(n)) / RATE
    total = model.rate_random_walk**2 * steps + model.angle_random_walk**2 * RATE * np.eye(n)
    return total + sum(part.deviation**2 * np.exp(-lags / part.time) for part in model.drift)


def test_likelihoods_are_those_of_the_differences_from_the_first_sample():
    models, n = (NONE, WALK, MARKOV), TIMES[-1] + 1
    found = filtered_by_all(models, RATE, TIMES, [3, 4])
    differences = np.hstack([-np.ones((n - 1, 1)), np.eye(n - 1)])
    for i, model in enumerate(models):
        normal = multivariate_normal(
            np.zeros(n - 1), differences @ covariance(model, n) @ differences.T
        )
        shared = -0.5 * (n - 1) * np.log(2.0 * np.pi)
        for j, other in enumerate(models):
            signal, _ = simulate_records(other, RATE, n, [3, 4])
            expected = normal.logpdf((differences @ signal).T) - shared
            # Eight steps; a bias of 0.5 deg/s leaves 14 digits of the 0.007 deg/s of noise, which
            # count twice in a square.
            np.testing.assert_allclose(found.likelihood[-1, i, j], expected, rtol=1e-11)


def test_estimates_are_those_of_the_optimum_of_each_model():
    models = (NONE, MARKOV)
    found = filtered_by_all(models, RATE, TIMES, [3, 4])
    for i, model in enumerate(models):
        best = optimum(model, RATE, TIMES[-1] + 1)
        assert found.optimum[i] == best.variance[TIMES].mean()
        for j, other in enumerate(models):
            signal, _ = simulate_records(other, RATE, TIMES[-1] + 1, [3, 4])
            np.testing.assert_array_equal(found.estimates[:, i, j], best.filtered(signal)[0][TIMES])


def test_a_walk_too_faint_to_matter_leaves_nothing_to_regret():
    faint = GyroModel("faint", rate_random_walk=1e-7)
    found = least_regret([NONE, faint], records=20)
    # It moves 4e-6 deg/s in half an hour, 1/50 of the 2.4e-4 deg/s to which a mean is known:
    # the square of the regret exceeds 1 by no more than the square of that, 4e-4.
    assert 1.0 <= found.lower < 1.0 + 2e-4


def test_twins_leave_nothing_to_regret():
    found = least_regret([NONE, GyroModel("twin")], records=5)
    assert found.lower == pytest.approx(1.0, rel=1e-12)  # rounding of a mixture of equals


def test_a_walk_that_may_be_absent_costs_what_no_method_can_save():
    found = least_regret([NONE, WALK], records=400)
    assert found.weights.sum() == pytest.approx(1.0, rel=1e-12)  # rounding
    # Not by chance: ten standard errors.
    assert found.lower - 10.0 * found.sigma > 1.0
    assert found.lower == pytest.approx(np.sqrt(found.weights @ found.regret**2), rel=1e-12)


def test_more_models_cannot_make_it_easier():
    few = least_regret([NONE, WALK], records=200)
    more = least_regret([NONE, WALK, *MODELS[2:4]], records=200)
    # Both are estimates: four of their joint standard errors.
    assert more.lower > few.lower - 4.0 * np.hypot(few.sigma, more.sigma)


def test_a_filter_of_either_model_is_no_better_than_the_bound():
    bound = least_regret([NONE, WALK], records=100)
    found = filtered_by_all([NONE, WALK], RATE, np.arange(60, 900), range(50))
    excess = (found.estimates[:, 0] - found.estimates[:, 1]) ** 2
    squared = 1.0 + excess.mean(axis=(0, 2)) / found.optimum
    # Each regrets nothing on its own model, and more than the bound on the other.
    assert squared.min() > bound.lower**2


def test_the_same_call_gives_the_same_bound():
    first, again = (least_regret([NONE, WALK], records=20) for _ in range(2))
    assert (first.lower, first.sigma) == (again.lower, again.sigma)
    np.testing.assert_array_equal(first.weights, again.weights)


@pytest.mark.parametrize(
    ("models", "options", "message"),
    [
        ([NONE], {}, "two models and two records of each, got 1 and 200"),
        ([NONE, WALK], {"records": 1}, "got 2 and 1"),
        ([NONE, WALK], {"duration": 100.0}, "120.0 s and 100.0 s"),
        ([NONE, MODELS[-1]], {}, "warm-up rounds or warms up"),
        ([NONE, GyroModel("steps", resolution=0.1)], {}, "steps rounds or warms up"),
    ],
)
def test_what_gives_no_bound_is_refused(models, options, message):
    with pytest.raises(ValueError, match=message):
        least_regret(models, **options)
