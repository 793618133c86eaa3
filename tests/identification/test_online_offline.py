"""The online model compared with the offline one of the same record."""

import numpy as np
import pytest
from scipy.signal import lfilter

import zerorate as zr
from zerorate import identification


def record(phi, theta, n, seed):
    a = np.random.default_rng(seed).standard_normal(n + 2000)
    return lfilter(np.r_[1.0, theta], np.r_[1.0, -np.asarray(phi)], a)[2000:]


def both(phi, theta, n, seed):
    """Return online minus offline coefficients in standard errors, and these errors."""
    z = record(phi, theta, n, seed)
    model = identification.fit_arma(z, len(phi), len(theta))
    online = zr.identification.RecursiveLeastSquares(order=(len(phi), len(theta)))
    online.process(z)
    offline = np.concatenate((model.phi, model.theta))
    errors = model.standard_errors[:-1]
    return (online.coefficients[:-1] - offline) / errors, errors


@pytest.mark.parametrize("phi", [[0.8], [0.5, -0.3], [1.2, -0.4, 0.1]])
def test_an_autoregression_online_is_that_of_least_squares(phi):
    difference, _ = both(phi, [], 100_000, 1)
    # The start-up keeps 100 samples of 100 000, a thirtieth of a standard error; thrice that.
    assert np.all(np.abs(difference) < 0.1)


@pytest.mark.parametrize(("phi", "theta"), [([0.5, -0.3], [0.4]), ([0.98], [-0.8])])
def test_with_a_moving_average_it_comes_as_close_as_the_record_tells(phi, theta):
    short = np.array([both(phi, theta, 3_000, seed) for seed in range(10)])
    long = np.array([both(phi, theta, 100_000, seed) for seed in range(10)])
    # Both are estimates of one model: the recursion's own error stays of the order of theirs.
    assert np.sqrt(np.mean(long[:, 0] ** 2)) < 1.5
    distances = [np.abs(found[:, 0] * found[:, 1]).mean(axis=0) for found in (short, long)]
    # The standard errors fall by the root of 33, 5.7; a third of that is asked, from ten records.
    assert np.all(distances[1] < 0.5 * distances[0])


def test_two_minutes_do_not_tell_a_faint_drift_online():
    differences = [both([0.999], [-0.98], 12_000, seed)[0] for seed in range(5)]
    # The recursion starts from zero, where a drift under much noise looks white.
    assert np.median(np.abs(differences)) > 5.0
