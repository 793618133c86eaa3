"""Temperature models: what is found, what is said not to be, and what is predicted."""

from functools import cache

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import zerorate as zr
from support.figures import check_contrast, check_layout
from zerorate.noise.coefficient import Coefficient

RATE = 4.0
WHITE, WALK = 0.005, 2.5e-4


def warm_up(n=3600, span=20.0):
    """Return a temperature from 20 degC up."""
    return 20.0 + span * (1.0 - np.exp(-np.arange(n) / RATE / 400.0))


def bias_at(temperature, slope=0.03, curvature=3e-4):
    d = temperature - 25.0
    return 0.5 + slope * d + curvature * d**2


def noise(seed, n=3600):
    rng = np.random.default_rng(seed)
    walk = np.cumsum(rng.standard_normal(n)) * WALK / np.sqrt(RATE)
    return walk, walk + rng.standard_normal(n) * WHITE * np.sqrt(RATE)


def fit(z, temperature, **arguments):
    return zr.TemperatureModel.fit(z, temperature, RATE, **arguments)


@cache
def usual(seed=0):
    temperature = warm_up()
    return fit(bias_at(temperature) + noise(seed)[1], temperature)


def assert_finite(model):
    for numbers in (model.coefficients, model.covariance, model.range, model.time_correlation):
        assert np.isfinite(numbers).all()
    predicted = model.predict([-40.0, 25.0, 31.0, 85.0, np.nan, np.inf, 1e300])
    assert np.isfinite(predicted.value).all()
    assert (predicted.sigma >= 0.0).all()


def test_without_noise_the_curve_is_found():
    temperature = warm_up()
    # All of it is at rest: without noise nothing is quiet but the straightest part.
    model = fit(bias_at(temperature), temperature, rests=np.ones(temperature.size, bool))
    assert model.degree == 2
    predicted = model.predict(temperature).value
    # The walk may be as weak as 1e-3 of the noise, of which there is none.
    np.testing.assert_allclose(predicted, bias_at(temperature), atol=1e-5)


def test_what_rounding_leaves_of_an_exact_curve_asks_for_no_higher_degree():
    """Of these one in thirty was once taken for a cubic, another one on each machine."""
    rng = np.random.default_rng(3)
    rests = np.ones(3600, bool)
    for _ in range(60):
        temperature = warm_up(span=rng.uniform(16.0, 30.0))
        bias = rng.uniform(-5.0, 5.0) + bias_at(temperature, *rng.normal(0.0, [0.05, 1e-3]))
        assert fit(bias, temperature, rests=rests).degree == 2


def test_a_cubic_is_found_where_the_range_is_wide():
    temperature = 20.0 + 40.0 * np.arange(3600) / 3600.0
    curve = bias_at(temperature) + 1e-5 * (temperature - 40.0) ** 3
    model = fit(curve + noise(0)[1], temperature)
    assert model.degree == 3
    assert fit(curve + noise(0)[1], temperature, max_degree=1).degree == 1


@pytest.mark.parametrize(("span", "most"), [(0.8, 0), (5.0, 1), (10.0, 2)])
def test_the_span_bounds_the_degree(span, most):
    temperature = 20.0 + span * np.arange(3600) / 3600.0
    # A strong cubic, of which the record may not show so much.
    curve = (temperature - 20.0) + (temperature - 20.0) ** 3
    assert fit(curve + noise(0)[1], temperature).degree == most


def test_the_truth_is_within_the_errors():
    """Slope and prediction over 40 records: the root mean square of z is about 1."""
    temperature = warm_up(3600)
    first = slice(0, 1440)
    slopes, ends = [], []
    for seed in range(40):
        walk, disturbance = noise(seed)
        bias = bias_at(temperature, curvature=0.0)
        model = fit((bias + disturbance)[first], temperature[first])
        slopes.append((model.slope - 0.03) / model.slope.sigma)
        at_end = bias[1439] + walk[1439]
        predicted = model.predict(temperature[1439])
        ends.append((predicted.value - at_end) / predicted.sigma)
    # Of 40 squares: 0.75 and 1.3 are two and a half deviations off.
    assert 0.6 < np.sqrt(np.mean(np.square(slopes))) < 1.3
    assert 0.6 < np.sqrt(np.mean(np.square(ends))) < 1.3


def test_no_effect_has_degree_zero_and_a_bound():
    models = [fit(0.5 + noise(seed)[1], warm_up()) for seed in range(6)]
    assert sum(model.degree == 0 for model in models) >= 5
    flat = next(model for model in models if model.degree == 0)
    assert not flat.slope.identifiable
    assert 0.0 < flat.slope.upper_bound < 0.01
    assert flat.predict(30.0).value == flat.predict(80.0).value


def test_whole_degrees_are_predicted_as_fine_ones():
    temperature, errors = warm_up(7200), []
    for seed in range(6):
        walk, disturbance = noise(seed, 7200)
        bias = bias_at(temperature)
        model = fit((bias + disturbance)[:3600], np.round(temperature[:3600]))
        assert model.step == 1.0
        later = model.predict(np.round(temperature[3600:])).value - (bias + walk)[3600:]
        errors.append(np.mean(later**2))
    # The slope there is 0.038 a kelvin: rounding alone makes 0.011 of it.
    assert np.sqrt(np.mean(errors)) < 0.020


def test_beyond_the_range_the_tangent_goes_on_for_one_span():
    model = usual()
    low, high = model.range
    h = 1e-4
    for end, outwards in ((low, -1.0), (high, 1.0)):
        at_end = model.predict(end).value
        slope = (at_end - model.predict(end - outwards * h).value) / h
        out = model.predict(end + outwards * np.array([1.0, 5.0, model.span])).value
        # The derivative by a difference is off by half its step times the curvature.
        np.testing.assert_allclose(
            out - at_end, slope * np.array([1.0, 5.0, model.span]), atol=2e-5
        )
        held = model.predict(end + outwards * np.array([model.span, 2.0 * model.span, 1e5]))
        np.testing.assert_allclose(held.value, held.value[0], rtol=1e-12)


def test_extrapolation_is_said_and_has_a_larger_error():
    model = usual()
    low, high = model.range
    predicted = model.predict([low - 0.1, low, high, high + 0.1, high + 10.0])
    np.testing.assert_array_equal(predicted.extrapolated, [True, False, False, True, True])
    assert predicted.sigma[-1] > 3.0 * predicted.sigma[2]
    # The curve goes on as it did: the tangent's error is within two of what is said.
    truth = model.predict(high).value + bias_at(high + 10.0) - bias_at(high)
    assert abs(predicted.value[-1] - truth) < 2.0 * predicted.sigma[-1]


@settings(max_examples=10)
@given(st.floats(-140, 140), st.booleans())
def test_units_do_not_matter(power, negative):
    alpha = 10.0**power * (-1.0 if negative else 1.0)
    temperature = warm_up(1200)
    z = bias_at(temperature) + noise(1, 1200)[1]
    model, scaled = fit(z, temperature), fit(alpha * z, temperature)
    assert scaled.degree == model.degree
    np.testing.assert_allclose(scaled.coefficients, alpha * model.coefficients, rtol=1e-6)
    sigma = abs(alpha) * model.predict(30.0).sigma
    np.testing.assert_allclose(scaled.predict(30.0).sigma, sigma, rtol=1e-6)


def test_axes_do_not_mix():
    temperature = warm_up()
    z = np.column_stack(
        [bias_at(temperature, s, 0.0) + noise(i)[1] for i, s in enumerate((0.03, -0.01))]
    )
    both = fit(z, temperature)
    for i in range(2):
        alone = fit(z[:, i], temperature)
        np.testing.assert_allclose(both.coefficients[i], alone.coefficients[0], rtol=1e-9)
        assert both.slope[i] == pytest.approx(alone.slope)
    predicted = both.predict([25.0, 30.0, 35.0])
    assert predicted.value.shape == predicted.sigma.shape == (3, 2)
    assert predicted.extrapolated.shape == (3,)


def no_temperature(n):
    return [
        None,
        25.0,
        np.full(n, 25.0),
        np.full(n, np.nan),
        np.full(n, 1e200),
        25.0 + 0.5 * np.arange(n) / n,
    ]


@pytest.mark.parametrize("which", range(6))
def test_without_temperature_the_bias_alone_is_found(which):
    z = 0.5 + noise(0)[1]
    model = fit(z, no_temperature(z.size)[which])
    assert model.degree == 0
    assert not model.slope.identifiable
    assert_finite(model)
    # The level is that of the end, to which the walk has led.
    assert model.predict(25.0).value == pytest.approx(0.5 + noise(0)[0][-1], abs=0.01)
    assert "no temperature" in model.notes[0] or "not identifiable" in model.notes[0]


def test_a_warm_up_cannot_be_told_from_a_drift_in_time():
    temperature = 20.0 + 10.0 * np.arange(3600) / 3600.0
    model = fit(0.5 + noise(0)[1], temperature)
    assert not model.time_separable
    assert any("cannot be distinguished" in note for note in model.notes)
    up_and_down = np.concatenate([warm_up(1800), warm_up(1800)[::-1]])
    assert fit(bias_at(up_and_down) + noise(0)[1], up_and_down).time_separable


def test_hysteresis_is_found_and_said():
    temperature = np.concatenate([warm_up(1800), warm_up(1800)[::-1]])
    warming = np.arange(3600) < 1800
    z = bias_at(temperature) + 0.04 * warming + noise(0)[1]
    model = fit(z, temperature)
    assert model.hysteresis == pytest.approx(0.04, abs=4.0 * model.hysteresis.sigma)
    assert any("warming and cooling" in note for note in model.notes)
    without = fit(z - 0.04 * warming, temperature)
    assert abs(without.hysteresis) < 3.0 * without.hysteresis.sigma
    assert not any("warming and cooling" in note for note in without.notes)
    assert not usual().hysteresis.known


def test_motion_is_left_out():
    temperature = warm_up()
    z = bias_at(temperature) + noise(3)[1]
    moving = np.arange(z.size) % 120 < 40
    turned = z + 50.0 * moving * np.sin(np.arange(z.size))
    found = fit(turned, temperature)
    np.testing.assert_allclose(
        found.coefficients[0, :2], fit(z, temperature).coefficients[0, :2], rtol=0.05
    )
    given_rests = fit(turned, temperature, rests=~moving)
    np.testing.assert_allclose(
        given_rests.coefficients[0, :2], found.coefficients[0, :2], rtol=0.05
    )


def test_missing_samples_are_left_out():
    temperature = warm_up()
    z = bias_at(temperature) + noise(4)[1]
    holes = z.copy()
    holes[::3] = np.nan
    holes[500:900] = np.inf
    model = fit(holes, temperature)
    assert abs(model.slope - fit(z, temperature).slope) < 2.0 * model.slope.sigma


HOSTILE = {
    "constant": np.full(400, 0.1),
    "zero": np.zeros(400),
    "huge": 1e149 * np.sin(np.arange(400.0)),
    "tiny": 1e-200 * np.sin(np.arange(400.0)),
    "denormal": 5e-324 * (np.arange(400) % 3),
    "alternating": (-1.0) ** np.arange(400),
    "steps": np.repeat([0.0, 1e100, -1e100, 1.0], 100),
    "offset": 1e9 + np.sin(np.arange(400.0)),
    "wide": 10.0 ** (np.arange(400) % 280 - 140.0),
}


@pytest.mark.parametrize("temperature", [0.0, 0.01, 1.0, 1e3], ids="{:g} K a second".format)
@pytest.mark.parametrize("name", HOSTILE)
def test_no_finite_record_makes_it_nan(name, temperature):
    for shown in (
        temperature * np.arange(400) / RATE,
        np.round(temperature * np.arange(400) / RATE),
    ):
        assert_finite(fit(HOSTILE[name], shown))


@pytest.mark.parametrize("places", [slice(8), slice(2000, 2004), slice(-4, None), [1, 900, 3000]])
def test_a_few_wild_temperatures_do_not_move_the_curve(places):
    """A thermometer that says 85 degC until it has measured, or where a line was disturbed."""
    temperature = warm_up()
    z = bias_at(temperature) + noise(0)[1]
    clean, temperature[places] = usual(), 85.0
    model = fit(z, temperature)
    np.testing.assert_allclose(model.range, clean.range, atol=0.2)
    moved = model.predict([21.0, 30.0, 38.0]).value - clean.predict([21.0, 30.0, 38.0]).value
    # A few samples of 3600 have a temperature that is held, some hundredths of a kelvin off.
    assert np.abs(moved).max() < 0.2 * clean.predict(38.0).sigma.max()
    count = temperature[places].size
    assert f"{count} temperatures leap by 10 K and more" in model.notes[-1] + model.notes[0]


def test_removal_takes_off_what_is_predicted():
    temperature = warm_up()
    z = bias_at(temperature) + noise(0)[1]
    model = usual()
    np.testing.assert_allclose(model.remove(z, temperature), z - model.predict(temperature).value)
    holes = temperature.copy()
    holes[1000:1010] = np.nan
    left = model.remove(z, holes)
    np.testing.assert_allclose(left[1005], z[1005] - model.predict(temperature[999]).value)
    assert np.isnan(model.remove(np.full(3600, np.nan), temperature)).all()


def logs():
    """Return a gyro of three axes and its thermometer on a clock of its own."""
    temperature = warm_up()
    z = np.column_stack([bias_at(temperature) + noise(i)[1] for i in range(3)])
    gyro = zr.Log(np.arange(3600) / RATE, RATE, z, ["gyro_x", "gyro_y", "gyro_z"], "deg/s")
    time = np.arange(-2, 902) / 1.0
    shown = np.interp(time, np.arange(3600) / RATE, temperature)
    return gyro, zr.Log(time, 1.0, shown, ["temp_degc"], "degC"), temperature


def test_logs_on_two_clocks():
    gyro, thermometer, temperature = logs()
    model = zr.TemperatureModel.fit(gyro, thermometer)
    same = zr.TemperatureModel.fit(gyro.data, temperature, RATE)
    np.testing.assert_allclose(model.coefficients, same.coefficients, rtol=1e-3, atol=1e-4)
    assert (model.unit, model.names, model.axes) == ("deg/s", gyro.names, 3)
    left = model.remove(gyro, thermometer)
    assert isinstance(left, zr.Log)
    assert np.abs(left.data[2800:].mean(axis=0)).max() < 0.02


def test_a_thermometer_of_another_time_is_refused():
    gyro, thermometer, _ = logs()
    other = zr.Log(thermometer.time + 1e4, 1.0, thermometer.data, thermometer.names, "degC")
    with pytest.raises(zr.LogError, match="no time in common"):
        zr.TemperatureModel.fit(gyro, other)


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        ({"rate": None}, "rate must be given in Hz"),
        ({"rate": -1.0}, "rate must be a positive"),
        ({"max_degree": 4}, "max_degree must be"),
        ({"temperature": np.zeros(7)}, r"temperature must have shape \(3600,\)"),
        ({"rests": np.zeros(3600)}, "rests must be 3600 values"),
        ({"rests": np.zeros(3600, bool)}, "needs 4 means of samples at rest, and 900 s have 0"),
        ({"z": np.zeros((3, 3, 3))}, "z must have shape"),
        ({"z": np.full(3600, 1e200)}, "z must be within 1e"),
        ({"z": np.full(3600, np.nan)}, "needs 4 means"),
        ({"z": np.zeros(3), "temperature": np.zeros(3)}, "needs 4 means"),
    ],
)
def test_refusals(arguments, said):
    usual_ones = {"z": noise(0)[1], "temperature": warm_up(), "rate": RATE}
    with pytest.raises(ValueError, match=said):
        zr.TemperatureModel.fit(**{**usual_ones, **arguments})


def test_removal_refuses_other_axes():
    with pytest.raises(ValueError, match="1 axes as the model has"):
        usual().remove(np.zeros((5, 2)), np.zeros(5))


def test_the_text_has_the_numbers():
    model = fit(np.column_stack([bias_at(warm_up()) + noise(0)[1]] * 2), warm_up(), unit="deg/s")
    text = str(model)
    assert "bias [deg/s]" in text
    assert text.count("0.03") >= 2
    assert max(map(len, text.splitlines())) <= 100
    assert "< " in str(fit(0.5 + noise(0)[1], warm_up()))
    assert repr(model).startswith("TemperatureModel(degree 2, 2; 20.")


def test_the_figure_shows_every_axis():
    gyro, thermometer, _ = logs()
    model = zr.TemperatureModel.fit(gyro, thermometer)
    figure = model.plot()
    titles = [axes.get_title() for axes in figure.axes]
    assert titles[:3] == list(gyro.names)
    low, high = figure.axes[0].get_xlim()
    assert low < model.range[0] < model.range[1] < high
    points = figure.axes[0].collections[-1]
    assert len(points.get_offsets()) == model.blocks.count.size
    loaded = zr.TemperatureModel.from_json(model.to_json()).plot()
    assert len(loaded.axes) == 3
    for drawn in (figure, loaded, usual().plot()):
        check_layout(drawn)
        check_contrast(drawn)


def test_the_curve_is_what_the_corrector_takes():
    model = usual()
    assert model.curve["reference"] == model.reference
    x = (30.0 - model.reference) / 10.0
    bias = sum(c * x**k for k, c in enumerate(model.curve["coefficients"][0]))
    assert bias == pytest.approx(float(model.predict(30.0).value))
    assert isinstance(model.slope, Coefficient)
