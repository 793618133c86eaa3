"""TemperatureFilter: against its twin, what it learns in a warm-up, and what is refused."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import zerorate as zr
from oracle.temperature_filter import TemperatureFilter as Twin
from support.classes import STREAMS
from support.records import warm_records
from support.rounding import but_for_roundings_of
from support.settings import temperature_settings

# As of the other filters that weigh models by likelihoods.
TOLERANCE = 1e-10
NAMES = ["bias", "bias_sigma", "slope", "slope_sigma", "at_rest"]


def warm_up(seed, n=24_000, rate=20.0, slope=0.03):
    """Twenty minutes of a gyro at rest while it warms up by ten kelvins, with a turn in between."""
    rng = np.random.default_rng(seed)
    t = np.arange(n) / rate
    temperature = 20.0 + 10.0 * (1.0 - np.exp(-t / 300.0))
    z = 0.5 + slope * (temperature - 25.0) + 0.05 * rng.standard_normal(n)
    turn = slice(n // 2, n // 2 + 300)
    z[turn] += 20.0 * np.sin(np.arange(300) / 20.0)
    return z, temperature


def compared(arguments, z, temperature):
    """Of the twin and the filter, each answer, and all that is known at a few places."""
    f, twin = zr.TemperatureFilter(**arguments), Twin(**arguments)
    got, expected = [[0.0]], [[0.0]]
    for k, sample in enumerate(zip(z.tolist(), temperature.tolist(), strict=True)):
        got.append([f.update(*sample)])
        expected.append([twin.update(*sample)])
        if k % 499 == 0 or k == len(z) - 1:
            got[-1] += [getattr(f, name) for name in NAMES]
            expected[-1] += [getattr(twin, name) for name in NAMES]
    return np.concatenate(got), np.concatenate(expected)


@settings(max_examples=8)
@given(st.data())
def test_it_is_its_twin(data):
    arguments = data.draw(temperature_settings())
    del arguments["channels"]
    z, temperature = data.draw(warm_records()).T
    got, expected = compared(arguments, z, temperature)
    scale = np.abs(expected).max(initial=1.0)

    def in_unit(unit):
        twin = Twin(**STREAMS["temperature"].in_unit(arguments, unit))
        samples = zip((unit * z).tolist(), temperature.tolist(), strict=True)
        return np.array([twin.update(*sample) for sample in samples])

    with but_for_roundings_of(in_unit, TOLERANCE):
        np.testing.assert_allclose(got, expected, rtol=TOLERANCE, atol=TOLERANCE * scale)


@pytest.mark.every(2)
@pytest.mark.parametrize("step", [0.0, 1.0])
def test_it_is_its_twin_in_a_warm_up(step):
    z, temperature = warm_up(1)
    temperature = np.round(temperature / step) * step if step else temperature
    got, expected = compared({"rate": 20.0}, z, temperature)
    np.testing.assert_allclose(got, expected, rtol=TOLERANCE, atol=TOLERANCE)


def test_a_warm_up_shows_the_slope():
    for seed in range(4):
        z, temperature = warm_up(seed)
        f = zr.TemperatureFilter(20.0)
        f.process(z, temperature)
        true = 0.5 + 0.03 * (temperature[-1] - 25.0)
        # Four deviations by the filter's own account, which is a small one.
        assert abs(f.slope - 0.03) < 4.0 * f.slope_sigma < 0.02
        assert abs(f.bias - true) < 4.0 * f.bias_sigma < 0.03


def test_in_motion_the_bias_goes_on_with_the_temperature():
    z, temperature = warm_up(2)
    f = zr.TemperatureFilter(20.0)
    f.process(z, temperature)
    slope, bias = f.slope, f.bias
    turning = 20.0 * np.sin(np.arange(2000) / 20.0)
    f.process(turning, np.linspace(temperature[-1], temperature[-1] + 5.0, 2000))
    assert not f.at_rest
    # A thermometer of fine steps is as good as its last tick, which the rise has passed a little.
    assert f.bias - bias == pytest.approx(5.0 * slope, rel=0.01)
    assert f.slope == slope


def test_without_a_temperature_it_learns_the_bias():
    z, _ = warm_up(3, slope=0.0)
    f = zr.TemperatureFilter(20.0)
    for sample in z.tolist():
        f.update(sample)
    assert f.bias == pytest.approx(0.5, abs=4.0 * f.bias_sigma)
    assert f.slope == 0.0


def test_one_thermometer_serves_all_channels():
    z, temperature = warm_up(4, n=2000)
    rows = np.stack([z, -z, z[::-1]], axis=1)
    alone = zr.TemperatureFilter(20.0, channels=3)
    each = alone.process(rows, np.stack([temperature] * 3, axis=1))
    shared = zr.TemperatureFilter(20.0, channels=3)
    np.testing.assert_array_equal(shared.process(rows, temperature), each)
    by_row = zr.TemperatureFilter(20.0, channels=3)
    pairs = zip(rows, temperature.tolist(), strict=True)
    np.testing.assert_array_equal([by_row.update(row, one) for row, one in pairs], each)
    assert by_row.to_bytes() == shared.to_bytes() == alone.to_bytes()
    assert shared.update([0.1, 0.2, 0.3]).shape == (3,)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"rate": 0.0}, "rate must be a positive number of samples a second"),
        ({"reference": np.inf}, "reference must be a finite number, got inf"),
        ({"slope": np.nan}, "slope must be a finite number, got NaN"),
        ({"slope_sigma": -1.0}, "slope_sigma must be zero or a positive number, got -1.0"),
        ({"walk": -1.0}, "walk must be zero or a positive number, got -1.0"),
        ({"rest_limit": 0.0}, "rest_limit must be a positive number, got 0.0"),
    ],
)
def test_a_parameter_out_of_range(arguments, message):
    with pytest.raises(ValueError, match=message):
        zr.TemperatureFilter(**{"rate": 100.0, **arguments})


def test_temperatures_of_another_shape():
    with pytest.raises(ValueError, match=r"temperature must have shape \(5,\), got \(4,\)"):
        zr.TemperatureFilter(100.0).process(np.zeros(5), np.zeros(4))
    with pytest.raises(ValueError, match=r"must have shape \(5, 2\) or \(5,\), got \(5, 3\)"):
        zr.TemperatureFilter(100.0, channels=2).process(np.zeros((5, 2)), np.zeros((5, 3)))
