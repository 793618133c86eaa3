"""Deviations of published records against their printed tables (NIST SP 1065, section 12.4)."""

import numpy as np
import pytest

import zerorate as zr
from support.published import NBS14, NBS14_PHASE, TABLES, UNCORRECTED, thousand
from zerorate.noise.freedom import total_bias
from zerorate.noise.kinds import KINDS

SETS = [(NBS14, [1, 2]), (thousand(), [1, 10, 100])]
CORRECTED = ("mtotdev", "ttotdev", "htotdev")
PARABOLIC = [
    *(0.29223187810675200, 0.21445233564252639, 0.15618112158618463, 0.11709745745448434),
    *(0.069029585189839343, 0.049749707730398392, 0.038947417330713739, 0.030862392741372108),
    0.012447414341332683,
]


def deviation(z, m, kind, rate=1.0):
    return zr.allan(z, rate, kind, taus=np.array(m) / rate).deviation


def white_bias(kind, m, n):
    return total_bias(KINDS[kind], np.array(m), np.zeros(len(m), dtype=np.int64), n)


def test_the_nine_rates_are_as_printed():
    mean = NBS14.mean()
    slope, start = np.polyfit(np.arange(9.0), NBS14, 1)
    # Seven digits are printed; the intercept stands for one step before the first sample.
    assert mean == pytest.approx(788.8889, abs=5e-5)
    assert slope == pytest.approx(-10.2, abs=5e-6)
    assert start - slope == pytest.approx(839.8889, abs=5e-5)
    assert (NBS14[-1] - NBS14[0]) / 8.0 == pytest.approx(-26.875, abs=5e-6)
    assert NBS14.std(ddof=1) == pytest.approx(100.9770, abs=5e-5)
    # Printed phases are cut at five decimals, not rounded.
    np.testing.assert_allclose(np.cumsum(NBS14 - mean), NBS14_PHASE[1:], rtol=0, atol=1e-5)


def test_the_thousand_points_are_as_printed():
    y = thousand()
    numbers = np.rint(y * 2147483647.0).astype(int)
    assert numbers[[1, 2, 3, 999]].tolist() == [395529916, 1209410747, 633705974, 1560135652]
    slope, start = np.polyfit(np.arange(1.0, 1001.0), y, 1)
    halves = (y[500:].mean() - y[:500].mean()) / 500.0
    found = [y.mean(), y.max(), y.min(), slope, start, halves, (y[-1] - y[0]) / 999.0]
    printed = [4.897745e-01, 9.957453e-01, 1.371760e-03, 6.490910e-06, 4.865258e-01]
    printed += [-6.104214e-06, 1.517561e-04]
    # Seven digits are printed.
    np.testing.assert_allclose(found, printed, rtol=5e-7)


@pytest.mark.parametrize(
    ("m", "printed"), [(1, 2.884664e-01), (10, 9.296352e-02), (100, 3.206656e-02)]
)
def test_averages_of_the_thousand_points_are_as_printed(m, printed):
    averages = thousand().reshape(-1, m).mean(axis=1)
    # Seven digits are printed.
    assert averages.std(ddof=1) == pytest.approx(printed, rel=5e-7)


@pytest.mark.parametrize("kind", [kind for kind in TABLES if kind not in CORRECTED])
@pytest.mark.parametrize("i", [0, 1])
def test_deviations_are_as_printed(kind, i):
    # Seven digits are printed, some of them cut rather than rounded.
    np.testing.assert_allclose(deviation(*SETS[i], kind), TABLES[kind][i], rtol=4e-7)


@pytest.mark.parametrize("kind", CORRECTED)
@pytest.mark.parametrize("i", [0, 1])
def test_total_deviations_without_their_bias_are_as_printed(kind, i):
    z, m = SETS[i]
    corrected = deviation(z, m, kind) / np.sqrt(white_bias(kind, m, len(z)))
    # Seven digits are printed.
    np.testing.assert_allclose(corrected, TABLES[kind][i], rtol=4e-7)


@pytest.mark.parametrize("kind", UNCORRECTED)
@pytest.mark.parametrize("i", [0, 1])
def test_total_deviations_with_their_bias_are_as_printed(kind, i):
    # Five digits are printed.
    np.testing.assert_allclose(deviation(*SETS[i], kind), UNCORRECTED[kind][i], rtol=5e-5)


def test_parabolic_deviations_are_as_printed():
    found = deviation(thousand(), 2 ** np.arange(9), "pdev")
    # Seventeen digits are printed; the sums have a thousand roundings of 1e-16.
    np.testing.assert_allclose(found, PARABOLIC, rtol=1e-12)


@pytest.mark.parametrize(("kind", "of_rate"), [("tdev", "mdev"), ("ttotdev", "mtotdev")])
def test_time_deviations_are_in_seconds(kind, of_rate):
    at_one, at_fifty = (zr.allan(thousand(), rate, kind) for rate in (1.0, 50.0))
    rates = zr.allan(thousand(), 50.0, of_rate).deviation
    # A rounding of a quotient or two each.
    np.testing.assert_allclose(at_fifty.deviation, at_one.deviation / 50.0, rtol=1e-15)
    np.testing.assert_allclose(at_fifty.upper, at_one.upper / 50.0, rtol=1e-15)
    np.testing.assert_allclose(at_fifty.deviation, at_fifty.taus / 3.0**0.5 * rates, rtol=1e-14)
    np.testing.assert_allclose(at_fifty.rate_deviation, rates, rtol=1e-14)
