"""Wavelet denoising of records: against PyWavelets, on noise and in motion, and what is refused."""

import numpy as np
import pytest
import pywt
from hypothesis import given
from hypothesis import strategies as st

import zerorate as zr
from support.checks import assert_same_bits, named
from support.records import hostile_records, ordinary_records
from zerorate._native import wavelet_decomposition
from zerorate.simulation.motions import MOTIONS

WAVELETS = {"haar": 2, "db2": 4, "db4": 8, "db8": 16}
BY_WAVELET = pytest.mark.parametrize("wavelet", WAVELETS)
MODES = ["soft", "hard"]
RULES = ["auto", "psr", "psr-normalised"]
NORMAL_MEDIAN = 0.674490


def noise(n, seed=1):
    return np.random.default_rng(seed).standard_normal(n)


def deepest(n, wavelet):
    return pywt.dwt_max_level(n, pywt.Wavelet(wavelet).dec_len)


def visushrink(z, wavelet, level, mode, approximation=False):
    """By PyWavelets, with the deviation of the noise and the threshold."""
    rest, *details = pywt.wavedec(z, wavelet, "symmetric", level)
    sigma = np.median(np.abs(details[-1])) / NORMAL_MEDIAN
    t = sigma * np.sqrt(2.0 * np.log(len(z)))
    parts = [rest, *details] if approximation else details
    parts = [pywt.threshold(part, t, mode) for part in parts]
    if not approximation:
        parts.insert(0, rest)
    return pywt.waverec(parts, wavelet, "symmetric")[: len(z)], sigma, t


@BY_WAVELET
@pytest.mark.parametrize("n", [30, 31, 57, 64, 255, 256, 1001, 5000])
def test_coefficients_are_those_of_pywavelets(wavelet, n):
    z = noise(n)
    for level in range(1, deepest(n, wavelet) + 1):
        found = wavelet_decomposition(z, wavelet, level)
        expected = pywt.wavedec(z, wavelet, "symmetric", level)
        assert [len(part) for part in found] == [len(part) for part in expected]
        for got, part in zip(found, expected, strict=True):
            # Of the largest; each level sums up to sixteen products of either order.
            assert np.abs(got - part).max() <= 2e-15 * np.abs(part).max()


@BY_WAVELET
@pytest.mark.parametrize("mode", MODES)
@pytest.mark.parametrize("approximation", [False, True])
def test_a_denoised_record_is_that_of_pywavelets(wavelet, mode, approximation):
    for n, offset in ((2000, 0.0), (2001, -3.0), (333, 50.0)):
        z = offset + noise(n) + 5.0 * np.sin(np.arange(n) / 60.0)
        for level in (1, 3, deepest(n, wavelet)):
            expected, sigma, t = visushrink(z, wavelet, level, mode, approximation)
            found = zr.denoise(z, wavelet, level, mode, approximation)
            np.testing.assert_allclose(found.signal, expected, rtol=0.0, atol=1e-11)
            np.testing.assert_allclose([found.sigma, found.threshold], [sigma, t], rtol=1e-13)
            assert found.level == level


def peak_to_sum(d):
    return np.abs(d).max() / np.abs(d).sum()


def peak_to_sum_of_noise(n):
    from scipy.stats import norm

    peak = norm.ppf(1 - 0.5 * (1 - (n - 0.375) / (n + 0.25)))
    return peak / (n * np.sqrt(2.0 / np.pi))


def looks_like_noise(d, first):
    sigma, n = np.median(np.abs(first)) / NORMAL_MEDIAN, len(d)
    ratio = np.median(np.abs(d)) / NORMAL_MEDIAN / sigma
    return (
        n >= 64
        and abs(np.log(ratio)) <= max(0.05, 3 * 1.17 * np.sqrt(1 / n + 1 / len(first)))
        and np.sqrt(np.mean(d**2)) <= sigma * (1 + max(0.1, 3 / np.sqrt(2 * n)))
    )


def last_level(z, wavelet, holds):
    """The last level before the first one that does not hold, the first one at least."""
    details = pywt.wavedec(z, wavelet, "symmetric")[:0:-1]
    levels = (k for k, d in enumerate(details) if k and not holds(d, details[0]))
    return next(levels, len(details))


HOLDS = {
    "auto": looks_like_noise,
    "psr": lambda d, _: peak_to_sum(d) <= 0.05,
    "psr-normalised": lambda d, _: peak_to_sum(d) <= 1.5 * peak_to_sum_of_noise(len(d)),
}


@pytest.mark.parametrize("rule", RULES)
@pytest.mark.parametrize("wavelet", ["db2", "db4"])
def test_levels_are_those_of_their_rules(rule, wavelet):
    for seed in range(6):
        for n in (300, 5000, 40_000):
            still = noise(n, seed)
            for z in (still, still + 30.0 * np.sin(np.arange(n) / (8.0 * (1 + seed)))):
                expected = last_level(z, wavelet, HOLDS[rule])
                assert zr.denoise(z, wavelet, rule).level == expected


def test_the_published_rule_measures_the_length_of_a_record():
    """White noise says nothing of a level; the normalised rule goes as deep as there is noise."""
    z = noise(120_000)
    lengths = (2500, 10_000, 40_000, 120_000)
    found = [[zr.denoise(noise(n, k), level="psr").level for n in lengths] for k in range(9)]
    medians = np.median(found, axis=0).tolist()
    # The 66 details of level 11 have their largest as likely above a twentieth as below.
    assert medians[:3] == [5, 7, 9]
    assert medians[3] in (10, 11)
    for rule in ("auto", "psr-normalised"):
        levels = [zr.denoise(z[:n], level=rule).level for n in lengths]
        assert levels == sorted(levels)
        assert all(level >= np.log2(n / 64) - 2 for level, n in zip(levels, lengths, strict=True))


def over_raw(motion, seed=1, **how):
    """Error to the true rate over that of the raw record, at 200 Hz and 0.1 deg/s of noise."""
    truth = MOTIONS[motion](200.0, 600.0, seed)
    found = zr.denoise(truth + 0.1 * noise(truth.size, seed + 100), **how)
    return np.sqrt(np.mean((found.signal - truth) ** 2)) / 0.1


@pytest.mark.parametrize(("motion", "bound"), [("table", 0.15), ("vehicle", 0.3), ("hand", 0.75)])
def test_the_level_found_spares_motion(motion, bound):
    for seed in (1, 2, 3):
        assert over_raw(motion, seed) <= bound
    assert over_raw("hand", level=5) > 1.0


def test_coloured_noise_is_not_called_white():
    """Its levels are not alike, so no threshold fits more than the first."""
    z = np.convolve(noise(40_001), [1.0, -0.7], "valid")
    assert zr.denoise(z).level == 1


@given(ordinary_records(), st.sampled_from(list(WAVELETS)), st.sampled_from(RULES), st.booleans())
def test_a_power_of_two_scales_without_rounding(z, wavelet, rule, approximation):
    z = z[np.isfinite(z)]
    how = {"wavelet": wavelet, "level": rule, "approximation": approximation}
    plain = zr.denoise(z, **how)
    for power in (-600, -3, 500):
        scaled = zr.denoise(z * 2.0**power, **how)
        assert_same_bits(scaled.signal, plain.signal * 2.0**power)
        assert scaled.level == plain.level
        assert scaled.sigma == plain.sigma * 2.0**power
        assert scaled.threshold == plain.threshold * 2.0**power


@given(hostile_records(), st.sampled_from(list(WAVELETS)), st.sampled_from(RULES), st.booleans())
def test_nothing_finite_breaks_it(z, wavelet, rule, approximation):
    z = np.tile(z[np.isfinite(z)], 3)
    if deepest(len(z), wavelet) < 1:
        return
    for mode in MODES:
        found = zr.denoise(z, wavelet, rule, mode, approximation)
        assert np.all(np.isfinite(found.signal))
        assert 0.0 <= found.sigma < np.inf
        assert 1 <= found.level <= deepest(len(z), wavelet)


@pytest.mark.parametrize("size", [1e150, 1e300, np.finfo(float).max, 5e-324, 1e-310])
def test_sizes_at_the_ends_of_the_numbers(size):
    for z in (size * np.sign(noise(500)), size * (-1.0) ** np.arange(500), np.full(500, -size)):
        found = zr.denoise(z)
        assert np.all(np.isfinite(found.signal))


@BY_WAVELET
@pytest.mark.parametrize("value", [0.0, -0.35, 1e150, 5e-324])
def test_a_constant_stays(wavelet, value):
    z = np.full(301, value)
    for approximation in (False, True):
        found = zr.denoise(z, wavelet, "psr", approximation=approximation)
        assert_same_bits(found.signal, z)
        assert (found.sigma, found.threshold) == (0.0, 0.0)


def test_an_offset_moves_nothing_but_the_level_of_the_signal():
    """Multiples of 2^-20, so that the offset itself rounds nothing."""
    z = np.round(noise(4000) * 2.0**20) / 2.0**20
    plain, moved = zr.denoise(z), zr.denoise(z + 2.0**20)
    assert moved.level == plain.level
    np.testing.assert_allclose(moved.signal - 2.0**20, plain.signal, rtol=0.0, atol=1e-9)


def test_columns_are_denoised_each_by_itself():
    z = np.column_stack([noise(3000), 50.0 * np.sin(np.arange(3000) / 3.0), np.zeros(3000)])
    found = zr.denoise(z)
    assert found.signal.shape == z.shape
    for k in range(3):
        alone = zr.denoise(z[:, k])
        assert_same_bits(found.signal[:, k].copy(), alone.signal)
        assert (found.level[k], found.sigma[k]) == (alone.level, alone.sigma)
        assert found.threshold[k] == alone.threshold


def test_any_layout_and_number_is_taken():
    z = np.round(100.0 * noise(400))
    expected = zr.denoise(z).signal
    for given_ in (z.tolist(), z.astype(np.int16), z.astype(np.float32), np.repeat(z, 2)[::2]):
        assert_same_bits(zr.denoise(given_).signal, expected)


BAD = {
    "level must be at most 5 for 250 samples and 'db4', got 6": {"level": 6},
    "level must be at most 4 for 250 samples and 'db8', got 1000": {
        "level": 1000,
        "wavelet": "db8",
    },
    "level must be at least 1, got 0": {"level": 0},
    "wavelet must be one of 'haar', 'db2', 'db4', 'db8', got 'sym4'": {"wavelet": "sym4"},
    "mode must be 'soft' or 'hard', got 'firm'": {"mode": "firm"},
    "level must be 'auto', 'psr', 'psr-normalised' or a number, got 'deep'": {"level": "deep"},
    "rho is the cut of level='psr' and level='psr-normalised' alone": {"rho": 0.1},
    "rho must be a positive number, got NaN": {"level": "psr", "rho": np.nan},
}


@pytest.mark.parametrize("message", BAD)
def test_arguments_out_of_range_are_refused(message):
    with pytest.raises(ValueError, match=message):
        zr.denoise(noise(250), **BAD[message])


def test_what_is_no_level_is_refused():
    for level in (2.5, None, [3]):
        with named(level), pytest.raises(TypeError, match="level must be a whole number or a rule"):
            zr.denoise(noise(250), level=level)


def test_missing_samples_are_refused_with_their_place():
    z = noise(250)
    z[17] = np.nan
    words = "z misses sample 17: denoise needs a record without gaps, DriftFilter"
    with pytest.raises(ValueError, match=words):
        zr.denoise(z)
    with pytest.raises(ValueError, match="z misses sample 17 of column 1: denoise needs"):
        zr.denoise(np.column_stack([noise(250), z]))


@pytest.mark.parametrize(("wavelet", "least"), [("haar", 2), ("db2", 6), ("db4", 14), ("db8", 30)])
def test_short_records_are_refused(wavelet, least):
    assert zr.denoise(noise(least), wavelet).level == 1
    for n in range(least):
        words = f"z is too short for '{wavelet}': a level needs {least} samples, got {n}"
        with pytest.raises(ValueError, match=words):
            zr.denoise(noise(n), wavelet)


def test_wrong_shapes_are_refused():
    for shape in ((), (3, 40, 2)):
        with named(shape), pytest.raises(ValueError, match=r"z must have shape \(n,\) or \(n, k\)"):
            zr.denoise(np.zeros(shape))
    with pytest.raises(ValueError, match="got no column"):
        zr.denoise(np.zeros((100, 0)))
