"""Bounds of the 1000-point set against those of Stable32, and the quantiles they are made of."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.stats import chi2

import zerorate as zr
from support.published import thousand
from zerorate._native import chi_squared_quantile
from zerorate.noise.freedom import total_bias
from zerorate.noise.kinds import KINDS

# Stable32 1.60, white noise taken for granted, 68.3 %: factor, terms, lower, deviation, upper.
PRINTED = {
    "adev": [
        (1, 999, 0.28515, 0.29223, 0.29987),
        (2, 499, 0.19787, 0.20510, 0.21319),
        (4, 249, 0.14201, 0.14943, 0.15815),
        (8, 124, 0.10254, 0.11013, 0.11971),
        (16, 61, 0.056510, 0.062381, 0.070567),
        (32, 30, 0.049153, 0.056233, 0.067635),
        (64, 14, 0.027109, 0.032550, 0.043537),
        (128, 6, 0.026481, 0.033855, 0.055744),
    ],
    "oadev": [
        (1, 999, 0.28515, 0.29223, 0.29987),
        (2, 997, 0.19520, 0.20102, 0.20738),
        (4, 993, 0.13931, 0.14479, 0.15098),
        (8, 985, 0.10038, 0.10570, 0.11198),
        (16, 969, 0.057696, 0.061915, 0.067217),
        (32, 937, 0.043654, 0.048082, 0.054202),
        (64, 873, 0.031755, 0.036237, 0.043377),
        (128, 745, 0.023045, 0.027674, 0.037027),
    ],
    "mdev": [
        (2, 996, 0.15336, 0.15821, 0.16355),
        (4, 990, 0.10322, 0.10780, 0.11304),
        (8, 978, 0.069840, 0.074192, 0.079481),
        (16, 954, 0.038022, 0.041376, 0.045809),
        (32, 906, 0.030466, 0.034255, 0.039933),
        (64, 810, 0.023687, 0.027871, 0.035511),
        (128, 618, 0.014874, 0.018669, 0.028584),
    ],
    "hdev": [
        (1, 998, 0.28635, 0.29439, 0.30315),
        (2, 498, 0.19887, 0.20716, 0.21659),
        (4, 248, 0.14054, 0.14890, 0.15896),
        (8, 123, 0.10744, 0.11649, 0.12829),
        (16, 60, 0.053296, 0.059589, 0.068811),
        (32, 29, 0.046987, 0.054697, 0.068092),
    ],
    "ohdev": [
        (2, 995, 0.19491, 0.20125, 0.20825),
        (4, 989, 0.13777, 0.14368, 0.15043),
        (8, 977, 0.10388, 0.10987, 0.11704),
        (16, 953, 0.056173, 0.060638, 0.066369),
        (32, 905, 0.040664, 0.045095, 0.051382),
        (64, 809, 0.029271, 0.033824, 0.041477),
        (128, 617, 0.023761, 0.029147, 0.041367),
    ],
    "totdev": [
        (1, 999, 0.28707, 0.29223, 0.29768),
        (2, 999, 0.19592, 0.20089, 0.20625),
        (4, 999, 0.13947, 0.14444, 0.14998),
        (8, 999, 0.10039, 0.10540, 0.11126),
        (16, 999, 0.057732, 0.061788, 0.066839),
        (32, 999, 0.044255, 0.048580, 0.054484),
        (64, 999, 0.031639, 0.035905, 0.042546),
        (128, 999, 0.026406, 0.031259, 0.040383),
        (256, 999, 0.010734, 0.013369, 0.019924),
    ],
    "htotdev": [
        (1, 998, 0.28670, 0.29439, 0.30274),
        (2, 995, 0.19726, 0.20297, 0.20922),
        (4, 989, 0.13744, 0.14252, 0.14821),
        (8, 977, 0.10303, 0.10822, 0.11430),
        (16, 953, 0.061280, 0.065265, 0.070151),
    ],
    "mtotdev": [
        (1, 999, 0.20163, 0.20664, 0.21204),
        (2, 996, 0.13898, 0.14337, 0.14821),
        (4, 990, 0.090598, 0.094613, 0.099218),
        (8, 978, 0.061866, 0.065721, 0.070406),
        (16, 954, 0.034536, 0.037135, 0.040425),
    ],
}
THEO1 = [
    *((10, 0.10757), (20, 0.072762), (40, 0.048652), (100, 0.031789)),
    *((202, 0.024120), (400, 0.014321), (998, 0.0050234)),
]


def white(kind, **options):
    return zr.allan(thousand(), 1.0, kind, exponent=0, **options)


@pytest.mark.parametrize("kind", PRINTED)
def test_bounds_are_those_of_stable32(kind):
    m, terms, lower, sigma, upper = map(np.array, zip(*PRINTED[kind], strict=True))
    r = white(kind, taus=m, confidence=0.683)
    # Of the total kinds it takes the bias off the Hadamard one alone.
    bias = total_bias(KINDS[kind], m, np.zeros_like(m), 1000) if kind == "htotdev" else 1.0
    np.testing.assert_array_equal(r.term_count, terms)
    # Five digits are printed; Stable32 approximates the quantiles of chi-squared.
    np.testing.assert_allclose(r.deviation / np.sqrt(bias), sigma, rtol=1e-4)
    np.testing.assert_allclose(r.lower / np.sqrt(bias), lower, rtol=1e-2)
    np.testing.assert_allclose(r.upper / np.sqrt(bias), upper, rtol=1e-2)


def test_theo1_is_that_of_stable32():
    m, sigma = np.transpose(THEO1)
    # Five digits are printed.
    np.testing.assert_allclose(white("theo1", taus=0.75 * m).deviation, sigma, rtol=1e-4)


@pytest.mark.parametrize("kind", [kind for kind in KINDS if kind != "pdev"])
@pytest.mark.parametrize("confidence", [0.5, 0.683, 0.9])
def test_bounds_are_quantiles_of_chi_squared(kind, confidence):
    r = white(kind, confidence=confidence)
    tail = (1.0 - confidence) / 2.0
    lower, upper = (np.sqrt(r.edf / chi2.ppf(p, r.edf)) for p in (1.0 - tail, tail))
    # What the quantiles are good to, see below.
    np.testing.assert_allclose(r.lower, r.deviation * lower, rtol=1e-8)
    np.testing.assert_allclose(r.upper, r.deviation * upper, rtol=1e-8)


def test_the_parabolic_deviation_has_no_bounds():
    r = white("pdev")
    assert np.all(r.deviation > 0.0)
    assert np.isnan([r.edf, r.lower, r.upper]).all()


@pytest.mark.parametrize("kind", [kind for kind in KINDS if kind != "pdev"])
def test_more_confidence_takes_wider_bounds(kind):
    narrow, wide = white(kind, confidence=0.68), white(kind, confidence=0.9)
    assert np.all(wide.lower < narrow.lower)
    assert np.all(narrow.upper < wide.upper)
    assert np.all(narrow.edf == wide.edf)


@pytest.mark.parametrize(
    ("exponent", "factor", "offset"), [(0, 1.50, 0.0), (-1, 1.17, 0.22), (-2, 0.93, 0.36)]
)
def test_freedoms_of_the_total_deviation_are_the_printed_fits(exponent, factor, offset):
    r = zr.allan(thousand(), 1.0, "totdev", exponent=exponent)
    # A product and a difference.
    np.testing.assert_allclose(r.edf, factor * 1000.0 / r.factors - offset, rtol=1e-14)
    assert zr.allan(thousand(), 1.0, "totdev", exponent=2).edf == pytest.approx(white("totdev").edf)


def test_dense_grids_have_the_freedoms_of_each_factor():
    every, some = white("oadev", taus="all"), white("oadev", taus=[3, 17, 90, 333, 480])
    # Each is a sum over lags good to half a percent, see test_covariance.
    np.testing.assert_allclose(every.edf[some.factors - 1], some.edf, rtol=1e-2)


# Quantiles of chi-squared against SciPy.
PROBABILITIES = [1e-4, 0.005, 0.05, 0.1585, 0.5, 0.8415, 0.95, 0.99, 1.0 - 1e-6]
FREEDOMS = np.concatenate(([0.5, 0.7, 1.0, 1.5], np.geomspace(2.0, 1e7, 60)))

# The incomplete gamma functions of both are good to some 1e-13, and to less of it in the far tail.
TOLERANCE = 1e-9


@pytest.mark.parametrize("p", PROBABILITIES)
def test_equals_scipy(p):
    found = chi_squared_quantile(p, FREEDOMS)
    np.testing.assert_allclose(found, chi2.ppf(p, FREEDOMS), rtol=TOLERANCE)


@given(st.floats(0.05, 1.0 - 1e-4), st.floats(1.0, 1e7))
def test_equals_scipy_anywhere(p, edf):
    assert chi_squared_quantile(p, [edf])[0] == pytest.approx(chi2.ppf(p, edf), rel=TOLERANCE)


@given(st.floats(0.5, 1e7))
def test_rises_with_the_probability(edf):
    quantiles = [float(chi_squared_quantile(p, [edf])[0]) for p in PROBABILITIES]
    assert quantiles == sorted(quantiles)


@pytest.mark.parametrize("edf", [np.nan, np.inf, 0.0, -1.0])
def test_without_freedom_there_is_no_quantile(edf):
    found = chi_squared_quantile(0.5, [edf, 2.0])
    assert np.isnan(found[0])
    assert found[1] == pytest.approx(chi2.ppf(0.5, 2.0), rel=TOLERANCE)


@pytest.mark.parametrize("p", [0.0, 1.0, -0.1, 1.1, np.nan])
def test_probabilities_lie_between_0_and_1(p):
    with pytest.raises(ValueError, match="probability must lie between 0 and 1"):
        chi_squared_quantile(p, [1.0])


def test_wrong_shapes_are_refused():
    with pytest.raises(ValueError, match="shape"):
        chi_squared_quantile(0.5, np.ones((2, 2)))
