"""Temperatures between the steps of a thermometer."""

import numpy as np
import pytest

from zerorate.calibration.temperature.thermometer import hold_last, interpolate_steps, remove_leaps

TIME = np.arange(7200) / 4.0
WARMING = 20.0 + 20.0 * (1.0 - np.exp(-TIME / 400.0))


def error(temperature, step=1.0):
    shown = np.round(temperature / step) * step
    found, seen = interpolate_steps(TIME, shown)
    assert seen == pytest.approx(step)
    return found - temperature


def test_a_straight_line_is_found_but_for_its_ends():
    # A change is seen up to a sample late; the ends have no second change beside them.
    inner = slice(400, -400)
    assert np.abs(error(20.0 + TIME / 100.0)[inner]).max() < 0.01


@pytest.mark.parametrize("temperature", [WARMING, WARMING[::-1], 25.0 + 10.0 * np.sin(TIME / 300)])
def test_whole_degrees_are_read_five_times_finer(temperature):
    # Rounding alone has an error of 0.29.
    assert np.sqrt(np.mean(error(temperature) ** 2)) < 0.29 / 4.0


def test_tenths_are_no_different():
    fine = error(20.0 + (WARMING - 20.0) / 10.0, 0.1)
    np.testing.assert_allclose(
        fine, error(10.0 * (20.0 + (WARMING - 20.0) / 10.0)) / 10.0, atol=0.1
    )


def test_noise_at_a_boundary_is_passed_over():
    noise = 0.1 * np.random.default_rng(0).standard_normal(TIME.size)
    found, _ = interpolate_steps(TIME, np.round(WARMING + noise))
    assert np.sqrt(np.mean((found - WARMING) ** 2)) < 0.29 / 1.5


@pytest.mark.parametrize(
    "temperature",
    [
        np.full(TIME.size, 25.0),
        np.where(TIME < 900.0, 25.0, 45.0),
        WARMING + 0.01 * np.random.default_rng(0).standard_normal(TIME.size),
    ],
    ids=["constant", "a jump", "fine"],
)
def test_others_are_left_as_they_are(temperature):
    found, step = interpolate_steps(TIME, temperature)
    assert step == 0.0
    np.testing.assert_array_equal(found, temperature)


def test_one_change_tells_one_moment():
    shown = np.where(TIME < 900.0, 25.0, 26.0)
    found, step = interpolate_steps(TIME, shown)
    assert (step, found[0], found[-1]) == (1.0, 25.0, 26.0)
    assert np.interp(900.0, TIME, found) == pytest.approx(25.5, abs=0.01)


def test_missing_temperatures_are_held():
    nan = np.nan
    shown = np.array([nan, nan, 20.0, nan, 21.0, np.inf, 1e30, -1e5])
    np.testing.assert_array_equal(hold_last(shown), [20, 20, 20, 20, 21, 21, 21, 21])
    assert np.isnan(hold_last(np.array([nan, 1e6]))).all()


@pytest.mark.parametrize("bad", [85.0, -127.0, 0.0])
@pytest.mark.parametrize("places", [slice(40), slice(3000, 3004), slice(-40, None), [9, 30, 60]])
def test_what_a_thermometer_cannot_have_shown_is_missing(places, bad):
    wild = np.zeros(TIME.size, bool)
    wild[places] = True
    shown = np.where(wild, bad, WARMING)
    found, count = remove_leaps(TIME, shown)
    assert count == wild.sum()
    np.testing.assert_array_equal(found, np.where(wild, np.nan, WARMING))


@pytest.mark.parametrize(
    "temperature",
    [
        WARMING,
        # A kelvin a second, as in a chamber that is opened.
        np.interp(TIME, [0.0, 600.0, 660.0, 1e4], [20.0, 20.0, 80.0, 80.0]),
        # It was switched off, and on again in the cold.
        np.where(TIME < 600.0, 40.0, -10.0),
        np.where(np.arange(TIME.size) % 2, 20.0, 85.0),
        np.full(TIME.size, np.nan),
        np.array([20.0] * 7199 + [np.nan]),
    ],
)
def test_what_it_may_have_shown_stays(temperature):
    found, count = remove_leaps(TIME, temperature)
    assert count == 0
    np.testing.assert_array_equal(found, temperature)
