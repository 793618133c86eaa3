"""Tests of trend and stationarity: published tables, exact counts, statsmodels."""

import itertools
import warnings

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.stats import kendalltau
from statsmodels.tsa.stattools import adfuller
from statsmodels.tsa.stattools import kpss as statsmodels_kpss

import zerorate as zr
from zerorate._native import reversals
from zerorate.identification import arrangements, reverse_arrangements
from zerorate.identification.stationarity import adf, kpss

# J. S. Bendat, A. G. Piersol, Random Data, section 4.5.2: example and table A.6.
BOOK = [5.2, 6.2, 3.7, 6.4, 3.9, 4.0, 3.9, 5.3, 4.0, 4.6]
BOOK += [5.9, 6.5, 4.3, 5.7, 3.1, 5.6, 5.2, 3.9, 6.2, 5.0]
TABLE = {
    10: (11, 33),
    12: (18, 47),
    14: (27, 63),
    16: (37, 82),
    18: (50, 102),
    20: (64, 125),
    30: (162, 272),
    40: (305, 474),
    50: (495, 729),
    60: (731, 1038),
    70: (1013, 1401),
    80: (1343, 1816),
    90: (1721, 2283),
    100: (2145, 2804),
}
NOISE = np.random.default_rng(1).standard_normal(20_000)
WALK = np.cumsum(NOISE)


def permutation(m, count):
    """Of m values, with so many reversals."""
    values, left = [], count
    remaining = list(range(m))
    for k in range(m - 1, -1, -1):
        first = min(left, k)
        values.append(remaining.pop(first))
        left -= first
    return np.array(values, dtype=float)


@pytest.mark.parametrize(("m", "bounds"), TABLE.items())
def test_table_of_acceptance(m, bounds):
    lower, upper = bounds
    assert arrangements.critical_values(m) == bounds
    for count, accepted in [(lower, False), (lower + 1, True), (upper, True), (upper + 1, False)]:
        found = reverse_arrangements(permutation(m, count), segments=None)
        assert (found.reversal_count, found.accepted) == (count, accepted)
        assert (found.lower, found.upper) == bounds
        assert (found.p_value > 0.05) == accepted


def test_the_example_of_the_book():
    found = reverse_arrangements(BOOK, segments=None)
    assert found.reversal_count == found.statistic == 86
    assert found.accepted
    # Seven pairs are equal, 3.9 three times among them: half of them is what A lacks.
    equal = sum(a == b for a, b in itertools.combinations(BOOK, 2))
    assert (found.tie_count, found.lower, found.upper) == (equal, 64 - equal / 2, 125 - equal / 2)
    assert (found.n, found.segment_count, found.of, found.left_out_count) == (20, 20, "sample", 0)


def test_probabilities_are_those_of_all_orders():
    orders = itertools.permutations(range(7))
    counts = np.bincount(
        [sum(a > b for a, b in itertools.combinations(order, 2)) for order in orders]
    )
    for count in range(counts.size):
        fewest = min(count, counts.size - 1 - count)
        expected = min(2.0 * counts[: fewest + 1].sum() / counts.sum(), 1.0)
        # A few roundings.
        assert arrangements.two_sided_probability(7, count) == pytest.approx(expected, rel=1e-14)


def test_probabilities_keep_their_digits_in_the_tail():
    # No reversal of 100 values is one order of 100!, two times for the other side.
    exact = 2.0 / float(np.prod(np.arange(1.0, 101.0)))
    # 99 divisions.
    assert arrangements.two_sided_probability(100, 0) == pytest.approx(exact, rel=1e-13)


def test_the_normal_approximation_joins_the_exact_distribution():
    m = arrangements.MAX_EXACT_VALUES + 1
    for count in (1900, 2200, 2525, 2900):
        exact = arrangements.two_sided_probability(m, count)
        found = reverse_arrangements(permutation(m, count), segments=None).p_value
        # The approximation lacks half a step of 0.003 deviations, and the fourth moment.
        assert found == pytest.approx(exact, rel=0.02, abs=0.002)


@given(st.lists(st.integers(-20, 20), min_size=2, max_size=300))
def test_reversals_are_kendalls(values):
    count, ties, _ = reversals(np.array(values, dtype=float))
    pairs = len(values) * (len(values) - 1) // 2
    later = pairs - ties - count
    if len(set(values)) > 1:
        # tau-b over its own norm gives back what it counted, to rounding.
        tau = kendalltau(np.arange(len(values)), values).statistic
        norm = np.sqrt(float(pairs) * (pairs - ties))
        assert later - count == pytest.approx(tau * norm, abs=1e-6)


def test_reversals_of_a_million_are_kendalls():
    z = np.random.default_rng(2).standard_normal(1_000_000)
    found = reverse_arrangements(z, segments=None)
    tau = kendalltau(np.arange(z.size), z)
    n = z.size
    # 1e12 pairs are counted exactly; tau is a double.
    assert found.reversal_count == pytest.approx(n * (n - 1) / 4 * (1.0 - tau.statistic), rel=1e-12)
    assert found.p_value == pytest.approx(tau.pvalue, rel=1e-6)


def test_ties_do_not_look_like_a_trend():
    rejected, scores = 0, []
    for seed in range(300):
        z = np.round(np.random.default_rng(seed).standard_normal(500))
        found = reverse_arrangements(z, segments=None)
        rejected += not found.accepted
        scores.append(found.z_score)
        assert found.p_value == pytest.approx(kendalltau(np.arange(500), z).pvalue, rel=0.02)
    # 15 of 300 expected, standard error 3.8; of the mean score 1/sqrt(300) = 0.06.
    assert 4 <= rejected <= 27
    assert abs(np.mean(scores)) < 0.25
    assert np.std(scores) == pytest.approx(1.0, abs=0.2)


def test_lambda_is_that_of_bao_and_yuan():
    means = NOISE.reshape(100, 200).mean(axis=1)
    later = sum(b > a for a, b in itertools.combinations(means, 2))
    m = 100
    expected = (later + 0.5 - m * (m - 1) / 4) / np.sqrt(m * (2 * m**2 + 3 * m - 5) / 72)
    found = reverse_arrangements(NOISE)
    # A few roundings.
    assert found.z_score == pytest.approx(expected, rel=1e-12)
    assert found.reversal_count == m * (m - 1) // 2 - later


def test_a_rise_has_few_reversals_and_a_positive_score():
    rise = NOISE + np.linspace(0.0, 0.4, NOISE.size)
    found = reverse_arrangements(rise)
    assert not found.accepted
    assert found.z_score > 2.0
    assert found.reversal_count < found.lower
    fall = reverse_arrangements(-rise)
    assert fall.z_score < -2.0
    assert fall.p_value == pytest.approx(found.p_value, rel=1e-9)


def test_variances_see_noise_that_grows():
    louder = NOISE * np.linspace(1.0, 1.3, NOISE.size)
    assert reverse_arrangements(louder).accepted
    assert not reverse_arrangements(louder, of="variance").accepted
    assert reverse_arrangements(1e7 + 1e-3 * NOISE, of="variance").accepted


def test_the_level_is_5_percent():
    records = np.random.default_rng(3).standard_normal((500, 2000))
    rejected = sum(not reverse_arrangements(z).accepted for z in records)
    # Standard error 4.9 of 25.
    assert 11 <= rejected <= 40


def test_where_it_differs():
    z = NOISE + 0.5 * (np.arange(20_000) >= 12_000)
    found = reverse_arrangements(z)
    # Means of 200 samples: the step is seven of their deviations, so its place is exact.
    assert found.where.startswith("means of segments 1 to 60 lie 0.5")
    assert found.where.endswith(" below 61 to 100 in the mean")
    assert reverse_arrangements(-z).where.replace("above", "below") == found.where
    assert reverse_arrangements(z[:500], None).where.startswith("samples 1 to ")


def test_segments_without_half_their_samples_are_left_out():
    z = NOISE.copy()
    z[:100] = np.nan  # half of the first
    z[400:599] = np.nan  # nearly all of the third
    z[800:899] = np.inf  # less than half of the fifth
    found = reverse_arrangements(z)
    assert (found.segment_count, found.left_out_count) == (98, 2)
    assert found.n == 98 * 200 - 99
    rows = np.where(np.isfinite(z), z, np.nan).reshape(100, 200)
    kept = np.delete(rows, [0, 2], axis=0)
    assert found.reversal_count == reversals(np.nanmean(kept, axis=1))[0]
    assert found.where.startswith("means of segments 2 to ")


def test_missing_samples_are_passed_over():
    z = NOISE[:2000].copy()
    z[::9] = np.nan
    found = reverse_arrangements(z, segments=None)
    assert found.reversal_count == reversals(z[np.isfinite(z)])[0]
    assert found.left_out_count == 0


def test_equal_values_have_no_trend():
    z = np.repeat(NOISE[:100], 2)
    found = reverse_arrangements(z, of="variance")
    assert (found.reversal_count, found.tie_count, found.accepted) == (0, 4950, True)
    assert found.p_value == 1.0


@pytest.mark.parametrize("z", [NOISE, 1e6 + NOISE + 1e-3 * WALK, WALK, np.diff(NOISE)])
@pytest.mark.parametrize(("trend", "named"), [("constant", "c"), ("linear", "ct")])
@pytest.mark.parametrize("lags", [None, 0, 1, 25])
def test_kpss_equals_statsmodels(z, trend, named, lags):
    z = z[:4000]
    with warnings.catch_warnings():
        # Of probabilities beyond the table.
        warnings.simplefilter("ignore")
        statistic, p_value, *_ = statsmodels_kpss(z, named, nlags="auto" if lags is None else lags)
    found = kpss(z, lags, trend)
    # statsmodels' trend is solved by singular values, and its mean loses digits to an offset.
    assert found.statistic == pytest.approx(statistic, rel=1e-6)
    assert found.p_value == pytest.approx(p_value, rel=1e-5)
    assert found.accepted == (p_value >= 0.05)
    assert found.n == z.size


def test_kpss_has_bounds_where_its_table_ends():
    assert (kpss(NOISE).p_value, kpss(NOISE).p_bound) == (0.10, ">")
    assert (kpss(WALK).p_value, kpss(WALK).p_bound) == (0.01, "<")
    between = kpss(np.linspace(0.0, 0.055, 20_000) + NOISE)
    assert 0.01 < between.p_value < 0.10
    assert between.p_bound == ""


def test_kpss_passes_over_gaps():
    z = NOISE.copy()
    z[5000:9000] = np.nan
    assert kpss(z).accepted
    assert kpss(z).n == 16_000
    assert not kpss(z + np.linspace(0.0, 1.0, z.size)).accepted
    assert kpss(z + np.linspace(0.0, 1.0, z.size), trend="linear").accepted


def peer_adf(z, lags):
    """Statistic, probability, lags, samples and 5 % point of statsmodels."""
    with warnings.catch_warnings():
        # Newer versions announce another form of the result.
        warnings.simplefilter("ignore")
        options = {"autolag": "AIC"} if lags is None else {"maxlag": lags, "autolag": None}
        statistic, p_value, used, n, points, *_ = adfuller(z, **options)
    return statistic, p_value, used, n, points["5%"]


ADF_RECORDS = {
    "white": NOISE[:1000],
    "walk": WALK[:1000],
    "far": 1e4 + WALK[:1000],
    "coloured": np.convolve(NOISE[:1100], 0.9 ** np.arange(100), mode="valid"),
    "faint": NOISE[:1000] + 0.02 * WALK[5000:6000],
    "short": NOISE[:40],
    "coarse": np.round(WALK[:500]),
}


@pytest.mark.every(2)
@pytest.mark.parametrize("z", ADF_RECORDS.values(), ids=ADF_RECORDS)
@pytest.mark.parametrize("lags", [None, 0, 1, 7])
def test_adf_equals_statsmodels(z, lags):
    statistic, p_value, used, n, point = peer_adf(z, lags)
    found = adf(z, lags)
    # An offset of 1e4 takes four digits from the peer's regression, near a unit root six more.
    assert found.statistic == pytest.approx(statistic, rel=1e-6)
    assert found.p_value == pytest.approx(p_value, rel=1e-5, abs=1e-300)
    assert found.lower == pytest.approx(point, rel=1e-12)
    assert (found.n, found.note.split()[0]) == (n, str(used))
    assert found.accepted == (statistic > point)


def test_adf_starts_anew_after_gaps():
    z = WALK[:4000].copy()
    z[2000] = np.nan
    found = adf(z, 2)
    assert found.n == 4000 - 1 - 2 * 3
    assert found.accepted
    # A level of its own after the gap is no step of the walk.
    z[2001:] += 1000.0
    assert adf(z, 2).accepted
    short = NOISE[:2000].copy()
    short[::12] = np.nan
    assert not adf(short).accepted


def test_faint_drift_is_seen_by_kpss_but_not_by_adf():
    found = np.zeros(3)
    for seed in range(30):
        noise = np.random.default_rng(seed).standard_normal((2, 5000))
        z = noise[0] + 0.01 * np.cumsum(noise[1])
        accepted = [adf(z).accepted, kpss(z).accepted, reverse_arrangements(z).accepted]
        found += ~np.array(accepted)
    unit_root, stationary, no_trend = found / 30
    # There is a unit root, but the moving-average root is 0.99. A walk that comes back has no
    # trend. Seen are 1.0, 1.0 and 0.83, of which chance takes at most 0.2 (three standard errors).
    assert unit_root > 0.9
    assert stationary > 0.7
    assert no_trend > 0.5


def test_tests_of_drift_do_not_depend_on_the_unit():
    z = 3.0 + NOISE[:4000] + 0.02 * WALK[:4000]
    for test in (kpss, reverse_arrangements, lambda z: adf(z, 3)):
        # Powers of two round nothing.
        assert test(2.0**200 * z).statistic == test(z).statistic
        assert test(2.0**-200 * z).statistic == test(z).statistic


@pytest.mark.parametrize("name", zr.simulation.DEVICES)
def test_drift_of_devices_is_seen(name):
    z, _ = zr.simulate(zr.simulation.device(name), 10.0, 7200.0, seed=1)
    verdicts = [kpss(z).accepted, reverse_arrangements(z).accepted]
    assert not all(verdicts)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (
            lambda: reverse_arrangements(NOISE, 5),
            "at least 10 segments with more than half of their samples, got 5",
        ),
        (lambda: reverse_arrangements(NOISE[:50]), "number of samples, 50, got 100"),
        (lambda: reverse_arrangements(NOISE[:5], None), "test needs at least 10 samples, got 5"),
        (lambda: reverse_arrangements(NOISE, of="median"), "of must be one of 'mean', 'variance'"),
        (
            lambda: reverse_arrangements(NOISE[:100], of="variance"),
            "variances need segments of 2 samples, got 100 of 1",
        ),
        (lambda: reverse_arrangements(np.ones(200)), "needs samples that differ, all 200 are 1"),
        (lambda: reversals([1.0, np.nan]), "z must hold finite samples only"),
        (lambda: kpss(NOISE[:9]), "the KPSS test needs at least 10 samples, got 9"),
        (lambda: kpss(NOISE, trend="none"), "trend must be one of 'constant', 'linear'"),
        (lambda: kpss(NOISE, lags=-1), "lags must be a whole number from 0 to 19999, got -1"),
        (lambda: kpss(np.arange(99.0), trend="linear"), "samples that differ from a straight line"),
        (lambda: adf(NOISE[:19]), "the Dickey-Fuller test needs at least 20 samples, got 19"),
        (lambda: adf(NOISE, lags=64), "lags must be a whole number from 0 to 63, got 64"),
        (lambda: adf(NOISE[:30], lags=14), "lags must be a whole number from 0 to 13, got 14"),
        (lambda: kpss(NOISE, lags=2.5), "lags must be a whole number from 0 to 19999, got 2.5"),
    ],
)
def test_wrong_input_is_refused_in_a_sentence(call, message):
    with pytest.raises(ValueError, match=message):
        call()
