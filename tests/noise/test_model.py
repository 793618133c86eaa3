"""The noise model's Allan curve and the table of devices."""

import dataclasses
import math
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import quad

from zerorate.noise import (
    FLICKER_FLOOR,
    Coefficient,
    Markov,
    NoiseModel,
    Sinusoid,
    worst_axis,
)
from zerorate.simulation.devices import DEVICES, device
from zerorate.units import convert

FIELDS = (
    "angle_random_walk",
    "bias_instability",
    "rate_random_walk",
    "rate_ramp",
    "quantization",
)
COEFFICIENTS = st.floats(min_value=0.0, max_value=1e100)


@pytest.mark.parametrize(
    ("term", "tau", "expected"),
    [
        ("angle_random_walk", 1.0, 1.0),
        ("angle_random_walk", 100.0, 0.1),
        ("bias_instability", 50.0, 0.66428247),
        ("rate_random_walk", 3.0, 1.0),
        ("rate_random_walk", 300.0, 10.0),
        ("rate_ramp", math.sqrt(2.0), 1.0),
        ("quantization", math.sqrt(3.0), 1.0),
        ("quantization", 100.0 * math.sqrt(3.0), 0.01),
    ],
)
def test_each_term_is_read_where_ieee_952_reads_it(term, tau, expected):
    # The printed floor has eight digits.
    deviation = NoiseModel(**{term: 1.0}).allan_deviation(tau)
    assert float(deviation) == pytest.approx(expected, rel=1e-8)


def test_terms_add_as_variances():
    model = NoiseModel(3.0, 2.0, 1.0, -0.5)
    tau = np.array([0.1, 1.0, 10.0])
    variance = 9.0 / tau + 8.0 * math.log(2.0) / math.pi + tau / 3.0 + 0.125 * tau**2
    np.testing.assert_allclose(model.allan_deviation(tau), np.sqrt(variance), rtol=1e-14)


def line(tau, order):
    """Mean square of an order of differences of a sine's averages, over starts in one period."""
    edges = np.linspace(0.0, 1.0, 100, endpoint=False)[:, np.newaxis] + tau * np.arange(order + 1)
    averages = -np.diff(np.cos(2.0 * np.pi * edges)) / (2.0 * np.pi * tau)
    return np.mean(np.diff(averages, n=order - 1) ** 2)


@pytest.mark.parametrize("tau", [1e-3, 0.1, 0.371, 1.0, 2.3])
def test_a_sinusoid_is_the_mean_of_its_differences(tau):
    model = NoiseModel(sinusoid=[Sinusoid(2.0, 0.25)])
    expected = [4.0 * line(tau, 2) / 2.0, 4.0 * line(tau, 3) / 6.0]
    found = [model.allan_deviation(4.0 * tau) ** 2, model.hadamard_deviation(4.0 * tau) ** 2]
    # Differences of cosines cancel: rounding over (2 pi tau) at the least tau, 2 * 2e-16 / 6e-3 of
    # deviations; whole periods leave rounding, squared.
    np.testing.assert_allclose(found, expected, rtol=1e-7, atol=1e-24)


def test_a_sinusoid_peaks_where_ieee_952_says():
    model = NoiseModel(sinusoid=[Sinusoid(1.0, 2.0)])
    taus = np.linspace(0.01, 0.45, 4001)
    curve = model.allan_deviation(taus)
    # Printed to four digits; the grid is finer.
    assert curve.max() == pytest.approx(0.7246, abs=5e-5)
    assert taus[curve.argmax()] == pytest.approx(0.3710 / 2.0, abs=1.1e-4)
    np.testing.assert_allclose(model.allan_deviation([0.5, 1.0, 5.0]), 0.0, atol=1e-15)


def test_markov_noise_peaks_where_ieee_952_says():
    model = NoiseModel(markov=[Markov(3.0, 4.0)])
    taus = np.linspace(4.0, 12.0, 4001)
    curve = model.allan_deviation(taus)
    # Printed to four digits; a flat maximum is found to the root of that.
    assert curve.max() == pytest.approx(0.4365 * 3.0 * 2.0, rel=2e-4)
    assert taus[curve.argmax()] == pytest.approx(1.8926 * 4.0, rel=1e-3)


@pytest.mark.parametrize(("curve", "walk"), [("allan_deviation", 3.0), ("hadamard_deviation", 6.0)])
def test_markov_noise_is_a_walk_at_first_and_white_at_last(curve, walk):
    deviation = getattr(NoiseModel(markov=[Markov(2.0, 5.0)]), curve)
    # The next terms of both series are of relative order tau/T_c and T_c/tau.
    for tau in (1e-9, 1e-6):
        assert float(deviation(tau)) == pytest.approx(2.0 * math.sqrt(tau / walk), rel=tau)
    for tau in (1e7, 1e10):
        assert float(deviation(tau)) == pytest.approx(10.0 / math.sqrt(tau), rel=10.0 / tau)


@pytest.mark.parametrize("x", [1e-3, 0.1, 0.2499, 0.25, 1.0, 10.0, 1e3])
@pytest.mark.parametrize(("curve", "order"), [("allan_deviation", 2), ("hadamard_deviation", 3)])
def test_markov_noise_is_the_integral_of_its_density(curve, order, x):
    """Both variances by quadrature in u = pi f tau, T_c = 1 / x for tau = 1, q_c = x."""

    def density(u):
        return math.sin(u) ** (2 * order) / u**2 / (1.0 + (2.0 * u / x) ** 2)

    knots = np.concatenate(([0.0], np.geomspace(1e-4, 1.0, 60) * 100.0 * math.pi))
    parts = [quad(density, a, b, epsabs=0.0, epsrel=1e-12)[0] for a, b in pairwise(knots)]
    factor = {2: 4.0, 3: 16.0 / 3.0}[order] / math.pi
    found = float(getattr(NoiseModel(markov=[Markov(x, 1.0 / x)]), curve)(1.0)) ** 2
    # Cut at u = 100 pi: what is left is below the integral of 1/u^2 (1 + (2 u/x)^2)^-1.
    rest = factor / (100.0 * math.pi) / (1.0 + (200.0 * math.pi / x) ** 2)
    assert factor * sum(parts) <= found * (1.0 + 1e-10)
    assert found <= factor * sum(parts) + rest + 1e-10 * found


@pytest.mark.parametrize(
    ("term", "ratio"),
    [
        # Hadamard variance over Allan variance.
        ("quantization", 10.0 / 9.0),
        ("angle_random_walk", 1.0),
        ("bias_instability", 0.8112781),
        ("rate_random_walk", 0.5),
        ("rate_ramp", 0.0),
    ],
)
def test_hadamard_variance_over_allan_variance(term, ratio):
    model, tau = NoiseModel(**{term: 0.7}), np.array([0.1, 3.0, 50.0])
    found = (model.hadamard_deviation(tau) / model.allan_deviation(tau)) ** 2
    # The printed flicker ratio has seven digits.
    np.testing.assert_allclose(found, ratio, rtol=5e-8)


def test_all_terms_add_as_variances():
    markov, sinusoid = [Markov(1.0, 2.0), Markov(3.0, 0.4)], [Sinusoid(0.3, 0.05)]
    tau = np.array([0.1, 1.0, 10.0])
    alone = [
        *(NoiseModel(**{field: 0.3 + i}) for i, field in enumerate(FIELDS)),
        *(NoiseModel(markov=[term]) for term in markov),
        NoiseModel(sinusoid=sinusoid),
    ]
    together = NoiseModel(0.3, 1.3, 2.3, 3.3, 4.3, markov, sinusoid)
    for curve in (NoiseModel.allan_deviation, NoiseModel.hadamard_deviation):
        variance = sum(curve(model, tau) ** 2 for model in alone)
        np.testing.assert_allclose(curve(together, tau), np.sqrt(variance), rtol=1e-14)


@settings(derandomize=True)
@given(
    COEFFICIENTS,
    COEFFICIENTS,
    COEFFICIENTS,
    st.floats(-1e100, 1e100),
    COEFFICIENTS,
    COEFFICIENTS,
    st.floats(1e-50, 1e50),
)
def test_any_model_has_finite_curves_of_the_taus_shape(n, b, k, r, q, amplitude, time):
    terms = {"markov": [Markov(amplitude, time)], "sinusoid": [Sinusoid(amplitude, 1.0 / time)]}
    model = NoiseModel(n, b, k, r, q, **terms)
    for curve in (model.allan_deviation, model.hadamard_deviation):
        deviation = curve([[1e-3, 1.0], [1e3, 1e6]])
        assert deviation.shape == (2, 2)
        assert np.all(np.isfinite(deviation) & (deviation >= 0.0))


@pytest.mark.parametrize(
    "field", [f.name for f in dataclasses.fields(NoiseModel) if f.name != "doubt"]
)
@pytest.mark.parametrize("value", [math.nan, math.inf, "much"])
def test_coefficients_are_finite_numbers(field, value):
    with pytest.raises(ValueError, match=f"{field} must be"):
        NoiseModel(**{field: value})


def test_only_the_ramp_may_fall():
    assert NoiseModel(rate_ramp=-1.0).rate_ramp == -1.0
    for field in set(FIELDS) - {"rate_ramp"}:
        with pytest.raises(ValueError, match=f"{field} must not be negative"):
            NoiseModel(**{field: -1e-9})


def test_numbers_are_kept_as_coefficients():
    model = NoiseModel(np.float32(0.5), 1)
    kept = [getattr(model, name) for name in FIELDS]
    assert [type(value) for value in kept] == [Coefficient] * 5
    assert kept == [0.5, 1.0, 0.0, 0.0, 0.0]
    with pytest.raises(dataclasses.FrozenInstanceError):
        model.rate_ramp = 1.0


@pytest.mark.parametrize("tau", [0.0, -1.0, math.nan, math.inf])
def test_taus_are_positive(tau):
    for curve in (NoiseModel().allan_deviation, NoiseModel().hadamard_deviation):
        with pytest.raises(ValueError, match="positive and finite"):
            curve([1.0, tau])


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"markov": Markov(1.0, 1.0)}, "markov must be a sequence of Markov, got Markov"),
        ({"markov": [Sinusoid(1.0, 1.0)]}, "markov must be a sequence of Markov"),
        ({"sinusoid": "no"}, "sinusoid must be a sequence of Sinusoid, got 'no'"),
        ({"quantity": "mass"}, "must be one of 'angular rate', .*, got 'mass'"),
    ],
)
def test_other_fields_are_checked(change, message):
    with pytest.raises(ValueError, match=message):
        NoiseModel(**change)


@pytest.mark.parametrize(("kind", "second"), [(Markov, "time"), (Sinusoid, "frequency")])
def test_correlated_terms_are_checked(kind, second):
    for value in (0.0, -1.0, math.nan, None):
        with pytest.raises(ValueError, match=f"{second} must"):
            kind(1.0, value)
    with pytest.raises(ValueError, match="amplitude must not be negative"):
        kind(-1.0, 1.0)
    with pytest.raises(TypeError, match="missing 1 required positional argument"):
        kind(1.0)


@pytest.mark.parametrize(
    ("unit", "expected"),
    [
        ("deg/sqrt(h)", math.degrees(1.0) * 60.0),
        ("°/h", math.degrees(2.0) * 3600.0),
        ("deg/h/sqrt(h)", math.degrees(3.0) * 216000.0),
        ("deg/h^2", math.degrees(-4.0) * 3600.0**2),
        ("arcsec", math.degrees(5.0) * 3600.0),
    ],
)
def test_a_unit_says_which_coefficient_is_meant(unit, expected):
    # A few roundings of factors.
    assert NoiseModel(1.0, 2.0, 3.0, -4.0, 5.0).in_units(unit) == pytest.approx(expected, rel=1e-15)


def test_units_of_an_accelerometer():
    model = NoiseModel(1.0, 2.0, 3.0, 4.0, 5.0, quantity="acceleration")
    units = ("m/s/sqrt(h)", "mg", "ug/sqrt(h)", "ug/s", "m/s")
    g = 9.80665
    expected = [60.0, 2e3 / g, 180e6 / g, 4e6 / g, 5.0]
    # A few roundings of factors.
    assert [model.in_units(unit) for unit in units] == pytest.approx(expected, rel=1e-15)


def test_all_of_a_coefficient_is_converted():
    model = NoiseModel(bias_instability=Coefficient(1.0, 0.5, False, 4.0))
    found = model.in_units("mdeg/s")
    factor = convert(1.0, "rad/s", "mdeg/s")
    assert [found.value, found.sigma, found.upper_bound] == [factor, 0.5 * factor, 4.0 * factor]
    assert not found.identifiable


def test_units_of_another_quantity_are_refused():
    with pytest.raises(ValueError, match=r"angular rate has no coefficient in mg \(acceleration\)"):
        NoiseModel().in_units("mg")
    with pytest.raises(ValueError, match=r"acceleration has no coefficient in deg/h \(rate\): it"):
        NoiseModel(quantity="acceleration").in_units("°/h")
    with pytest.raises(ValueError, match="unknown unit 'furlong'"):
        NoiseModel().in_units("furlong")


def test_deviations_per_sample():
    bounded = Coefficient(0.0, identifiable=False, upper_bound=4e-6)
    sigmas = NoiseModel(1e-3, rate_random_walk=bounded).discrete_sigmas(400.0)
    # The root of 400 is exact; one product and one quotient.
    assert sigmas == pytest.approx((2e-2, 2e-7), rel=1e-15)
    assert NoiseModel(1e-3).discrete_sigmas(400.0).walk_step == math.inf
    with pytest.raises(ValueError, match=r"rate must be positive and finite, got -1\.0"):
        NoiseModel().discrete_sigmas(-1.0)


def test_the_table_is_aligned_and_says_what_is_unknown():
    model = NoiseModel(
        Coefficient(1e-4, 2e-6),
        Coefficient(0.0, identifiable=False, upper_bound=1e-5),
        0.0,
        markov=[Markov(1e-6, Coefficient(100.0, 20.0))],
        sinusoid=[Sinusoid(1e-4, 0.1)],
    )
    assert str(model).splitlines() == [
        "angle random walk   0.3438 ± 0.0069  deg/sqrt(h)",
        "bias instability    not identifiable (< 2.1 deg/h)",
        "Markov noise        12.38            deg/h/sqrt(h)",
        "  correlation time  100 ± 20         s",
        "sinusoid            20.63            deg/h",
        "  frequency         0.1              Hz",
        "unknown: quantization, rate ramp",
    ]
    assert str(NoiseModel(0, 0, 0, 0, 0)) == "no noise"
    bounded = Coefficient(0.0, identifiable=False, upper_bound=1.0)
    model = NoiseModel(bounded, 0, 0, 0, 0, quantity="acceleration")
    assert str(model) == "velocity random walk  not identifiable (< 60 m/s/sqrt(h))"


def test_a_model_in_the_unit_of_the_samples_says_so():
    model = NoiseModel(0.5, 0, 2, 0, 0, quantity="unknown")
    assert str(model).splitlines() == [
        "white noise  0.5  unit/sqrt(Hz)",
        "random walk  2    unit/s/sqrt(Hz)",
        '"unit" is the unknown unit of the samples',
    ]
    assert model.discrete_sigmas(4.0) == (1.0, 1.0)
    with pytest.raises(ValueError, match=r'in deg/h cannot be given because .* unit="deg/s"'):
        model.in_units("deg/h")


def test_the_worst_axis_is_the_worst_in_each_term():
    bounded = Coefficient(0.0, identifiable=False, upper_bound=4.0)
    x = NoiseModel(1.0, 3.0, bounded, -7.0, markov=[Markov(1.0, 8.0)])
    y = NoiseModel(Coefficient(2.0, 0.1), 2.0, 3.0, 5.0, 0.0, sinusoid=[Sinusoid(1.0, 1.0)])
    z = NoiseModel(0.0, 0.0, 1.0, 0.0, 0.0, markov=[Markov(2.0, 1.0), Markov(1.0, 1.0)])
    worst = worst_axis(iter([x, y, z]))
    assert worst == NoiseModel(2.0, 3.0, 3.0, -7.0, 0.0, x.markov, y.sinusoid)
    assert not worst_axis([x, x]).quantization.known
    assert worst.angle_random_walk.sigma == 0.1


def test_an_axis_that_determines_a_coefficient_goes_before_a_larger_bound():
    bounded = Coefficient(0.0, identifiable=False, upper_bound=4.0)
    larger = Coefficient(0.0, identifiable=False, upper_bound=9.0)
    x, y, z, unknown = (
        NoiseModel(1.0, rate_random_walk=walk) for walk in (bounded, Coefficient(1.0), larger, None)
    )
    assert worst_axis([x, y, z, unknown]).rate_random_walk == 1.0
    assert worst_axis([x, z, unknown]).rate_random_walk.upper_bound == 9.0


def test_axes_of_one_quantity_are_needed():
    with pytest.raises(ValueError, match="one quantity, got none"):
        worst_axis([])
    with pytest.raises(ValueError, match="one quantity, got acceleration, angular rate"):
        worst_axis([NoiseModel(), NoiseModel(quantity="acceleration")])


@pytest.mark.parametrize(
    ("name", "density", "instability", "turn_on", "resolution"),
    [
        ("MTi-100", 0.01, 10.0 / 3600.0, 0.2, 0.0),
        ("3DM-GX4-25", 0.005, 10.0 / 3600.0, 0.05, 0.0),
        ("ADIS16405", 2.0 / 60.0, 0.007, 3.0, 0.05),
        ("MPU-6050", 0.005, 0.002, 20.0 / 3.0, 1.0 / 131.0),
    ],
)
def test_devices_are_as_their_sheets_state(name, density, instability, turn_on, resolution):
    gyro = DEVICES[name]
    in_degrees = [
        convert(gyro.noise.angle_random_walk, "rad/s/sqrt(Hz)", "deg/s/sqrt(Hz)"),
        convert(gyro.noise.bias_instability, "rad/s", "deg/s"),
        convert(gyro.turn_on_bias, "rad/s", "deg/s"),
        convert(gyro.resolution, "rad/s", "deg/s"),
    ]
    assert in_degrees == pytest.approx([density, instability, turn_on, resolution], rel=1e-14)


@pytest.mark.parametrize("gyro", DEVICES.values(), ids=lambda gyro: gyro.name)
def test_chosen_walks_meet_the_floor_and_say_so(gyro):
    assert "chosen for simulation" in gyro.source
    walk = NoiseModel(rate_random_walk=gyro.noise.rate_random_walk)
    floor = FLICKER_FLOOR * gyro.noise.bias_instability
    assert float(walk.allan_deviation(1000.0)) == pytest.approx(floor, rel=1e-14)


@pytest.mark.parametrize("name", ["mpu-6050", "MPU6050", "mpu 6050", "Mpu_6050"])
def test_device_names_are_found_however_written(name):
    assert device(name) is DEVICES["MPU-6050"]


def test_unknown_device_lists_the_known():
    with pytest.raises(ValueError, match=r"unknown device 'HG1700': known are MTi-100, .*MPU-6050"):
        device("HG1700")
