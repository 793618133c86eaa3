"""Deviations of the Allan family against their printed sums, allantools, and themselves."""

import warnings

import allantools
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from oracle import deviations as oracle
from zerorate._native import allan_deviations, longest_factor

KINDS = sorted(oracle.KINDS)
BY_KIND = pytest.mark.parametrize("kind", KINDS)
FACTORS = [1, 2, 3, 4, 7, 10, 12, 16]

# Some hundred roundings of 1e-16 of a sum of some ten samples, in terms that may be a hundredth
# of it.
TOLERANCE = 1e-11


def noise(n, seed=1):
    return np.random.default_rng(seed).standard_normal(n)


def walk(n, seed=1):
    return np.cumsum(noise(n, seed))


@st.composite
def records(draw):
    """White noise or a walk of up to 70 samples on an offset, with gaps."""
    seed, n = draw(st.integers(0, 2**32 - 1)), draw(st.integers(0, 70))
    make = draw(st.sampled_from([noise, walk]))
    z = draw(st.sampled_from([1e-9, 1.0, 1e9])) * (make(n, seed) + draw(st.floats(-10.0, 10.0)))
    for gap in draw(st.lists(st.integers(0, max(n - 1, 0)), max_size=4)):
        z[gap : gap + 1 + gap % 3] = draw(st.sampled_from([np.nan, np.inf, -np.inf]))
    return z


@pytest.mark.every(2)
@BY_KIND
@given(z=records())
def test_equals_the_printed_sum(kind, z):
    deviation, terms, _ = allan_deviations(z, FACTORS, kind)
    for i, m in enumerate(FACTORS):
        expected, count = oracle.deviation(z, m, kind)
        assert terms[i] == count
        assert deviation[i] == pytest.approx(expected, rel=TOLERANCE, abs=0.0, nan_ok=True)


@BY_KIND
def test_the_longest_factor_is_the_last_with_a_term(kind):
    for n in [0, 1, 2, 3, 9, 10, 11, 30, 31, 32, 100]:
        _, terms, _ = allan_deviations(noise(n), range(1, n + 2), kind)
        factors = 1 + np.flatnonzero(terms)
        assert longest_factor(kind, n) == (factors[-1] if factors.size else 0)


@BY_KIND
def test_equals_allantools(kind):
    z = walk(600) + 100.0 * noise(600, 11)
    factors = [10, 16, 64, 100] if kind == "theo1" else [1, 2, 5, 16, 33, 64]
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of its own deprecated calls
        answer = getattr(allantools, kind)(z, rate=1.0, data_type="freq", taus=factors)
    taus, theirs = answer[:2]
    ours, _, _ = allan_deviations(z, np.rint(taus).astype(int).tolist(), kind)
    assert len(ours) == len(factors)
    # Both round 1e-16 of a phase of 1e4 in terms from 1e2 on.
    np.testing.assert_allclose(ours, theirs, rtol=1e-9)


@pytest.mark.parametrize("kind", ["oadev", "mdev", "ohdev", "totdev", "pdev", "mtotdev", "theo1"])
def test_small_noise_on_a_large_offset(kind):
    z = 1e7 + 1e-4 * noise(3000)
    factors = [m for m in FACTORS if longest_factor(kind, 3000) >= m]
    # The noise that is left when 1e7 is added: subtracting 1e7 is exact.
    small, _, _ = allan_deviations(z - 1e7, factors, kind)
    large, _, _ = allan_deviations(z, factors, kind)
    np.testing.assert_allclose(large, small, rtol=1e-6)


@BY_KIND
def test_threads_and_company_change_no_bit(kind):
    z = noise(3 * 2500).reshape(-1, 3)
    z[700:710, 1] = np.nan
    factors = [1, 2, 3, 4, 5, 10, 20, 40, 80, 160]
    alone = allan_deviations(z, factors, kind, threads=1)
    for threads in [None, 2, 3]:
        for one, other in zip(alone, allan_deviations(z, factors, kind, 0, threads), strict=True):
            np.testing.assert_array_equal(one, other)
    for c in range(3):
        for several, single in zip(alone, allan_deviations(z[:, c], factors, kind), strict=True):
            np.testing.assert_array_equal(several[:, c], single)


@BY_KIND
@pytest.mark.parametrize("scale", [2.0**-1060, 2.0**-600, 2.0**600, 2.0**1015])
def test_no_scale_overflows(kind, scale):
    z = np.round(noise(200) * 8.0)
    deviation, _, _ = allan_deviations(z, [1, 10], kind)
    scaled, _, _ = allan_deviations(z * scale, [1, 10], kind)
    # At 2^-1060 a deviation of order 1 has 14 bits left.
    np.testing.assert_allclose(scaled, deviation * scale, rtol=1e-4 if scale < 1e-300 else 1e-14)


@BY_KIND
def test_a_constant_has_no_deviation(kind):
    deviation, terms, _ = allan_deviations(np.full(100, 0.1), [1, 10], kind)
    np.testing.assert_array_equal(deviation[terms > 0], 0.0)
    assert terms[1] > 0


def test_hostile_numbers_are_survived():
    largest = np.finfo(float).max
    z = [largest, -largest, 1.0, 0.0, 5e-324, largest, largest, -largest]
    deviation, _, _ = allan_deviations(z, [1, 2], "oadev")
    assert not np.isnan(deviation).any()


def test_short_gaps_are_bridged():
    line = 3.0 + 0.5 * np.arange(100.0)
    z = line.copy()
    z[[10, 50, 51, 52]] = np.nan
    for bridge, pieces in [(0, 3), (1, 2), (2, 2), (3, 1)]:
        deviation, terms, _ = allan_deviations(z, [4], bridge=bridge)
        gaps = {0: 4, 1: 3, 2: 3, 3: 0}[bridge]
        assert terms[0] == 100 - gaps - pieces * (2 * 4 - 1)
        # A ramp's deviation at any averaging time; roundings of sums of a hundred samples.
        assert deviation[0] == pytest.approx(0.5 * 4 / np.sqrt(2.0), rel=1e-11)


@pytest.mark.parametrize(
    "convert",
    [
        lambda z: z.astype(np.float32),
        lambda z: z.astype(np.int16),
        lambda z: np.asfortranarray(z),
        lambda z: np.repeat(z, 2, axis=0)[::2],
        lambda z: z[::-1].copy()[::-1],
        lambda z: np.ma.masked_array(z, mask=False),
        lambda z: np.frombuffer(b"." + z.tobytes(), np.uint8)[1:].view(np.float64).reshape(z.shape),
        lambda z: z.tolist(),
    ],
)
def test_any_layout_is_read(convert):
    z = np.round(10.0 * noise(300)).reshape(100, 3)
    expected, _, _ = allan_deviations(z, [1, 3])
    got, _, _ = allan_deviations(convert(z), [1, 3])
    np.testing.assert_array_equal(got, expected)


def test_masked_and_none_are_missing():
    z = noise(50)
    z[20] = np.nan
    expected, _, _ = allan_deviations(z, [2])
    masked = np.ma.masked_array(np.nan_to_num(z), mask=np.isnan(z))
    listed = [None if np.isnan(value) else float(value) for value in z]
    assert allan_deviations(masked, [2])[0] == allan_deviations(listed, [2])[0] == expected


def test_shapes_and_types_of_the_answer():
    for z, shape in [
        (noise(9), (2,)),
        (noise(12).reshape(4, 3), (2, 3)),
        (np.empty((5, 0)), (2, 0)),
    ]:
        deviation, terms, exponent = allan_deviations(z, [1, 50])
        assert deviation.shape == terms.shape == exponent.shape == shape
        assert deviation.dtype == np.float64
        assert terms.dtype == exponent.dtype == np.int64
    assert allan_deviations([], [])[0].shape == (0,)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"kind": "adve"}, "kind must be one of 'adev', .* got 'adve'"),
        ({"factors": [1, 0]}, "a factor must be at least 1, got 0"),
        ({"factors": [-3]}, "a factor must be at least 1, got -3"),
        ({"z": 1.0}, r"z must have shape \(n,\) or \(n, k\), got \(\)"),
        ({"z": np.zeros((2, 2, 2))}, r"got \(2, 2, 2\)"),
        ({"bridge": -1}, "bridge must not be negative, got -1"),
        ({"threads": 0}, "threads must be at least 1, got 0"),
    ],
)
def test_wrong_arguments_are_named(arguments, message):
    with pytest.raises(ValueError, match=message):
        allan_deviations(**({"z": noise(9), "factors": [1]} | arguments))


def test_wrong_types_are_refused():
    with pytest.raises(TypeError, match="real numbers"):
        allan_deviations(["a", "b"], [1])
    with pytest.raises(TypeError):
        allan_deviations(noise(9), [1.5])
    with pytest.raises(ValueError, match="number of samples, got -1"):
        longest_factor("adev", -1)
