"""The regret that no method can undercut: its filters, its limits, its draws."""

import numpy as np
import pytest
from scipy.stats import multivariate_normal

from zerorate.compare.simulated import DeviceModel, optimum, walk_bound
from zerorate.compare.simulated.walks import _samples, watched

RATIOS = np.array([0.0, 0.01, 0.3])
TIMES = np.array([0, 1, 7])


def drawn(k, seed):
    """The records that `watched` filters, shape (samples, sizes, k)."""
    samples = _samples(RATIOS, k, np.random.default_rng(seed))
    return np.array([next(samples) for _ in range(TIMES[-1] + 1)])


def test_likelihoods_are_those_of_the_steps_from_the_first_sample():
    walks, records = watched(RATIOS, TIMES, 2, 3), drawn(2, 3)
    n = TIMES[-1]
    steps = np.minimum.outer(np.arange(1, n + 1), np.arange(1, n + 1))
    for i, ratio in enumerate(RATIOS):
        # Every step from the first sample shares that sample's noise.
        normal = multivariate_normal(np.zeros(n), np.eye(n) + np.ones((n, n)) + ratio * steps)
        expected = normal.logpdf(np.moveaxis(records[1:] - records[0], 0, -1))
        shared = -0.5 * n * np.log(2.0 * np.pi)
        # Eight steps, each rounded; the sum is of order ten.
        np.testing.assert_allclose(walks.likelihood[-1, i], expected - shared, rtol=1e-12)


def test_estimates_are_those_of_the_optimum():
    walks, records = watched(RATIOS, TIMES, 2, 3), drawn(2, 3)
    for i, ratio in enumerate(RATIOS):
        best = optimum(DeviceModel("walk", 1.0, np.sqrt(ratio)), 1.0, TIMES[-1] + 1)
        for size in range(RATIOS.size):
            expected = best.estimate(records[:, size])[TIMES]
            np.testing.assert_allclose(
                walks.estimates[:, i, size], expected, rtol=1e-12
            )  # rounding
        assert walks.optimum[i] == pytest.approx(best.variance[TIMES].mean(), rel=1e-12)  # rounding


def test_walks_too_faint_to_matter_leave_nothing_to_regret():
    found = walk_bound([1e-7, 1e-12], records=20)
    # 1e-7 moves 4e-6 deg/s in half an hour, 1/50 of the 2.4e-4 deg/s to which a mean is known:
    # squared regret exceeds 1 by no more than the square of that, 4e-4.
    assert 1.0 <= found.lower < 1.0 + 2e-4


def test_a_walk_that_may_be_absent_costs_what_no_method_can_save():
    found = walk_bound([1e-4], records=400)
    assert found.sizes.tolist() == [0.0, 1e-4]
    assert found.weights.sum() == pytest.approx(1.0, rel=1e-12)  # rounding
    # Not by chance: ten standard errors; and the best method is near it at both sizes.
    assert found.lower - 10.0 * found.sigma > 1.0
    assert found.lower <= found.regret.max()


def test_more_sizes_cannot_make_it_easier():
    sizes = [3e-5, 1e-4, 3e-4]
    few, more = walk_bound(sizes[1:2], records=400), walk_bound(sizes, records=400)
    # Both are estimates: four of their joint standard errors.
    assert more.lower > few.lower - 4.0 * np.hypot(few.sigma, more.sigma)


def test_the_methods_that_know_one_size_are_no_better_than_the_bound():
    found = walk_bound([1e-4], records=200)
    q = (1e-4 / (0.5 * 0.01)) ** 2
    times = np.arange(60, 900)
    walks = watched(np.array([0.0, q]), times, 50, 9)
    excess = (walks.estimates[:, 0] - walks.estimates[:, 1]) ** 2
    squared = 1.0 + excess.mean(axis=(0, 2)) / walks.optimum
    # Each regrets nothing at its own size, and more than the bound at the other.
    assert squared.min() > found.lower**2


def test_the_same_call_gives_the_same_bound():
    first, again = (walk_bound([1e-4], records=20) for _ in range(2))
    assert (first.lower, first.sigma) == (again.lower, again.sigma)
    np.testing.assert_array_equal(first.weights, again.weights)


@pytest.mark.parametrize("sizes", [[], [0.0], [-1e-4], [np.nan], [[1e-4]]])
def test_sizes_must_be_positive(sizes):
    with pytest.raises(ValueError, match="sizes must be a list of positive random walks"):
        walk_bound(sizes)


def test_one_record_tells_no_error():
    with pytest.raises(ValueError, match="records must be at least 2 for each size, got 1"):
        walk_bound([1e-4], records=1)
