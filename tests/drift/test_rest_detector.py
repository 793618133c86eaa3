"""RestDetector: against its twin, and what it takes for rest; its laws are those of tests/laws."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import oracle
import zerorate as zr
from support.checks import assert_same_bits
from support.classes import assert_same_state
from support.records import hostile_records, moving_records, ordinary_records
from support.rounding import but_for_rounding

RATE = 100.0
RATES = st.sampled_from([1.0, 7.5, 20.0, 62.5])


def fed(z, rate=20.0, **arguments):
    detector = zr.RestDetector(rate, **arguments)
    detector.process(z)
    return detector


def rest_of(z, rate=RATE):
    return zr.RestDetector(rate).process(z)


def noise(seconds, rate=RATE, seed=1):
    return np.random.default_rng(seed).standard_normal(round(seconds * rate))


def moved(start, motion, *, seconds=600.0, rate=RATE, seed=1):
    """Noise of unit deviation, with `motion` from the second `start` on."""
    z = noise(seconds, rate, seed)
    first = round(start * rate)
    z[first : first + len(motion)] += motion
    return z


def turning(seconds, size, period, rate=RATE):
    return size * np.sin(2.0 * np.pi * np.arange(round(seconds * rate)) / (period * rate))


@given(RATES, st.one_of(moving_records(), ordinary_records()))
def test_the_twin_agrees(rate, z):
    twin = oracle.RestDetector(rate)
    expected = np.array([twin.update(sample) for sample in z.tolist()], dtype=bool)
    with but_for_rounding(z, rate):
        np.testing.assert_array_equal(rest_of(z, rate), expected)


@given(RATES, moving_records())
def test_no_sign_changes_a_decision(rate, z):
    assert_same_bits(rest_of(-z, rate), rest_of(z, rate))


@given(RATES, moving_records((0.0,)), st.floats(1e-150, 1e150))
def test_no_unit_changes_a_decision(rate, z, a):
    """Of samples of which no two lie as far off as each other, which rounding would decide."""
    assert_same_bits(rest_of(a * z, rate), rest_of(z, rate))


@given(RATES, st.lists(hostile_records(), min_size=1, max_size=4))
def test_whatever_comes_a_new_rest_is_found(rate, parts):
    """Hostile samples leave no state that noise could not end."""
    z = np.concatenate(parts)
    seen = z[np.isfinite(z)]
    size = np.max(np.abs(seen), initial=1.0)
    detector = fed(z, rate)
    # As large as the largest, and a trifle beside it.
    for a in (min(size, 1e299), 1.0):
        detector.process(a * noise(400.0, rate=max(rate, 10.0)))
        assert detector.at_rest is True


def test_a_large_offset_changes_no_decision():
    # Multiples of what a float of 1e7 resolves, so that the offset itself rounds nothing.
    z = np.round(1e-4 * moved(50.0, turning(10.0, 30.0, 5.0)) * 2.0**29) / 2.0**29
    assert_same_bits(rest_of(1e7 + z), rest_of(z))


NOISE = {
    "white": lambda rng, n: rng.standard_normal(n),
    "heavy tails": lambda rng, n: rng.standard_t(3, n),
    "outliers": lambda rng, n: rng.standard_normal(n) + 50.0 * (rng.random(n) < 1e-3),
    "fine steps": lambda rng, n: np.round(3.0 * rng.standard_normal(n)),
    "coarse steps": lambda rng, n: np.round(0.1 * rng.standard_normal(n) + 0.49),
    "two levels": lambda rng, n: np.round(np.cumsum(0.003 * rng.standard_normal(n))),
    "random walk": lambda rng, n: rng.standard_normal(n) + 0.01 * np.cumsum(rng.standard_normal(n)),
    "fast random walk": lambda rng, n: (
        rng.standard_normal(n) + np.cumsum(0.1 * rng.standard_normal(n))
    ),
    "warming up": lambda rng, n: rng.standard_normal(n) + 5.0 * np.exp(-np.arange(n) / (n / 10)),
    "one sample in five": lambda rng, n: np.where(np.arange(n) % 5, np.nan, rng.standard_normal(n)),
    "some missing": lambda rng, n: np.where(rng.random(n) < 0.3, np.nan, rng.standard_normal(n)),
    "constant": lambda rng, n: np.full(n, 3.3),
}


@pytest.mark.parametrize("kind", NOISE)
def test_noise_is_rest(kind):
    rest = rest_of(NOISE[kind](np.random.default_rng(3), 200_000))
    assert not np.any(rest[:100])
    # A false alarm takes 2 s; the seven of heavy tails lose 0.4 %.
    assert np.mean(rest[200:]) > 0.99


@pytest.mark.parametrize("rate", [1.0, 3.0, 10.0, 8000.0])
def test_at_every_rate_noise_is_rest(rate):
    rest = rest_of(noise(max(100.0, 6000.0 / rate), rate), rate)
    # Six ticks of a quarter of a second or four samples.
    first = 6 * max(4, round(rate / 4.0))
    assert not np.any(rest[: first - 1])
    assert np.all(rest[first - 1 :])


@pytest.mark.parametrize("size", [2.0, 10.0, 1000.0])
@pytest.mark.parametrize("period", [0.5, 2.0, 10.0, 20.0])
def test_motion_is_no_rest(size, period):
    """From two deviations of the samples on, whatever the period."""
    rest = rest_of(moved(300.0, turning(120.0, size, period), seed=4))
    # Turning at the steepest, the level is 4.9 deviations of a tick (0.2) off within 2.5 s.
    assert np.all(rest[200:30_000])
    assert np.mean(rest[30_250:42_000]) < (0.25 if size == 2.0 else 0.03)
    # The rest after it is that before.
    assert np.all(rest[42_300:])


def test_a_step_ends_rest_within_a_tick_and_its_end_begins_it_after_one_and_a_half_seconds():
    rest = rest_of(moved(60.0, np.full(500, 5.0), seconds=120.0))
    ends = np.flatnonzero(np.diff(rest)) + 1
    assert ends.tolist() == [149, 6024, 6649]


def test_a_start_in_motion_is_found_out():
    """Turning to and fro at a steady rate, as of a motor that reverses every 3.6 s."""
    n = 200_000
    z = noise(n / RATE) + 50.0 * np.where(np.arange(n) // 360 % 2, 1.0, -1.0)
    rest = rest_of(z)
    assert np.all(rest[149:360])
    assert not np.any(rest[400:])


def test_a_start_in_turning_believes_in_rest_after_it():
    z = moved(0.0, turning(20.0, 30.0, 4.0), seconds=60.0)
    rest = rest_of(z)
    assert not np.any(rest[:2000])
    assert np.all(rest[3100:])


@pytest.mark.parametrize(("size", "seconds"), [(1.0, 20.0), (3.0, 40.0), (30.0, 60.0)])
def test_a_level_that_stays_is_taken_for_rest(size, seconds):
    """A bias that jumps; ten seconds and as many again a deviation, a minute at most."""
    z = noise(600.0)
    z[30_000:] += size
    rest = rest_of(z)
    first = 30_000 + round(100 * seconds)
    assert not np.any(rest[30_074 : first - 100])
    # The deviation without the farthest of 25 samples is a tenth smaller, so distances are larger.
    assert np.all(rest[first + 500 :])


def test_the_level_before_is_known_again():
    """After a turn so long and steady that it was taken for rest."""
    rest = rest_of(moved(300.0, np.full(9000, 30.0)))
    assert np.all(rest[36_100:39_000])
    assert not np.any(rest[39_024:39_124])
    assert np.all(rest[39_174:])


def test_louder_noise_becomes_normal_and_quiet_is_known_again():
    z = noise(900.0)
    z[30_000:60_000] *= 4.0
    rest = rest_of(z)
    # As long as the root of the deviation tells: twice ten seconds.
    assert not np.any(rest[30_024:31_900])
    assert np.all(rest[32_200:59_900])
    assert np.mean(rest[60_000:]) > 0.99


def test_motion_in_louder_noise_is_seen():
    z = moved(600.0, turning(60.0, 40.0, 6.0), seconds=900.0)
    z[30_000:] += 3.0 * noise(600.0, seed=2)
    rest = rest_of(z)
    assert np.all(rest[33_000:59_900])
    assert np.mean(rest[60_050:66_000]) < 0.01


def test_shaking_never_becomes_normal():
    """Its variance changes from tick to tick, and an engine's does not."""
    rate = 0.5 + 2.0 * np.random.default_rng(2).random(30_000).cumsum() / np.arange(1, 30_001)
    shaking = (
        300.0 * np.sin(2.0 * np.pi * np.cumsum(rate) / RATE) * (1.0 + 0.5 * turning(300, 1, 6))
    )
    rest = rest_of(moved(100.0, shaking))
    assert not np.any(rest[10_024:40_000])


def test_too_few_samples_change_nothing():
    z = noise(100.0)
    for gap in (slice(3000, 3999), slice(7000, 7024)):
        z[gap] = np.nan
    rest = rest_of(z)
    assert np.all(rest[149:])


def test_answers_are_bools():
    single, pair = zr.RestDetector(RATE), zr.RestDetector(RATE, channels=2)
    assert single.update(1.0) is False
    assert single.update(None) is False
    assert single.at_rest is False
    assert_same_bits(pair.update([1.0, 2.0]), np.array([False, False]))
    assert_same_bits(pair.at_rest, np.array([False, False]))
    assert single.process(noise(10.0)).dtype == np.bool_
    assert single.at_rest is True


WRONG = [
    (
        {"rate": 5e-324},
        ValueError,
        "rate must be a positive number of samples a second, got 5e-324",
    ),
    ({"rate": 0.0}, ValueError, "rate must be a positive number of samples a second, got 0.0"),
    ({"rate": math.inf}, ValueError, "rate must be a positive number of samples a second, got inf"),
    ({"rate": "fast"}, TypeError, "rate"),
    ({"channels": 0}, ValueError, "channels must be at least 1, got 0"),
]


@pytest.mark.parametrize(("arguments", "error", "words"), WRONG)
def test_wrong_arguments(arguments, error, words):
    with pytest.raises(error, match=words):
        zr.RestDetector(**{"rate": RATE, **arguments})


@pytest.mark.parametrize("rate", [1e-308, 1e-9, 1e15, 1.7e308])
def test_strange_rates(rate):
    detector = zr.RestDetector(rate)
    detector.process(np.random.default_rng(1).standard_normal(1000))
    assert_same_state(zr.RestDetector.from_bytes(detector.to_bytes()), detector)


def test_a_wrong_batch_changes_nothing():
    detector = fed(np.arange(100.0))
    before = detector.to_bytes()
    with pytest.raises(ValueError, match=r"z must have shape \(n,\), got \(3, 2\)"):
        detector.process(np.zeros((3, 2)))
    with pytest.raises(ValueError, match="threads must be at least 1, got 0"):
        detector.process([1.0], threads=0)
    with pytest.raises(TypeError, match=r"update\(\) takes one number"):
        detector.update([1.0])
    assert detector.to_bytes() == before


@pytest.mark.parametrize("held", [100, 6000, 30_000])
def test_an_output_that_seldom_changes_can_be_saved(held):
    """As of a sensor far coarser than its noise."""
    z = np.repeat(np.arange(12.0) % 2.0, held)
    for length in (3 * held, 12 * held, 12 * held - 7):
        f = fed(z[:length])
        assert_same_state(zr.RestDetector.from_bytes(f.to_bytes()), f)


@pytest.mark.parametrize("rate", [20.0, 100.0])
def test_outliers_after_motion_are_outliers(rate):
    """Motion has not taught that they are noise."""
    rng = np.random.default_rng(11)
    n = round(300.0 * rate)
    z = 0.3 + 0.1 * rng.standard_normal(n)
    k = np.arange(round(60.0 * rate))
    z[len(k) : 2 * len(k)] += 50.0 * np.sin(4.4 * k / rate) + 20.0 * np.sin(13.0 * k / rate)
    f = zr.DriftFilter(rate, method="auto", output="estimate")
    f.process(z[: 2 * len(k)])
    spoilt = z[2 * len(k) :] + 10.0 * (rng.random(n - 2 * len(k)) < 0.02)
    bias = f.process(spoilt)
    # Held until rest is found again, and not moved by the outliers afterwards.
    assert np.max(np.abs(bias - 0.3)) < 5.0 * 0.1 / np.sqrt(10.0 * rate)
    assert f.status == "at rest"
