"""Outliers, stuck sensors, gaps and motion: the filters against their literal NumPy twins."""

from itertools import product

import numpy as np
import pytest

import oracle
import zerorate as zr
from oracle.agreement import COUNTS, RATE, SIGNALS, assert_equal_to_twin, record
from oracle.test_oracle import differences

# What a sample of `record` deviates by, offset and drift aside.
NOISE = 0.1


def outliers(rng, z):
    """Of either sign, ten and a hundred deviations."""
    hit = rng.random(len(z)) < 0.02
    return z + hit * rng.choice([-100.0, -10.0, 10.0, 100.0], len(z)) * NOISE


def one_sided(rng, z):
    return z + 20.0 * NOISE * (rng.random(len(z)) < 0.05)


def bursts(rng, z):
    """Some too short to be motion, some too long for outliers."""
    z = z.copy()
    for k in rng.integers(0, len(z), 12):
        z[k : k + rng.integers(2, 25)] += rng.choice([-30.0, 30.0]) * NOISE
    return z


def stuck(rng, z):
    """At zero, at the last value and at the end of the range, for up to ten seconds."""
    z = z.copy()
    for k in rng.integers(0, len(z), 8):
        z[k : k + rng.integers(2, 1000)] = rng.choice([0.0, z[k], 9.0 * NOISE])
    return z


def gaps(rng, z):
    """Which leave one to three samples in a tick, or none."""
    z = z.copy()
    for k in rng.integers(0, len(z), 6):
        n = rng.integers(100, 2000)
        z[k : k + n][rng.random(len(z[k : k + n])) > rng.choice([0.02, 0.08, 0.2])] = np.nan
    return z


def coarse(rng, z):
    step = rng.choice([0.3, 1.0, 3.0]) * NOISE
    return np.round(z / step) * step


def motion(rng, z):
    z = z.copy()
    for k in rng.integers(0, len(z), 4):
        n = len(z[k : k + rng.integers(100, 3000)])
        turning = np.sin(np.arange(n) / rng.uniform(2.0, 200.0))
        z[k : k + n] += rng.choice([5.0, 50.0]) * NOISE * turning
    return z


def start_in_motion(rng, z):
    n = rng.integers(100, 4000)
    turning = np.sin(np.arange(n) / rng.uniform(2.0, 200.0))
    return z + np.append(rng.choice([5.0, 50.0]) * NOISE * turning, np.zeros(len(z) - n))


def louder_start(rng, z):
    """A quieter level of noise is found later."""
    return z * np.where(np.arange(len(z)) < rng.integers(100, 5000), 8.0, 1.0)


def steps(rng, z):
    z = z.copy()
    for k in rng.integers(0, len(z), 4):
        z[k:] += 20.0 * NOISE * rng.standard_normal()
    return z


SPOILERS = [
    outliers,
    one_sided,
    bursts,
    stuck,
    gaps,
    coarse,
    motion,
    start_in_motion,
    louder_start,
    steps,
]
SPOILT = {f.__name__: f for f in SPOILERS}
SETTINGS = {
    "default": {},
    "limit": {"limit": 12.0 * NOISE},
    "rest limit": {"rest_limit": 4.0 * NOISE},
    "bias limit": {"bias_limit": 6.0 * NOISE},
    "all limits": {"limit": 40.0 * NOISE, "rest_limit": 1.5 * NOISE, "bias_limit": 15.0 * NOISE},
    "ignore": {"motion": "ignore", "limit": 40.0 * NOISE},
    "long start": {"startup": 5.0, "rest_limit": 4.0 * NOISE},
}
BY_SPOILT = pytest.mark.parametrize("spoilt", SPOILT)


def spoilt_record(spoilt, n, signal="walk", seed=1):
    return SPOILT[spoilt](np.random.default_rng(seed + 10), record(signal, n, seed))


# Each record in the default setting and in every third other one, each setting on many records.
@pytest.mark.every(6)
@pytest.mark.parametrize(
    ("spoilt", "setting"),
    [
        (spoilt, setting)
        for i, spoilt in enumerate(SPOILT)
        for j, setting in enumerate(SETTINGS)
        if setting == "default" or (i + j) % 3 == 0
    ],
)
def test_every_setting_on_spoilt_records(spoilt, setting):
    assert_equal_to_twin(spoilt_record(spoilt, 8000), **SETTINGS[setting])


# Each kind of record is tried at another rate above.
@pytest.mark.every(5)
@pytest.mark.parametrize(
    "case",
    [
        (spoilt, rate)
        for i, spoilt in enumerate(SPOILT)
        for rate in ((4.0, 62.5), (20.0, 1000.0))[i % 2]
    ],
)
def test_every_rate(case):
    spoilt, rate = case
    signal = "white" if rate < RATE else "quantised"
    assert_equal_to_twin(spoilt_record(spoilt, 8000, signal), rate)


@pytest.mark.every(3)
@pytest.mark.parametrize("seed", range(12))
def test_several_at_once(seed):
    rng = np.random.default_rng(seed)
    z = record(rng.choice([*SIGNALS]), 8000, seed)
    for spoiler in rng.choice(SPOILERS, 3, replace=False):
        z = spoiler(rng, z)
    assert_equal_to_twin(z, **SETTINGS[[*SETTINGS][seed % len(SETTINGS)]])


@pytest.mark.slow
@BY_SPOILT
@pytest.mark.parametrize("signal", SIGNALS)
def test_a_hundred_thousand_samples_of_every_kind(spoilt, signal):
    assert_equal_to_twin(spoilt_record(spoilt, 100_000, signal))


def test_the_records_show_what_they_are_for():
    """Each kind of sample that is left out, and each that is not taken for one."""
    clean = assert_equal_to_twin(record("walk", 8000))
    # Of normal samples one in 16 000 is four deviations off, and a few more of a second's median.
    assert (clean.saturated_count, clean.stuck_count) == (0, 0)
    assert clean.outlier_count < 8
    assert assert_equal_to_twin(spoilt_record("outliers", 8000)).outlier_count > 100
    assert assert_equal_to_twin(spoilt_record("stuck", 8000)).stuck_count > 1000
    limited = assert_equal_to_twin(spoilt_record("one_sided", 8000), limit=1.5)
    assert limited.saturated_count > 300


@pytest.mark.every(2)
@pytest.mark.parametrize("setting", ["default", "all limits"])
@pytest.mark.parametrize("spoilt", ["start_in_motion", "stuck", "louder_start"])
def test_the_status_after_every_sample(spoilt, setting):
    z, arguments = spoilt_record(spoilt, 12_000), SETTINGS[setting]
    f, twin = zr.DriftFilter(RATE, method="auto", **arguments), oracle.AutoFilter(RATE, **arguments)
    for sample in z.tolist():
        f.update(sample)
        twin.update(sample)
        assert f.status == twin.status


@pytest.mark.every(10)
@BY_SPOILT
@pytest.mark.parametrize("limits", [{}, {"rest_limit": 10.0 * NOISE, "bias_limit": 10.0 * NOISE}])
def test_rest_alone(spoilt, limits):
    z = spoilt_record(spoilt, 20_000, "white")
    twin = oracle.RestDetector(RATE, **limits)
    expected = np.array([twin.update(sample) for sample in z.tolist()], dtype=bool)
    np.testing.assert_array_equal(zr.RestDetector(RATE, **limits).process(z), expected)


GATED = [
    {"method": "kf", "outliers": "reject"},
    {"method": "akf", "outliers": "reject", "limit": 40.0 * NOISE},
    {"method": "fading", "outliers": "reject", "motion": "hold"},
    {"method": "fading", "motion": "hold"},
    {"method": "kf", "limit": 12.0 * NOISE},
]


@pytest.mark.every(8)
@pytest.mark.parametrize("case", [*product(GATED, SPOILT)], ids=str)
def test_published_filters_that_are_kept_from_some_samples(case):
    arguments, spoilt = case
    z = spoilt_record(spoilt, 4000, "white")
    f, twin = zr.DriftFilter(RATE, **arguments), oracle.GatedFilter(RATE, **arguments)
    trace, expected = f.trace(z), twin.trace(z)
    for name in ("missing", "at_rest", "saturated", "stuck", "guarded"):
        np.testing.assert_array_equal(getattr(trace, name), expected[name], err_msg=name)
    for name in COUNTS:
        assert getattr(f, name) == getattr(twin.tally, name), name
    found = differences(trace, expected, z)
    assert max(found.values()) <= 1e-10, found
