"""Non-negative least squares against SciPy, and what is said of its errors."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.optimize import nnls
from scipy.stats import chi2

from zerorate.noise.least_squares import (
    bound_by_single,
    residual_chi_squared,
    solve,
    solve_non_negative,
    upper_bound,
)


@st.composite
def problems(draw):
    """Matrices of up to 20 by 7, columns of sizes from 1e-6 to 1e6, and targets."""
    rows, columns = draw(st.integers(1, 20)), draw(st.integers(1, 7))
    random = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    sizes = 10.0 ** random.uniform(-6.0, 6.0, columns)
    matrix = random.standard_normal((rows, columns)) * sizes
    if draw(st.booleans()):
        matrix = np.abs(matrix)
    return matrix, random.standard_normal(rows)


@given(problems())
def test_equals_scipy(problem):
    matrix, target = problem
    strengths = solve_non_negative(matrix, target)
    assert np.all(strengths >= 0.0)
    lengths = np.linalg.norm(matrix, axis=0)
    # SciPy's is for columns of a like size.
    expected, residual = nnls(matrix / lengths, target)
    left = np.linalg.norm(matrix @ strengths - target)
    # Both stop at a slope of some 1e-12 of the target.
    assert left == pytest.approx(residual, rel=1e-9, abs=1e-10)
    if np.linalg.matrix_rank(matrix / lengths) == lengths.size:
        condition = np.linalg.cond(matrix / lengths)
        np.testing.assert_allclose(strengths * lengths, expected, atol=1e-10 * condition)


@given(problems())
def test_no_strength_can_be_changed_for_the_better(problem):
    """Kuhn and Tucker: the slope is zero where a strength is free and not upwards elsewhere."""
    matrix, target = problem
    strengths = solve_non_negative(matrix, target)
    slopes = (matrix / np.linalg.norm(matrix, axis=0)).T @ (target - matrix @ strengths)
    # The tolerance of the search, and roundings of a least squares solution.
    least = 1e-10 * np.linalg.norm(target)
    assert np.all(slopes <= least)
    assert np.all(np.abs(slopes[strengths > 0.0]) <= least)


def test_columns_of_zeros_take_no_strength():
    strengths = solve_non_negative(np.array([[1.0, 0.0], [1.0, 0.0]]), np.array([2.0, 4.0]))
    np.testing.assert_allclose(strengths, [3.0, 0.0], rtol=1e-15)


BASIS = np.column_stack((np.ones(12), np.arange(12.0)))


def test_known_weights_give_weighted_least_squares():
    random = np.random.default_rng(2)
    truth, scatter = np.array([5.0, 3.0]), random.uniform(0.5, 2.0, 12)
    data = BASIS @ truth + np.sqrt(scatter) * random.standard_normal(12)
    found = solve(BASIS, data, scatter, lambda _: scatter)
    normal = np.linalg.inv(BASIS.T @ (BASIS / scatter[:, np.newaxis]))
    # A well-conditioned problem: rounding.
    np.testing.assert_allclose(found.strengths, normal @ BASIS.T @ (data / scatter), rtol=1e-12)
    np.testing.assert_allclose(found.sigmas, np.sqrt(np.diag(normal)), rtol=1e-12)
    residual = (data - BASIS @ found.strengths) ** 2 / scatter
    assert found.chi_squared == pytest.approx(residual.sum(), rel=1e-12)
    assert found.chi_squared == pytest.approx(residual_chi_squared(BASIS, data, scatter), rel=1e-12)
    assert found.degrees_of_freedom == 10


def test_a_full_covariance_counts_as_its_diagonal_does():
    scatter = np.linspace(0.5, 2.0, 12)
    data = BASIS @ [5.0, 3.0] + np.random.default_rng(3).standard_normal(12)
    one = solve(BASIS, data, scatter, lambda _: scatter)
    full = solve(BASIS, data, np.diag(scatter), lambda _: np.diag(scatter))
    # Rounding of an eigenvalue decomposition.
    np.testing.assert_allclose(full.strengths, one.strengths, rtol=1e-12)
    np.testing.assert_allclose(full.sigmas, one.sigmas, rtol=1e-12)


def test_what_is_zero_has_no_error_and_is_bounded():
    data = 5.0 - 0.5 * np.arange(12.0)
    scatter = np.ones(12)
    found = solve(BASIS, data, scatter, lambda _: scatter)
    assert found.strengths[1] == 0.0
    assert np.isnan(found.sigmas[1])
    assert found.degrees_of_freedom == 11
    bound = upper_bound(BASIS, found, 1, lambda _: scatter)
    normal = np.linalg.inv(BASIS.T @ BASIS)
    # With weights that do not change, 95 % of a Gaussian.
    assert bound == pytest.approx(1.6448536269514722 * np.sqrt(normal[1, 1]), rel=1e-3)


def test_weights_follow_the_fit():
    """Data that scatter by a tenth of what is fitted: equals the same weights given."""
    data = (BASIS @ [5.0, 3.0]) * (1.0 + 0.1 * np.random.default_rng(4).standard_normal(12))
    found = solve(BASIS, data, data**2, lambda strengths: (0.1 * BASIS @ strengths) ** 2)
    settled = (0.1 * BASIS @ found.strengths) ** 2
    again = solve(BASIS, data, settled, lambda _: settled)
    # Rounds end when nothing changes by more than 1e-9.
    np.testing.assert_allclose(found.strengths, again.strengths, rtol=1e-8)


def test_the_most_telling_estimate_bounds_a_strength():
    data, edf = np.array([4.0, 1.0, 9.0]), np.array([1.0, 10.0, 3.0])
    column = np.array([1.0, 0.0, 2.0])
    limits = data * edf / chi2.ppf(0.05, edf) / np.array([1.0, np.inf, 2.0])
    # Both invert chi-squared, see test_chi_squared.
    assert bound_by_single(column, data, edf) == pytest.approx(min(limits[[0, 2]]), rel=1e-8)
