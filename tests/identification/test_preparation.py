"""Preparation of records: smoothing, outliers, trends, decimation, and what it says of them."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from zerorate.identification.preparation import Change, detrend, prepare, segments
from zerorate.identification.window_filters import (
    decimate,
    far_from_average,
    hampel,
    moving_average,
)

RATE = 100.0
NOISE = np.random.default_rng(1).standard_normal(5000)
GAPPY = np.where(np.arange(5000) % 97 < 3, np.nan, NOISE)
NAN = float("nan")

# Sums of at most a few thousand values about 1 in size.
ROUNDING = 1e-12


def window(z, k, width):
    """The samples round the k-th that are there, as the definition has it."""
    part = z[max(k - width // 2, 0) : k + width - width // 2]
    return part[np.isfinite(part)]


def in_windows(z, width, what):
    return np.array(
        [what(window(z, k, width)) if np.isfinite(z[k]) else np.nan for k in range(z.size)]
    )


def scaled_mad(values):
    return 1.482602218505602 * np.median(np.abs(values - np.median(values)))


def sine(frequency, n=20_000):
    """A sine of so many cycles a sample."""
    return np.sin(2.0 * np.pi * frequency * np.arange(n))


def size_of(z):
    """Amplitude of a sine, from where the filter is whole."""
    return np.sqrt(2.0 * np.nanmean(z * z))


@pytest.mark.parametrize("z", [NOISE, GAPPY])
@pytest.mark.parametrize("width", [1, 2, 3, 8, 11, 299, 300, 20_000])
def test_moving_average_is_the_mean_of_each_window(z, width):
    z = z[: 1000 if width < 20 else 300]
    np.testing.assert_allclose(
        moving_average(z, width), in_windows(z, width, np.mean), rtol=0, atol=ROUNDING
    )


@given(st.lists(st.floats(-1e3, 1e3) | st.just(NAN), min_size=1, max_size=60), st.integers(1, 80))
def test_moving_average_of_any_record(values, width):
    z = np.array([0.0, *values])
    # Rounding of sums of values up to 1e3.
    np.testing.assert_allclose(
        moving_average(z, width), in_windows(z, width, np.mean), rtol=0, atol=1e3 * ROUNDING
    )


def test_an_offset_or_an_outlier_costs_the_average_no_precision():
    # The offset itself is held to 2e-9; a window's mean keeps that.
    offset = 1e7 + 1e-4 * NOISE
    expected = 1e7 + moving_average(offset - 1e7, 5)
    np.testing.assert_allclose(moving_average(offset, 5), expected, rtol=0, atol=4e-9)
    spike = NOISE.copy()
    spike[100] = 1e15
    far = np.abs(np.arange(5000) - 100) > 5
    np.testing.assert_array_equal(moving_average(spike, 5)[far], moving_average(NOISE, 5)[far])


@pytest.mark.parametrize("width", [2, 5, 10])
def test_smoothing_correlates_white_noise_as_it_says(width):
    z = moving_average(np.random.default_rng(2).standard_normal(200_000), width)
    found = np.corrcoef(z[:-1], z[1:])[0, 1]
    # Its standard error is below sqrt(2 width / n) = 0.01 at the widest.
    assert found == pytest.approx((width - 1) / width, abs=0.03)
    (change, *_) = prepare(NOISE, smooth=width).changes
    assert change.what.endswith(f"a correlation of {(width - 1) / width:.3g} at lag 1")
    assert change.count == 5000


@pytest.mark.every(3)
@pytest.mark.parametrize("z", [NOISE, GAPPY])
@pytest.mark.parametrize("width", [1, 2, 3, 11, 12, 101, 9000])
def test_hampel_is_the_median_where_a_sample_is_far(z, width):
    z = z[: 1000 if width < 200 else 400]
    median = in_windows(z, width, np.median)
    far = np.abs(z - median) > 2.0 * in_windows(z, width, scaled_mad)
    data, outliers = hampel(z, width, threshold=2.0)
    # The two constants of the MAD agree to a rounding, which no distance of this record meets.
    np.testing.assert_array_equal(outliers, far)
    np.testing.assert_array_equal(data, np.where(far, median, z))


def test_hampel_finds_spikes_and_nothing_else():
    z = NOISE.copy()
    z[[0, 700, 701, 4999]] = [40.0, -40.0, 50.0, 60.0]
    data, outliers = hampel(z, 101, threshold=6.0)
    assert np.flatnonzero(outliers).tolist() == [0, 700, 701, 4999]
    np.testing.assert_array_equal(data[~outliers], z[~outliers])
    # Medians of 51 to 101 Gaussian samples: standard error 1.25/sqrt(51) = 0.18.
    assert np.abs(data[outliers]).max() < 0.8


@pytest.mark.parametrize(("width", "share"), [(11, 1 / 90), (51, 1 / 1500)])
def test_hampel_of_gaussian_noise_finds_as_many_as_documented(width, share):
    z = np.random.default_rng(3).standard_normal(400_000)
    found = hampel(z, width).outliers.mean()
    # The rarer are some 270 of 400 000: 6 % standard error.
    assert found == pytest.approx(share, rel=0.2)


def test_coarse_records_keep_their_steps():
    z = np.round(0.3 * NOISE) * 0.05
    assert np.median(np.abs(z)) == 0.0
    assert not hampel(z).outliers.any()
    z[1234] = 5 * 0.05
    assert np.flatnonzero(hampel(z).outliers).tolist() == [1234]
    z[1234] = 4 * 0.05
    assert not hampel(z).outliers.any()


def test_far_from_average_replaces_by_the_average():
    z = NOISE.copy()
    z[[50, 3000]] = [30.0, np.inf]
    data, outliers = far_from_average(z, 11, threshold=5.0)
    assert np.flatnonzero(outliers).tolist() == [50]
    assert data[50] == moving_average(z, 11)[50]
    assert np.isnan(data[3000])
    kept = ~outliers & np.isfinite(z)
    np.testing.assert_array_equal(data[kept], z[kept])


@pytest.mark.parametrize("clean", [hampel, far_from_average])
def test_outliers_do_not_depend_on_the_unit(clean):
    z = NOISE.copy()
    z[::500] += 30.0
    here, there = clean(z, 21, 5.0), clean(2.0**-40 * z, 21, 5.0)
    np.testing.assert_array_equal(here.outliers, there.outliers)
    # Powers of two round nothing.
    np.testing.assert_array_equal(2.0**-40 * here.data, there.data)


def test_detrend_takes_off_what_fits_best():
    k = np.arange(5000)
    there = np.isfinite(GAPPY)
    slope, level = np.polyfit(k[there], GAPPY[there], 1)
    # polyfit solves by singular values and loses a few digits to the powers of k.
    np.testing.assert_allclose(
        detrend(GAPPY, "linear"), GAPPY - slope * k - level, rtol=0, atol=1e-10
    )
    np.testing.assert_allclose(detrend(GAPPY), GAPPY - np.nanmean(GAPPY), rtol=0, atol=ROUNDING)
    assert np.isnan(detrend([NAN, 3.0, 4.0], "mean")[0])


def test_an_offset_costs_the_trend_no_precision():
    line = 1e-3 * np.arange(5000)
    offset = 1e7 + line + 1e-4 * NOISE
    # 1e7 is held to 2e-9, which is all the rounding there is; the line of the noise is taken, too.
    np.testing.assert_allclose(
        detrend(offset, "linear"), detrend(1e-4 * NOISE, "linear"), rtol=0, atol=4e-9
    )


@pytest.mark.parametrize("factor", [2, 5, 16])
def test_decimation_lets_pass_what_is_slow(factor):
    for frequency in np.linspace(0.0, 0.8, 9) * 0.5 / factor:
        z = np.cos(2.0 * np.pi * frequency * np.arange(20_000))
        slow = decimate(z, factor)
        there = np.isfinite(slow)
        # A ripple of 80 dB is 1e-4; the filter has no delay.
        np.testing.assert_allclose(slow[there], z[::factor][there], rtol=0, atol=1.2e-4)


@pytest.mark.parametrize("factor", [2, 5, 16])
def test_decimation_stops_what_would_fold_back(factor):
    for frequency in np.linspace(0.5 / factor, 0.5, 9)[:-1]:
        # 80 dB is 1e-4; Kaiser's formula for the length is good to a few tenths of a dB.
        assert size_of(decimate(sine(frequency), factor)) < 1.2e-4


def test_decimation_keeps_times_and_levels():
    slow = decimate(np.full(4001, 7.0), 4)
    assert slow.shape == (1001,)
    reach = np.flatnonzero(np.isfinite(slow))[0]
    assert 25 * 4 <= 4 * reach <= 26 * 4
    # Weights that sum to 1 to a rounding.
    np.testing.assert_allclose(slow[reach:-reach], 7.0, rtol=1e-14)
    np.testing.assert_array_equal(decimate(GAPPY, 1), GAPPY)


def test_a_gap_spreads_as_far_as_the_filter_reaches():
    z = NOISE.copy()
    z[2500] = np.nan
    lost = np.isnan(decimate(z, 4)) & np.isfinite(decimate(NOISE, 4))
    places = 4 * np.flatnonzero(lost)
    assert 2500 - 26 * 4 <= places.min() <= 2500 - 24 * 4
    assert 2500 + 24 * 4 <= places.max() <= 2500 + 26 * 4


def test_segments_are_rows():
    rows = segments(GAPPY, 7)
    assert rows.shape == (7, 714)
    np.testing.assert_array_equal(rows.ravel(), GAPPY[: 7 * 714])


def test_everything_is_said_in_order():
    z = 3.0 + NOISE
    z[[100, 2000, 2001]] += [50.0, -50.0, 50.0]
    z[3000] = np.inf
    prepared = prepare(
        z, RATE, smooth=4, outliers="hampel", window=51, threshold=8.0, trend="linear", decimate=5
    )
    assert prepared.rate == 20.0
    assert prepared.data.shape == (1000,)
    assert [change.what for change in prepared.changes] == [
        "3 outliers replaced by the median of 51 samples",
        "smoothed by a moving average of 4 samples, which alone gives white noise a correlation "
        "of 0.75 at lag 1",
        "one sample of 5 kept after a low-pass against aliasing",
        "a straight line was taken off",
    ]
    there = int(np.isfinite(prepared.data).sum())
    assert [change.count for change in prepared.changes] == [3, 4999, 4000, there]
    by_hand = hampel(z, 51, 8.0).data
    expected = detrend(decimate(moving_average(by_hand, 4), 5), "linear")
    np.testing.assert_array_equal(prepared.data, expected)


def test_nothing_asked_nothing_done():
    z = GAPPY.copy()
    z[0] = np.inf
    prepared = prepare(z, trend=None)
    assert prepared.rate is None
    assert prepared.changes == ()
    np.testing.assert_array_equal(prepared.data, np.where(np.isfinite(z), z, np.nan))
    assert np.isinf(z[0])


def test_each_outlier_is_counted_and_named():
    z = NOISE.copy()
    z[10] = 99.0
    (change, _) = prepare(z, outliers="moving-average", window=5, threshold=20.0).changes
    assert change == Change("1 outlier replaced by the mean of 5 samples", 1)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: moving_average(NOISE, 0), "width must be a whole number from 1 on, got 0"),
        (lambda: moving_average(NOISE, 2.5), "width must be a whole number from 1 on, got 2.5"),
        (lambda: moving_average(NOISE, True), "width must be a whole number from 1 on, got True"),
        (lambda: hampel(NOISE, -1), "width must be a whole number from 1 on, got -1"),
        (lambda: hampel(NOISE, 3, -1.0), "threshold must be finite and not negative, got -1.0"),
        (lambda: far_from_average(NOISE, 3, NAN), "threshold must be finite and not negative"),
        (lambda: detrend(NOISE, "cubic"), "kind must be one of 'mean', 'linear', got 'cubic'"),
        (lambda: detrend([1.0, NAN], "linear"), "a linear trend needs at least 2 samples, got 1"),
        (lambda: segments(NOISE, 5001), "at most the number of samples, 5000, got 5001"),
        (lambda: segments(NOISE, 0), "segments must be a whole number from 1 on, got 0"),
        (lambda: decimate(NOISE, 0), "factor must be a whole number from 1 on, got 0"),
        (lambda: decimate(NOISE, 1000), "decimation by 1000 needs 50[0-9]+ samples in a row"),
        (lambda: prepare(NOISE, 0.0), "rate must be a positive finite number of Hz"),
        (lambda: prepare(NOISE, smooth=0), "smooth must be a whole number from 1 on, got 0"),
        (lambda: prepare(NOISE, decimate=0), "decimate must be a whole number from 1 on, got 0"),
        (lambda: prepare(NOISE, outliers="all"), "outliers must be one of 'hampel', 'moving-av"),
        (lambda: prepare(NOISE.reshape(-1, 2)), r"one axis of shape \(n,\), got shape \(2500, 2\)"),
        (lambda: prepare([NAN, NAN]), "z holds no finite sample"),
    ],
)
def test_wrong_input_is_refused_in_a_sentence(call, message):
    with pytest.raises(ValueError, match=message):
        call()


def test_text_is_refused():
    with pytest.raises(TypeError, match="z must hold real numbers, got dtype <U1"):
        prepare(["a", "b"])
