"""The table of the filter's constants: it is what `NavigationFilter` takes, uses and says."""

import inspect
import math
import re

import pytest

from support.settings import LEVEL
from zerorate import FootNavigation, NavigationFilter
from zerorate.navigation.options import FOOT_OPTIONS, NAVIGATION_OPTIONS

OTHERS = {
    "start",
    "gyro",
    "accel",
    "antenna",
    "consider_antenna",
    "vehicle",
    "axle",
    "baseline",
    "limits",
}
"""Arguments that are not one number or one word."""


def made(name, value):
    vehicle = {"vehicle": "wheeled"} if NAVIGATION_OPTIONS[name].methods else {}
    return NavigationFilter(LEVEL, **vehicle, **{name: value})


def ends(option):
    """Return the first and the last number that words such as 'from 0.1 to 1 s' allow."""
    found = re.match(r"from (\S+) to (\S+)", option.expected)
    return (math.ulp(0.0), 1e9) if found is None else (float(found[1]), float(found[2]))


def test_it_has_every_constant_of_the_filter_with_its_default():
    signature = inspect.signature(NavigationFilter).parameters
    assert set(NAVIGATION_OPTIONS) == set(signature) - OTHERS
    for name, option in NAVIGATION_OPTIONS.items():
        assert option.name == name
        # One of wheels alone has no default of the class: without them it means nothing.
        assert signature[name].default == (None if option.methods else option.default)


@pytest.mark.parametrize("name", NAVIGATION_OPTIONS)
def test_the_range_is_that_of_the_filter(name):
    option = NAVIGATION_OPTIONS[name]
    if option.choices:
        for choice in option.choices:
            made(name, choice)
        with pytest.raises(ValueError, match=f"^{name} must be"):
            made(name, "pink")
        return
    first, last = ends(option)
    for value in (option.default, first, last):
        made(name, value)
    for value in (-1.0, math.nan, *([last * 1.001] if "from" in option.expected else [0.0])):
        with pytest.raises(ValueError, match=f"^{name} must be {re.escape(option.expected)}, got"):
            made(name, value)


@pytest.mark.parametrize("name", [n for n, one in NAVIGATION_OPTIONS.items() if one.methods])
def test_one_of_wheels_is_refused_without_them(name):
    with pytest.raises(ValueError, match=name):
        NavigationFilter(LEVEL, **{name: NAVIGATION_OPTIONS[name].default})


def test_those_of_a_foot_are_those_of_its_class():
    signature = inspect.signature(FootNavigation).parameters
    assert set(FOOT_OPTIONS) == set(signature) - {"rate", "restore", "assume_foot"}
    for name, option in FOOT_OPTIONS.items():
        assert signature[name].default == option.default
        for choice in option.choices:
            FootNavigation(**{name: choice})
        with pytest.raises(ValueError, match=f"^{name} must be {option.expected}, got"):
            FootNavigation(**{name: "pink"})
