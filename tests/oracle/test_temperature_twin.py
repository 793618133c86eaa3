"""The temperature filter's twin against closed forms."""

import numpy as np
import pytest

from oracle.temperature_filter import TemperatureFilter, Thermometer

RATE = 8.0


def run(f, z, temperature):
    return np.array([f.update(a, b) for a, b in zip(z, temperature, strict=True)])


def warm_up(seed, n=2400, slope=0.03):
    rng = np.random.default_rng(seed)
    temperature = 45.0 - 20.0 * np.exp(-np.arange(n) / n * 3.0)
    return 0.5 + slope * (temperature - 25.0) + 0.02 * rng.normal(size=n), temperature


def test_without_walk_it_is_least_squares_over_the_ticks_at_rest():
    z, temperature = warm_up(0)
    f = TemperatureFilter(RATE, slope_sigma=1e3, walk=0.0)
    at_rest = []
    for a, b in zip(z, temperature, strict=True):
        f.update(a, b)
        at_rest.append(f.at_rest)
    # Rest is told at the end of a tick, whose four samples count.
    first = at_rest.index(True) - 3
    assert all(at_rest[first + 3 :])
    A = np.column_stack([np.ones(z.size - first), temperature[first:] - 25.0])
    A, y = A.reshape(-1, 4, 2).mean(axis=1), z[first:].reshape(-1, 4).mean(axis=1)
    expected = np.linalg.lstsq(A, y, rcond=None)[0]
    # Within a part of its own error: an outlier in a tick counts less.
    assert f.slope == pytest.approx(expected[1], abs=0.2 * f.slope_sigma)
    assert f.bias == pytest.approx(A[-1] @ expected, abs=0.2 * f.bias_sigma)


def test_a_fixed_slope_is_the_published_model():
    z, temperature = warm_up(1, slope=0.1)
    f = TemperatureFilter(RATE, slope=0.1, walk=0.0)
    run(f, z, temperature)
    # All walks hold the same slope, but for the rounding of their weights.
    assert (f.slope, f.slope_sigma) == (pytest.approx(0.1), pytest.approx(0.0, abs=1e-12))
    assert f.bias == pytest.approx(0.5 + 0.1 * (temperature[-1] - 25.0), abs=4 * 0.02 / 48)


def test_whole_degrees_show_the_slope_too():
    z, temperature = warm_up(2, n=4800)
    f = TemperatureFilter(RATE)
    run(f, z, np.round(temperature))
    assert f.slope == pytest.approx(0.03, rel=0.1)


def test_without_temperature_the_bias_alone_is_learned():
    z = warm_up(3, slope=0.0)[0]
    f = TemperatureFilter(RATE)
    run(f, z, np.full(z.size, np.nan))
    assert f.bias == pytest.approx(0.5, abs=4 * 0.02 / np.sqrt(z.size))
    assert f.slope == 0.0


def test_units_do_not_matter():
    z, temperature = warm_up(4, n=800)
    f, g = TemperatureFilter(RATE), TemperatureFilter(RATE)
    # A power of two, so that nothing is rounded.
    np.testing.assert_allclose(run(g, 1024.0 * z, temperature), 1024.0 * run(f, z, temperature))
    assert g.slope_sigma == pytest.approx(1024.0 * f.slope_sigma)


def test_a_fine_thermometer_is_its_mean_over_a_tick():
    thermometer = Thermometer(25.0)
    for temperature in (26.0, 26.5):
        thermometer.observe(temperature)
    assert thermometer.end_tick() == 1.25
    assert thermometer.end_tick() == 1.25
