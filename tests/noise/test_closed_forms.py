"""Deviations of records and models that are known in closed form (IEEE Std 952-1997, annex C)."""

import math
from itertools import pairwise

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.signal import welch

import zerorate as zr
from zerorate.noise.covariance import variances
from zerorate.noise.curve_fit import expected_deviation, expected_terms
from zerorate.noise.kinds import KINDS
from zerorate.noise.processes import (
    COLOURED,
    FLICKER,
    QUANTISATION,
    WALK,
    WHITE,
    markov,
    ramp_variance,
    sinusoid_variance,
    strength,
)
from zerorate.simulation import sequences

RATE = 100.0
FLICKER_MODIFIED = (27.0 * math.log(3.0) - 32.0 * math.log(2.0)) / (16.0 * math.log(2.0))
HADAMARD = ["hdev", "ohdev", "htotdev"]


def white(n, seed=1):
    return np.random.default_rng(seed).standard_normal(n)


@pytest.mark.parametrize("kind", ["adev", "oadev", "mdev"])
@pytest.mark.parametrize("slope", [1e-6, -3.0])
def test_a_ramp_has_slope_times_tau_over_root_two(kind, slope):
    r = zr.allan(5.0 + slope / RATE * np.arange(5000.0), RATE, kind)
    # Roundings of 5, 1e-16, over the difference of neighbours, 1e-8: they average out after.
    np.testing.assert_allclose(r.deviation, abs(slope) * r.taus / math.sqrt(2.0), rtol=1e-7)


@pytest.mark.parametrize("kind", HADAMARD)
def test_a_ramp_has_no_hadamard_deviation(kind):
    z = 0.25 * np.arange(5000.0)
    # Rounding of a phase of 3e6: 5e-10 a sample at one sample.
    assert zr.allan(z, RATE, kind).deviation.max() < 1e-8


def test_a_sine_has_its_line():
    amplitude, frequency = 2.0, 0.5
    z = amplitude * np.sin(2.0 * np.pi * frequency / RATE * np.arange(400_000) + 0.7)
    taus = np.array([0.02, 0.1, 0.3710 / frequency, 1.0, 3.3, 7.0])
    r = zr.allan(z, RATE, taus=taus)
    x = np.pi * frequency * r.taus
    # A sum of samples for an integral: (pi f / rate)^2 / 6 = 4e-5, and the ends of 2000 periods.
    np.testing.assert_allclose(r.deviation, amplitude * np.sin(x) ** 2 / x, rtol=2e-3, atol=1e-3)
    model = zr.NoiseModel(sinusoid=[zr.noise.Sinusoid(amplitude, frequency)])
    np.testing.assert_allclose(r.deviation, model.allan_deviation(r.taus), rtol=2e-3, atol=1e-3)


def test_a_sine_vanishes_over_whole_periods():
    z = np.sin(2.0 * np.pi * 0.5 / RATE * np.arange(100_000))
    r = zr.allan(z, RATE, taus=[2.0, 4.0, 10.0])
    # Sums of a thousand samples with a rounding of 1e-16 each.
    np.testing.assert_allclose(r.deviation, 0.0, atol=1e-13)


@pytest.mark.parametrize("kind", ["adev", "oadev", "hdev", "ohdev", "totdev", "htotdev"])
def test_white_samples_average_as_one_over_root_m(kind):
    r = zr.allan(white(20_000), RATE, kind, exponent=0)
    n = zr.NoiseModel(1.0 / math.sqrt(RATE))
    # The relative deviation of an estimate is 1/sqrt(2 edf); four of those.
    within = 4.0 / np.sqrt(2.0 * r.edf)
    told = r.edf > 30.0
    assert np.all(np.abs(r.deviation * np.sqrt(r.factors) - 1.0)[told] < within[told])
    np.testing.assert_allclose(n.allan_deviation(r.taus), 1.0 / np.sqrt(r.factors), rtol=1e-14)


@pytest.mark.parametrize("factor", [1, 10, 100])
def test_freedoms_are_those_of_the_percentage_error_of_ieee_952(factor):
    n = 100_000
    r = zr.allan(white(n), RATE, "adev", taus=[factor / RATE], exponent=0)
    error = 1.0 / math.sqrt(2.0 * r.edf[0])
    # The standard's 1/sqrt(2 (L/K - 1)) takes n/m - 1 differences for independent; neighbours of
    # white noise correlate by -1/2, so that the error is larger by sqrt(1.5).
    simple = 1.0 / math.sqrt(2.0 * (n / factor - 1.0))
    assert error / simple == pytest.approx(math.sqrt(1.5), rel=1e-2)


def of_term(kind, term, m):
    """Squared deviation of a coefficient of 1 at m samples, as the fit has it."""
    if term == "rate_ramp":
        return ramp_variance(KINDS[kind], m) * strength(term, RATE)
    return variances(KINDS[kind], m.astype(np.int64), COLOURED[term]) * strength(term, RATE)


@pytest.mark.parametrize("term", [*COLOURED, "rate_ramp"])
@pytest.mark.parametrize(("kind", "curve"), [("oadev", "allan"), ("ohdev", "hadamard")])
def test_the_fit_has_the_curves_of_the_model(kind, curve, term):
    m = np.array([10.0, 30.0, 1000.0, 1e5])
    model = zr.NoiseModel(**{term: 1.0})
    expected = getattr(model, f"{curve}_deviation")(m / RATE) ** 2
    # A sampled walk lies above the continuous one by 1/(2 m^2) or 1/m^2.
    tolerance = 2.0 / m**2 if term == "rate_random_walk" else 1e-9
    assert np.all(np.abs(of_term(kind, term, m) - expected) <= tolerance * expected)


@pytest.mark.parametrize(
    ("process", "allan", "hadamard", "modified"),
    [
        # At m samples, many: Allan variance, Hadamard over Allan, and modified over Allan.
        (QUANTISATION, lambda m: 3.0 / m**2, 10.0 / 9.0, 1.0 / 1000.0),
        (WHITE, lambda m: 1.0 / m, 1.0, 1.0 / 2.0),
        (FLICKER, lambda m: 2.0 * math.log(2.0) / math.pi, 0.8112781, FLICKER_MODIFIED),
        (WALK, lambda m: m / 3.0, 1.0 / 2.0, 33.0 / 40.0),
    ],
    ids=["quantisation", "white", "flicker", "walk"],
)
def test_ratios_of_the_kinds(process, allan, hadamard, modified):
    m = np.array([1000])
    found = [variances(KINDS[kind], m, process)[0] for kind in ("oadev", "ohdev", "mdev")]
    # The ratios hold to 1/m^2; that of flicker has seven digits.
    assert found[0] == pytest.approx(allan(1000.0), rel=1e-6)
    assert found[1] / found[0] == pytest.approx(hadamard, rel=1e-6)
    assert found[2] / found[0] == pytest.approx(modified, rel=1e-5)


@pytest.mark.parametrize("process", [QUANTISATION, WHITE, FLICKER, WALK, markov(5.0)])
def test_nothing_is_averaged_over_one_sample(process):
    one = np.array([1])
    plain, modified = (variances(KINDS[kind], one, process)[0] for kind in ("oadev", "mdev"))
    # What the sums of flicker and Markov noise are good to.
    assert modified == pytest.approx(plain, rel=2e-3)


@pytest.mark.parametrize(("kind", "walk"), [("oadev", 3.0), ("ohdev", 6.0)])
def test_markov_noise_in_the_fit_is_a_walk_and_then_white(kind, walk):
    time, m = 1e4, np.array([10, 30])
    early = variances(KINDS[kind], m, markov(time))
    # Variance 1 is a walk of steps 2/T: next terms are of order m/T.
    np.testing.assert_allclose(early, 2.0 / time * m / walk, rtol=2.0 * 30.0 / time)
    late = variances(KINDS[kind], np.array([10_000, 30_000]), markov(5.0))
    # And white of density 2 T: next terms of order T/m.
    np.testing.assert_allclose(late, 10.0 / np.array([1e4, 3e4]), rtol=2.0 * 5.0 / 1e4)


@pytest.mark.parametrize(("kind", "curve"), [("oadev", "allan"), ("ohdev", "hadamard")])
def test_correlated_terms_of_the_fit_are_those_of_the_model(kind, curve):
    m = np.array([1, 7, 100, 3000])
    model = zr.NoiseModel(markov=[zr.noise.Markov(math.sqrt(2.0 / 0.5), 0.5)])
    found = variances(KINDS[kind], m, markov(50.0))
    # Two forms of the same function.
    expected = getattr(model, f"{curve}_deviation")(m / RATE) ** 2
    np.testing.assert_allclose(found, expected, rtol=1e-9)
    sine = zr.NoiseModel(sinusoid=[zr.noise.Sinusoid(1.0, 0.01)])
    line = sinusoid_variance(KINDS[kind], m.astype(float), 0.01 / RATE)
    # A sum of samples for an integral: (pi f / rate)^2 / 3.
    expected = getattr(sine, f"{curve}_deviation")(m / RATE) ** 2
    np.testing.assert_allclose(line, expected, rtol=1e-6)


@pytest.mark.parametrize("kind", ["oadev", "ohdev", "mdev"])
def test_a_sine_in_the_fit_is_that_of_a_record(kind):
    frequency = 0.013
    z = np.sin(2.0 * np.pi * frequency * np.arange(200_000) + 0.3)
    r = zr.allan(z, 1.0, kind, taus=[1, 5, 28, 60, 500])
    expected = sinusoid_variance(KINDS[kind], r.factors.astype(float), frequency)
    # The ends of 2600 periods.
    np.testing.assert_allclose(r.deviation**2, expected, rtol=2e-3, atol=1e-6)


DENSITIES = {
    "angle_random_walk": lambda f: 1.0,
    "bias_instability": lambda f: 1.0 / (2.0 * math.pi * f),
    "rate_random_walk": lambda f: 1.0 / (2.0 * math.pi * f) ** 2,
}


@pytest.mark.parametrize("term", DENSITIES)
@pytest.mark.parametrize(("curve", "order"), [("allan", 2), ("hadamard", 3)])
def test_deviations_are_integrals_of_the_density(term, curve, order):
    """sigma^2 = 4 int S sin^4(pi f tau) / (pi f tau)^2 df, or 16/3 and sin^6."""
    tau, last = 1.0, 100.0

    def integrand(f):
        return DENSITIES[term](f) * math.sin(math.pi * f) ** (2 * order) / (math.pi * f) ** 2

    knots = [1e-9, *np.arange(0.5, last + 0.1, 0.5)]
    whole = sum(quad(integrand, a, b, epsrel=1e-12)[0] for a, b in pairwise(knots))
    # Beyond `last`, S times the mean of the power of the sine over (pi f)^2, S falling as f^-s.
    fall = {"angle_random_walk": 1.0, "bias_instability": 2.0, "rate_random_walk": 3.0}[term]
    mean = math.comb(2 * order, order) / 4.0**order
    whole += DENSITIES[term](last) * mean / math.pi**2 / last / fall
    factor = {2: 4.0, 3: 16.0 / 3.0}[order]
    found = float(getattr(zr.NoiseModel(**{term: 1.0}), f"{curve}_deviation")(tau)) ** 2
    # What is beyond is known to 1/last^2 of itself, which is 1/last of the whole.
    assert found == pytest.approx(factor * whole, rel=1e-5)


def test_quantisation_is_the_integral_of_its_density():
    """S = (4 Q^2/tau0) sin^2(pi f tau0) up to half the rate, and what is folded back there."""
    m = 8

    def integrand(f):
        ratio = math.sin(math.pi * f * m) ** 4 / (m * math.sin(math.pi * f)) ** 2
        return 4.0 * math.sin(math.pi * f) ** 2 * ratio

    knots = np.linspace(1e-9, 0.5, 2 * m + 1)
    whole = 4.0 * sum(quad(integrand, a, b)[0] for a, b in pairwise(knots))
    found = float(zr.NoiseModel(quantization=1.0).allan_deviation(8.0)) ** 2
    # Accuracy asked of the quadrature.
    assert found == pytest.approx(whole, rel=1e-7)


def test_one_sided_densities_are_twice_the_square():
    """Both directions: a record of known N read by `welch`, and a density turned into a record."""
    n = 2e-4
    z, _ = zr.simulate(zr.NoiseModel(n), RATE, 2000.0, 3)
    _, density = welch(z, RATE, nperseg=1000)
    # 200 000 samples give a variance to sqrt(2/n) = 0.3 %; four of those, halved by the root.
    one_sided = np.sqrt(np.mean(density[5:-5]))
    assert one_sided == pytest.approx(math.sqrt(2.0) * n, rel=0.007)
    samples = one_sided * math.sqrt(RATE / 2.0) * white(200_000)
    deviation = zr.allan(samples, RATE, taus=[1.0]).deviation[0]
    # 2000 averages, of which overlapping ones give 3000 degrees of freedom: 1.3 %; four of those.
    assert deviation == pytest.approx(n, rel=0.052)
    fit = zr.allan(samples, RATE).fit()
    assert math.sqrt(2.0) * fit.angle_random_walk == pytest.approx(one_sided, rel=0.01)


@pytest.mark.parametrize(
    ("make", "term", "tau"),
    [
        (lambda n: np.diff(white(n + 1)), "quantization", 100.0 * math.sqrt(3.0)),
        (white, "angle_random_walk", 100.0),
        (lambda n: sequences.walk(white(n)), "rate_random_walk", 300.0),
    ],
    ids=["quantisation", "white", "walk"],
)
def test_records_are_read_where_ieee_952_reads_them(make, term, tau):
    """At 1 Hz: the coefficient's place, moved along its slope to where samples average."""
    r = zr.allan(make(100_000), 1.0, taus=[round(tau)])
    expected = float(zr.NoiseModel(**{term: 1.0}).allan_deviation(r.taus[0]))
    # The interval of the estimate: four of 1/sqrt(2 edf).
    assert r.deviation[0] == pytest.approx(expected, rel=4.0 / math.sqrt(2.0 * r.edf[0]))


def test_flicker_is_flat_at_its_floor():
    z = sequences.flicker(white(2**18))
    r = zr.allan(z, 1.0, taus=[64, 256, 1024], exponent=-1)
    # Four intervals of each estimate.
    within = 4.0 * zr.noise.FLICKER_FLOOR / np.sqrt(2.0 * r.edf)
    assert np.all(np.abs(r.deviation - zr.noise.FLICKER_FLOOR) < within)


@pytest.mark.parametrize("kind", ["oadev", "ohdev", "mdev", "tdev", "totdev"])
def test_the_drawn_model_is_what_a_long_record_shows(kind):
    model = zr.NoiseModel(angle_random_walk=1e-4, rate_random_walk=1e-4)
    z = zr.simulate(model, RATE, 20_000.0, seed=3)[0]
    result = zr.allan(z, RATE, kind=kind, taus=[0.1, 0.5, 1.0, 5.0, 20.0])
    # 1000 stretches of 20 s give the last to 3 %; three times that.
    np.testing.assert_allclose(expected_deviation(model, result), result.rate_deviation, rtol=0.1)


def test_expected_terms_add_up_and_leave_out_what_is_zero():
    result = zr.allan(white(50_000), RATE)
    model = zr.NoiseModel(
        angle_random_walk=1e-4,
        markov=[zr.noise.Markov(1e-5, 3.0)],
        sinusoid=[zr.noise.Sinusoid(1e-5, 0.5)],
    )
    terms = expected_terms(model, result)
    assert [term.field for term in terms] == ["angle_random_walk", "markov", "sinusoid"]
    total = np.sqrt(sum(term.deviation**2 for term in terms))
    np.testing.assert_allclose(expected_deviation(model, result), total)
    # The formulas of the continuous curve, which a sampled one nears well above one sample.
    long = result.taus > 0.3
    continuous = model.allan_deviation(result.taus[long])
    np.testing.assert_allclose(total[long], continuous, rtol=1e-3)
