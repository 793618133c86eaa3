"""What every filter keeps to, of the linear Kalman filter with any model and any samples."""

import copy
import pickle

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import zerorate as zr
from support.checks import assert_covariance, assert_same_bits
from support.linear import measurements, model

KNOWN = ("state", "covariance", "innovation", "nis", "log_likelihood")
SIZES = [(1, 1), (2, 1), (3, 3), (8, 4), (9, 2), (2, 3)]
EXTREMES = [0.0, 1.0, -1.0, 1e150, -1e150, 1e-150, 5e-324, -1e-308, np.nan, np.inf, -np.inf, 1e300]


@st.composite
def filters(draw, hostile=False):
    """A filter with its arguments."""
    n, m = draw(st.sampled_from(SIZES))
    arguments = model(n, m, p=1, seed=draw(st.integers(0, 50)))
    if hostile:
        arguments = spoilt(draw, arguments)
    return zr.LinearKalman(**arguments, channels=draw(st.sampled_from([None, 1, 3])))


def spoilt(draw, arguments):
    """Models that no one should have: unstable, without noise, of states of any size."""
    arguments["F"] = arguments["F"] * draw(st.sampled_from([1.0, 0.0, 1e-3, 3.0, 1e3, 1e30, -1e12]))
    if draw(st.booleans()):
        arguments["F"] = np.round(arguments["F"])
    for name in ("Q", "R", "P0"):
        arguments[name] = arguments[name] * draw(
            st.sampled_from([1.0, 0.0, 1e-300, 1e-12, 1e12, 1e59])
        )
        rank_one = np.ones_like(arguments[name]) * arguments[name][0, 0]
        arguments[name] = draw(st.sampled_from([arguments[name], rank_one]))
    arguments["H"] = arguments["H"] * draw(st.sampled_from([1.0, 0.0, 1e-150, 1e-9, 1e29]))
    sizes = 10.0 ** np.array(draw(st.lists(st.integers(-10, 10), min_size=9, max_size=9)))
    sizes = sizes[: len(arguments["F"])]
    arguments["F"] = np.clip(arguments["F"] * np.divide.outer(sizes, sizes), -1e30, 1e30)
    return arguments


def row(kf, count):
    return (count, *([kf.channels] if kf.channels else []), len(kf.H))


def assert_same_state(got, expected):
    for name in KNOWN:
        assert_same_bits(np.asarray(getattr(got, name)), np.asarray(getattr(expected, name)))
    assert got.to_bytes() == expected.to_bytes()


@given(filters(), st.integers(0, 10_000), st.data())
def test_batches_parts_and_steps_give_the_same_bits(kf, seed, data):
    count = 12
    z = measurements(*row(kf, count), seed=seed)
    u = measurements(*row(kf, count)[:-1], 1, seed=seed + 1)
    cut = data.draw(st.integers(0, count))
    whole, parts, steps = (kf.copy() for _ in range(3))
    run = whole.process(z, u)
    halves = [parts.process(z[part], u[part]) for part in (slice(cut), slice(cut, None))]
    for name in KNOWN:
        joined = np.concatenate([getattr(half, name) for half in halves])
        assert_same_bits(joined, np.ascontiguousarray(getattr(run, name)))
    for k in range(count):
        steps.predict(u[k])
        assert_same_bits(steps.update(z[k]), run.state[k])
        for name in KNOWN:
            assert_same_bits(np.asarray(getattr(steps, name)), np.array(getattr(run, name)[k]))
    assert_same_state(parts, whole)
    assert_same_state(steps, whole)


@given(filters(hostile=True), st.integers(0, 10_000), st.booleans())
def test_saved_at_any_place_it_goes_on_to_the_bit(kf, seed, predicted):
    z = measurements(*row(kf, 12), seed=seed)
    kf.process(z[:6])
    if predicted:
        kf.predict()
    copies = [
        kf.copy(),
        copy.copy(kf),
        copy.deepcopy(kf),
        pickle.loads(pickle.dumps(kf)),
        zr.LinearKalman.from_bytes(kf.to_bytes()),
    ]
    kf.process(z[6:])
    for other in copies:
        other.process(z[6:])
        assert_same_state(other, kf)
    kf.reset()
    fresh = zr.LinearKalman.from_bytes(kf.to_bytes())
    fresh.process(z)
    kf.process(z)
    assert_same_state(fresh, kf)


@settings(deadline=None)
@given(filters(hostile=True), st.integers(0, 10_000), st.booleans())
def test_nothing_makes_it_infinite_or_indefinite(kf, seed, wild):
    rng = np.random.default_rng(seed)
    shape = row(kf, 40)
    z = rng.choice(EXTREMES, shape) if wild else measurements(*shape, seed=seed)
    u = rng.choice(EXTREMES, (*shape[:-1], 1))
    for k in range(len(z)):
        predicted = kf.predict(u[k])
        assert np.isfinite(predicted).all()
        assert_covariance(kf.covariance)
        assert np.isfinite(kf.update(z[k])).all()
        assert_covariance(kf.covariance)
        gone = ~(np.abs(z[k]) <= 1e150)
        np.testing.assert_array_equal(np.isnan(kf.innovation), gone)
        assert not np.isinf(kf.innovation).any()
        nis = np.asarray(kf.nis)
        np.testing.assert_array_equal(np.isnan(nis), gone.all(axis=-1))
        assert not np.isinf(nis).any()
        assert not np.any(nis < 0.0)
        assert np.isfinite(kf.log_likelihood).all()
    # What it came to is a state that it takes back.
    assert zr.LinearKalman.from_bytes(kf.to_bytes()).to_bytes() == kf.to_bytes()


@settings(deadline=None)
@given(filters(hostile=True), st.integers(0, 10_000))
def test_smoothing_stays_finite(kf, seed):
    z = np.random.default_rng(seed).choice([0.0, 1.0, -1.0, 1e9, np.nan], row(kf, 20))
    smoothed = kf.process(z).smooth()
    assert np.isfinite(smoothed.state).all()
    assert np.isfinite(smoothed.covariance).all()


@pytest.mark.parametrize("size", SIZES)
@given(st.integers(-30, 30), st.integers(0, 100))
def test_units_of_the_measurements_do_not_matter(size, power, seed):
    a = 2.0**power
    arguments = model(*size, seed=seed)
    other = {**arguments, "H": a * arguments["H"], "R": a * a * arguments["R"]}
    z = measurements(20, size[1], seed=seed)
    run = zr.LinearKalman(**arguments).process(z)
    scaled = zr.LinearKalman(**other).process(a * z)
    # Powers of two round nothing.
    for name in ("state", "covariance", "nis"):
        assert_same_bits(getattr(scaled, name), getattr(run, name))
    assert_same_bits(scaled.innovation, a * run.innovation)


@pytest.mark.parametrize("size", SIZES)
@given(st.integers(-30, 30), st.integers(0, 100))
def test_units_of_the_states_do_not_matter(size, power, seed):
    """Also where nothing is known of them before."""
    n, m = size
    arguments = model(n, m, p=1, seed=seed)
    arguments["P0"] = None
    a = 2.0 ** (power * (np.arange(n) % 3))
    F, H, Q, B = (arguments[name] for name in "FHQB")
    other = {
        **arguments,
        "F": F * np.divide.outer(a, a),
        "H": H / a,
        "Q": Q * np.outer(a, a),
        "B": B * a[:, None],
        "x0": arguments["x0"] * a,
    }
    z, u = measurements(20, m, seed=seed), measurements(20, 1, seed=seed, missing=0.0)
    run = zr.LinearKalman(**arguments).process(z, u)
    scaled = zr.LinearKalman(**other).process(z, u)
    assert_same_bits(scaled.state, run.state * a)
    assert_same_bits(scaled.covariance, run.covariance * np.outer(a, a))
    for name in ("innovation", "nis", "log_likelihood"):
        assert_same_bits(getattr(scaled, name), getattr(run, name))
