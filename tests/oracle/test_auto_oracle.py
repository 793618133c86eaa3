"""The filter that tunes itself against its literal NumPy twin."""

import numpy as np
import pytest
from scipy.signal import lfilter

import oracle
import zerorate as zr

# Both sides round some hundred operations a block to 1.1e-16, and forget old errors: 4e-14 is seen.
# The twin's P + qt - C^2/S cancels where a gap has left a P far beyond the noise: after an hour
# unseen, q of a hundred noises a block loses five digits of sixteen.
TOLERANCE = 1e-10
EPSILON = np.finfo(float).eps
RATE = 100.0
NAMES = [
    "estimate",
    "bias",
    "bias_sigma",
    "innovation",
    "innovation_variance",
    "gain",
    "measurement_noise",
    "process_noise",
    "covariance",
    "coefficients",
]


def white(rng, n):
    return rng.standard_normal(n)


def walk(rng, n):
    return white(rng, n) + np.cumsum(1e-3 * white(rng, n))


def strong_walk(rng, n):
    return white(rng, n) + np.cumsum(0.3 * white(rng, n))


def quantised(rng, n):
    """Most samples repeat the one before."""
    return np.round(0.5 * white(rng, n))


def hump(rng, n):
    """At 0.18 of the rate, with poles of radius 0.97."""
    resonance = np.poly(0.97 * np.exp(2j * np.pi * 0.18 * np.array([1.0, -1.0]))).real
    return 0.1 * white(rng, n) + lfilter([0.06], resonance, white(rng, n))


def with_missing(rng, n):
    """At the start, at random, and in gaps shorter and longer than a block."""
    z = walk(rng, n)
    z[rng.random(n) < 0.05] = np.nan
    z[:7] = np.inf
    z[n // 3 : n // 3 + n // 50] = np.nan
    z[n // 2 : n // 2 + 40] = np.nan
    return z


def louder(rng, n):
    """Ten times as loud in its second half."""
    return walk(rng, n) * np.where(np.arange(n) < n // 2, 1.0, 10.0)


SIGNALS = {f.__name__: f for f in (white, walk, strong_walk, quantised, hump, with_missing, louder)}


def record(signal, n, seed=1):
    return 0.3 + 0.1 * SIGNALS[signal](np.random.default_rng(seed), n)


def tick_rounding(z, length):
    """What a last place in the mean of a tick, in the unit of the samples, is in its deviations."""
    seen = z[np.isfinite(z)]
    return 4.0 * EPSILON * np.max(np.abs(seen)) / np.std(seen) * np.sqrt(length)


def differences(trace, twin, z):
    """Largest difference of each array, relative to what it is made of."""
    deviation = np.std(z[np.isfinite(z)])
    scales = {name: twin[name] for name in NAMES}
    scales |= dict.fromkeys(("estimate", "bias", "innovation"), deviation)
    return {name: relative(getattr(trace, name), twin[name], scales[name]) for name in NAMES}


def relative(got, expected, scale):
    difference = np.abs(got.reshape(len(expected)) - expected)
    # Nothing may differ where the scale is zero: before the first two unequal samples.
    return np.max(difference / np.where(np.abs(scale) > 0.0, scale, np.finfo(float).tiny))


def assert_equal_to_twin(z, rate=RATE, **arguments):
    trace = zr.DriftFilter(rate, method="auto", **arguments).trace(z)
    twin = oracle.AutoFilter(rate, **arguments).trace(z)
    np.testing.assert_array_equal(trace.missing, twin["missing"])
    np.testing.assert_array_equal(trace.at_rest, twin["at_rest"])
    found = differences(trace, twin, z)
    assert max(found.values()) <= TOLERANCE + tick_rounding(z, rate / 4.0), found


@pytest.mark.parametrize("signal", SIGNALS)
def test_every_signal(signal):
    assert_equal_to_twin(record(signal, 15_000))


def test_a_hundred_thousand_samples():
    assert_equal_to_twin(record("with_missing", 100_000))


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(2, 5))
@pytest.mark.parametrize("signal", SIGNALS)
def test_a_hundred_thousand_samples_of_every_kind(signal, seed):
    assert_equal_to_twin(record(signal, 100_000, seed))


@pytest.mark.parametrize("signal", ["white", "with_missing"])
@pytest.mark.parametrize("rate", [1.0, 10.0, 62.5, 2000.0 / 7.0, 1000.0])
def test_every_rate(rate, signal):
    assert_equal_to_twin(record(signal, min(15_000, int(600 * rate))), rate)


@pytest.mark.parametrize("offset", [-1e7, 1e4])
def test_far_from_zero(offset):
    assert_equal_to_twin(offset + record("walk", 10_000))


@pytest.mark.parametrize(
    "arguments",
    [
        {"startup": 1e-3},
        {"startup": 0.37},
        {"startup": 5.0},
        {"scale": 0.1},
        {"scale": 7.0},
        {"motion": "ignore"},
    ],
    ids=str,
)
def test_every_setting(arguments):
    assert_equal_to_twin(record("with_missing", 10_000), **arguments)


def test_a_start_up_of_equal_samples_goes_on_until_two_differ():
    z = record("white", 5000)
    z[:1234] = 0.25
    assert_equal_to_twin(z)


def test_motion():
    z = record("walk", 40_000)
    z[12_000:15_000] += 50.0 * np.sin(np.arange(3000) / 40.0)
    z[26_000:] += 3.0
    assert_equal_to_twin(z)


@pytest.mark.parametrize("seen", [0, 50, 777, 5999])
def test_switched_on_again(seen):
    """What was learned about the noise stays, the drift begins anew."""
    z = record("walk", 12_000)
    f, twin = zr.DriftFilter(RATE, method="auto"), oracle.AutoFilter(RATE)
    f.process(z[:seen])
    for sample in z[:seen]:
        twin.update(sample)
    f.power_on()
    twin.power_on()
    later = 5.0 - z[seen:]
    found = differences(f.trace(later), twin.trace(later), later)
    assert max(found.values()) <= TOLERANCE, found
