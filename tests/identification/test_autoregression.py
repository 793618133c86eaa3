"""`fit_ar`: against R, NumPy and statsmodels, in any unit, on any offset, with gaps."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from statsmodels.regression.linear_model import yule_walker
from statsmodels.tsa.ar_model import AutoReg
from statsmodels.tsa.stattools import pacf_burg

from oracle.autoregression import least_squares, stretches
from support.autoregressions import LH, simulated, stationary_records
from zerorate._native import autoregression_variances
from zerorate.identification import fit_ar

METHODS = ("least-squares", "burg", "yule-walker")
BY_METHOD = pytest.mark.parametrize("method", METHODS)
BY_CONSTANT = pytest.mark.parametrize("constant", [True, False])

# Normal equations cost twice the digits of the rows; conditions here stay below 1e6, rounding
# times that is 2e-10.
DIGITS = 1e-9


def with_gaps(z, seed, share=0.02):
    z = z.copy()
    z[np.random.default_rng(seed).random(z.size) < share] = np.nan
    return z


def assert_fits(model, expected, rtol=DIGITS):
    """Compare with the oracle: coefficients by their standard errors, the rest by its own size."""
    p = len(model.phi)
    sigma = np.sqrt(np.diag(expected.covariance))
    # Where the record says nothing of a coefficient, its relative error means nothing.
    for got, i in [*zip(model.phi, range(p), strict=True), (model.constant, p)]:
        size = max(abs(expected.coefficients[i]), sigma[i])
        assert got == pytest.approx(expected.coefficients[i], rel=rtol, abs=rtol * size)
    np.testing.assert_allclose(model.standard_errors, sigma, rtol=rtol)
    assert model.sigma2 == pytest.approx(expected.sigma2, rel=rtol)
    assert model.n == expected.n
    assert model.condition == pytest.approx(expected.condition, rel=1e-6)


@pytest.mark.parametrize(
    ("method", "phi", "sigma2"),
    [
        ("least-squares", [0.6578, -0.0658, -0.2348], 0.1905),
        ("burg", [0.6588, -0.0608, -0.2234], 0.1786),
        ("yule-walker", [0.6534, -0.0636, -0.2269], 0.1959),
    ],
)
def test_luteinizing_hormone_as_in_r(method, phi, sigma2):
    model = fit_ar(LH, 3, method)
    # R divides the variance of Yule-Walker by n - p - 1 in place of n.
    divisor = (LH.size - 4) / LH.size if method == "yule-walker" else 1.0
    # Half of the last digit that R prints.
    np.testing.assert_allclose(model.phi, phi, atol=0.5e-4)
    assert model.sigma2 / divisor == pytest.approx(sigma2, abs=0.5e-4)


def test_intercept_of_luteinizing_hormone_as_in_r():
    # R takes the mean off and then fits an intercept.
    assert fit_ar(LH - LH.mean(), 3).constant == pytest.approx(-0.005259, abs=0.5e-6)
    model = fit_ar(LH, 3)
    left = model.constant - LH.mean() * (1.0 - model.phi.sum())
    assert left == pytest.approx(-0.005259, abs=0.5e-6)


@given(stationary_records(), st.integers(0, 20), st.booleans())
def test_least_squares_as_lstsq_of_the_rows(record, p, constant):
    z, _ = record
    assert_fits(fit_ar(z, p, constant=constant), least_squares(z, p, constant=constant))


@given(stationary_records(), st.integers(0, 5), st.integers(0, 99))
def test_gaps_part_the_rows(record, p, seed):
    z = with_gaps(record[0], seed)
    assert_fits(fit_ar(z, p), least_squares(z, p))


@given(stationary_records(), st.integers(1, 8))
def test_least_squares_as_statsmodels(record, p):
    z, _ = record
    model, peer = fit_ar(z, p), AutoReg(z, p, trend="c").fit()
    order = [*range(1, p + 1), 0]
    sigma = peer.bse[order]
    np.testing.assert_allclose(
        [*model.phi, model.constant] / sigma, peer.params[order] / sigma, rtol=1e-7, atol=1e-7
    )
    np.testing.assert_allclose(model.standard_errors, sigma, rtol=1e-7)
    assert model.sigma2 == pytest.approx(peer.sigma2, rel=1e-7)
    assert model.log_likelihood == pytest.approx(peer.llf, rel=1e-7, abs=1e-6)


@given(stationary_records(), st.integers(1, 12))
def test_burg_as_statsmodels(record, p):
    z, _ = record
    model, reflections = fit_ar(z, p, "burg"), pacf_burg(z, p, demean=True)[0][1:]
    assert model.phi[-1] == pytest.approx(reflections[-1], rel=1e-9, abs=1e-9)
    # R's first variance: what each order leaves of the mean square.
    sigma2 = np.var(z) * np.prod(1.0 - reflections**2)
    assert model.sigma2 == pytest.approx(sigma2, rel=1e-9)


@given(stationary_records(), st.integers(1, 12), st.booleans())
def test_yule_walker_as_statsmodels(record, p, constant):
    z = record[0] + 0.5
    model = fit_ar(z, p, "yule-walker", constant)
    phi, sigma = yule_walker(z, p, method="mle", demean=constant, result_object=False)
    # Both solve equations of a condition below 1e5.
    np.testing.assert_allclose(model.phi, phi, rtol=1e-8, atol=1e-10)
    assert model.sigma2 == pytest.approx(sigma**2, rel=1e-8)


def test_yule_walker_over_gaps_is_that_of_sums_over_stretches():
    z = with_gaps(simulated([0.6, 0.2], 2000), 3)
    centred = [part - np.nanmean(z) for part in stretches(z)]
    n = sum(part.size for part in centred)
    lagged = [
        sum(part[j:] @ part[: part.size - j] for part in centred if part.size > j) / n
        for j in range(4)
    ]
    gamma = np.array([[lagged[abs(i - j)] for j in range(3)] for i in range(3)])
    model = fit_ar(z, 3, "yule-walker")
    # Both orders of summation round a few units in the last place.
    np.testing.assert_allclose(model.phi, np.linalg.solve(gamma, lagged[1:]), rtol=1e-11)
    covariance = np.linalg.inv(gamma) * model.sigma2 / n
    np.testing.assert_allclose(model.covariance[:3, :3], covariance, rtol=1e-11)
    scaled = np.linalg.cond(gamma)
    assert model.condition == pytest.approx(scaled, rel=1e-9)


def test_burg_over_stretches_sums_what_it_makes_small():
    z = simulated([0.8], 300)
    parted = np.insert(z, 100, np.nan)
    parts = [part - z.mean() for part in (z[:100], z[100:])]
    products = sum(2.0 * part[1:] @ part[:-1] for part in parts)
    squares = sum(part[1:] @ part[1:] + part[:-1] @ part[:-1] for part in parts)
    # One quotient of two sums.
    assert fit_ar(parted, 1, "burg").phi[0] == pytest.approx(products / squares, rel=1e-13)


@BY_METHOD
def test_methods_agree_on_long_records(method):
    phi = [1.2, -0.5, 0.1]
    model = fit_ar(simulated(phi, 200_000) + 3.0, 3, method)
    # Five standard errors: one in a million.
    assert np.all(np.abs(model.phi - phi) < 5.0 * model.standard_errors[:3])
    assert abs(model.constant - 3.0 * (1.0 - sum(phi))) < 5.0 * model.standard_errors[3]
    # A variance of n values has the standard error sqrt(2 / n).
    assert model.sigma2 == pytest.approx(1.0, abs=5.0 * np.sqrt(2.0 / 200_000))
    reference = fit_ar(simulated(phi, 200_000) + 3.0, 3).standard_errors
    # Estimates of the same limits, which n = 200 000 samples give to about 1/sqrt(n).
    np.testing.assert_allclose(model.standard_errors, reference, rtol=0.01)


@pytest.mark.parametrize("alpha", [1e-12, 3.7e-5, 1e6])
@BY_CONSTANT
@BY_METHOD
def test_units_do_not_matter(method, constant, alpha):
    z = simulated([0.7, 0.1], 5000) + 2.0
    one, other = (fit_ar(record, 3, method, constant) for record in (z, alpha * z))
    # Every product rounds anew: a few units in the last place, times a condition below 100.
    np.testing.assert_allclose(other.phi, one.phi, rtol=1e-12)
    assert other.constant == pytest.approx(alpha * one.constant, rel=1e-12)
    assert other.sigma2 == pytest.approx(alpha**2 * one.sigma2, rel=1e-12)
    units = [1.0, 1.0, 1.0, alpha]
    np.testing.assert_allclose(other.standard_errors, one.standard_errors * units, rtol=1e-12)
    assert other.condition == pytest.approx(one.condition, rel=1e-12)


@BY_METHOD
def test_an_offset_loses_nothing(method):
    z = 1e7 + 1e-4 * simulated([0.7, 0.1], 5000)
    # Near 1e7 samples are multiples of 2e-9; this difference is exact.
    one, other = fit_ar(z, 3, method), fit_ar(z - 1e7, 3, method)
    np.testing.assert_allclose(one.phi, other.phi, rtol=1e-10)
    np.testing.assert_allclose(one.standard_errors[:3], other.standard_errors[:3], rtol=1e-10)
    assert one.sigma2 == pytest.approx(other.sigma2, rel=1e-10)
    assert one.mean == pytest.approx(1e7, rel=1e-9)


@pytest.mark.parametrize("p", [1, 2, 10, 20])
@pytest.mark.parametrize("n", [2049, 15_000])
def test_near_a_unit_root_digits_are_kept(p, n):
    # FH's model: roots 0.0269 and 0.9933.
    z = simulated([1.0202, -0.0267], n) - 0.1
    assert_fits(fit_ar(z, p), least_squares(z, p))


def test_a_unit_root_shows_in_the_condition():
    z = simulated([1.0202, -0.0267], 15_000)
    assert fit_ar(z, 2).condition > 100.0
    assert fit_ar(simulated([0.5], 15_000), 2).condition < 10.0


def smooth(z, times, width=50):
    for _ in range(times):
        z = np.convolve(z, np.full(width, 1.0 / width), "valid")
    return z


NOISE = np.random.default_rng(1).standard_normal(20_000)


@pytest.mark.parametrize("p", [3, 10, 20])
@pytest.mark.parametrize(
    ("z", "rtol"),
    [
        (smooth(NOISE, 1), 1e-9),
        # A condition of 1e5 times rounding is 1e-11 of a coefficient, more of its error of 0.007.
        (np.cumsum(NOISE), 1e-8),
        # Conditions up to 1e15: lstsq itself keeps half of the digits.
        (smooth(NOISE, 2), 1e-7),
        (np.cumsum(np.cumsum(NOISE)), 1e-6),
        (with_gaps(np.cumsum(np.cumsum(NOISE)), 1, share=2e-3), 1e-6),
    ],
    ids=["averaged", "walk", "averaged twice", "integrated walk", "with gaps"],
)
def test_smooth_records_keep_their_digits(z, p, rtol):
    model, expected = fit_ar(z, p), least_squares(z, p)
    sigma = np.sqrt(np.diag(expected.covariance))
    # By what the record says of each: some coefficients are near 0.
    np.testing.assert_allclose(
        model.phi / sigma[:p], expected.coefficients[:p] / sigma[:p], rtol=rtol, atol=rtol
    )
    np.testing.assert_allclose(model.standard_errors, sigma, rtol=rtol)
    assert model.sigma2 == pytest.approx(expected.sigma2, rel=rtol)
    assert model.condition == pytest.approx(expected.condition, rel=1e-3)


@given(stationary_records(), st.integers(0, 99))
def test_all_orders_at_once_are_each_on_the_common_samples(record, seed):
    z = with_gaps(record[0], seed, share=0.01)
    variances, n = autoregression_variances(z, 7, "least-squares", True)
    each = [least_squares(z, p, start=7) for p in range(8)]
    np.testing.assert_allclose(variances, [fit.sigma2 for fit in each], rtol=DIGITS)
    assert n == each[0].n


@BY_METHOD
@BY_CONSTANT
def test_variances_are_those_of_the_fits(method, constant):
    z = simulated([0.7, 0.1], 500) + 1.0
    variances, n = autoregression_variances(z, 4, method, constant)
    model = fit_ar(z, 4, method, constant)
    assert variances.shape == (5,)
    # The same sums.
    assert variances[4] == pytest.approx(model.sigma2, rel=1e-15)
    assert n == model.n


@BY_METHOD
def test_without_a_constant_the_record_is_taken_as_it_is(method):
    model = fit_ar(simulated([0.5], 1000) + 10.0, 1, method, constant=False)
    assert (model.constant, model.mean, model.has_constant) == (0.0, 0.0, False)
    assert model.phi[0] > 0.98
    assert not model.covariance[1].any()
    assert not model.covariance[:, 1].any()


@BY_METHOD
def test_order_zero_is_mean_and_variance(method):
    z = simulated([0.5], 1000) + 10.0
    model = fit_ar(z, 0, method)
    assert (model.order, model.condition, model.parameter_count) == ((0, 0), 1.0, 2)
    # Two sums of 1000 samples in another order.
    assert model.constant == pytest.approx(z.mean(), rel=1e-14)
    assert model.sigma2 == pytest.approx(z.var(), rel=1e-13)
    assert model.standard_errors[0] == pytest.approx(z.std() / np.sqrt(1000), rel=1e-13)


@pytest.mark.parametrize(
    "convert",
    [
        lambda z: z.tolist(),
        lambda z: np.repeat(z, 2)[::2],
        lambda z: z[::-1].copy()[::-1],
        lambda z: z.astype(np.float32),
        lambda z: np.ma.masked_array(z, mask=False),
        lambda z: np.frombuffer(b"\0" + z.tobytes(), np.uint8)[1:].view(np.float64),
    ],
    ids=["list", "strided", "backwards", "float32", "masked", "unaligned"],
)
def test_any_array_will_do(convert):
    z = simulated([0.5], 500).astype(np.float32).astype(np.float64)
    np.testing.assert_array_equal(fit_ar(convert(z), 2).phi, fit_ar(z, 2).phi)


def test_masked_samples_and_none_are_missing():
    z = simulated([0.5], 500)
    gap = np.where(np.arange(500) == 100, np.nan, z)
    masked = np.ma.masked_array(z, mask=np.arange(500) == 100)
    listed = [None if np.isnan(value) else value for value in gap]
    for other in (masked, listed, np.where(np.isnan(gap), np.inf, gap)):
        np.testing.assert_array_equal(fit_ar(other, 2).phi, fit_ar(gap, 2).phi)


ALTERNATING = np.tile([1.0, -1.0], 50)
SHORT_STRETCHES = np.where(np.arange(60) % 4 == 3, np.nan, simulated([0.5], 60))


@pytest.mark.parametrize(
    ("z", "p", "message"),
    [
        (np.full(5, np.nan), 1, "z holds no finite sample"),
        ([], 1, "z holds no finite sample"),
        (np.full(50, 0.3), 1, "needs samples that differ, all 50 are 0.3"),
        (np.zeros((10, 2)), 1, r"z must have shape \(n,\), got \(10, 2\)"),
        (SHORT_STRETCHES, 3, "order 3 needs more than 3 samples in a row, z has at most 3"),
        (np.arange(5.0) ** 2, 3, "order 3 needs at least 5 residuals, z gives"),
        (ALTERNATING, 1, "z follows an autoregression of order 1 without any noise"),
        (np.arange(100.0), 2, "z follows an autoregression of order 2 without any noise"),
        (1e-170 * NOISE, 1, "too large or too small to be squared"),
        (1e170 * NOISE, 1, "too large or too small to be squared"),
    ],
)
def test_what_cannot_be_fitted_is_refused(z, p, message):
    with pytest.raises(ValueError, match=message):
        fit_ar(z, p)


@pytest.mark.parametrize("method", ["burg", "yule-walker"])
def test_other_methods_refuse_it_too(method):
    for z, message in [
        (np.full(5, np.nan), "z holds no finite sample"),
        (np.full(50, 0.3), "all 50 are 0.3"),
        (SHORT_STRETCHES, "more than 3 samples in a row"),
        (1e170 * NOISE, "too large or too small"),
    ]:
        with pytest.raises(ValueError, match=message):
            fit_ar(z, 3, method)


def test_burg_refuses_a_record_without_noise():
    with pytest.raises(ValueError, match="without any noise"):
        fit_ar(ALTERNATING, 1, "burg")


def test_lags_that_depend_on_each_other_are_refused():
    with pytest.raises(ValueError, match="lags 1 to 1 are linearly dependent"):
        fit_ar(np.append(np.zeros(20), 1.0), 1)


@pytest.mark.parametrize(
    ("arguments", "error", "message"),
    [
        ((-1,), ValueError, "p must be 0 to 64, got -1"),
        ((65,), ValueError, "p must be 0 to 64, got 65"),
        ((1.5,), TypeError, "p must be a whole number, got 1.5"),
        ((1, "ols"), ValueError, "method must be one of 'least-squares', 'burg', 'yule-walker'"),
    ],
)
def test_arguments_out_of_range_are_refused(arguments, error, message):
    with pytest.raises(error, match=message):
        fit_ar(NOISE, *arguments)


def test_complex_numbers_are_refused():
    with pytest.raises(TypeError, match="z must hold real numbers, got dtype complex128"):
        fit_ar(NOISE[:10] * 1j, 1)
