"""The linear Kalman filter: closed forms, missing samples, channels, refusals."""

import pickle
import re

import numpy as np
import pytest

import zerorate as zr
from support.checks import assert_covariance, assert_same_bits
from support.linear import TRACKING, covariance, measurements, model

KNOWN = ("state", "covariance", "innovation", "nis", "log_likelihood")


def test_all_ones_give_the_golden_ratio():
    kf = zr.LinearKalman(1.0, [[1.0]], 1.0, 1.0)
    kf.process(np.zeros(60))
    # Some roundings of 1.1e-16, of which the steps forget most.
    assert kf.covariance[0, 0] == pytest.approx(0.6180339887498949, rel=1e-15)


def test_gains_of_the_alpha_beta_filter():
    kf = zr.LinearKalman(**TRACKING)
    kf.process(np.zeros(200))
    kf.predict()
    P = kf.covariance
    np.testing.assert_allclose(P[:, 0] / (P[0, 0] + 1.0), [0.75, 0.5], rtol=1e-14)
    # The gain is also what a measurement of 1 moves the states by.
    np.testing.assert_allclose(kf.update(1.0), [0.75, 0.5], rtol=1e-14)


@pytest.mark.parametrize("size", [(2, 1), (9, 1)])
def test_precise_measurements_of_what_is_unknown(size):
    """With R = 1e-12, P0 = 1e9 and Q = 0 P - K H P collapses to zero; Joseph's form does not."""
    n, m = size
    F = np.eye(n) + np.diag(np.full(n - 1, 0.1), 1)
    kf = zr.LinearKalman(F, np.eye(m, n), np.zeros((n, n)), 1e-12 * np.eye(m), P0=1e9 * np.eye(n))
    run = kf.process(np.zeros((200, m)))
    assert_covariance(run.covariance)
    assert np.all(np.einsum("kii->ki", run.covariance) > 0.0)


def test_without_noise_of_the_state_it_is_the_mean():
    z = np.random.default_rng(1).normal(3.0, 1.0, 1000)
    kf = zr.LinearKalman(1.0, [[1.0]], 0.0, 1.0)
    run = kf.process(z)
    # Nothing known before is a deviation of some 7,000: its part in the mean is below 1e-5 at once.
    np.testing.assert_allclose(run.state[:, 0], np.cumsum(z) / np.arange(1, 1001), atol=1e-5)
    np.testing.assert_allclose(run.covariance[:, 0, 0], 1.0 / np.arange(1, 1001), rtol=2e-5)


def test_smoothed_constant_is_the_last_estimate():
    z = np.random.default_rng(1).normal(3.0, 1.0, 100)
    run = zr.LinearKalman(1.0, [[1.0]], 0.0, 1.0).process(z)
    smoothed = run.smooth()
    np.testing.assert_allclose(smoothed.state, run.state[-1, 0], rtol=1e-12)
    np.testing.assert_allclose(smoothed.covariance, run.covariance[-1, 0, 0], rtol=1e-12)


@pytest.mark.parametrize("unit", [1e-6, 1.0, 1e6])
def test_what_is_unknown_has_the_unit_of_the_states(unit):
    """The first measurements decide, in any unit of length and at any rate."""
    F, Q = [[1.0, 1e-3], [0.0, 1.0]], 1e-8 * unit**2 * np.eye(2)
    kf = zr.LinearKalman(F, [[1.0, 0.0]], Q, 0.01 * unit**2)
    run = kf.process(unit * np.array([1e3, 1e3 + 5.0]))
    np.testing.assert_allclose(run.state[-1] / unit, [1e3 + 5.0, 5e3], rtol=1e-4)


def test_the_first_sample_is_predicted_too():
    kf = zr.LinearKalman(2.0, [[1.0]], 0.0, 1.0, x0=[3.0], P0=[[0.0]])
    assert kf.process([[np.nan]]).state == 6.0


def test_what_is_left_of_a_vector_corrects():
    arguments = model(4, 3)
    z = measurements(1, 3, missing=0.0)[0]
    kf, part = zr.LinearKalman(**arguments), zr.LinearKalman(**arguments)
    kf.predict()
    kf.update([z[0], np.nan, z[2]])
    H, R = arguments["H"][[0, 2]], arguments["R"][np.ix_([0, 2], [0, 2])]
    other = zr.LinearKalman(**{**arguments, "H": H, "R": R})
    other.predict()
    other.update(z[[0, 2]])
    # The same sums, with terms of zero between them.
    assert_same_bits(kf.state, other.state)
    assert_same_bits(kf.covariance, other.covariance)
    np.testing.assert_array_equal(kf.innovation[[0, 2]], other.innovation)
    assert np.isnan(kf.innovation[1])
    assert (kf.nis, kf.log_likelihood) == (other.nis, other.log_likelihood)
    part.predict()
    for gone in (None, np.full(3, np.nan), [np.inf, -np.inf, np.nan], [1e200, -1e151, None]):
        before = part.to_bytes()
        part.update(gone)
        assert np.isnan(part.nis)
        assert part.log_likelihood == 0.0
        assert np.isnan(part.innovation).all()
        assert part.to_bytes() == before


def test_a_missing_input_counts_as_zero():
    arguments = model(2, 1, p=2)
    kf, other = zr.LinearKalman(**arguments), zr.LinearKalman(**arguments)
    assert_same_bits(kf.predict([np.nan, 2.0]), other.predict([0.0, 2.0]))
    assert_same_bits(kf.predict([np.inf, -1e151]), other.predict())


def test_measurements_that_others_determine_correct_nothing():
    """The same without any noise twice: the second tells nothing, and S has no inverse."""
    kf = zr.LinearKalman(
        np.eye(2), [[1.0, 1.0], [1.0, 1.0]], np.zeros((2, 2)), np.zeros((2, 2)), P0=np.eye(2)
    )
    kf.predict()
    np.testing.assert_allclose(kf.update([2.0, 5.0]), [1.0, 1.0], rtol=1e-14)
    np.testing.assert_allclose(kf.covariance, [[0.5, -0.5], [-0.5, 0.5]], rtol=1e-14)
    # Density of a normal number of variance 2 at its deviation squared of 2.
    assert kf.log_likelihood == pytest.approx(-0.5 * (2.0 + np.log(4.0 * np.pi)), rel=1e-14)
    kf.predict()
    np.testing.assert_allclose(kf.update([2.0, 5.0]), [1.0, 1.0], rtol=1e-14)
    assert_covariance(kf.covariance)


def test_innovations_are_white_and_as_large_as_said():
    """Measurements of the model itself: NIS has its mean of m, the error its covariance."""
    rng = np.random.default_rng(1)
    arguments = model(3, 2)
    x = rng.multivariate_normal(arguments["x0"], arguments["P0"])
    states, z = [], []
    pushes = rng.multivariate_normal(np.zeros(3), arguments["Q"], 20_000)
    noise = rng.multivariate_normal(np.zeros(2), arguments["R"], 20_000)
    for push, white in zip(pushes, noise, strict=True):
        x = arguments["F"] @ x + push
        states.append(x)
        z.append(arguments["H"] @ x + white)
    run = zr.LinearKalman(**arguments).process(z)
    smoothed = run.smooth()
    # Means of 20,000 squares: four deviations of them, some of which are correlated.
    assert run.nis.mean() == pytest.approx(2.0, abs=0.06)
    for found in (run, smoothed):
        error = np.array(states) - found.state
        squares = np.einsum("ki,kij,kj->k", error, np.linalg.inv(found.covariance), error)
        assert squares.mean() == pytest.approx(3.0, abs=0.15)


@pytest.mark.parametrize("size", [(2, 1), (3, 2), (9, 2)])
@pytest.mark.parametrize("missing", ["none", "together", "alone"])
def test_channels_are_filters_alone(size, missing):
    """Those with one covariance too, of which eight go side by side."""
    n, m = size
    k, count = 11, 40
    arguments = model(n, m, p=1)
    starts = np.random.default_rng(1).standard_normal((k, n))
    z = measurements(count, k, m, missing=0.1 if missing == "alone" else 0.0)
    if missing == "together":
        z[[3, 17, 18], :, 0] = np.nan
        z[22] = np.nan
    u = measurements(count, k, 1, missing=0.0)
    several = zr.LinearKalman(**{**arguments, "x0": starts}, channels=k)
    run = several.process(z, u)
    smoothed = run.smooth()
    assert (run.covariance.strides[1] == 0) == (missing != "alone")
    for i in range(k):
        alone = zr.LinearKalman(**{**arguments, "x0": starts[i]})
        own = alone.process(z[:, i], u[:, i])
        for name in KNOWN:
            assert_same_bits(getattr(run, name)[:, i], getattr(own, name))
            assert_same_bits(np.asarray(getattr(several, name)[i]), getattr(alone, name))
        again = own.smooth()
        assert_same_bits(smoothed.state[:, i], again.state)
        assert_same_bits(smoothed.covariance[:, i], again.covariance)


def test_channels_that_are_equal_again_share_a_covariance():
    kf = zr.LinearKalman(**TRACKING, channels=3)
    z = np.zeros((500, 3))
    z[2, 1] = np.nan
    assert kf.process(z).covariance.strides[1] > 0
    assert kf.process(z[100:]).covariance.strides[1] == 0


def test_one_axis_may_be_left_out():
    z, u = measurements(20, 1), measurements(20, 1, seed=1, missing=0.0)
    arguments = model(2, 1, p=1)
    runs = [
        zr.LinearKalman(**arguments).process(*given)
        for given in ((z, u), (z[:, 0], u[:, 0]), (list(z[:, 0]), u))
    ]
    for run in runs[1:]:
        assert_same_bits(run.state, runs[0].state)
    kf = zr.LinearKalman(**arguments)
    for zk, uk in zip(z, u, strict=True):
        kf.predict(float(uk[0]))
        kf.update(float(zk[0]))
    assert_same_bits(kf.state, runs[0].state[-1])


def test_matrices_of_one_step_are_not_kept():
    kf, arguments, other = (
        zr.LinearKalman(**model(3, 2, p=1)),
        model(3, 2, p=1),
        model(3, 2, seed=1),
    )
    changed = zr.LinearKalman(**{**arguments, **{name: other[name] for name in "FQHR"}})
    B = np.ones((3, 4))
    z = [0.3, -0.2]
    assert_same_bits(
        kf.predict(np.ones(4), F=other["F"], Q=other["Q"], B=B),
        changed.state * 0.0
        + zr.LinearKalman(**{**arguments, "F": other["F"], "Q": other["Q"], "B": B}).predict(
            np.ones(4)
        ),
    )
    changed.predict(np.ones(4), B=B)
    assert_same_bits(kf.update(z, H=other["H"], R=other["R"]), changed.update(z))
    assert_same_bits(kf.covariance, changed.covariance)
    for name in "FHQRB":
        assert_same_bits(getattr(kf, name), arguments[name])


def test_only_states_are_kept():
    z = measurements(50, 1)
    kf, other = zr.LinearKalman(**TRACKING), zr.LinearKalman(**TRACKING)
    run = kf.process(z, keep="state")
    assert_same_bits(run.state, other.process(z).state)
    assert kf.to_bytes() == other.to_bytes()
    with pytest.raises(ValueError, match="this run kept only the states"):
        run.smooth()
    with pytest.raises(ValueError, match="keep must be 'all' or 'state', got 'none'"):
        kf.process(z, keep="none")


def test_a_run_is_a_value():
    run = zr.LinearKalman(**TRACKING).process(np.arange(5.0))
    again = pickle.loads(pickle.dumps(run))
    assert_same_bits(again.smooth().state, run.smooth().state)
    assert repr(run) == "<LinearRun: state (5, 2)>"
    empty = zr.LinearKalman(**TRACKING).process(np.zeros((0, 1)))
    assert empty.state.shape == empty.smooth().state.shape == (0, 2)


def test_its_text():
    assert repr(zr.LinearKalman(**TRACKING)) == (
        "<LinearKalman: 2 states, 1 measurement, 0 inputs>"
    )
    assert repr(zr.LinearKalman(**model(3, 2, p=1), channels=4)) == (
        "<LinearKalman: 3 states, 2 measurements, 1 input, 4 channels>"
    )


ONE = np.eye(2)
BAD = {
    "F must have shape (n, n), got (2, 1)": {"F": [[1.0], [2.0]]},
    "F must be of finite numbers, at most 1e30 in size": {"F": [[1.0, np.nan], [0.0, 1.0]]},
    "H must have shape (m, 2), got (1, 3)": {"H": [[1.0, 0.0, 0.0]]},
    "H must be of finite numbers, at most 1e30 in size": {"H": [[1e31, 0.0]]},
    "Q must have shape (2, 2), got (3, 3)": {"Q": np.eye(3)},
    "Q must be symmetric": {"Q": [[1.0, 0.5], [0.0, 1.0]]},
    "Q must be positive semidefinite": {"Q": [[1.0, 2.0], [2.0, 1.0]]},
    "Q must be of finite numbers, at most 1e60 in size": {"Q": [[np.inf, 0.0], [0.0, 1.0]]},
    "R must have shape (1, 1), got (2,)": {"R": [1.0, 2.0]},
    "R must be positive semidefinite": {"R": -1.0},
    "B must have shape (2, p), got (2,)": {"B": [0.5, 1.0]},
    "x0 must have shape (2,), got (3,)": {"x0": np.zeros(3)},
    "x0 must be of finite numbers, at most 1e150 in size": {"x0": [np.nan, 0.0]},
    "x0 must have shape (2,) or (3, 2), got (2, 2)": {"x0": np.zeros((2, 2)), "channels": 3},
    "P0 must have shape (2, 2), got (2,)": {"P0": [1.0, 1.0]},
    "P0 must be symmetric": {"P0": [[1.0, 0.5], [0.4, 1.0]]},
    "P0 must be given: of a state the measurements tell nothing": {"F": ONE},
    # They do tell, to the last digit; what they don't is how large a deviation is.
    "P0 must be given: a state is measured without noise, so Q and R tell no size": {
        "Q": 0.0 * ONE,
        "R": 0.0,
    },
    "channels must be at least 1, got 0": {"channels": 0},
    "a filter has at most 256 measurements, got 257": {
        "H": np.ones((257, 2)),
        "R": np.eye(257),
    },
}


@pytest.mark.parametrize("sentence", BAD)
def test_refused_models(sentence):
    with pytest.raises(ValueError, match=f"^{re.escape(sentence)}"):
        zr.LinearKalman(**{**TRACKING, **BAD[sentence]})


Z = np.zeros((4, 1))
REFUSED = {
    "z must have shape (n, 1), got (4, 2)": lambda kf: kf.process(np.zeros((4, 2))),
    "u was given, but the filter has no B": lambda kf: kf.process(Z, np.zeros(4)),
    "u must have shape (4, 1), got (3,)": lambda kf: kf.process(Z, np.zeros(3), B=np.ones((2, 1))),
    "F must have shape (2, 2) or (4, 2, 2), got (3, 2, 2)": lambda kf: kf.process(
        Z, F=np.zeros((3, 2, 2))
    ),
    "Q[2] must be positive semidefinite": lambda kf: kf.process(
        Z, Q=np.stack([ONE, ONE, -ONE, ONE])
    ),
    "H[0] must be of finite numbers": lambda kf: kf.process(Z, H=np.full((4, 1, 2), np.nan)),
    "z must have shape (1,), got (2,)": lambda kf: kf.update([1.0, 2.0]),
    "R must be positive semidefinite": lambda kf: kf.update(1.0, R=-1.0),
    "R must have shape (1, 1), got (2, 2)": lambda kf: kf.update(1.0, R=ONE),
    "F must have shape (2, 2), got (3, 3)": lambda kf: kf.predict(F=np.eye(3)),
    "u must have shape (1,), got (2,)": lambda kf: kf.predict([1.0, 2.0], B=np.ones((2, 1))),
}


@pytest.mark.parametrize("sentence", REFUSED)
def test_refused_steps_change_nothing(sentence):
    kf = zr.LinearKalman(**TRACKING)
    kf.process(np.arange(3.0))
    before = kf.to_bytes()
    with pytest.raises(ValueError, match=f"^{re.escape(sentence)}"):
        REFUSED[sentence](kf)
    assert kf.to_bytes() == before


def test_covariances_that_rounding_made_unequal_are_taken():
    Q = covariance(np.random.default_rng(1), 5)
    Q[0, 1] *= 1.0 + 1e-13
    kf = zr.LinearKalman(np.eye(5), np.eye(5), Q, np.eye(5))
    assert_covariance(kf.Q)
