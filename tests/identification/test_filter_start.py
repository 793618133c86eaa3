"""Filters that begin with an identified model."""

import dataclasses

import numpy as np
import pytest
from hypothesis import given
from scipy.signal import lfilter

import zerorate as zr
from support.checks import assert_same_bits
from support.classes import assert_same_state
from support.models import FU_HAN, arma_models
from support.settings import RATE
from zerorate import identification
from zerorate.identification import ArmaModel
from zerorate.identification.filter_start import split_noise

# A drift of time constant 10 s under white noise, as one ARMA(1, 1).
MODEL = ArmaModel.of([0.999], [-0.95])
R = 0.95 / 0.999
G = 1.0 + 0.95**2 - R * (1.0 + 0.999**2)
N = 60_000


def simulated(seed, n=N, phi=0.999):
    """Drift and samples of MODEL, from a stationary start."""
    rng = np.random.default_rng(seed)
    first = rng.standard_normal() * np.sqrt(G / (1.0 - phi**2))
    noise = np.sqrt(G) * rng.standard_normal(n)
    drift, _ = lfilter([1.0], [1.0, -phi], noise, zi=[phi * first])
    return drift, drift + np.sqrt(R) * rng.standard_normal(n)


def optimal(z, phi=0.999):
    """Estimates, and innovation variances, of the Kalman filter that knows the truth."""
    x, P = 0.0, G / (1.0 - phi**2)
    estimates, variances = np.empty(len(z)), np.empty(len(z))
    for k, sample in enumerate(z):
        S = P + R
        x, P = x + P / S * (sample - x), R * P / S
        estimates[k], variances[k] = x, S
        x, P = phi * x, phi**2 * P + G
    return estimates, variances


def rms(x):
    return np.sqrt(np.mean(x**2))


class TestOptimality:
    def test_innovations_are_those_of_the_model(self):
        _, z = simulated(1)
        trace = MODEL.to_filter(RATE, "kf").trace(z)
        estimates, variances = optimal(z)
        # The floor of G lets the constant walk by 1e-6 deviations a sample: seen, 3e-5 of S.
        np.testing.assert_allclose(trace.innovation_variance, variances, rtol=1e-4)
        assert trace.innovation_variance[-1] == pytest.approx(MODEL.sigma2, rel=1e-4)
        assert trace.gain[-1, 0] == pytest.approx(1.0 - R / variances[-1], rel=1e-3)
        assert rms(trace.estimate - estimates) < 0.02 * rms(estimates)

    def test_innovations_are_white_from_the_first_sample(self):
        first = np.array(
            [
                MODEL.to_filter(RATE, "kf").trace(simulated(seed, 50)[1]).innovation
                for seed in range(400)
            ]
        )
        variances = MODEL.to_filter(RATE, "kf").trace(np.zeros(50)).innovation_variance
        scaled = first / np.sqrt(variances)
        correlation = scaled.T @ scaled / len(scaled)
        # Means of 400 products of unit variance: 1275 of them stay within five of their errors,
        # and the squares have twice the variance.
        assert np.abs(correlation - np.eye(50)).max() < 5.0 * np.sqrt(2.0 / 400)

    def test_error_to_the_true_drift(self):
        """Optimal to 2 %, where the ignorant start has three times the error."""
        ratios = {"started": [], "ignorant": [], "started fading": []}
        for seed in range(4):
            drift, z = simulated(seed)
            best = rms(optimal(z)[0] - drift)
            filters = {
                "started": MODEL.to_filter(RATE, "kf", output="estimate"),
                "ignorant": zr.DriftFilter(RATE, order=(1, 1), method="kf", output="estimate"),
                "started fading": MODEL.to_filter(RATE, output="estimate"),
            }
            for name, f in filters.items():
                ratios[name].append(rms(f.process(z) - drift) / best)
        assert max(ratios["started"]) < 1.02
        assert min(ratios["ignorant"]) > 2.5
        assert max(ratios["started fading"]) < 1.2


class TestSplit:
    @given(arma_models(largest=0.99, shapes=((1, 0), (2, 0), (3, 0))))
    def test_drift_under_noise_is_split_exactly(self, drift):
        # Nothing to find where phi is nearly zero, or the noise hides the drift.
        noise = 2.0 * drift.sigma2
        phi, theta, _, sigma2 = drift.to_state_space(measurement_noise=noise).to_arma()
        if len(phi) < len(drift.phi) or np.abs(drift.phi).max() < 1e-2:
            return
        found = split_noise(phi, theta, sigma2)
        # theta comes from a Riccati equation, good to some 1e-10 of the sum of both.
        assert pytest.approx(noise, rel=1e-6) == found.R
        assert found.g == pytest.approx(drift.sigma2, rel=1e-5)

    def test_closed_form_of_first_order(self):
        found = split_noise(np.array([0.9]), np.array([-0.5]), 4.0)
        # Two products and a sum.
        assert pytest.approx(0.5 * 4.0 / 0.9, rel=1e-14) == found.R
        assert found.g == pytest.approx(4.0 * 1.25 - found.R * 1.81, rel=1e-14)

    @pytest.mark.parametrize("phi", [[0.9], [1.5, -0.6], [-0.5]])
    def test_an_autoregression_has_the_allan_variance_as_noise(self, phi):
        model = ArmaModel.of(phi, [], sigma2=2.0)
        gamma = model.autocovariance(1)
        found = split_noise(model.phi, model.theta, 2.0)
        assert pytest.approx(gamma[0] - gamma[1], rel=1e-12) == found.R
        # The likelihood's frequencies are a sum in the place of an integral.
        assert found.g == pytest.approx(2.0, rel=1e-6)

    def test_a_walk_too(self):
        assert pytest.approx(1.0, rel=1e-15) == split_noise(np.ones(1), np.zeros(0), 2.0).R
        # Its difference is AR(1) of 0.3.
        found = split_noise(np.array([1.3, -0.3]), np.zeros(0), 2.0).R
        assert found == pytest.approx(1.0 / (1.0 - 0.09), rel=1e-14)

    def test_fu_han_has_no_drift(self):
        """Their ARMA(2, 1) is white noise to 0.1 %, with less of it at low frequencies."""
        found = split_noise(FU_HAN.phi, FU_HAN.theta, 1.0)
        assert found.g == 0.0
        assert pytest.approx(FU_HAN.autocovariance(0)[0], rel=1e-3) == found.R
        power = FU_HAN.spectrum([0.0, 0.2, 0.5], 1.0)
        assert power[0] < 0.5 * power[1]

    @pytest.mark.parametrize("theta", [[], [0.4], [-0.7, 0.2]])
    def test_without_an_autoregression_all_is_noise(self, theta):
        model = ArmaModel.of([], theta, sigma2=3.0)
        found = split_noise(model.phi, model.theta, 3.0)
        # The same sum, by products in another order on some processors.
        assert found == pytest.approx((0.0, model.autocovariance(0)[0]), rel=1e-15)

    def test_an_explosive_model_needs_its_noise(self):
        with pytest.raises(ValueError, match="explosive model"):
            split_noise(np.array([1.5]), np.zeros(0), 1.0)


def fitted(z, p):
    """AR(p) with a constant by least squares, as an estimator makes it."""
    mean = z.mean()
    y = z - mean
    columns = [y[p - i : len(y) - i] for i in range(1, p + 1)] + [np.ones(len(y) - p)]
    X = np.column_stack(columns)
    inverse = np.linalg.inv(X.T @ X)
    phi = inverse @ (X.T @ y[p:])
    sigma2 = np.mean((y[p:] - X @ phi) ** 2)
    constant = phi[-1] + mean * (1.0 - phi[:-1].sum())
    return ArmaModel(
        phi[:-1], [], constant, sigma2, inverse * sigma2, len(y) - p, 0.0, 1.0, "least-squares"
    )


def test_it_learns_on_as_if_it_had_seen_the_record():
    rng = np.random.default_rng(7)
    z = 5.0 + lfilter([1.0], [1.0, -1.2, 0.4], rng.standard_normal(8000))
    model = fitted(z[:4000], 2)
    f = model.to_filter(RATE, "kf", adapt_for=None, output="estimate")
    f.process(z[4000:])
    both = fitted(z, 2)
    step = np.abs(both.phi - model.phi).max()
    # The one sample that least squares starts with, three edges, and products with a constant
    # that are not quite zero: some parts in a thousand of a thousandth.
    assert np.abs(f.coefficients[:2] - both.phi).max() < 1e-4
    assert step > 1e-3
    assert f.coefficients[2] == pytest.approx(both.constant, abs=3e-3)


def test_by_default_the_coefficients_stay():
    f = MODEL.to_filter(RATE, output="estimate")
    f.process(simulated(2, 500)[1])
    assert_same_bits(f.coefficients[:2], np.array([0.999, -0.95]))


def test_a_given_model_is_certain():
    f = MODEL.to_filter(RATE, adapt_for=None, output="estimate")
    f.process(simulated(2, 500)[1])
    assert_same_bits(f.coefficients[:2], np.array([0.999, -0.95]))


def test_it_is_ready_at_the_first_sample():
    model = ArmaModel.of([0.999], [-0.95], constant=0.002)
    f = model.to_filter(RATE, "kf", output="estimate")
    assert f.ready
    assert f.samples_seen == 0
    assert f.estimate == pytest.approx(2.0, rel=1e-12)
    gamma = model.autocovariance(0)[0]
    assert f.innovation_variance == pytest.approx(gamma, rel=1e-12)
    gain = (gamma - R) / gamma
    # The floor of G, 1e-12 of the variance.
    assert f.update(3.0) == pytest.approx(2.0 + gain, rel=1e-9)


@pytest.mark.parametrize(("startup", "samples"), [(10.0, 1000), (1e-3, 10)])
def test_adaptive_noise_goes_on_as_after_a_start_up(startup, samples):
    f = MODEL.to_filter(RATE, "akf", startup=startup, output="estimate")
    f.process([0.0, 3.0])
    # The start-up would have held one difference fewer than samples; this is the next.
    expected = R + (4.5 - R) / samples
    assert f.measurement_noise == pytest.approx(expected, rel=1e-12)


@pytest.mark.parametrize("method", ["kf", "akf", "fading"])
def test_units_do_not_matter(method):
    _, z = simulated(3, 2000)
    plain = ArmaModel.of([0.999], [-0.95], 1e-3).to_filter(
        RATE, method, adapt_for=5.0, output="estimate"
    )
    a = 7.3e-6
    model = ArmaModel.of([0.999], [-0.95], 1e-3 * a, a**2)
    scaled = model.to_filter(RATE, method, adapt_for=5.0, output="estimate")
    # Each sample is rounded in its unit; the filter forgets that at once.
    np.testing.assert_allclose(scaled.process(z * a) / a, plain.process(z), rtol=0.0, atol=1e-11)


def test_given_noises_and_scale():
    f = MODEL.to_filter(RATE, measurement_noise=4.0, process_noise=0.5, offset=-1.0, scale=2.0)
    start = f.start
    assert (start["measurement_noise"], start["process_noise"]) == (4.0, 0.5)
    assert (start["offset"], start["scale"]) == (-1.0, 2.0)
    assert f.measurement_noise == 4.0
    assert f.process_noise[0, 0] == 0.5


def test_a_fit_that_runs_away_brings_the_moments_of_its_record():
    z = 2.0 + np.cumprod(np.full(2000, 1.002)) + np.random.default_rng(1).normal(0.0, 1e-3, 2000)
    for model in (identification.fit_ar(z, 1), identification.fit_arma(z, 1, 0)):
        assert not model.stationary
        moments = (model.record_mean, model.record_deviation)
        # Sums of 2000 in another order.
        assert moments == pytest.approx((z.mean(), z.std()), rel=1e-13)
        started = model.to_filter(RATE, measurement_noise=1e-6)
        # Its place is the point that it runs away from; its scale is the record's.
        assert started.start["offset"] == pytest.approx(2.0, abs=0.01)
        assert started.start["scale"] == model.record_deviation
    assert np.isnan(identification.fit_ar(np.random.default_rng(1).normal(size=500), 1).record_mean)


def test_a_walk_takes_its_place_from_the_record():
    walk = ArmaModel.of([1.0], [-0.9])
    with pytest.raises(ValueError, match="does not determine the offset of a filter: give it"):
        walk.to_filter(RATE)
    with pytest.raises(ValueError, match="does not determine the scale of a filter: give it"):
        walk.to_filter(RATE, offset=3.0)
    known = dataclasses.replace(walk, record_mean=3.0, record_deviation=0.5)
    f = known.to_filter(RATE, "kf", output="estimate")
    assert (f.start["offset"], f.start["scale"]) == (3.0, 0.5)
    assert f.start["state_covariance"][0, 0] == 0.25
    # R is 0.9 sigma2, and theta the gain: 1 + theta.
    f.process(3.0 + np.zeros(500))
    assert f.gain[0] == pytest.approx(0.1, rel=1e-3)


def test_a_pure_moving_average_is_filtered_to_its_mean():
    f = ArmaModel.of([], [0.4], constant=2.0).to_filter(RATE, "kf", output="estimate")
    assert f.order == (1, 1)
    found = f.process(2.0 + np.random.default_rng(4).standard_normal(300))
    # The floor of G: 1e-6 of a deviation a sample.
    np.testing.assert_allclose(found, 2.0, rtol=0.0, atol=1e-3)


class TestSeveralAxes:
    MODELS = (MODEL, ArmaModel.of([1.2, -0.3], [], constant=0.5), ArmaModel.of([], [], 3.0))

    def test_each_is_as_alone(self):
        z = 1.0 + np.random.default_rng(5).standard_normal((300, 3))
        f = identification.to_filter(self.MODELS, RATE, adapt_for=1.0, output="estimate")
        assert (f.channels, f.order) == (3, (2, 1))
        found = f.process(z)
        for axis, model in enumerate(self.MODELS):
            phi = np.append(model.phi, np.zeros(2 - len(model.phi)))
            theta = np.append(model.theta, np.zeros(1 - len(model.theta)))
            same = ArmaModel.of(phi, theta, model.constant)
            alone = same.to_filter(RATE, adapt_for=1.0, output="estimate").process(
                z[:, axis].copy()
            )
            # The split of a padded model solves other equations.
            np.testing.assert_allclose(found[:, axis], alone, rtol=0.0, atol=1e-9)

    def test_of_one_order_to_the_bit(self):
        models = [MODEL, ArmaModel.of([0.9], [-0.2], 4.0, 1e-6)]
        z = np.random.default_rng(6).standard_normal((200, 2))
        found = identification.to_filter(models, RATE, "akf", output="estimate").process(z)
        for axis, model in enumerate(models):
            assert_same_bits(
                found[:, axis].copy(),
                model.to_filter(RATE, "akf", output="estimate").process(z[:, axis].copy()),
            )

    def test_of_none(self):
        with pytest.raises(ValueError, match="to_filter needs at least one model, got none"):
            identification.to_filter([], RATE)


@pytest.mark.parametrize("models", [None, [MODEL], [MODEL, MODEL]])
def test_start_and_params_make_such_a_filter_anew(models):
    f = (
        MODEL.to_filter(RATE, output="estimate")
        if models is None
        else identification.to_filter(models, RATE, "akf", output="estimate")
    )
    fresh = f.copy()
    f.process(np.ones(10) if models is None else np.ones((10, len(models))))
    assert_same_state(zr.DriftFilter.started(f.start, **f.params), fresh)
    f.reset()
    assert_same_state(f, fresh)
    assert zr.DriftFilter(RATE).start is None


@pytest.mark.parametrize("order", [(4, 0), (1, 4)])
def test_orders_that_no_filter_has(order):
    model = ArmaModel.of(np.full(order[0], 0.1), np.full(order[1], 0.1))
    with pytest.raises(ValueError, match=r"a filter has orders up to \(3, 3\)"):
        model.to_filter(RATE)


def test_a_model_without_innovations():
    with pytest.raises(ValueError, match="innovations have a variance above 0"):
        ArmaModel.of([0.5], [], sigma2=0.0).to_filter(RATE)


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"scale": 0.0}, "scale must be a positive number"),
        ({"offset": np.nan}, "offset must be finite"),
        ({"measurement_noise": -1.0}, "measurement_noise must be zero or a positive number"),
        ({"process_noise": np.inf}, "process_noise must be"),
        ({"method": "median"}, "method must be"),
        ({"method": "auto"}, "method 'auto', the default, learns its own start"),
        ({"fading": 2.0}, "fading must be"),
    ],
)
def test_options_out_of_range(options, words):
    with pytest.raises(ValueError, match=words):
        MODEL.to_filter(RATE, **options)


@pytest.mark.parametrize(
    ("change", "error", "words"),
    [
        ({"scale": "wide"}, TypeError, r'start\["scale"\] must hold numbers'),
        (
            {"offset": np.zeros(2)},
            ValueError,
            r'start\["offset"\] must have shape \(\), got \(2,\)',
        ),
        ({"coefficients": np.zeros(2)}, ValueError, r"must have shape \(3,\), got \(2,\)"),
        ({"covariance": -np.eye(3)}, ValueError, "covariance must be symmetric positive"),
    ],
)
def test_starts_that_are_none(change, error, words):
    start = MODEL.to_filter(RATE).start | change
    with pytest.raises(error, match=words):
        zr.DriftFilter.started(start, rate=RATE, order=(1, 1), method="fading")


def test_a_start_that_lacks_something():
    start = MODEL.to_filter(RATE).start
    del start["scale"]
    with pytest.raises(ValueError, match='start lacks "scale"'):
        zr.DriftFilter.started(start, rate=RATE, order=(1, 1), method="fading")
