"""Contamination: how many samples are moved, how far and which way; and the texts that say so."""

import math

import numpy as np
import pytest

from zerorate.simulation import Contamination

RATE = 100.0
N = 60_000
Z = np.random.default_rng(7).standard_normal(N)


def moves(text, z=Z, seed=1):
    """Return how far each sample was moved."""
    return Contamination.parse(text).apply(z, RATE, seed) - z


def moved(text, z=Z, seed=1):
    """Return by how much samples were moved, without those that were not."""
    by = moves(text, z, seed)
    return by[by != 0.0]


def test_the_share_of_samples_goes_either_way_as_far_as_asked():
    by = moved("share=0.05,size=100")
    # Five deviations of a binomial count, and of the sum of as many signs.
    assert abs(by.size - 0.05 * N) < 5.0 * math.sqrt(0.05 * 0.95 * N)
    assert abs(np.sign(by).sum()) < 5.0 * math.sqrt(by.size)
    # The median of 60 000 steps has a relative deviation of 0.6 %.
    np.testing.assert_allclose(np.abs(by), 100.0, rtol=0.03)


def test_one_sided_goes_upwards():
    assert (moved("share=0.05,size=100,one-sided") > 0.0).all()
    assert (moved("burst=20,size=30,one-sided") > 0.0).all()


def test_bursts_are_neighbours_once_a_minute():
    where = np.flatnonzero(moves("burst=20,size=30"))
    assert where.size == 10 * 20
    for minute, burst in enumerate(where.reshape(10, 20)):
        assert (np.diff(burst) == 1).all()
        assert minute * 6000 <= burst[0] <= burst[-1] < (minute + 1) * 6000


def test_a_burst_may_fill_its_minute_and_a_record_may_end_before_its_last():
    assert np.count_nonzero(moves("burst=7000,size=5")) == N
    assert np.count_nonzero(moves("burst=5990,size=5", Z[:5995])) >= 5985


@pytest.mark.parametrize(("text", "value"), [("stuck=10", Z[29_999]), ("stuck=10,at-zero", 0.0)])
def test_stuck_repeats_the_last_value_or_zero(text, value):
    found = Contamination.parse(text).apply(Z, RATE, seed=1)
    span = Contamination.parse(text).stuck_span(N, RATE)
    assert (span.start, span.stop) == (30_000, 31_000)
    assert (found[span] == value).all()
    assert np.array_equal(np.delete(found, span), np.delete(Z, span))


def test_all_at_once():
    found = moves("share=0.01,size=50,burst=20,stuck=5,at-zero")
    assert (found[30_000:30_500] == -Z[30_000:30_500]).all()
    outside = np.delete(found, slice(30_000, 30_500))
    assert 600 < np.count_nonzero(outside) < 1000


def test_missing_samples_stay_and_are_not_the_last_value():
    z = Z.copy()
    z[29_990:30_010] = np.nan
    z[5] = np.inf
    found = Contamination.parse("share=0.05,size=10,stuck=1").apply(z, RATE, seed=1)
    assert np.array_equal(np.isfinite(found), np.isfinite(z))
    assert found[5] == np.inf
    assert (found[30_010:30_100] == found[29_989]).all()


def test_the_same_seed_gives_the_same_copy_and_the_record_stays():
    before = Z.copy()
    faults = Contamination(share=0.01, size=10.0)
    first, again, other = (faults.apply(Z, RATE, seed) for seed in (1, 1, 2))
    assert np.array_equal(first, again)
    assert not np.array_equal(first, other)
    assert np.array_equal(Z, before)


def test_a_channel_does_not_depend_on_how_many_there_are():
    z = np.column_stack([Z, 3.0 * Z[::-1]])
    faults = Contamination(share=0.01, size=10.0, burst=5)
    both, one = faults.apply(z, RATE, seed=1), faults.apply(Z, RATE, seed=1)
    assert both.shape == z.shape
    assert np.array_equal(both[:, 0], one)
    assert not np.array_equal(both[:, 0] != z[:, 0], both[:, 1] != z[:, 1])


def test_unit_level_and_drift_do_not_matter():
    plain = moves("share=0.01,size=10")
    # A power of two scales without rounding.
    np.testing.assert_allclose(moves("share=0.01,size=10", 1024.0 * Z), 1024.0 * plain, rtol=1e-12)
    drifting = Z + 300.0 + 1e-3 * np.arange(N)
    # The drift's step adds 1e-3 to steps of deviation 1.4, and sums are rounded at 300.
    np.testing.assert_allclose(moves("share=0.01,size=10", drifting), plain, rtol=1e-3, atol=1e-12)


def test_a_coarse_output_has_a_deviation():
    coarse = np.zeros(N)
    coarse[::10] = 1.0
    # Two steps of size 1 in ten samples.
    np.testing.assert_allclose(
        np.abs(moved("share=0.01,size=10", coarse)), 10.0 * math.sqrt(0.1), rtol=1e-3
    )


@pytest.mark.parametrize(
    "text",
    [
        "share=0.05,size=100",
        "share=0.001,size=10,one-sided",
        "size=30,burst=20",
        "stuck=10",
        "stuck=0.5,at-zero",
        "share=0.123456789012,size=3,burst=2,stuck=1",
    ],
)
def test_a_text_is_read_and_told(text):
    found = Contamination.parse(text)
    assert str(found) == text
    assert Contamination.parse(str(found)) == found


def test_words_may_have_spaces_around():
    assert Contamination.parse(" share = 0.05 , size=100") == Contamination(0.05, 100.0)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", r"is made of share=, size=, one-sided, burst=, stuck=, at-zero, got ''"),
        ("share=0.1,wide=3", "got 'wide=3'"),
        ("share", "got 'share'"),
        ("one-sided=1", "got 'one-sided=1'"),
        ("share=0.1,share=0.2,size=3", "share stands twice in"),
        ("share=much,size=3", "share must be a number, got 'much'"),
        ("burst=2.5,size=3", "burst must be a whole number, got '2.5'"),
        ("share=1.5,size=3", "share must be 0 to 1, got 1.5"),
        ("share=nan,size=3", "share must be 0 to 1, got nan"),
        ("share=0.1,size=-3", "size must be finite and not negative, got -3"),
        ("burst=-1,size=3", "burst must be a whole number from 0, got -1"),
        ("stuck=inf", "stuck must be finite"),
        ("share=0.1", "need a size above 0"),
        ("size=3,stuck=1", "a size needs one of them"),
        ("stuck=0", "needs share, burst or stuck above 0"),
        ("stuck=1,one-sided", "one_sided is for share and burst only"),
        ("share=0.1,size=3,at-zero", "at_zero needs stuck above 0"),
    ],
)
def test_a_text_that_means_nothing_is_refused(text, message):
    with pytest.raises(ValueError, match=message):
        Contamination.parse(text)


@pytest.mark.parametrize(
    ("z", "rate", "seed", "message"),
    [
        (np.zeros((2, 2, 2)), RATE, 1, r"shape \(n,\) or \(n, k\), got \(2, 2, 2\)"),
        (Z, 0.0, 1, "rate must be positive and finite, got 0.0"),
        (Z, RATE, -1, "seed must be a whole number from 0, got -1"),
    ],
)
def test_a_record_that_means_nothing_is_refused(z, rate, seed, message):
    with pytest.raises(ValueError, match=message):
        Contamination(share=0.1, size=3.0).apply(z, rate, seed)


@pytest.mark.parametrize("z", [np.ones(10), np.array([1.0, np.nan, 2.0]), np.array([])])
def test_where_no_sample_differs_from_the_next_outliers_have_no_size(z):
    found = Contamination(share=1.0, size=3.0).apply(z, RATE, seed=1)
    np.testing.assert_array_equal(found, z)


def test_a_constant_record_may_be_stuck():
    assert Contamination(stuck=0.05, at_zero=True).apply(np.ones(10), RATE, seed=1).sum() == 5.0
