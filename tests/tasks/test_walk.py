"""The task `walk`: what it takes and saves, and recordings that are not what they seem."""

import numpy as np
import pytest

import zerorate as zr
from support.commands import names
from zerorate.findings.attitude import up_direction
from zerorate.record import LogError

WALK = zr.simulate_walk(strides=10, seed=1)
RECORDING = WALK.recording()


def test_it_is_the_filter_of_a_recording_that_is_right():
    found = zr.walk(RECORDING, floor="level", smooth=True)
    own = zr.FootNavigation(floor="level").process(RECORDING).smooth()
    np.testing.assert_array_equal(found.position, own.position)
    np.testing.assert_array_equal(found.sigma, own.sigma)
    assert (found.alarms, found.notes) == ((), own.notes)


def test_a_start_on_the_earth_is_saved_as_maps(tmp_path):
    found = zr.walk(RECORDING, at=(48.1, 11.6), heading=np.radians(90.0), height=520.0)
    assert found.origin == pytest.approx((48.1, 11.6, np.radians(90.0), 520.0))
    written = found.save(tmp_path / "foot.csv", figure=False)
    assert names(tmp_path) == ["foot.csv", "foot.geojson", "foot.gpx"]
    assert written[0].name == "foot.csv"


def test_clipped_rates_are_restored_once_and_said_once():
    clipped = zr.simulate_walk(strides=10, seed=1, gyro_range=6.5).recording()
    found = zr.walk(clipped)
    own = zr.FootNavigation().process(clipped)
    np.testing.assert_array_equal(found.position, own.position)
    said = [text for text in (*found.alarms, *found.notes) if "clipped" in text]
    assert len(said) == len(own.clipped) == 2
    left = zr.walk(clipped, clipped="leave")
    assert not any("clipped" in text for text in (*left.alarms, *left.notes))


@pytest.mark.parametrize("gyro_range", [2.184, 4.366, 6.5])
@pytest.mark.parametrize("seed", [1, 3])
def test_clipping_is_no_fault_of_the_axes(gyro_range, seed):
    """Flat peaks fit exchanged axes better than their own."""
    made = zr.simulate_walk(strides=30, seed=seed, turn=0.1, gyro_range=gyro_range)
    assert zr.walk(made.recording(), assume_foot=True).alarms == ()


def test_acceleration_without_gravity_is_refused():
    felt = 9.80665 * up_direction(zr.walk(RECORDING, smooth=True).quaternion)
    rows = {"time_s": WALK.time}
    for name, values in (("gyro", WALK.gyro), ("accel", WALK.accel - felt)):
        rows |= {f"{name}_{x}": values[:, i] for i, x in enumerate("xyz")}
    with pytest.raises(LogError, match="gravity is absent"):
        zr.walk(rows, unit="rad/s,m/s^2")
    rows |= {f"gravity_{x}": felt[:, i] for i, x in enumerate("xyz")}
    found = zr.walk(rows, unit="rad/s,m/s^2")
    np.testing.assert_allclose(found.position, zr.walk(RECORDING).position, atol=1e-6)


@pytest.mark.parametrize(
    ("options", "match"),
    [
        ({"heading": 0.1}, "heading= needs at="),
        ({"height": 1.0}, "height= needs at="),
        ({"at": (90.0, 0.0)}, "at= takes deg, latitude within 89.5 first, got '90,0'"),
        ({"at": (48.0, 11.0, 0.0)}, "at= takes deg"),
        ({"at": (48.0, 11.0), "heading": 7.0}, "heading= takes an angle within 360 deg, got 401"),
        ({"at": (48.0, 11.0), "height": np.nan}, "height= takes m, got nan"),
        ({"floor": "flat"}, "floor must be None or 'level'"),
    ],
)
def test_refusals(options, match):
    with pytest.raises(ValueError, match=match):
        zr.walk(RECORDING, **options)


def test_a_recording_that_is_too_slow_is_a_fault_of_the_data():
    slow = zr.simulate_walk(rate=40.0, strides=5).recording()
    with pytest.raises(LogError, match="48 samples a second or more, got 40"):
        zr.walk(slow)
