"""A network as state equation: what it learns, what it gains over AR, and when it is refused."""

import numpy as np
import pytest

from support.recordings import column, needs_recordings
from zerorate import identification
from zerorate.identification import network

NOISE = 0.5
NOISY = np.random.default_rng(1).standard_normal(2000)


def autoregressive(n, seed=1):
    """AR(2) with roots of 0.9 and 0.5."""
    a = np.random.default_rng(seed).standard_normal(n)
    z = np.zeros(n)
    for k in range(2, n):
        z[k] = 1.4 * z[k - 1] - 0.45 * z[k - 2] + a[k]
    return z


def bent(n, seed=1):
    """A map that no autoregression can be; without noise it comes to rest at 0.37."""
    a = NOISE * np.random.default_rng(seed).standard_normal(n)
    z = np.zeros(n)
    for k in range(1, n):
        z[k] = 0.5 * np.cos(2.0 * z[k - 1]) + a[k]
    return z


@pytest.fixture(scope="module")
def linear():
    return identification.fit_network(autoregressive(10_000), inputs=2)


@pytest.fixture(scope="module")
def curved():
    return identification.fit_network(bent(4000), inputs=1, hidden=4)


def test_it_gains_nothing_on_what_is_linear(linear):
    assert linear.verdict == "no gain"
    # Five weights more than AR has: each costs one part in 10,000 of the variance, on the mean.
    assert abs(linear.gain_over_ar) < 0.003
    assert linear.limit_cycle < 1e-6
    assert (linear.n, linear.held_out) == (4998, 4998)


def test_it_has_found_the_coefficients(linear):
    """At the mean its gradient is theirs: to three of their standard errors and the curvature."""
    np.testing.assert_allclose(linear.gradient(np.zeros(2)), [1.4, -0.45], rtol=0.0, atol=0.06)


def test_it_gains_on_what_is_not_linear(curved):
    assert curved.verdict == "gain"
    assert curved.gain_over_ar > 0.05
    # All but the noise can be learned.
    assert curved.rmse == pytest.approx(NOISE, rel=0.05)


def test_what_oscillates_by_itself_says_so():
    """Van der Pol's oscillator in steps, with noise: the map alone goes round for ever."""
    rng, x, v, z = np.random.default_rng(1), 1.0, 0.0, np.empty(6000)
    for k in range(z.size):
        v += 0.3 * ((1.0 - x * x) * v - x)
        x += 0.3 * v
        z[k] = x + 0.01 * rng.standard_normal()
    found = identification.fit_network(z, inputs=3, hidden=4)
    assert found.limit_cycle > 0.5
    assert found.verdict == "oscillates"


def test_gradient_is_that_of_the_step(curved, linear):
    for model in (curved, linear):
        past = np.random.default_rng(3).normal(0.0, 0.5, (7, model.inputs))
        for i in range(model.inputs):
            h = 1e-5 * np.eye(model.inputs)[i]
            slope = (model.step(past + h) - model.step(past - h)) / 2e-5
            # A central difference of 1e-5 is right to 1e-10 of curvatures, its rounding to 1e-11.
            np.testing.assert_allclose(model.gradient(past)[:, i], slope, rtol=1e-7, atol=1e-8)


def test_predictions_are_the_steps(curved):
    z = bent(300, seed=2)
    z[100] = np.nan
    predicted = curved.predict(z)
    assert np.isnan(predicted[:1]).all()
    assert np.isnan(predicted[101])
    assert predicted[200] == pytest.approx(float(curved.step(z[199:200])), rel=1e-15)
    there = np.isfinite(predicted) & np.isfinite(z)
    assert np.sqrt(np.mean((z - predicted)[there] ** 2)) == pytest.approx(curved.rmse, rel=0.2)


def test_the_unit_does_not_matter():
    z = autoregressive(3000)
    plain, scaled = (identification.fit_network(a * z, inputs=2) for a in (1.0, 2.0**40))
    assert scaled.gain_over_ar == pytest.approx(plain.gain_over_ar, rel=1e-9)
    np.testing.assert_array_equal(scaled.weights, plain.weights)
    assert scaled.rmse == pytest.approx(2.0**40 * plain.rmse, rel=1e-12)


def test_a_seed_is_a_start():
    z = autoregressive(3000)
    once, again, other = (identification.fit_network(z, inputs=2, seed=seed) for seed in (4, 4, 5))
    np.testing.assert_array_equal(once.weights, again.weights)
    assert not np.array_equal(once.weights, other.weights)


def test_missing_samples_are_left_out():
    z = autoregressive(8000)
    z[np.random.default_rng(1).random(8000) < 0.05] = np.inf
    found = identification.fit_network(z, inputs=2)
    # A step needs three samples.
    assert found.n == pytest.approx(0.95**3 * 4000, rel=0.02)
    assert abs(found.gain_over_ar) < 0.005


def test_the_longest_training():
    """Twenty thousand samples, however long the record."""
    z = np.random.default_rng(1).standard_normal(60_000)
    found = identification.fit_network(z, inputs=1, hidden=1)
    assert (found.n, found.held_out) == (
        network.MAX_TRAINING_SAMPLES - 1,
        60_000 - network.MAX_TRAINING_SAMPLES - 1,
    )


@pytest.mark.parametrize(("z", "how", "message"), [
    (np.zeros(5), {"inputs": 0}, "inputs must be from 1 to 64, got 0"),
    (np.zeros(5), {"hidden": 9}, "hidden must be from 1 to 8, got 9"),
    (np.arange(1499.0), {}, "a network of 15 weights needs at least 1500 samples, got 1499"),
    (np.zeros(9000), {}, "a network of 15 weights needs samples that differ, all 9000 are 0"),
    (np.append(np.full(2000, np.nan), NOISY), {},
     "a network of 15 weights needs 750 samples for training, 50 a weight"),
    (np.append(NOISY, np.full(2000, np.nan)), {},
     "the second half of z has no step without a missing sample for the test"),
    (np.append(np.zeros(2000), NOISY), {}, "needs samples that differ"),
    (1e200 * NOISY, {}, "too large or too small to be squared"),
    (np.zeros((9000, 2)), {}, "z must be one axis"),
])  # fmt: skip
def test_refusals(z, how, message):
    with pytest.raises(ValueError, match=message):
        identification.fit_network(z, **how)


def test_numbers_that_are_none():
    with pytest.raises(TypeError):
        identification.fit_network(np.zeros(9000), hidden=2.5)


@pytest.mark.every(4)
@needs_recordings
@pytest.mark.parametrize("axis", "xyz")
@pytest.mark.parametrize("name", ["adis16405_static_100hz_run1", "mpu6050_static_100hz"])
def test_it_gains_nothing_on_gyros(name, axis):
    """Less than one per cent on every axis, and where it gains at all it oscillates by itself."""
    found = identification.fit_network(column(name, f"gyro_{axis}_dps")[:30_000])
    assert abs(found.gain_over_ar) < 0.01
    oscillates = (name, axis) == ("adis16405_static_100hz_run1", "z")
    assert found.verdict == ("oscillates" if oscillates else "no gain")
    assert (found.limit_cycle > 0.15) == oscillates
