"""Simulated aids: their noise, faults and spans are those that were asked for."""

import numpy as np
import pytest

import zerorate as zr
from support.drives import drive
from zerorate.simulation import (
    antenna_baseline,
    barometer,
    compass_heading,
    magnetometer,
    with_aids,
)

SEA_LEVEL, TROPOSPHERE, EXPONENT = 101_325.0, 44_330.769, 0.190_263_24


def height_of(pressure):
    return TROPOSPHERE * (1.0 - (pressure / SEA_LEVEL) ** EXPONENT)


@pytest.mark.parametrize("seed", range(3))
def test_a_barometer_has_its_reference_noise_and_step(seed):
    one = drive(60.0)
    made = barometer(one, sigma=0.4, reference=-12.0, walk=0.0, steps=[(30.0, 5.0)], seed=seed)
    at = np.isfinite(made)
    off = height_of(made[at]) - one.truth_position[at, 2]
    before, after = off[one.time[at] < 30.0], off[one.time[at] >= 30.0]
    assert abs(before.mean() + 12.0) < 0.1
    assert abs(after.mean() + 7.0) < 0.1
    assert 0.35 < before.std() < 0.45
    assert at.sum() == 600


def test_a_compass_has_its_offset_disturbance_and_frozen_span():
    one = drive(60.0)
    clean = compass_heading(one, sigma=0.0)
    off = compass_heading(
        one, sigma=0.0, offset=0.1, disturbances=[(20.0, 25.0, 0.5)], frozen=[(40.0, 50.0)]
    )
    error = np.angle(np.exp(1j * (off - clean)))
    t = one.time
    assert np.nanmax(np.abs(error[t < 20.0] - 0.1)) < 1e-9
    assert np.nanmax(np.abs(error[(t >= 20.0) & (t < 25.0)] - 0.6)) < 1e-9
    assert np.unique(off[np.isfinite(off) & (t >= 40.0) & (t < 50.0)]).size == 1


def test_a_magnetometer_shows_the_heading_with_declination_and_iron():
    one = drive(60.0)
    iron = np.array([10.0, -4.0, 7.0])
    field = magnetometer(one, sigma=0.0, hard_iron=iron, magnets=[(30.0, 35.0, (5.0, 0.0, 0.0))])
    plain = magnetometer(one, sigma=0.0)
    inside = (one.time >= 30.0) & (one.time < 35.0)
    np.testing.assert_allclose(
        (field - plain)[inside], np.tile(iron + np.array((5.0, 0.0, 0.0)), (250, 1))
    )
    np.testing.assert_allclose((field - plain)[~inside], np.tile(iron, (2750, 1)))
    level = zr.geometry.rotations.rotate(one.truth_quaternion, plain)
    np.testing.assert_allclose(np.arctan2(level[:, 1], level[:, 0]), 0.075)


def test_a_baseline_turns_with_the_vehicle():
    one = drive(60.0)
    vectors = antenna_baseline(one, (1.0, 0.5, 0.0), sigma=0.0)
    at = np.isfinite(vectors).all(axis=1)
    np.testing.assert_allclose(np.linalg.norm(vectors[at], axis=1), np.hypot(1.0, 0.5))


def test_a_recording_holds_the_aids():
    one = drive(60.0)
    recording = with_aids(
        one, pressure=barometer(one), heading=compass_heading(one), mag=magnetometer(one)
    )
    assert recording.names == ("gyro", "accel", "pressure", "heading", "mag")
    assert recording["pressure"].unit, recording["heading"].unit == ("Pa", "rad")
    with pytest.raises(ValueError, match="wind is no aid; known: pressure, heading, mag, baseline"):
        with_aids(one, wind=barometer(one))


@pytest.mark.parametrize(
    ("make", "options", "message"),
    [
        (barometer, {"rate": 0.0}, "rate must be above 0"),
        (barometer, {"sigma": -1.0}, "sigma"),
        (compass_heading, {"rate": 1e4}, "rate must be above 0 and 50 Hz at most"),
        (magnetometer, {"hard_iron": (1.0, 2.0)}, "hard_iron"),
    ],
)
def test_wrong_arguments(make, options, message):
    with pytest.raises(ValueError, match=message):
        make(drive(60.0), **options)
