"""The linear Kalman filter beside its twin and beside one dense normal distribution."""

import numpy as np
import pytest

import oracle.linear as twin
import zerorate as zr
from support.linear import measurements, model

# Both round some hundreds of operations a sample to 1.1e-16 of what they hold, and forget it again:
# 1e-13 is seen.
TOLERANCE = 1e-10
SIZES = [(n, m) for n in range(1, 9) for m in range(1, min(n, 4) + 1)]
OTHER_SIZES = [(10, 5), (2, 3), (9, 1), (8, 5)]
KNOWN = ("state", "covariance", "innovation", "nis", "log_likelihood")


def assert_equal_runs(run, expected):
    for name in KNOWN:
        scale = np.nanmax(np.abs(expected[name]))
        np.testing.assert_allclose(
            getattr(run, name), expected[name], rtol=0.0, atol=TOLERANCE * scale, err_msg=name
        )


def same_runs(n, m, count, seed=0):
    arguments = model(n, m, p=2, seed=seed)
    z, u = measurements(count, m, seed=seed), measurements(count, 2, seed=seed, missing=0.0)
    run = zr.LinearKalman(**arguments).process(z, u)
    assert_equal_runs(run, twin.LinearKalman(**arguments).process(z, u))
    np.testing.assert_array_equal(run.missing, np.isnan(z))


@pytest.mark.every(4)
@pytest.mark.parametrize(("n", "m"), SIZES + OTHER_SIZES)
def test_equal_to_its_twin(n, m):
    same_runs(n, m, 2000)


@pytest.mark.slow
@pytest.mark.parametrize(("n", "m"), [(2, 1), (8, 4), (10, 5)])
def test_equal_to_its_twin_over_many_samples(n, m):
    same_runs(n, m, 100_000, seed=1)


@pytest.mark.parametrize("names", ["F", "H", "Q", "R", "B", "FHQRB"])
@pytest.mark.parametrize("size", [(3, 2), (10, 5)])
def test_matrices_of_each_sample(size, names):
    n, m = size
    count = 300
    arguments = model(n, m, p=1)
    each = [model(n, m, p=1, seed=k) for k in range(count)]
    given = {name: np.array([one[name] for one in each]) for name in names}
    z, u = measurements(count, m), measurements(count, 1, missing=0.0)
    run = zr.LinearKalman(**arguments).process(z, u, **given)
    assert_equal_runs(run, twin.LinearKalman(**arguments).process(z, u, **given))


@pytest.mark.parametrize(("n", "m"), [(1, 1), (4, 2), (9, 3)])
def test_smoothed_states_and_likelihood_are_those_of_one_normal_distribution(n, m):
    arguments = model(n, m, p=1)
    z, u = measurements(25, m, missing=0.3), measurements(25, 1, missing=0.0)
    z[7] = np.nan
    state, covariance, density = twin.joint(z=z, u=u, **arguments)
    run = zr.LinearKalman(**arguments).process(z, u)
    smoothed = run.smooth()
    # The dense solution of 225 unknowns rounds to some 1e-13.
    close = {"rtol": 0.0, "atol": TOLERANCE}
    np.testing.assert_allclose(smoothed.state, state, **close)
    np.testing.assert_allclose(smoothed.covariance, covariance, **close)
    np.testing.assert_allclose(run.log_likelihood.sum(), density, rtol=1e-11)


def test_smoothed_by_matrices_of_each_sample():
    """A model that changes at every step, smoothed as one whose state holds all steps."""
    arguments = model(2, 1)
    changes = np.random.default_rng(1).choice([0.5, 2.0], 20)
    F = np.multiply.outer(changes, arguments["F"])
    z = measurements(20, 1)
    smoothed = zr.LinearKalman(**arguments).process(z, F=F).smooth()
    # With y_k = x_k / (product of the changes) the same F holds for all steps, and other noises.
    scale = np.cumprod(changes)
    Q = arguments["Q"] / scale[:, None, None] ** 2
    H = np.multiply.outer(scale, arguments["H"])
    same = zr.LinearKalman(**arguments).process(z, Q=Q, H=H).smooth()
    np.testing.assert_allclose(smoothed.state, same.state * scale[:, None], rtol=1e-9)
