"""Every option changes something, and ``params`` says them all."""

import ast
import inspect
import re

import numpy as np
import pytest
from hypothesis import given

import zerorate as zr
from support.checks import assert_same_bits
from support.checks import named as named_case
from support.classes import assert_same_state
from support.records import records
from support.settings import (
    METHODS,
    MOTIONS,
    ORDERS,
    OUTPUTS,
    RATE,
    TRACE,
    drift,
    drift_settings,
    traced,
)
from zerorate._native import filter_options


def record(n=1500):
    """Coloured noise on a slope, so that each option has something to act on."""
    rng = np.random.default_rng(12)
    z = np.zeros(n)
    for k in range(1, n):
        z[k] = 0.9 * z[k - 1] + rng.standard_normal()
    return 5.0 + z + 0.01 * np.arange(n)


# Each with what it needs to matter, and another value than its default.
DRIFT_OPTIONS = [
    ({}, {"rate": 50.0}),
    ({}, {"order": (1, 1)}),
    ({}, {"order": (2, 0)}),
    ({}, {"order": (3, 1)}),
    ({}, {"order": (2, 3)}),
    ({}, {"method": "kf"}),
    ({}, {"method": "akf"}),
    ({"method": "kf"}, {"method": "akf"}),
    ({}, {"fading": 0.9}),
    ({}, {"fading": 1.0}),
    ({}, {"adapt_for": 5.0}),
    ({}, {"adapt_for": 0.0}),
    ({"adapt_for": 5.0}, {"adapt_for": None}),
    ({}, {"forgetting_factor": 0.99}),
    ({}, {"process_noise": 1.0}),
    ({}, {"process_noise": 0.0}),
    ({}, {"process_noise_memory": 100.0}),
    ({}, {"noise": "hadamard"}),
    ({"method": "kf"}, {"noise": "hadamard"}),
    ({"method": "akf"}, {"noise": "hadamard"}),
    ({}, {"startup": 2.0}),
    ({}, {"startup": 0.5}),
    ({}, {"scale": 3.0}),
    ({"scale": 3.0}, {"scale": 4.0}),
    ({"method": "robust"}, {"order": (2, 1)}),
    ({"method": "robust"}, {"zones": (1.5, 0.75)}),
    ({"method": "robust"}, {"zones": "published"}),
    ({"method": "robust", "zones": (1.5, 0.75)}, {"zones": (1.5, 0.5)}),
    ({"method": "robust", "zones": (1.5, 0.75)}, {"damping": 0.1}),
    ({"method": "robust", "zones": (1.5, 0.75)}, {"correction": 0.1}),
    ({}, {"method": "auto"}),
    ({"method": "auto"}, {"startup": 2.0}),
    ({"method": "auto"}, {"rate": 50.0}),
    ({}, {"output": "compensated"}),
    ({"method": "auto"}, {"output": "compensated"}),
    ({"motion": "hold"}, {"output": "compensated"}),
    ({}, {"limit": 12.0}),
    ({"motion": "hold"}, {"limit": 12.0}),
    ({"method": "auto"}, {"limit": 12.0}),
    ({}, {"outliers": "reject"}),
    ({"method": "kf"}, {"outliers": "reject"}),
    ({"method": "auto"}, {"rest_limit": 2.0}),
    ({"method": "auto"}, {"bias_limit": 6.0}),
]
LEAST_SQUARES_OPTIONS = [
    ({}, {"order": (1, 1)}),
    ({}, {"order": (2, 2)}),
    ({}, {"forgetting_factor": 0.99}),
    ({}, {"startup": 50}),
    ({}, {"scale": 3.0}),
]
ALLAN_OPTIONS = [({}, {"fading": 0.9}), ({}, {"noise": "hadamard"}), ({}, {"floor": 10.0})]


def named(options):
    return pytest.mark.parametrize(
        ("base", "option"), options, ids=[f"{base}-{option}" for base, option in options]
    )


def assert_matters(kind, base, option):
    plain, other = kind(**base), kind(**{**base, **option})
    difference = np.abs(plain.process(record()) - other.process(record()))
    # Far beyond rounding: the deviation of the record is about five.
    assert difference.max() > 1e-6


@named(DRIFT_OPTIONS)
def test_every_option_of_a_drift_filter_matters(base, option):
    fading = {"rate": RATE, "method": "fading", "output": "estimate"}
    assert_matters(zr.DriftFilter, {**fading, **base}, option)


@named(LEAST_SQUARES_OPTIONS)
def test_every_option_of_least_squares_matters(base, option):
    assert_matters(zr.identification.RecursiveLeastSquares, base, option)


@named(ALLAN_OPTIONS)
def test_every_option_of_allan_noise_matters(base, option):
    assert_matters(zr.noise.AllanNoise, base, option)


@pytest.mark.parametrize(
    ("kind", "options"),
    [
        (zr.DriftFilter, DRIFT_OPTIONS),
        (zr.identification.RecursiveLeastSquares, LEAST_SQUARES_OPTIONS),
        (zr.noise.AllanNoise, ALLAN_OPTIONS),
    ],
)
def test_no_option_was_forgotten_above(kind, options):
    tried = {name for _, option in options for name in option}
    # What channels and motion do shows in other records: test_laws.py, test_motion.py.
    assert set(inspect.signature(kind).parameters) - tried <= {"channels", "motion"}


def test_no_two_orders_or_methods_are_the_same():
    answers = {
        (order, method): zr.DriftFilter(
            rate=RATE, order=order, method=method, output="estimate"
        ).process(record())
        for order in ORDERS
        for method in METHODS
    }
    assert len({answer.tobytes() for answer in answers.values()}) == len(answers)


@pytest.mark.parametrize("kind", [zr.identification.RecursiveLeastSquares, zr.noise.AllanNoise])
def test_channels_set_the_shape(kind):
    assert kind().channels is None
    assert kind(channels=2).process(np.zeros((5, 2))).shape == (5, 2)


TABLE = {option["name"]: option for option in filter_options()}


@pytest.mark.parametrize("method", [*METHODS, "robust", "auto"])
def test_an_option_that_the_method_does_not_use_is_refused(method):
    """Even with the value that it has by default; the others are taken."""
    for name, option in TABLE.items():
        given = {"method": method, name: option["default"]}
        with named_case(f"{name} of {method}"):
            if method in option["methods"]:
                zr.DriftFilter(RATE, **given)
                continue
            with pytest.raises(ValueError, match=f"^{name} has no effect on method '{method}', "):
                zr.DriftFilter(RATE, **given)


def test_the_refusal_names_who_uses_it():
    with pytest.raises(ValueError, match=r"only on 'kf', 'akf', 'fading' and 'robust'$"):
        zr.DriftFilter(RATE, method="auto", order=(3, 1))


def test_an_option_that_does_not_exist_is_refused_by_name():
    with pytest.raises(TypeError, match="unexpected keyword argument 'ordre'"):
        zr.DriftFilter(RATE, ordre=(2, 1))


def test_signature_and_stub_are_the_table():
    """The text in the bindings: names in the order of the table, with its defaults."""
    parameters = dict(inspect.signature(zr.DriftFilter).parameters)
    assert list(parameters) == ["rate", "method", "channels", *list(TABLE)[1:]]
    for name, option in TABLE.items():
        assert parameters[name].default == option["default"], name
        assert parameters[name].kind is inspect.Parameter.KEYWORD_ONLY


def test_the_ranges_of_the_table_are_those_of_the_refusals():
    for name, option in TABLE.items():
        bad = {"order": (0, 9), "choice": "nonsense"}.get(option["kind"], -1.0)
        words = re.escape(f"{name} must be {option['expected']}, got")
        with named_case(name), pytest.raises(ValueError, match=words):
            zr.DriftFilter(RATE, **{"method": option["methods"][0], name: bad})


@pytest.mark.parametrize("method", ["akf", "fading"])
def test_only_the_fading_method_adapts_its_process_noise(method):
    G = zr.DriftFilter(rate=RATE, method=method).trace(record()).process_noise[100:]
    assert np.all(G[0] == G) == (method == "akf")


@pytest.mark.parametrize("method", METHODS)
def test_only_kf_keeps_its_measurement_noise(method):
    R = zr.DriftFilter(rate=RATE, method=method).trace(record()).measurement_noise[99:]
    assert np.all(R[0] == R) == (method == "kf")


@pytest.mark.parametrize("seconds", [0.0, 0.05, 3.0])
def test_the_model_is_learned_for_as_long_as_said(seconds):
    f = zr.DriftFilter(rate=RATE, method="fading", adapt_for=seconds, startup=1.0)
    coefficients = f.trace(record()).coefficients[99:]
    changes = np.flatnonzero(np.any(np.diff(coefficients, axis=0) != 0.0, axis=1))
    assert len(changes) == round(seconds * RATE)
    assert np.all(changes == np.arange(len(changes)))


@pytest.mark.parametrize(
    ("rate", "startup", "samples"),
    [(100.0, 1.0, 100), (100.0, 0.01, 10), (1.0, 1.0, 10), (250.0, 0.1, 25), (8000.0, 0.5, 4000)],
)
def test_the_start_up_lasts_as_long_as_said(rate, startup, samples):
    f = zr.DriftFilter(rate=rate, method="fading", startup=startup, output="estimate")
    z = np.random.default_rng(13).standard_normal(samples)
    f.process(z[:-1])
    assert not f.ready
    f.update(z[-1])
    assert f.ready


@given(drift_settings(), records())
def test_params_rebuild_an_equal_filter(arguments, z):
    f = drift(arguments)
    started = {} if f.start is None else {"start": f.start}
    twin = drift({**f.params, **started})
    assert twin.params == f.params
    expected, got = traced(f, z), traced(twin, z)
    for name in TRACE:
        assert_same_bits(got[name], expected[name])
    assert_same_state(twin, f)
    assert zr.DriftFilter.from_bytes(f.to_bytes()).params == f.params


@pytest.mark.parametrize("method", [*METHODS, "robust", "auto"])
def test_params_name_every_argument_that_the_method_uses(method):
    f = zr.DriftFilter(rate=RATE, method=method)
    unused = {name for name, option in TABLE.items() if method not in option["methods"]}
    expected = [name for name in inspect.signature(zr.DriftFilter).parameters if name not in unused]
    assert list(f.params) == expected


def test_params_of_the_self_tuning_filter_name_those_that_it_uses():
    f = zr.DriftFilter(rate=RATE, method="auto")
    conduct = ["rate", "method", "channels", "output", "motion"]
    used = [*conduct, "limit", "rest_limit", "bias_limit", "startup", "scale"]
    assert list(f.params) == used


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("motion", MOTIONS)
@pytest.mark.parametrize("output", OUTPUTS)
def test_params_say_the_conduct(method, motion, output):
    f = zr.DriftFilter(rate=RATE, method=method, motion=motion, output=output)
    assert (f.params["motion"], f.params["output"]) == (motion, output)


@pytest.mark.parametrize("method", [*METHODS, "robust", "auto"])
def test_only_the_self_tuning_filter_holds_unasked(method):
    expected = "hold" if method == "auto" else "ignore"
    assert zr.DriftFilter(rate=RATE, method=method).params["motion"] == expected
    assert zr.DriftFilter(rate=RATE, method=method, motion=None).params["motion"] == expected


def test_params_say_what_was_given():
    given = {
        "rate": 8000.0,
        "order": (3, 2),
        "method": "fading",
        "fading": 0.5,
        "adapt_for": None,
        "forgetting_factor": 0.75,
        "channels": 2,
        "motion": "hold",
        "output": "compensated",
        "process_noise": 0.25,
        "process_noise_memory": 3.0,
        "noise": "hadamard",
        "startup": 2.5,
        "scale": 1.5,
        "limit": 300.0,
        "outliers": "reject",
    }
    assert zr.DriftFilter(**given).params == given


def test_the_documented_defaults_are_the_defaults():
    assert zr.DriftFilter(RATE).params == {
        "rate": RATE,
        "method": "auto",
        "channels": None,
        "output": "compensated",
        "motion": "hold",
        "limit": None,
        "rest_limit": None,
        "bias_limit": None,
        "startup": 1.0,
        "scale": None,
    }
    assert zr.DriftFilter(rate=RATE, method="fading").params == {
        "rate": RATE,
        "order": (2, 1),
        "method": "fading",
        "fading": 0.97,
        "adapt_for": 120.0,
        "forgetting_factor": 1.0,
        "channels": None,
        "motion": "ignore",
        "output": "compensated",
        "process_noise": 0.1,
        "process_noise_memory": 0.0,
        "noise": "allan",
        "startup": 1.0,
        "scale": None,
        "limit": None,
        "outliers": "keep",
    }


@given(drift_settings())
def test_repr_names_what_differs_from_the_default_of_the_method(arguments):
    f = drift(arguments)
    method = f.params["method"]
    plain = zr.DriftFilter(RATE, method=method).params | {"method": "auto"}
    differing = {name: value for name, value in f.params.items() if value != plain[name]}
    call = ast.parse(repr(f), mode="eval").body
    shown = {word.arg: ast.literal_eval(word.value) for word in call.keywords}
    assert shown == {"rate": f.rate} | differing
