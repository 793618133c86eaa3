"""The filter that tunes itself against its literal NumPy twin."""

import numpy as np
import pytest

import oracle
import zerorate as zr
from oracle.agreement import (
    RATE,
    SIGNALS,
    TOLERANCE,
    assert_equal_to_twin,
    differences,
    record,
)


@pytest.mark.every(2)
@pytest.mark.parametrize("signal", SIGNALS)
def test_every_signal(signal):
    assert_equal_to_twin(record(signal, 15_000))


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(2, 5))
@pytest.mark.parametrize("signal", SIGNALS)
def test_a_hundred_thousand_samples_of_every_kind(signal, seed):
    assert_equal_to_twin(record(signal, 100_000, seed))


@pytest.mark.every(2)
@pytest.mark.parametrize("signal", ["white", "with_missing"])
@pytest.mark.parametrize("rate", [1.0, 10.0, 62.5, 2000.0 / 7.0, 1000.0])
def test_every_rate(rate, signal):
    assert_equal_to_twin(record(signal, min(15_000, int(600 * rate))), rate)


@pytest.mark.parametrize("offset", [-1e7, 1e4])
def test_far_from_zero(offset):
    assert_equal_to_twin(offset + record("walk", 10_000))


@pytest.mark.every(2)
@pytest.mark.parametrize(
    "arguments",
    [
        {"startup": 1e-3},
        {"startup": 0.37},
        {"startup": 5.0},
        {"scale": 0.1},
        {"scale": 7.0},
        {"motion": "ignore"},
    ],
    ids=str,
)
def test_every_setting(arguments):
    assert_equal_to_twin(record("with_missing", 10_000), **arguments)


def test_a_start_up_of_equal_samples_goes_on_until_two_differ():
    z = record("white", 5000)
    z[:1234] = 0.25
    assert_equal_to_twin(z)


def test_motion():
    z = record("walk", 20_000)
    z[6000:7500] += 50.0 * np.sin(np.arange(1500) / 40.0)
    z[13_000:] += 3.0
    assert_equal_to_twin(z)


@pytest.mark.every(2)
@pytest.mark.parametrize("seen", [0, 50, 777, 5999])
def test_switched_on_again(seen):
    """What was learned about the noise stays, the drift begins anew."""
    z = record("walk", 12_000)
    f, twin = zr.DriftFilter(RATE, method="auto"), oracle.AutoFilter(RATE)
    f.process(z[:seen])
    for sample in z[:seen]:
        twin.update(sample)
    f.power_on()
    twin.power_on()
    later = 5.0 - z[seen:]
    found = differences(f.trace(later), twin.trace(later), later)
    assert max(found.values()) <= TOLERANCE, found
