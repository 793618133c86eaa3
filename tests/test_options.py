"""The table of the filter's options: it is what `DriftFilter` takes, uses and says."""

import inspect
import re

import pytest

from zerorate import DriftFilter
from zerorate.options import (
    FILTER_OPTIONS,
    METHODS,
    PUBLISHED,
    check_used,
    checked_options,
)

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
        assert checked_options(options)[name] == OTHER[name]
        return
    with pytest.raises(ValueError, match=f"{name} has no effect on method '{method}', only on "):
        checked_options(options)
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
    assert PUBLISHED == ("kf", "akf", "fading", "robust")


def test_an_unknown_option():
    with pytest.raises(TypeError, match="unknown option 'colour', expected some of method"):
        check_used(["colour"], ["kf"])
