"""The fit of a deviation curve: what it recovers, how sure it is, and what it refuses."""

from dataclasses import replace

import numpy as np
import pytest

import zerorate as zr
from support.simulated_fits import TERMS, coefficients, share_within, simulated_fits
from zerorate.noise.kinds import KINDS

MODEL = zr.NoiseModel(1e-4, 2e-5, 1e-6, 1e-8, 1e-6)
NOISE = np.random.default_rng(1).standard_normal(360_000)
PLAIN = ["adev", "oadev", "hdev", "ohdev"]


def curve_of(model, kind, taus="octave"):
    """Return the result of a record with the deviations of a model in place of its own."""
    r = zr.allan(NOISE, 100.0, kind, taus)
    made = model.allan_deviation if KINDS[kind].order == 2 else model.hadamard_deviation
    return replace(r, deviation=made(r.taus))


def values(model, terms=TERMS):
    return np.array([float(getattr(model, term)) for term in terms])


@pytest.mark.parametrize("kind", PLAIN)
def test_exact_curves_give_their_coefficients(kind):
    terms = TERMS if KINDS[kind].order == 2 else TERMS[:-1]
    fit = curve_of(MODEL, kind).fit()
    # Of the closed form, a walk as sampled differs by 1/(2 m^2) of a term that at one sample is
    # 3e-9 of the whole; the rest is rounding.
    np.testing.assert_allclose(values(fit, terms), values(MODEL, terms), rtol=1e-6)
    assert fit.misfit == 0.0
    assert fit.chi_squared < 1e-6


@pytest.mark.parametrize("term", TERMS[:-1])
def test_a_single_term_is_found_alone(term):
    taus = 2.0 ** np.arange(10, 17) / 100.0
    fit = curve_of(zr.NoiseModel(**{term: 3e-5}), "oadev", taus).fit(terms=[term])
    # A walk as sampled has a variance 1/(2 m^2) above the closed form, 5e-7 at 1024 samples; the
    # other terms are equal to rounding.
    assert getattr(fit, term) == pytest.approx(3e-5, rel=1e-6)
    assert all(getattr(fit, other) == 0.0 for other in set(TERMS) - {term})


def test_correlated_terms_are_found_where_they_are_told():
    markov, sine = zr.noise.Markov(1e-4, 2.0), zr.noise.Sinusoid(5e-5, 0.1)
    model = zr.NoiseModel(1e-4, 2e-5, markov=[markov], sinusoid=[sine])
    fit = curve_of(model, "oadev").fit(markov=[2.0], sinusoid=[0.1])
    found = [fit.markov[0].amplitude, fit.sinusoid[0].amplitude, *values(fit)[1:3]]
    # The closed form of a sine sampled at 0.1 of 100 Hz is off by (pi/1000)^2/6 = 2e-6.
    np.testing.assert_allclose(found, [1e-4, 5e-5, 1e-4, 2e-5], rtol=1e-5)
    assert (fit.markov[0].time, fit.sinusoid[0].frequency) == (2.0, 0.1)


@pytest.mark.parametrize("true_time", [0.3, 5.0, 40.0])
def test_correlation_times_are_looked_for(true_time):
    model = zr.NoiseModel(1e-4, markov=[zr.noise.Markov(3e-4 / true_time, true_time)])
    fit = curve_of(model, "oadev").fit(terms=["angle_random_walk"], markov=1)
    # Eight times to a decade are tried: the nearest is at most a sixteenth of one away.
    assert abs(np.log10(fit.markov[0].time / true_time)) < 1.0 / 16.0
    assert fit.markov[0].amplitude.identifiable


def test_intervals_of_all_terms_hold_the_truth():
    share, count = share_within(coefficients("curve"))
    assert count > 200
    # Required: 68 % give or take ten.
    assert 0.58 <= share <= 0.78


@pytest.mark.parametrize(
    ("term", "least"),
    [("angle_random_walk", 100), ("bias_instability", 60), ("rate_random_walk", 5)],
)
def test_intervals_of_each_term_hold_the_truth(term, least):
    share, count = share_within(coefficients("curve", [term]))
    assert count >= least
    # Three deviations of a binomial share, besides the ten per cent of all terms together.
    assert abs(share - 0.68) <= 0.10 + 3.0 * np.sqrt(0.68 * 0.32 / count)


def test_upper_bounds_hold():
    held = [found.upper_bound >= truth for truth, found in coefficients("curve") if truth > 0.0]
    # Of 95 % stated; required are 90.
    assert np.mean(held) >= 0.90


def test_absent_terms_are_not_identified():
    found = [found.identifiable for truth, found in coefficients("curve") if truth == 0.0]
    assert len(found) > 200
    # Two standard errors are exceeded in 2.3 % of runs by one term, more by several; required.
    assert np.mean(found) <= 0.10


def test_bounds_of_deviations_hold_the_true_curve():
    inside = [
        (r.lower <= curve) & (curve <= r.upper)
        for truth, r, *_ in simulated_fits()
        for curve in [truth.allan_deviation(r.taus)]
    ]
    # Required: 68 % give or take ten.
    assert 0.58 <= np.mean(inside) <= 0.78


def test_chi_squared_is_as_its_degrees_of_freedom():
    fits = [fits.curve for fits in simulated_fits()]
    ratio = np.mean([fit.chi_squared for fit in fits]) / np.mean(
        [fit.degrees_of_freedom for fit in fits]
    )
    # The mean of 120 with some ten degrees of freedom each: its deviation is sqrt(2/1200) = 4 %;
    # terms held at zero have not used up what the count takes off for others.
    assert 0.75 < ratio < 1.25
    # Misfit is allowed for where chance explains the data in one of a hundred runs.
    assert np.mean([fit.misfit > 0.0 for fit in fits]) <= 0.05


def test_a_short_record_does_not_tell_the_walk():
    for seed in range(5):
        z, _ = zr.simulate(zr.NoiseModel(1e-4, 1e-5, 2e-6), 100.0, 120.0, seed)
        walk = zr.allan(z, 100.0).fit().rate_random_walk
        assert not walk.identifiable
        assert walk.upper_bound > 2e-6


@pytest.fixture(scope="module")
def record():
    return zr.simulate(zr.NoiseModel(1e-4, 2e-5, 2e-6), 100.0, 600.0, 4)[0]


def parts(model, factor=1.0):
    """Return value, error and bound of every term, over a factor."""
    listed = [getattr(model, term) for term in TERMS]
    return np.array([[c.value, c.sigma, c.upper_bound] for c in listed]) / factor


@pytest.mark.parametrize("kind", ["oadev", "ohdev", "mdev", "totdev"])
def test_coefficients_go_with_the_scale(record, kind):
    plain = zr.allan(record, 100.0, kind).fit()
    for factor in [2.0**-950, 2.0**-40, 2.0**60, 2.0**950]:
        scaled = zr.allan(record * factor, 100.0, kind).fit()
        # Powers of two round nothing in the deviations; squares and roots in the fit neither.
        np.testing.assert_array_equal(parts(scaled, factor), parts(plain))
    # Roundings of the deviations, through the tolerance of the upper bound's iteration.
    np.testing.assert_allclose(
        parts(zr.allan(record * 0.3, 100.0, kind).fit(), 0.3), parts(plain), rtol=1e-9
    )


def test_units_are_converted(record):
    plain = zr.allan(record, 100.0).fit()
    degrees = zr.allan(np.degrees(record), 100.0, unit="deg/s").fit()
    # One more rounding of each sample.
    np.testing.assert_allclose(parts(degrees), parts(plain), rtol=1e-9)
    accelerations = zr.allan(record, 100.0, unit="m/s^2").fit()
    assert accelerations.quantity == "acceleration"
    np.testing.assert_array_equal(parts(accelerations), parts(plain))


def test_coefficients_go_with_the_rate(record):
    slow, fast = (values(zr.allan(record, rate).fit()) for rate in (100.0, 400.0))
    # With time four times as fast: Q/4, N/2, B, 2 K and 4 R; roundings of products.
    np.testing.assert_allclose(fast, slow * [0.25, 0.5, 1.0, 2.0, 4.0], rtol=1e-9)


KINDS_WITH_MODEL = [kind for kind in KINDS if kind not in ("theo1", "pdev")]


@pytest.fixture(scope="module")
def slow_record():
    """20 Hz, so that the kinds that take n tau operations are quick."""
    return zr.simulate(zr.NoiseModel(1e-4, 3e-5), 20.0, 1800.0, 7)[0]


@pytest.mark.every(2)
@pytest.mark.parametrize("kind", KINDS_WITH_MODEL)
def test_every_kind_with_a_model_recovers_it(slow_record, kind):
    fit = zr.allan(slow_record, 20.0, kind).fit()
    # 36 000 samples give N to 0.4 %; separate terms to 0.8 %.
    assert fit.angle_random_walk == pytest.approx(1e-4, rel=0.02)
    assert abs(fit.bias_instability - 3e-5) < 4.0 * fit.bias_instability.sigma
    assert fit.method == kind


@pytest.mark.parametrize("kind", ["theo1", "pdev"])
def test_kinds_without_a_model_refuse(slow_record, kind):
    r = zr.allan(slow_record[:2000], 20.0, kind)
    with pytest.raises(ValueError, match=f"{kind} has no model to fit; use oadev"):
        r.fit()


def hump(n, seed):
    """White noise through two poles at 20 of 100 Hz, scaled to a density of 1 at frequency 0."""
    radius, angle = 0.9, 2.0 * np.pi * 0.2
    a, b = 2.0 * radius * np.cos(angle), -(radius**2)
    from scipy.signal import lfilter

    white = np.random.default_rng(seed).standard_normal(n + 500)
    return lfilter([1.0 - a - b], [1.0, -a, -b], white)[500:]


def test_what_the_model_cannot_explain_widens_the_intervals():
    density = 1e-4
    coloured = density * np.sqrt(100.0) * hump(200_000, 8)
    white = density * np.sqrt(100.0) * np.random.default_rng(8).standard_normal(200_000)
    fits = [zr.allan(z, 100.0).fit() for z in (coloured, white)]
    assert fits[0].misfit > 0.0
    assert fits[1].misfit == 0.0
    errors = [fit.angle_random_walk.sigma for fit in fits]
    assert errors[0] > 3.0 * errors[1]
    # At low frequency the hump is white noise of this density; two standard errors.
    found = fits[0].angle_random_walk
    assert abs(found - density) < 2.0 * found.sigma


def test_the_polynomial_is_plain_least_squares(record):
    r = zr.allan(record, 100.0)
    fit = r.fit("polynomial")
    powers = r.taus[:, np.newaxis] ** np.arange(-2.0, 3.0)
    variance = r.deviation[:, np.newaxis] ** 2
    a = np.linalg.lstsq(powers / variance, np.ones(r.taus.size))[0]
    units = [3.0, 1.0, 2.0 * np.log(2.0) / np.pi, 1.0 / 3.0, 0.5]
    expected = np.sqrt(np.maximum(a, 0.0) / units)
    # The columns are equilibrated in one and not in the other: the condition number times 1e-16.
    np.testing.assert_allclose(values(fit), expected, rtol=1e-5)
    assert fit.method == "polynomial"
    assert [getattr(fit, term).identifiable for term in TERMS][1]


def test_the_polynomial_recovers_exact_curves():
    fit = curve_of(MODEL, "oadev").fit("polynomial")
    # Rounding times the condition number of five powers.
    np.testing.assert_allclose(values(fit), values(MODEL), rtol=1e-6)


def test_axes_are_fitted_each(record):
    both = np.column_stack((record, 2.0 * record))
    fits = zr.allan(both, 100.0, names=["x", "y"]).fit()
    assert isinstance(fits, tuple)
    np.testing.assert_array_equal(parts(fits[0]), parts(zr.allan(record, 100.0).fit()))
    np.testing.assert_array_equal(parts(fits[1]), parts(fits[0], 0.5))


def test_terms_left_out_are_zero(record):
    fit = zr.allan(record, 100.0).fit(terms=["angle_random_walk", "bias_instability"])
    assert values(fit)[[0, 3, 4]].tolist() == [0.0, 0.0, 0.0]
    assert fit.angle_random_walk == pytest.approx(1e-4, rel=0.01)  # 60 000 samples: 0.3 %


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"method": "wavelet"}, "unknown method 'wavelet'; known: curve, polynomial"),
        ({"terms": ["bias"]}, "unknown term 'bias'; known: quantization, "),
        ({"terms": []}, "terms is empty"),
        ({"terms": ["rate_ramp"]}, "a fit needs a noise: name a Markov term or one of quant"),
        ({"markov": [-1.0]}, "markov must be positive correlation times in s, got"),
        ({"markov": -1}, "markov must not be a negative number of terms, got -1"),
        ({"sinusoid": [0.0]}, "above 0 and below 50 Hz, got"),
        ({"sinusoid": [80.0]}, "above 0 and below 50 Hz, got"),
    ],
)
def test_wrong_arguments_are_named(record, change, message):
    with pytest.raises(ValueError, match=message):
        zr.allan(record, 100.0).fit(**change)


def test_without_a_unit_a_fit_is_in_that_of_the_samples(record):
    plain, radians = zr.allan(record, 100.0).fit(), zr.allan(record, 100.0, unit="rad/s").fit()
    np.testing.assert_array_equal(parts(plain), parts(radians))
    assert (plain.quantity, radians.quantity) == ("unknown", "angular rate")
    assert zr.noise.whittle(record, 100.0).quantity == "unknown"


def test_what_was_not_looked_for_is_unknown(record):
    assert not zr.allan(record, 100.0).fit(terms=["angle_random_walk"]).rate_ramp.known
    assert not zr.allan(record, 100.0, "ohdev").fit().rate_ramp.known


def test_what_cannot_be_fitted_is_refused(record):
    with pytest.raises(ValueError, match="record is constant: there is no noise to fit"):
        zr.allan(np.full(1000, 0.1), 100.0).fit()
    both = np.column_stack((record, np.ones_like(record)))
    with pytest.raises(ValueError, match="record of y is constant"):
        zr.allan(both, 100.0, names=["x", "y"]).fit()
    with pytest.raises(ValueError, match=r"needs 5 averaging times with a deviation, .* has 4"):
        zr.allan(record[:30], 100.0).fit()
    with pytest.raises(ValueError, match="polynomial fit needs 6 averaging times, has 5"):
        zr.allan(record[:40], 100.0).fit("polynomial")
