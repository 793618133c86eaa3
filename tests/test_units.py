"""Units: exact factors, refusals, spellings."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from zerorate.units import UNITS, canonical, convert, kind, whole_samples

NUMBERS = st.floats(allow_nan=False, allow_infinity=False, min_value=-1e150, max_value=1e150)


@pytest.mark.parametrize(
    ("value", "source", "target", "expected"),
    [
        (1.0, "deg/s", "deg/h", 3600.0),
        (180.0, "deg/s", "rad/s", math.pi),
        (1.0, "deg/s/sqrt(Hz)", "deg/sqrt(h)", 60.0),
        (1.0, "deg/s/sqrt(Hz)", "deg/h/sqrt(Hz)", 3600.0),
        (180.0, "deg/sqrt(h)", "rad/s/sqrt(Hz)", math.pi / 60.0),
        (1.0, "deg/s/sqrt(s)", "deg/h/sqrt(h)", 216000.0),
        (180.0, "deg/s/sqrt(s)", "rad/s^2/sqrt(Hz)", math.pi),
        (1.0, "deg", "arcsec", 3600.0),
        (1.0, "deg/s^2", "deg/h^2", 3600.0**2),
        (1.0, "rad", "urad", 1e6),
        (180.0, "deg", "urad", 1e6 * math.pi),
        (1.0, "g", "m/s^2", 9.80665),
        (1.0, "m/s^2", "ug", 1e6 / 9.80665),
        (1.0, "m/s^2/sqrt(Hz)", "m/s/sqrt(h)", 60.0),
        (1.0, "ug/sqrt(Hz)", "m/s^2/sqrt(Hz)", 9.80665e-6),
        (1.0, "mg/s/sqrt(Hz)", "m/s^3/sqrt(Hz)", 9.80665e-3),
        (1.0, "ug/s/sqrt(Hz)", "ug/sqrt(h)", 60.0),
        (1.0, "m/s^3/sqrt(Hz)", "m/s^2/sqrt(h)", 60.0),
        (1.0, "ug/s", "ug/h", 3600.0),
        (1.0, "ug/s", "m/s^3", 9.80665e-6),
    ],
)
def test_factors_of_ieee_952(value, source, target, expected):
    # One rounding of pi/180 and one product: a few units in the last place.
    assert convert(value, source, target) == pytest.approx(expected, rel=1e-15)


def test_degrees_to_degrees_is_exact():
    assert convert(7.0, "dps", "°/h") == 25200.0


@pytest.mark.parametrize(
    ("alias", "name"),
    [
        ("dps", "deg/s"),
        ("DPS", "deg/s"),
        ("°/s", "deg/s"),
        ("deg / sec", "deg/s"),
        ("degrees/second", "deg/s"),
        ("radps", "rad/s"),
        ("degph", "deg/h"),
        ("°/h", "deg/h"),
        ("deg/hr", "deg/h"),
        ("deg/hour", "deg/h"),
        ("°/sqrt(h)", "deg/sqrt(h)"),
        ("°/√h", "deg/sqrt(h)"),
        ("deg/sqrt(hr)", "deg/sqrt(h)"),
        ("dps/rtHz", "deg/s/sqrt(Hz)"),
        ("°/s/√Hz", "deg/s/sqrt(Hz)"),
        ("rad/sqrt(s)", "rad/s/sqrt(Hz)"),
        ("rad/s/√s", "rad/s^2/sqrt(Hz)"),
        ("rad/s²", "rad/s^2"),
        ("rad/s**2", "rad/s^2"),
        ("µrad", "urad"),
        ("G", "g"),
        ("m/s²", "m/s^2"),
        ("μg", "ug"),
        ("µg/√Hz", "ug/sqrt(Hz)"),
        ("mg/rtHz", "mg/sqrt(Hz)"),
        ("m/s/√hr", "m/s/sqrt(h)"),
        ("m/s/√s", "m/s^2/sqrt(Hz)"),
        ("m/s³/√Hz", "m/s^3/sqrt(Hz)"),
    ],
)
def test_spellings(alias, name):
    assert canonical(alias) == name


@pytest.mark.parametrize("name", UNITS)
def test_names_are_their_own_canonical_form(name):
    assert canonical(name) == name
    assert kind(name.upper()) == UNITS[name].kind


@pytest.mark.parametrize("unit", ["", "m/s", "deg", "rad/s/sqrt(Hz)", "deg/h/sqrt(h)", "rad/s^2"])
def test_a_rate_does_not_become_anything_else(unit):
    with pytest.raises(ValueError, match=r"deg/s, .*deg/h"):
        convert(1.0, "rad/s", unit)


@pytest.mark.parametrize("unit", ["rad", "m/s", "m/s^2", "ug/sqrt(h)", "ug/h", "rad/s/sqrt(Hz)"])
def test_a_velocity_random_walk_does_not_become_anything_else(unit):
    with pytest.raises(ValueError, match=r"are .*m/s/sqrt\(h\), mg/sqrt\(Hz\), ug/sqrt\(Hz\)$"):
        convert(1.0, "mg/sqrt(Hz)", unit)


def test_unknown_unit_lists_the_known():
    with pytest.raises(ValueError, match=r"unknown unit 'furlong': known are .*deg/sqrt\(h\)"):
        canonical("furlong")


@settings(derandomize=True)
@given(NUMBERS, st.sampled_from(list(UNITS)), st.sampled_from(list(UNITS)))
def test_there_and_back(value, source, target):
    if UNITS[source].kind == UNITS[target].kind:
        back = convert(convert(value, source, target), target, source)
        # Two factors of two roundings each and two products; denormals lose digits.
        assert back == pytest.approx(value, rel=2e-15, abs=1e-300)


def test_shape_and_type_follow_the_value():
    assert type(convert(1, "deg/s", "rad/s")) is float
    assert type(convert(np.float32(1.0), "deg/s", "rad/s")) is float
    array = convert(np.ones((2, 3), dtype=np.float32), "deg/s", "deg/h")
    assert array.shape == (2, 3)
    assert array.dtype == np.float64
    np.testing.assert_array_equal(array, 3600.0)


def test_any_finite_time_is_a_whole_number_of_samples():
    assert [whole_samples(t, 100.0) for t in (0.0, 0.014, 0.016, -1.0)] == [0, 1, 2, -100]
    for far in (1e17, 1e300, 1.7e308):
        assert whole_samples(far, 1e3) == -whole_samples(-far, 1e3) > 10**18
