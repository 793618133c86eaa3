"""The table of the filter's options: it is what `DriftFilter` takes, uses and says."""

import inspect
import re

import pytest

from zerorate import DriftFilter
from zerorate.options import (
    FILTER_OPTIONS,
    METHODS,
    PUBLISHED_METHODS,
    add_rest_limits,
    check_options,
    check_used,
)
from zerorate.units import convert

OTHER = {
    "order": (1, 0),
    "fading": 0.9,
    "adapt_for": None,
    "forgetting_factor": 0.99,
    "process_noise": 0.2,
    "process_noise_memory": 5.0,
    "noise": "hadamard",
    "startup": 0.5,
    "scale": 0.1,
    "motion": "hold",
    "limit": 250.0,
    "rest_limit": 10.0,
    "bias_limit": 20.0,
    "outliers": "reject",
    "output": "compensated",
    "method": "kf",
    "zones": (3.0, 0.5),
    "damping": 0.1,
    "correction": 0.1,
}


def test_it_has_every_argument_of_the_filter_with_its_default():
    signature = inspect.signature(DriftFilter).parameters
    assert set(FILTER_OPTIONS) == set(OTHER) == set(signature) - {"rate", "channels"}
    for name, option in FILTER_OPTIONS.items():
        assert option.name == name
        assert option.default == signature[name].default


@pytest.mark.parametrize("name", [n for n, o in FILTER_OPTIONS.items() if o.kind == "choice"])
def test_every_choice_is_taken_and_no_other(name):
    option = FILTER_OPTIONS[name]
    method = {} if name == "method" else {"method": option.methods[0]}
    for choice in option.choices:
        assert DriftFilter(100.0, **{**method, name: choice}).params[name] == choice
    with pytest.raises(ValueError, match=re.escape(f"{name} must be {option.expected}")):
        DriftFilter(100.0, **{**method, name: "pink"})


@pytest.mark.parametrize("name", [n for n, o in FILTER_OPTIONS.items() if o.kind != "choice"])
def test_a_refusal_says_what_is_expected(name):
    option = FILTER_OPTIONS[name]
    bad = (9, 9) if option.kind == "order" else -1.0
    with pytest.raises(ValueError, match=re.escape(f"{name} must be {option.expected}, got")):
        DriftFilter(100.0, **{"method": option.methods[-1], name: bad})


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("name", FILTER_OPTIONS)
def test_a_method_takes_what_it_uses_and_refuses_the_rest(name, method):
    users = FILTER_OPTIONS[name].methods
    options = {"method": method, name: OTHER[name]}
    if method in users:
        assert check_options(options)[name] == OTHER[name]
        return
    with pytest.raises(ValueError, match=f"{name} has no effect on method '{method}', only on "):
        check_options(options)
    check_used([name], [method, users[0]])
    with pytest.raises(ValueError, match=f"{name} has no effect on ") as told:
        check_used([name], [method])
    with pytest.raises(ValueError, match=f"^{re.escape(str(told.value))}$"):
        DriftFilter(100.0, **options)


def test_a_sentence_names_who_uses_it():
    told = "fading has no effect on methods 'kf' and 'auto', only on 'fading'"
    with pytest.raises(ValueError, match=f"^{told}$"):
        check_used(["startup", "fading"], ["kf", "auto"])
    with pytest.raises(ValueError, match="order has no effect on method 'auto', only on 'kf', "):
        check_used(["order"], ["auto"])
    assert PUBLISHED_METHODS == ("kf", "akf", "fading", "robust")


@pytest.mark.parametrize("unit", ["deg/s", "dps", "rad/s", "deg/h"])
def test_limits_of_rest_are_known_where_the_unit_is(unit):
    found = add_rest_limits({"startup": 2.0}, ["kf", "auto"], unit)
    assert found == {
        "rest_limit": pytest.approx(convert(10.0, "deg/s", unit)),
        "bias_limit": pytest.approx(convert(20.0, "deg/s", unit)),
        "startup": 2.0,
    }
    assert add_rest_limits({}, ["auto"], unit, ["rest_limit"]).keys() == {"rest_limit"}


@pytest.mark.parametrize("unit", [None, "unit", "g", "deg", "deg/s, rad/s"])
def test_there_are_none_for_what_is_no_rate(unit):
    assert add_rest_limits({"startup": 2.0}, ["auto"], unit) == {"startup": 2.0}


def test_there_are_none_where_they_have_no_effect():
    assert add_rest_limits({}, ["kf", "fading"], "deg/s") == {}
    assert add_rest_limits({"motion": "ignore"}, ["auto"], "deg/s") == {"motion": "ignore"}


def test_what_is_given_stands():
    given = {"rest_limit": None, "bias_limit": 5.0, "motion": "hold"}
    assert add_rest_limits(given, ["auto"], "deg/s") == given


@pytest.mark.parametrize("name", ["rest_limit", "bias_limit"])
def test_a_limit_of_rest_is_refused_where_motion_is_ignored(name):
    message = f"^{name} has no effect on motion 'ignore', only on 'hold'$"
    with pytest.raises(ValueError, match=message):
        DriftFilter(100.0, method="auto", motion="ignore", **{name: 3.0})
    filter_ = DriftFilter(100.0, method="auto", motion="ignore", **{name: None})
    assert DriftFilter(**filter_.params).params == filter_.params


def test_an_unknown_option():
    with pytest.raises(TypeError, match="unknown option 'colour', expected some of method"):
        check_used(["colour"], ["kf"])
