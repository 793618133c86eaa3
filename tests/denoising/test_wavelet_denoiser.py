"""WaveletDenoiser: against its twin, its delay, the noise that it learns, what is missing."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import oracle
import zerorate as zr
from support.checks import assert_same_bits, named
from support.records import moving_records, ordinary_records
from support.settings import wavelet_settings

WAVELETS = {"haar": 2, "db2": 4, "db4": 8, "db8": 16}
RATE = 200.0


def noise(n, seed=1):
    return np.random.default_rng(seed).standard_normal(n)


def twin(arguments):
    return oracle.WaveletDenoiser(**{k: v for k, v in arguments.items() if k != "channels"})


@given(wavelet_settings(), st.one_of(ordinary_records(), moving_records()))
def test_the_twin_agrees(arguments, z):
    found, expected = zr.WaveletDenoiser(**arguments).process(z), twin(arguments).process(z)
    size = np.abs(z[np.isfinite(z)]).max(initial=0.0)
    # A detail within rounding of the threshold would differ: none of these is.
    np.testing.assert_allclose(found, expected, rtol=0.0, atol=1e-10 * size)


@pytest.mark.parametrize("wavelet", WAVELETS)
@pytest.mark.parametrize("level", [1, 2, 3, 5, 10])
def test_without_threshold_it_is_a_delay(wavelet, level):
    denoiser = zr.WaveletDenoiser(RATE, wavelet, level, threshold=0.0)
    delay = (2**level - 1) * (WAVELETS[wavelet] - 1) + 1
    assert denoiser.delay == delay
    assert denoiser.delay_seconds == delay / RATE
    z = noise(delay + 3000)
    x = denoiser.process(z)
    # Each level rounds once on the way down and once on the way up.
    assert np.abs(x[delay:] - z[:-delay]).max() < 1e-14
    # Before the first sample all is as the first sample.
    np.testing.assert_allclose(x[:delay], z[0], rtol=0.0, atol=1e-14)


def test_known_delays():
    known = {("haar", 5): 32, ("db2", 3): 22, ("db2", 5): 94, ("db4", 3): 50, ("db4", 5): 218}
    for (wavelet, level), delay in known.items():
        assert zr.WaveletDenoiser(RATE, wavelet, level).delay == delay


@pytest.mark.parametrize("mode", ["soft", "hard"])
@pytest.mark.parametrize(("wavelet", "level"), [("haar", 3), ("db2", 3), ("db4", 5)])
def test_noise_falls_by_the_root_of_the_octaves(wavelet, level, mode):
    x = zr.WaveletDenoiser(RATE, wavelet, level, mode).process(3.0 + noise(100_000))[20_000:]
    # A few details in ten thousand pass the threshold of four deviations, more by one where the
    # noise is taken for somewhat less than it is.
    assert 0.97 < x.std() * 2 ** (level / 2) < 1.15
    assert abs(x.mean() - 3.0) < 0.02


@pytest.mark.parametrize("wavelet", WAVELETS)
def test_the_noise_is_learned(wavelet):
    denoiser = zr.WaveletDenoiser(RATE, wavelet, 2)
    denoiser.process(noise(20_000))
    # The last few hundred details count: 3 % of standard error.
    assert denoiser.sigma == pytest.approx(1.0, rel=0.1)
    # Ten times as loud: a factor of e takes 7 s on the way up, 16 s on the way down.
    denoiser.process(10.0 * noise(8000))
    assert denoiser.sigma == pytest.approx(10.0, rel=0.15)
    denoiser.process(noise(16_000))
    assert denoiser.sigma == pytest.approx(1.0, rel=0.15)


def test_outliers_do_not_move_it():
    z, rng = noise(40_000), np.random.default_rng(2)
    spoilt = np.where(rng.random(z.size) < 0.01, 1e4, z)
    denoiser = zr.WaveletDenoiser(RATE, "db2", 2)
    denoiser.process(spoilt)
    # A spike is in two details of the first level, so 2 % of them lie beyond any deviation.
    assert denoiser.sigma == pytest.approx(1.0, rel=0.15)


def test_equal_samples_teach_nothing():
    denoiser = zr.WaveletDenoiser(RATE)
    denoiser.process(noise(4000))
    before = denoiser.sigma
    denoiser.process(np.full(4000, 0.5))
    # But for the details that the step is in.
    assert denoiser.sigma == pytest.approx(before, rel=0.02)


def test_a_constant_stays():
    for value in (0.0, -0.35, 1e150, 1e300, 5e-324):
        denoiser = zr.WaveletDenoiser(RATE, "db4", 4)
        assert_same_bits(denoiser.process(np.full(700, value)), np.full(700, value))
        assert denoiser.sigma == 0.0


def test_a_missing_sample_is_as_the_last_one():
    z = noise(3000)
    missing = np.random.default_rng(3).random(z.size) < 0.05
    missing[0] = False
    gaps = np.where(missing, np.nan, z)
    held = z[np.maximum.accumulate(np.where(missing, 0, np.arange(z.size)))]
    how = {"wavelet": "db2", "level": 3, "threshold": 0.0}
    found = zr.WaveletDenoiser(RATE, **how)
    assert_same_bits(found.process(gaps), zr.WaveletDenoiser(RATE, **how).process(held))
    assert found.missing_count == missing.sum()
    assert found.samples_seen == z.size


def test_gaps_teach_nothing():
    """Neither the samples that are held nor the step at the end."""
    z = noise(40_000)
    z[np.arange(z.size) % 40 < 20] = np.nan
    denoiser = zr.WaveletDenoiser(RATE)
    denoiser.process(z)
    assert denoiser.sigma == pytest.approx(1.0, rel=0.1)


def test_nothing_is_known_before_the_first_sample():
    denoiser = zr.WaveletDenoiser(RATE)
    assert np.isnan(denoiser.process([np.nan, np.inf, -np.inf])).all()
    assert np.isnan(denoiser.update(None))
    assert denoiser.process([2.0, np.nan, 2.0]).tolist() == [2.0, 2.0, 2.0]
    assert (denoiser.missing_count, denoiser.samples_seen) == (5, 7)


def test_what_was_chosen_is_told():
    denoiser = zr.WaveletDenoiser(50.0, "db4", 2, "soft", 3.0, channels=2)
    told = (denoiser.rate, denoiser.wavelet, denoiser.level, denoiser.mode, denoiser.threshold)
    assert told == (50.0, "db4", 2, "soft", 3.0)
    assert denoiser.channels == 2
    assert repr(denoiser) == (
        "WaveletDenoiser(rate=50.0, wavelet='db4', level=2, mode='soft', threshold=3.0, channels=2)"
    )
    denoiser.process([[1.0, np.nan]])
    assert denoiser.missing_count.tolist() == [0, 1]


BAD = {
    "rate must be a positive number of samples a second, got 0.0": {"rate": 0.0},
    "wavelet must be one of 'haar', 'db2', 'db4', 'db8', got 'db3'": {"wavelet": "db3"},
    "level must be at least 1, got 0": {"level": 0},
    "level must be from 1 to 10, got 11.0": {"level": 11},
    "mode must be 'soft' or 'hard', got ''": {"mode": ""},
    "threshold must be zero or a positive number, got -1.0": {"threshold": -1.0},
    "threshold must be zero or a positive number, got inf": {"threshold": np.inf},
    "channels must be at least 1, got 0": {"channels": 0},
}


@pytest.mark.parametrize("message", BAD)
def test_arguments_out_of_range_are_refused(message):
    with pytest.raises(ValueError, match=message):
        zr.WaveletDenoiser(**{"rate": RATE, **BAD[message]})


def test_channels_that_begin_at_different_times_are_saved():
    z = noise(300).reshape(-1, 3)
    z[:50, 1] = np.nan
    z[:, 2] = np.nan
    denoiser = zr.WaveletDenoiser(RATE, channels=3)
    for cut in (1, 49, 51, 90):
        denoiser.reset()
        denoiser.process(z[:cut])
        other = zr.WaveletDenoiser.from_bytes(denoiser.to_bytes())
        with named(cut):
            assert_same_bits(other.process(z[cut:]), denoiser.process(z[cut:]))
