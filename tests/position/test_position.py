"""Positions from fixes: closed forms, what each method does with a fix, missing ones, refusals."""

import re

import numpy as np
import pytest

import zerorate as zr
from support.checks import assert_same_bits
from zerorate.navigation.options import POSITION_METHODS, POSITION_OPTIONS

BY_METHOD = pytest.mark.parametrize("method", POSITION_METHODS)
NOWHERE = np.full(2, np.nan)


def test_moving_average_is_the_mean_of_the_last_fixes():
    fixes = np.random.default_rng(1).normal(size=(50, 2))
    found = zr.PositionFilter(1.0, method="moving_average", window=7).process(fixes)
    for k in range(50):
        # A sum of seven numbers about 1 rounds to some 1e-16.
        expected = fixes[max(k - 6, 0) : k + 1].mean(axis=0)
        np.testing.assert_allclose(found[k], expected, rtol=0.0, atol=1e-15)


def test_moving_average_is_late_by_half_its_window():
    """At 15 m/s and one fix a second ten of them are 67.5 m late."""
    road = np.stack([15.0 * np.arange(60.0), np.zeros(60)], axis=1)
    found = zr.PositionFilter(1.0, method="moving_average").process(road)
    assert road[-1, 0] - found[-1, 0] == pytest.approx(67.5)


def test_constant_velocity_has_the_gains_of_the_closed_form():
    """Gains a, b of the filter of white acceleration, by Kalata's tracking index."""
    f = zr.PositionFilter(1.0, method="kalman", sigma=1.0, process_noise=0.3)
    f.process(np.zeros((2000, 2)))
    f.update((1.0, 0.0))
    (a, _), (b, _) = f.position, f.velocity
    # Steady state of F P F' + Q with T = 1, solved by iteration to the last digits.
    P = np.eye(2)
    F, Q = np.array([[1.0, 1.0], [0.0, 1.0]]), 0.3 * np.array([[1 / 3, 0.5], [0.5, 1.0]])
    for _ in range(2000):
        P = F @ P @ F.T + Q
        K = P[:, 0] / (P[0, 0] + 1.0)
        P = P - np.outer(K, P[0])
    np.testing.assert_allclose([a, b], K, rtol=1e-12)
    assert f.sigma == pytest.approx(np.sqrt(K[0]), rel=1e-12)


def test_the_second_fix_tells_the_velocity():
    f = zr.PositionFilter(1.0, method="kalman", process_noise=0.0)
    f.update((0.0, 0.0))
    f.update((8.0, -2.0))
    # It was unknown to a hundred times sigma a second: the rest is one part in 1e4.
    np.testing.assert_allclose(f.velocity, [8.0, -2.0], rtol=3e-4)


@pytest.mark.parametrize(("cn0", "times"), [(45.0, 1.0), (60.0, 1.0), (35.0, 10.0), (25.0, 100.0)])
def test_the_variance_of_weak_signals(cn0, times):
    f = zr.PositionFilter(1.0, method="strength", sigma=2.0)
    f.update((0.0, 0.0), cn0=cn0)
    assert f.sigma**2 == pytest.approx(4.0 * times, rel=1e-14)


def test_signals_that_cannot_be_weaker():
    """Below zero there is no signal; where the strength is unknown it is a strong one."""
    sigmas = []
    for cn0 in (0.0, -300.0, None, np.nan):
        f = zr.PositionFilter(1.0, method="strength")
        f.update((0.0, 0.0), cn0=cn0)
        sigmas.append(f.sigma)
    assert sigmas[0] == sigmas[1] == pytest.approx(0.7 * 10**2.25)
    assert sigmas[2] == sigmas[3] == pytest.approx(0.7)


def test_a_step_aside_is_not_taken_and_one_onward_is():
    f = zr.PositionFilter(1.0, method="heading")
    f.update((0.0, 0.0))
    assert f.update((1.0, 0.0)).tolist() == [1.0, 0.0]
    # 59 and 61 degrees to the left.
    onward, aside = ((1.0 + np.cos(a), np.sin(a)) for a in np.radians([59.0, 61.0]))
    held = f.copy()
    assert held.update(aside).tolist() == [1.0, 0.0]
    assert held.held
    assert_same_bits(f.update(onward), np.array(onward))
    assert not f.held
    # Three metres are taken whatever their course.
    assert held.update((-2.0, 0.0)).tolist() == [-2.0, 0.0]


def test_at_rest_the_position_is_the_mean_that_knows_the_error_is_slow():
    """Best linear estimate of a place from fixes with white and Gauss-Markov errors."""
    n, white, slow, time = 40, 0.7, 2.5, 120.0
    fixes = np.random.default_rng(3).normal([5.0, -3.0], 2.0, (n, 2))
    f = zr.PositionFilter(1.0)
    found = f.process(fixes, rest=np.ones(n, bool))
    k = np.arange(n)
    C = white**2 * np.eye(n) + slow**2 * np.exp(-np.abs(k - k[:, None]) / time)
    weights = np.linalg.solve(C, np.ones(n))
    # Both solve the same least squares; C has a condition of 400.
    np.testing.assert_allclose(found[-1], weights @ fixes / weights.sum(), rtol=1e-10)
    assert f.sigma == pytest.approx(1.0 / np.sqrt(weights.sum()), rel=1e-10)


def test_doppler_alone_moves_it():
    """Without fixes it follows the mean of the velocities at both ends of a second."""
    f = zr.PositionFilter(1.0)
    f.update((0.0, 0.0), speed=(0.0, 0.0))
    speeds = np.random.default_rng(2).normal(0.0, 5.0, (30, 2))
    before = f.sigma
    for speed in speeds:
        f.update(NOWHERE, speed=speed)
    expected = speeds.sum(axis=0) - speeds[-1] / 2.0
    np.testing.assert_allclose(f.position, expected, rtol=0.0, atol=1e-12)
    assert f.sigma == pytest.approx(np.sqrt(before**2 + 30 * 0.1**2), rel=1e-12)


def test_where_rest_ends_the_first_second_counts():
    """It stood, and now moves at 2 m/s: one metre, to the noise of the velocity."""
    f = zr.PositionFilter(1.0)
    f.process(np.zeros((100, 2)), rest=np.ones(100, bool))
    before = f.position
    f.update(NOWHERE, speed=(2.0, 0.0))
    np.testing.assert_allclose(f.position - before, [1.0, 0.0], rtol=0.0, atol=1e-12)


def test_an_unknown_velocity_is_the_last_one_and_known_worse():
    f = zr.PositionFilter(1.0, acceleration=0.5)
    f.update((0.0, 0.0), speed=(3.0, 0.0))
    variance = f.sigma**2
    for k in range(1, 4):
        f.update(NOWHERE)
        variance += (0.1 + 0.5 * k) ** 2
        assert f.position[0] == pytest.approx(3.0 * k, rel=1e-14)
        assert f.sigma == pytest.approx(np.sqrt(variance), rel=1e-14)


def test_without_aids_it_follows_the_fixes():
    """Nothing is known of the velocity: 100 m/s a second hold nothing against a fix."""
    fixes = np.cumsum(np.random.default_rng(1).normal(0.0, 10.0, (100, 2)), axis=0)
    np.testing.assert_allclose(zr.PositionFilter(1.0).process(fixes), fixes, rtol=0.0, atol=0.1)


def test_sigmas_cover():
    """Of receivers that are as the filter takes them to be: within three sigma or so."""
    rng = np.random.default_rng(5)
    k, n, T = 400, 300, 1.0
    f = np.exp(-T / 120.0)
    error, place, speed = 2.5 * rng.normal(size=(k, 2)), np.zeros((k, 2)), np.zeros((k, 2))
    fixes, speeds = np.empty((n, k, 2)), np.empty((n, k, 2))
    for i in range(n):
        last, speed = speed, speed + rng.normal(0.0, 0.5, (k, 2))
        # The filter takes the error of a mean velocity for white.
        place = place + 0.5 * (last + speed) * T + rng.normal(0.0, 0.1 * T, (k, 2))
        error = f * error + 2.5 * np.sqrt(1.0 - f * f) * rng.normal(size=(k, 2))
        fixes[i], speeds[i] = place + error + rng.normal(0.0, 0.7, (k, 2)), speed
    flt = zr.PositionFilter(1.0, channels=k)
    flt.process(fixes, speeds)
    # The mean of 800 squares of normal numbers: 0.85 to 1.15 are three of its deviations.
    assert 0.85 < np.mean(((flt.position - place) / flt.sigma[:, None]) ** 2) < 1.15


@BY_METHOD
def test_before_the_first_fix_it_is_unknown(method):
    f = zr.PositionFilter(1.0, method=method)
    blind = np.full((10, 2), np.nan)
    assert np.isnan(f.process(blind, speed=np.ones((10, 2)))).all()
    assert f.missing
    assert f.update((3.0, 4.0)).tolist() == [3.0, 4.0]
    assert not f.missing


@BY_METHOD
def test_a_missing_fix_corrects_nothing(method):
    f = zr.PositionFilter(1.0, method=method)
    f.process(np.full((20, 2), 2.0), rest=np.ones(20, bool))
    before = f.position
    for missing in (NOWHERE, (np.inf, 0.0), (0.0, np.nan), (1e200, 0.0)):
        np.testing.assert_allclose(f.update(missing, rest=True), before, rtol=1e-12)
        assert f.missing
    assert f.samples_seen == 24


@BY_METHOD
def test_times_of_its_own(method):
    rng = np.random.default_rng(1)
    fixes, speeds = rng.normal(size=(2, 100, 2))
    slow, fast = zr.PositionFilter(0.5, method=method), zr.PositionFilter(1.0, method=method)
    assert_same_bits(slow.process(fixes, speeds), fast.process(fixes, speeds, dt=2.0))
    fast.reset()
    each = [fast.update(*sample, dt=2.0) for sample in zip(fixes, speeds, strict=True)]
    assert_same_bits(slow.position, each[-1])


@BY_METHOD
def test_receivers_side_by_side_and_traced(method):
    rng = np.random.default_rng(1)
    fixes, speeds = rng.normal(size=(2, 100, 3, 2))
    cn0, rest = rng.uniform(20.0, 50.0, (100, 3)), rng.random((100, 3)) < 0.3
    f = zr.PositionFilter(1.0, method=method, channels=3)
    found = f.process(fixes, speeds, cn0, rest, threads=2)
    for i in range(3):
        alone = zr.PositionFilter(1.0, method=method)
        given = [np.ascontiguousarray(part[:, i]) for part in (fixes, speeds, cn0, rest)]
        assert_same_bits(found[:, i], alone.process(*given))
    traced = zr.PositionFilter(1.0, method=method, channels=3)
    trace = traced.trace(fixes, speeds, cn0, rest)
    assert_same_bits(trace["position"], found)
    assert traced.to_bytes() == f.to_bytes()
    for name, values in trace.items():
        assert values.shape[:2] == (100, 3)
        assert_same_bits(values[-1], getattr(f, name))


@BY_METHOD
def test_what_a_method_has_no_use_for_it_does_not_look_at(method):
    rng = np.random.default_rng(2)
    fixes, speeds = rng.normal(size=(2, 50, 2))
    plain, told = (zr.PositionFilter(1.0, method=method) for _ in range(2))
    expected, found = plain.process(fixes), told.process(fixes, speeds, np.full(50, 20.0))
    assert (found == expected).all() == (method not in ("aided", "strength"))


@BY_METHOD
@pytest.mark.parametrize("name", [name for name in POSITION_OPTIONS if name != "method"])
def test_a_constant_is_used_or_refused(method, name):
    option, other = POSITION_OPTIONS[name], 3 if name == "window" else 0.07
    if method in option.methods:
        assert f"{name}={other}" in repr(zr.PositionFilter(1.0, method=method, **{name: other}))
        with pytest.raises(ValueError, match=re.escape(f"{name} must be {option.expected}, got")):
            zr.PositionFilter(1.0, method=method, **{name: -1.0})
        return
    with pytest.raises(ValueError, match=f"^{name} has no effect on method '{method}', only on '"):
        zr.PositionFilter(1.0, method=method, **{name: other})


@pytest.mark.parametrize(("call", "told"), [
    (lambda: zr.PositionFilter(1.0, method="mean"),
     "method must be 'aided', 'moving_average', 'kalman', 'heading' or 'strength', got 'mean'"),
    (lambda: zr.PositionFilter(0.0), "rate must be a positive number of samples a second, got 0.0"),
    (lambda: zr.PositionFilter(1.0, method="moving_average", window=2.5),
     "window must be a whole number from 1 to 64, got 2.5"),
    (lambda: zr.PositionFilter(1.0, channels=0), "channels must be at least 1, got 0"),
    (lambda: zr.PositionFilter(1.0).update((0.0, 0.0), dt=-1.0),
     "dt must not be negative, got -1.0 s"),
    (lambda: zr.PositionFilter(1.0).update((0.0, 0.0, 0.0)),
     r"position must have shape \(2,\), got \(3,\)"),
    (lambda: zr.PositionFilter(1.0).update((0.0, 0.0), speed=3.0),
     r"speed must have shape \(2,\), got \(\)"),
    (lambda: zr.PositionFilter(1.0).process(np.zeros((3, 3))),
     r"position must have shape \(n, 2\), got \(3, 3\)"),
    (lambda: zr.PositionFilter(1.0).process(np.zeros((3, 2)), cn0=np.zeros(4)),
     r"cn0 must have shape \(3,\), got \(4,\)"),
    (lambda: zr.PositionFilter(1.0, channels=2).process(np.zeros((3, 2))),
     r"position must have shape \(n, 2, 2\), got \(3, 2\)"),
    (lambda: zr.PositionFilter(1.0).process(np.zeros((3, 2)), dt=np.zeros(2)),
     "dt must have shape"),
])  # fmt: skip
def test_refusals(call, told):
    with pytest.raises(ValueError, match=f"^{told}"):
        call()


@pytest.mark.parametrize("text", [
    "PositionFilter(rate=1.0)",
    "PositionFilter(rate=4.0, error_time=60.0, channels=3)",
    "PositionFilter(rate=1.0, method='moving_average', window=5)",
    "PositionFilter(rate=1.0, method='heading', step=2.0)",
])  # fmt: skip
def test_the_text_is_the_call(text):
    assert repr(eval(text, {"PositionFilter": zr.PositionFilter})) == text
