"""The check of a recording against its slow twin."""

import numpy as np
import pytest

import zerorate as zr
from oracle import checks as twin
from zerorate._native import check_field, check_fit, check_gyro, check_ticks

# Rounding of some thousand steps, and of a mean's time over stamps of minutes.
CLOSE = {"rtol": 1e-10, "atol": 1e-10}


@pytest.fixture(scope="module")
def ticked():
    motion = zr.simulate_motion("hand", 100.0, 70.0, seed=4, start="motion").recording()
    n = int((motion.gyro.time[-1] - motion.gyro.time[0]) / twin.TICK)
    logs = (motion.gyro, motion.accel, motion.mag)
    found = [check_ticks(log.time, log.data, log.time[0], n) for log in logs]
    return motion, [found[0], *(v / np.median(np.linalg.norm(v, axis=1)) for v in found[1:])]


@pytest.mark.parametrize("rate", [31.0, 100.0, 286.0])
def test_ticks(rate):
    rng = np.random.default_rng(5)
    time = np.cumsum(rng.uniform(0.7, 1.3, 4000)) / rate
    values = rng.standard_normal((4000, 3))
    values[rng.random(4000) < 0.05] = np.nan
    values[700:800, 1] = np.inf
    values[1000:1010, 2] = 30.0
    count = int(time[-1] / twin.TICK) + 3
    found = check_ticks(time, values, time[0], count)
    np.testing.assert_allclose(found, twin.ticks(time, values, time[0], count), **CLOSE)
    assert 0 < np.isnan(found).any(axis=1).sum() < count


@pytest.mark.parametrize("seconds", [25.0, 70.0])
def test_costs_of_a_gyro(ticked, seconds):
    # Of 25 s there are short windows alone.
    _, (rates, forces, _) = ticked
    n = round(seconds / twin.TICK)
    rates = rates[:n].copy()
    rates[100] = np.nan
    found = check_gyro(rates, forces[:n])
    costs, null, biases, starts, length = twin.gyro_costs(rates, forces[:n])
    np.testing.assert_array_equal(found[3], starts)
    assert found[4] == length == (400 if seconds < 60.0 else 800)
    for one, other in zip(found[:3], (costs, null, biases), strict=True):
        np.testing.assert_allclose(one, other, **CLOSE)


@pytest.mark.parametrize("fits", [True, False])
def test_fit_of_a_gyro(ticked, fits):
    _, (rates, forces, _) = ticked
    starts, bias = np.arange(0, 2400, 400), np.array([0.01, -0.02, 0.0])
    found = check_fit(rates, forces, starts, 800, bias, fits)
    expected = twin.fitted(rates, forces, starts, 800, bias, fits)
    for one, other in zip(found, expected, strict=True):
        np.testing.assert_allclose(one, other, rtol=1e-8, atol=1e-10)  # a system of 13 equations


def test_costs_of_a_magnetometer(ticked):
    _, (rates, _, fields) = ticked
    found = check_field(rates, fields)
    costs, null, starts = twin.field_costs(rates, fields)
    np.testing.assert_array_equal(found[2], starts)
    np.testing.assert_allclose(found[0], costs, **CLOSE)
    np.testing.assert_allclose(found[1], null, **CLOSE)


def test_windows_that_tell_most():
    rng = np.random.default_rng(6)
    rates = np.cumsum(rng.standard_normal((9000, 3)), axis=0) / 100
    forces = np.cumsum(rng.standard_normal((9000, 3)), axis=0) / 100
    expected = twin.windows(rates, forces, 1200, most=60)
    assert len(expected) < 15
    long = np.tile(rates, (6, 1)) * np.repeat(rng.uniform(0.5, 2.0, 54), 1000)[:, None]
    fields = np.tile(forces, (6, 1)) * np.repeat(rng.uniform(0.5, 2.0, 54), 1000)[:, None]
    found = check_field(long, fields)[2]
    np.testing.assert_array_equal(found, twin.windows(long, fields, 1200, most=60))
    assert len(found) == 60
