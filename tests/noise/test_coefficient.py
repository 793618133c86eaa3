"""A coefficient: a float in every use, that knows how well it is known."""

import copy
import dataclasses
import math
import pickle

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.stats import norm

from zerorate.noise import Coefficient, Markov, NoiseModel, Sinusoid

NUMBERS = st.floats(-1e100, 1e100)
BOUNDED = Coefficient(0.0, identifiable=False, upper_bound=2e-6)
UNKNOWN = NoiseModel().angle_random_walk
PARTS = ("value", "sigma", "identifiable", "upper_bound")


def pickled(thing):
    return pickle.loads(pickle.dumps(thing))


def parts(coefficient):
    return [getattr(coefficient, part) for part in PARTS]


@settings(derandomize=True)
@given(NUMBERS, st.floats(-1e3, 1e3))
def test_it_is_its_value_in_every_use(value, other):
    coefficient = Coefficient(value, sigma=1.0)
    assert coefficient == value
    assert hash(coefficient) == hash(value)
    assert coefficient + other == value + other
    assert type(coefficient * other) is float
    assert (f"{coefficient:.3g}", str(coefficient)) == (f"{value:.3g}", str(value))
    assert np.asarray([coefficient]).dtype == np.float64


def test_a_given_number_is_exact():
    assert parts(Coefficient(-0.5)) == [-0.5, 0.0, True, -0.5]
    assert [type(part) for part in parts(Coefficient(np.float32(1)))] == [float, float, bool, float]


def test_an_estimate_is_bounded_at_95_percent():
    # Both are the same quantile to the last digits of a float.
    bound = Coefficient(2.0, sigma=0.5).upper_bound
    assert bound == pytest.approx(2.0 + 0.5 * norm.ppf(0.95), rel=1e-15)


def test_a_filter_is_never_given_zero_for_unknown():
    assert BOUNDED.conservative == 2e-6
    assert Coefficient(1.0, sigma=0.1).conservative == 1.0
    assert Coefficient(0.0).conservative == 0.0
    assert UNKNOWN.conservative == math.inf


def test_of_an_unknown_one_nothing_is_known():
    assert parts(UNKNOWN) == [0.0, 0.0, False, math.inf]
    assert not UNKNOWN.known
    assert BOUNDED.known
    assert parts(UNKNOWN.scaled(2.0)) == parts(UNKNOWN)
    assert parts(NoiseModel(rate_random_walk=None).rate_random_walk) == parts(UNKNOWN)
    assert parts(NoiseModel(rate_random_walk=0).rate_random_walk) == [0.0, 0.0, True, 0.0]


@pytest.mark.parametrize(
    ("coefficient", "text"),
    [
        (Coefficient(1.2e-4, 3e-6), "Coefficient(0.00012 ± 3e-06)"),
        (Coefficient(0.5), "Coefficient(0.5)"),
        (BOUNDED, "Coefficient(not identifiable, below 2e-06)"),
        (UNKNOWN, "Coefficient(unknown)"),
    ],
)
def test_repr_says_how_well_it_is_known(coefficient, text):
    assert repr(coefficient) == text


@pytest.mark.parametrize("twin", [copy.copy, copy.deepcopy, pickled])
def test_copies_keep_every_part(twin):
    for coefficient in (BOUNDED, UNKNOWN, Coefficient(0.1, 0.2, True, 0.7)):
        again = twin(coefficient)
        assert type(again) is Coefficient
        assert parts(again) == parts(coefficient)


@pytest.mark.parametrize("part", PARTS)
def test_it_is_read_only(part):
    with pytest.raises(AttributeError):
        setattr(BOUNDED, part, 1.0)


def test_scaling_scales_every_part():
    assert parts(BOUNDED.scaled(2.0)) == [0.0, 0.0, False, 4e-6]
    assert parts(Coefficient(-1.0, 0.5, True, 3.0).scaled(4.0)) == [-4.0, 2.0, True, 12.0]


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"value": math.nan}, "value must be finite, got nan"),
        ({"value": 1.0, "sigma": math.inf}, "sigma must be finite, got inf"),
        ({"value": 1.0, "sigma": -0.1}, "sigma must not be negative, got -0.1"),
        ({"value": 1.0, "upper_bound": 0.5}, "must not be below the value 1.0, got 0.5"),
        ({"value": 1.0, "identifiable": False}, "needs its upper_bound"),
        ({"value": 1.0, "upper_bound": math.inf}, "upper_bound must be finite, got inf"),
    ],
)
def test_refusals(arguments, message):
    with pytest.raises(ValueError, match=message):
        Coefficient(**arguments)


def test_a_model_keeps_what_it_is_given():
    estimate = Coefficient(1e-4, 2e-6)
    model = NoiseModel(estimate, BOUNDED, markov=[Markov(estimate, 10)])
    assert model.angle_random_walk is estimate
    assert model.bias_instability is BOUNDED
    assert model.markov == (Markov(1e-4, 10.0),)
    assert model.markov[0].amplitude.sigma == 2e-6


@pytest.mark.parametrize("twin", [copy.deepcopy, dataclasses.replace, pickled])
def test_copies_of_a_model_keep_every_part(twin):
    model = NoiseModel(Coefficient(1e-4, 2e-6), BOUNDED, sinusoid=(Sinusoid(0.1, 2.0),))
    again = twin(model)
    assert again == model
    assert parts(again.bias_instability) == parts(BOUNDED)
    assert again.angle_random_walk.sigma == 2e-6
