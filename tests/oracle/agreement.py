"""The self-tuning filter beside its twin: records, and how far both may differ."""

import numpy as np
from scipy.signal import lfilter

import oracle
import zerorate as zr

# Both sides round some hundred operations a block to 1.1e-16, and forget old errors: 4e-14 is seen.
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
FLAGS = ["missing", "at_rest", "saturated", "stuck"]
COUNTS = ["saturated_count", "outlier_count", "stuck_count"]


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
    """All numbers and all decisions; returns the filter after the record."""
    f, twin = zr.DriftFilter(rate, method="auto", **arguments), oracle.AutoFilter(rate, **arguments)
    trace, expected = f.trace(z), twin.trace(z)
    for name in FLAGS:
        np.testing.assert_array_equal(getattr(trace, name), expected[name], err_msg=name)
    for name in COUNTS:
        assert getattr(f, name) == getattr(twin.tally, name), name
    assert (f.status, f.restart_count) == (twin.status, twin.restarts)
    found = differences(trace, expected, z)
    assert max(found.values()) <= TOLERANCE + tick_rounding(z, rate / 4.0), found
    return f
