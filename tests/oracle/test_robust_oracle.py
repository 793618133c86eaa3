"""The robust filter against its literal NumPy twin, as printed and with its exit."""

from itertools import product

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import oracle
from oracle.test_oracle import TOLERANCE, differences, record, start_of
from support.records import SIGNALS
from support.settings import RATE, drift

ZONES = [(4.0, 0.75), (2.0, 0.3), (3.0, 1.0), "published"]


def contaminated(z, share=0.03, size=20.0, step=8.0, seed=5):
    """Outliers of either sign, and a step in the middle, in deviations of the record."""
    rng = np.random.default_rng(seed)
    deviation = np.std(z[np.isfinite(z)])
    far = rng.random(len(z)) < share
    z = z + np.where(far, size * deviation * rng.standard_normal(len(z)), 0.0)
    z[len(z) // 2 :] += step * deviation
    return z


def assert_equal_to_twin(z, **arguments):
    f = drift({"rate": RATE, "method": "robust", "output": "estimate", **arguments})
    twin = oracle.RobustFilter(RATE, **arguments)
    trace, expected = f.trace(z), twin.trace(z)
    found = differences(trace, expected, z)
    assert max(found.values()) <= TOLERANCE, found
    np.testing.assert_array_equal(trace.guarded, expected["guarded"])
    assert f.exit_count == twin.exits
    assert f.outlier_count == trace.guarded.sum()
    return f


@pytest.mark.every(9)
@pytest.mark.parametrize("signal", SIGNALS)
@pytest.mark.parametrize("order", [(1, 0), (2, 1), (3, 3)], ids=str)
@pytest.mark.parametrize("zones", ZONES, ids=str)
def test_every_zone_on_every_signal(signal, order, zones):
    z = contaminated(record(signal, 300))
    for damping, correction in product([0.0, 0.3], [0.0, 0.1]):
        arguments = {"zones": zones, "damping": damping, "correction": correction}
        assert_equal_to_twin(z, order=order, **arguments)


@given(
    st.fixed_dictionaries(
        {
            "zones": st.sampled_from(ZONES),
            "damping": st.floats(0.0, 1.0),
            "correction": st.floats(0.0, 1.0),
        },
        optional={
            "process_noise": st.sampled_from([1e-4, 0.1, 1.0]),
            "adapt_for": st.sampled_from([None, 0.0, 2.0]),
            "noise": st.just("hadamard"),
            "scale": st.just(2.0),
            "start": st.just(start_of((1, 0))),
        },
    ),
    st.integers(0, 2**32),
)
def test_every_combination_of_options(arguments, seed):
    assert_equal_to_twin(contaminated(record("white", 400, seed), seed=seed), **arguments)


@pytest.mark.slow
def test_many_samples():
    z = contaminated(record("autoregressive", 30_000))
    f = assert_equal_to_twin(z, zones=(4.0, 0.5), adapt_for=None)
    assert f.outlier_count > 300
    assert f.exit_count >= 1


def test_two_thousand_samples_as_printed():
    """The twin takes the variance of all innovations anew each time: its work is their square."""
    z = contaminated(record("white", 2000))
    f = assert_equal_to_twin(z, zones="published", damping=0.1, correction=0.1)
    assert f.outlier_count > 100
