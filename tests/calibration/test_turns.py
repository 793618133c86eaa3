"""Turns and orientation in the core: against matrices, closed forms, and what is refused."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from oracle import turns
from zerorate._native import integrate_rates, propagate_turns

METHODS = ["backward-euler", "trapezoid", "coning"]
NOTHING = (np.zeros((1, 3)), np.eye(3))


def hand_turn(seed, n=120):
    """Smooth rates of a turn, its uneven steps, a bias and a correction."""
    rng = np.random.default_rng(seed)
    t = np.linspace(0.0, 1.0, n)[:, None]
    waves = np.sin(np.pi * t * rng.uniform(1.0, 4.0, 3) + rng.uniform(0.0, 6.0, 3))
    steps = 0.01 * rng.uniform(0.7, 1.3, n - 1)
    matrix = np.eye(3) + 0.05 * rng.standard_normal((3, 3))
    return 2.0 * rng.standard_normal(3) * waves, steps, 0.05 * rng.standard_normal(3), matrix


@settings(max_examples=settings().max_examples // 3)
@given(st.integers(0, 10**6))
def test_a_turn_and_its_sensitivities_are_those_of_the_oracle(seed):
    rates, steps, bias, matrix = hand_turn(seed)
    spans, biases = [(0, 120), (30, 90), (119, 120)], np.stack([bias, -bias, bias])
    found = propagate_turns(rates, steps, spans, biases, matrix)
    for k, (first, last) in enumerate(spans):
        part = (rates[first:last], steps[first : last - 1], biases[k], matrix)
        # A rounding of either a step.
        assert np.abs(found[0][k] - turns.turn(*part)).max() < 1e-13
        by_matrix, by_rate = turns.sensitivities(*part)
        # Central differences: h squared, and roundings over h.
        assert np.abs(found[1][k] - by_matrix).max() < 1e-7
        assert np.abs(found[2][k] - by_rate).max() < 1e-7
        w = (part[0] - biases[k]) @ matrix.T
        steps_of = [turns.rotation_vector(*w[i : i + 2], dt) for i, dt in enumerate(part[1])]
        angle = sum(np.linalg.norm(phi) for phi in steps_of)
        assert found[3][k] == pytest.approx(angle, rel=1e-12)


def test_a_vector_at_rest_moves_as_said():
    rates, steps, bias, matrix = hand_turn(5)
    carried = propagate_turns(rates, steps, [(0, 120)], bias[None], matrix)
    error = 1e-6 * np.arange(9.0).reshape(3, 3)
    moved = propagate_turns(rates, steps, [(0, 120)], bias[None], matrix + error)
    u = np.array([0.6, 0.0, 0.8])
    psi = np.einsum("abc,bc", carried[1][0], error)
    expected = carried[0][0].T @ u + np.cross(carried[0][0].T @ u, psi)
    # psi is some 1e-5: its square is left out.
    assert np.abs(moved[0][0].T @ u - expected).max() < 1e-9


@pytest.mark.parametrize("method", METHODS)
def test_orientations_are_those_of_the_oracle(method):
    rates, steps, _, _ = hand_turn(7, n=2000)
    found = integrate_rates(rates, steps, method)
    expected = turns.orientations(rates, steps, method)
    for q, rotation in zip(found[::50], expected[::50], strict=True):
        # Two thousand steps, each a rounding of either.
        assert np.abs(turns.rotation_matrix(q) - rotation).max() < 1e-12
    assert np.abs(np.linalg.norm(found, axis=1) - 1.0).max() < 4e-15


@pytest.mark.parametrize("method", METHODS)
def test_a_constant_rate_is_one_rotation(method):
    rate, n = np.array([0.3, -0.2, 1.1]), 1000
    q = integrate_rates(np.tile(rate, (n + 1, 1)), np.full(n, 0.002), method)[-1]
    half = 0.5 * 0.002 * n * np.linalg.norm(rate)
    axis = rate / np.linalg.norm(rate)
    # A thousand roundings.
    assert q == pytest.approx([np.cos(half), *np.sin(half) * axis], abs=1e-13)


def coned(n, beta=0.2, speed=20.0):
    """Rates of an axis that runs on a cone for a second, their steps, and the whole turn."""
    t = np.linspace(0.0, 1.0, n + 1)
    sine, down = np.sin(beta), -2.0 * np.sin(beta / 2.0) ** 2
    rates = speed * np.stack(
        [-sine * np.sin(speed * t), sine * np.cos(speed * t), 0.0 * t + down], 1
    )
    start, stop = (
        turns.exponential(beta * np.array([np.cos(a), np.sin(a), 0.0])) for a in (0.0, speed)
    )
    return rates, np.full(n, 1.0 / n), start.T @ stop


@pytest.mark.parametrize(("method", "gain"), list(zip(METHODS, (2.0, 4.0, 4.0), strict=True)))
def test_twice_the_rate_makes_the_error_of_coning_smaller(method, gain):
    errors = []
    for n in (500, 1000):
        rates, steps, expected = coned(n)
        found = turns.rotation_matrix(integrate_rates(rates, steps, method)[-1])
        errors.append(np.linalg.norm(turns.logarithm(expected.T @ found)))
    assert errors[0] / errors[1] == pytest.approx(gain, rel=0.1)


def test_coning_is_what_its_method_is_for():
    rates, steps, expected = coned(500)
    found = [integrate_rates(rates, steps, method)[-1] for method in METHODS]
    angles = [np.linalg.norm(turns.logarithm(expected.T @ turns.rotation_matrix(q))) for q in found]
    assert angles[0] > 10.0 * angles[1] > 10.0 * angles[2]


@pytest.mark.parametrize("size", [1e-300, 1e-160, 1e-12, 1e12, 1e300])
def test_no_finite_rate_ends_in_nan(size):
    rates = size * np.random.default_rng(3).standard_normal((50, 3))
    for method in METHODS:
        assert np.isfinite(integrate_rates(rates, np.full(49, 0.01), method)).all()
    for found in propagate_turns(rates, np.full(49, 0.01), [(0, 50)], *NOTHING):
        assert np.isfinite(found).all()


def test_nan_follows_on_a_missing_sample():
    rates = np.zeros((6, 3))
    rates[3, 1] = np.nan
    found = integrate_rates(rates, np.full(5, 0.01), "coning")
    assert np.isfinite(found[:3]).all()
    assert np.isnan(found[3:]).all()
    rotations, *_ = propagate_turns(
        rates, np.full(5, 0.01), [(0, 3), (0, 6)], np.zeros((2, 3)), np.eye(3)
    )
    assert np.isfinite(rotations[0]).all()
    assert np.isnan(rotations[1]).all()


def test_no_samples_and_no_turns():
    assert integrate_rates(np.zeros((0, 3)), [], "coning").shape == (0, 4)
    assert integrate_rates(np.zeros((1, 3)), [], "coning").tolist() == [[1.0, 0.0, 0.0, 0.0]]
    none = propagate_turns(np.zeros((2, 3)), [0.1], np.zeros((0, 2)), np.zeros((0, 3)), np.eye(3))
    assert [part.shape for part in none] == [(0, 3, 3), (0, 3, 3, 3), (0, 3, 3), (0,)]


@pytest.mark.parametrize(
    ("changed", "message"),
    [
        ({"rates": np.zeros(9)}, r"rates must have shape \(n, 3\), got \(9,\)"),
        ({"steps": np.zeros(3)}, r"steps must have shape \(2,\), got \(3,\)"),
        ({"spans": [0, 3]}, r"spans must have shape \(m, 2\), got \(2,\)"),
        ({"biases": np.zeros(3)}, r"biases must have shape \(1, 3\), got \(3,\)"),
        ({"matrix": np.eye(2)}, r"matrix must have shape \(3, 3\), got \(2, 2\)"),
        ({"spans": [(0, 4)]}, r"from 0 to 3, got \(0, 4\)"),
        ({"spans": [(2, 2)]}, r"from 0 to 3, got \(2, 2\)"),
        ({"spans": [(-1, 2)]}, r"from 0 to 3, got \(-1, 2\)"),
    ],
)
def test_other_shapes_are_refused(changed, message):
    fits = {
        "rates": np.zeros((3, 3)),
        "steps": np.zeros(2),
        "spans": [(0, 3)],
        "biases": np.zeros((1, 3)),
        "matrix": np.eye(3),
    }
    with pytest.raises(ValueError, match=message):
        propagate_turns(**(fits | changed))


def test_an_unknown_method_is_refused():
    with pytest.raises(ValueError, match="method must be one of 'backward-euler', 'trapezoid'"):
        integrate_rates(np.zeros((3, 3)), np.zeros(2), "euler")
