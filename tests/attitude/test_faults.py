"""Single faults and bodies that never rest: a scenario for each.

Limits are some half more than what is found; without the cure it is several times as much.
"""

import itertools

import numpy as np
import pytest

import zerorate as zr
from support import faults, outside


def traced(scene, *, nine=False, **arguments):
    """What the filter knows after each sample."""
    mag = scene.mag if nine else None
    return zr.Attitude(scene.rate, mag=nine, **arguments).trace(scene.gyro, scene.accel, mag)


# A slow turn after a rest.


@pytest.mark.parametrize("rest", [20.0, 60.0])
def test_a_slow_turn_after_a_rest_is_no_bias(rest):
    """Of 0.35 and 0.5 deg/s: the seconds of the rest before it do not count, nor does its mean."""
    for rate, lasts, noise in itertools.product((0.35, 0.5), (4.0, 20.0), (0.05, 0.35)):
        scene = faults.creep(rest, rate, lasts, noise, 0)
        trace = traced(scene)
        heading, _, where = outside.judged(scene, trace["quaternion"])
        assert np.max(np.abs(np.degrees(trace["bias"][where, 2]))) < 0.06
        assert abs(np.degrees(heading[-1])) < 1.0


# Bodies that never rest.


def off_course(scene):
    """Error of the heading about its mean, deg."""
    heading, _, _ = outside.judged(scene, traced(scene)["quaternion"])
    turned = np.exp(1j * heading)
    return outside.rms(np.angle(turned / turned.mean()))


@pytest.mark.parametrize(("kind", "most"), [("robot", 15.0), ("car", 13.0)])
def test_straights_come_back_at_one_rate(kind, most):
    """Arcs have each another: taken for the bias they made it 68 and 31 deg."""
    assert np.mean([off_course(faults.under_way(kind, seed)) for seed in range(6)]) < most


# Bodies that speed up.


def leaning(scene):
    """Error of the inclination, deg, and its deviation, deg."""
    trace = traced(scene)
    _, off, where = outside.judged(scene, trace["quaternion"])
    return np.degrees(off), np.degrees(trace["tilt_sigma"][where])


@pytest.mark.parametrize(
    ("tilt", "lift", "most"), [(20.0, 0.0, 2.5), (35.0, 0.0, 5.5), (35.0, 1.0, 11.0)]
)
def test_fast_flight_is_no_knock(tilt, lift, most):
    """The force of what speeds up is longer than gravity's; without that it is 5, 15 and 16 deg."""
    found = [leaning(faults.fast_drone(tilt, seed, lift=lift)) for seed in range(3)]
    assert np.mean([outside.rms(np.radians(off)) for off, _ in found]) < most
    assert np.mean([np.mean(off < 3.0 * sigma) for off, sigma in found]) > 0.95


@pytest.mark.parametrize(("push", "lasts"), [(1.5, 60.0), (2.5, 35.0), (4.0, 15.0)])
@pytest.mark.parametrize("ramp", [0.5, 6.0])
def test_a_take_off_is_no_rest(push, lasts, ramp):
    """As one it is 12 deg off."""
    off, _ = leaning(faults.pushed(push, lasts, ramp=ramp))
    assert outside.rms(np.radians(off)) < 4.5


# Sensors that fail.


@pytest.mark.parametrize("rate", [100.0, 200.0])
@pytest.mark.parametrize("nine", [True, False])
def test_a_garbage_sample_of_the_gyro_turns_nothing(rate, nine):
    """A pulse of one sample: no sensor's own filter passes it."""
    scene = faults.hand(rate, 30.0)
    expected = traced(scene, nine=nine)["quaternion"]
    for value, axis in itertools.product((500.0, 2000.0, 20000.0), (0, 2)):
        found = traced(faults.garbage(scene, 1500, value, axis), nine=nine)["quaternion"]
        moved = np.degrees(outside.parts(found[2500:], expected[2500:]))
        assert np.max(np.abs(moved)) < 4.0, value


def test_two_in_a_row_are_the_sensors_word():
    """A turn of two samples is one that a sensor can have felt."""
    scene = faults.hand(100.0, 20.0)
    twice = faults.garbage(faults.garbage(scene, 1500, 2000.0, 2), 1501, 2000.0, 2)
    found, expected = (traced(one)["quaternion"] for one in (twice, scene))
    assert abs(np.degrees(outside.parts(found[1550:1551], expected[1550:1551])[0][0])) > 10.0


# Deviations.


@pytest.mark.parametrize(("push", "lasts"), [(2.5, 35.0), (3.5, 12.0)])
@pytest.mark.parametrize("rate", [10.0, 100.0])
def test_no_tilt_is_further_off_than_any(push, lasts, rate):
    """A vehicle that speeds up on a rough road: it was told as 700 deg."""
    scene = faults.pushed(push, lasts, shaken=3.0, noise=3.0, rate=rate)
    trace = traced(scene)
    assert np.degrees(np.max(trace["tilt_sigma"])) < 60.0
    assert np.degrees(np.max(trace["bias_sigma"][trace["quaternion"].shape[0] // 2 :])) < 2.0


# The field.


@pytest.mark.parametrize(("angle", "lasts"), [(50.0, 8.0), (90.0, 4.0)])
def test_a_field_that_passes_by_is_no_drift(angle, lasts):
    """A drift makes a slope: this one, a step, led the heading away by 40 and 75 deg."""
    scene = faults.passing(angle, lasts, 0)
    off, _, _ = outside.judged(scene, traced(scene, nine=True)["quaternion"])
    assert np.max(np.abs(np.degrees(off))) < 8.0


@pytest.mark.parametrize(("every", "last"), [(1, 500), (100, None), (50, None)])
def test_a_field_that_is_held_is_no_news(every, last):
    """Frozen, and held between updates of 1 and 2 Hz: 44, 13 and 8 deg as a field."""
    scene = faults.held_field(faults.hand(100.0, 60.0), every, last)
    trace = traced(scene, nine=True)
    off, _, _ = outside.judged(scene, trace["quaternion"])
    assert outside.rms(off[500:]) < 9.0
    assert (np.mean(trace["disturbed"]) > 0.5) == (last is not None)


# A bias beyond what a good gyro has.


@pytest.mark.parametrize("size", [12.0, 25.0])
def test_gravity_proves_a_large_bias(size):
    scene = faults.big_bias(size, (1.0, -0.5, 0.3))
    trace = traced(scene)
    off, leaning, _ = outside.judged(scene, trace["quaternion"], 2000)
    assert outside.rms(off) < 1.0
    assert outside.rms(leaning) < 1.0
    assert trace["at_rest"][1000:2000].mean() > 0.9


@pytest.mark.parametrize("size", [12.0, 25.0])
def test_a_field_proves_a_bias_about_the_vertical(size):
    scene = faults.big_bias(size, (0.1, 0.1, 1.0))
    off, _, _ = outside.judged(scene, traced(scene, nine=True)["quaternion"])
    assert outside.rms(off) < 5.0


def test_nobody_tells_a_large_bias_from_a_rate_table():
    """Six axes: the deviation of the heading says so, and the status."""
    scene = faults.big_bias(15.0, (0.05, 0.05, 1.0))
    filter_ = zr.Attitude(100.0, mag=False)
    filter_.process(scene.gyro[:1000], scene.accel[:1000])
    assert filter_.status == "at rest, or on a rate table: bias_limit"
    assert filter_.heading_sigma > 1.0
    limited = zr.Attitude(100.0, mag=False, bias_limit=20.0 * outside.DEG)
    limited.process(scene.gyro[:1000], scene.accel[:1000])
    assert limited.status == "at rest"


@pytest.mark.parametrize("rate", [12.0, 20.0, 60.0])
@pytest.mark.parametrize("rest", [15.0, 0.0])
def test_a_table_is_none(rate, rest):
    scene = outside.turntable(rate, 0, rest=rest, still=True)
    off, _, _ = outside.judged(scene, traced(scene)["quaternion"])
    assert outside.rms(off) < 2.0
