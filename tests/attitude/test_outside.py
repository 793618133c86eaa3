"""Bodies that rest or do not, against what most rules say: a scenario for each part that it needs.

Limits are some half more than what is found; without the part it is several times as much.
"""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import zerorate as zr
from support import outside

DEG = outside.DEG


def traced(scene, *, nine=True, **arguments):
    """What the filter knows after each sample."""
    mag = scene.mag if nine else None
    filter_ = zr.Attitude(scene.rate, mag=mag is not None, **arguments)
    return filter_.trace(scene.gyro, scene.accel, mag)


def heading(scene, trace):
    return np.degrees(outside.judged(scene, trace["quaternion"])[0])


def rms(scene, trace, relative=None):
    """Root mean squares of heading and inclination, deg."""
    found = outside.judged(scene, trace["quaternion"], relative)
    return outside.rms(found[0]), outside.rms(found[1])


def moved(kind, duration, **more):
    """A simulated motion as a scene of which everything counts after ten seconds."""
    motion = zr.simulate_motion(kind, 100.0, duration, **more)
    where = np.arange(len(motion.gyro)) >= 1000
    return outside.Scene(100.0, motion.gyro, motion.accel, motion.mag, motion.quaternion, where)


# Rests: quiet, calm, refuted.


@pytest.mark.parametrize(("seed", "rest"), [(1, 3.0), (5, 2.0)])
def test_a_quadrotor_rests_for_seconds_with_its_motors_on(seed, rest):
    """Quiet rests: of a bias of 5 deg/s a filter that waits for ten seconds learns nothing."""
    scene = outside.hover(seed, 5.0, rest, flight=40.0)
    off, leaning = rms(scene, traced(scene, nine=False), 10)
    assert off < 3.0
    assert leaning < 1.5


@pytest.mark.parametrize("rate", [1.0, 5.0, 60.0])
def test_a_rate_table_is_less_calm_than_a_rest(rate):
    scene = outside.turntable(rate, 0)
    assert rms(scene, traced(scene, nine=False))[0] < 1.0


def test_a_road_has_bends():
    scene = outside.bends(3.0, 1)
    assert rms(scene, traced(scene, nine=False))[0] < 2.0


def test_a_turn_between_two_rests_is_no_rest():
    """Far levels have to be steady for half a minute once a rest was used."""
    scene = outside.jumped()
    assert abs(heading(scene, traced(scene, nine=False))[-1]) < 1.0


def test_a_bend_at_power_on_is_undone_by_the_first_rest():
    """And with it what it did to the heading."""
    yaw = np.zeros(2500)
    yaw[:800] = 4.0
    scene = outside.level(yaw, 0, shaken=0.0)
    gyro = scene.gyro.copy()
    gyro[:800] += 1.0 * DEG * np.random.default_rng(1).standard_normal((800, 3))
    scene = replace(scene, gyro=gyro)
    off = heading(scene, traced(scene, nine=False))
    assert np.max(np.abs(off)) > 10.0, "it is believed until then"
    assert abs(off[-1]) < 2.0


def test_the_limit_of_a_bias_is_a_persons_word():
    """A table that turns slowly from the first sample on passes for a rest, if it can be one."""
    scene = outside.turntable(5.0, 0, rest=0.0, still=True)
    assert rms(scene, traced(scene, nine=False))[0] > 20.0
    limited = traced(scene, nine=False, bias_limit=2.0 * DEG)
    assert rms(scene, limited)[0] < 2.0


def test_a_bias_that_is_far_is_found_after_a_long_rest():
    """It has jumped by 0.7 deg/s: half a minute. By 3 deg/s it is a turn, unless a field stays."""
    jump = 1.0 * (np.arange(9000) > 3000)
    near, far = (outside.level(np.zeros(9000), 0, shaken=0.0, jump=x * jump) for x in (0.7, 3.0))
    bias = np.degrees(traced(near, nine=False)["bias"])
    assert bias[5000, 2] < 0.3
    assert abs(bias[-1, 2] - 0.72) < 0.1
    assert np.degrees(traced(far, nine=False)["bias"][-1, 2]) < 0.1
    assert abs(np.degrees(traced(far)["bias"][-1, 2]) - 3.02) < 0.1


@pytest.mark.parametrize("rate", [2.0, 5.0, 8.0])
def test_a_level_that_no_gyro_drifts_to_is_a_turn(rate):
    """A table that nothing shakes, six axes: as a bias that jumped it was 53 to 84 deg off."""
    scene = outside.turntable(rate, 0, still=True)
    assert rms(scene, traced(scene, nine=False))[0] < 1.0


@pytest.mark.parametrize("rate", [1.0, 2.0, 5.0])
def test_a_first_rest_that_may_be_a_turn_is_in_the_deviation(rate):
    """Until the body moves: nobody can tell a table that turns from the first sample on."""
    scene = outside.turntable(rate, 0, rest=0.0, still=True)
    trace = traced(scene, nine=False)
    off = np.abs(np.radians(heading(scene, trace)))
    assert np.mean(off < 3.0 * trace["heading_sigma"]) > 0.95
    moved = outside.hover(0, 5.0, 4.0, flight=20.0)
    assert np.degrees(traced(moved, nine=False)["heading_sigma"][-1]) < 8.0


def test_gravity_tells_a_bias_that_has_jumped_from_a_turn():
    """About a level axis a turn would carry it along: three seconds are enough."""
    scene = outside.level(np.zeros(6000), 0, shaken=0.0)
    gyro = scene.gyro.copy()
    gyro[3000:] += np.radians([1.0, -1.0, 1.0])
    bias = traced(replace(scene, gyro=gyro), nine=False)["bias"]
    np.testing.assert_allclose(np.degrees(bias[3500]), [1.02, -1.02, 1.02], atol=0.1)


# The field, a witness.


@pytest.mark.parametrize("rate", [0.5, 0.7])
def test_a_field_tells_a_table_from_a_rest(rate):
    """Nothing shakes it: to gyro and accelerometer it rests with a bias that has drifted."""
    scene = outside.turntable(rate, 0, still=True)
    assert rms(scene, traced(scene))[0] < 1.0
    assert rms(scene, traced(scene, nine=False))[0] > 10.0


@pytest.mark.parametrize("rate", [2.0, 5.0])
def test_a_field_denies_a_rest_that_was_a_turn(rate):
    """From the first sample on: what half a second had taught is forgotten."""
    scene = outside.turntable(rate, 0, rest=0.0, still=True)
    assert rms(scene, traced(scene))[0] < 3.0


def test_a_magnet_brought_near_denies_no_rest():
    """It moves the field, but not as the gyro turns."""
    near = np.clip((np.arange(6000) - 300) / 200.0, 0.0, 1.0)[:, None] * [40.0, 30.0, -20.0]
    scene = outside.level(np.zeros(6000), 0, shaken=0.0, field=near)
    bias = traced(replace(scene, gyro=scene.gyro + 4.0 * DEG))["bias"]
    np.testing.assert_allclose(np.degrees(bias[-1]), [4.02, 3.98, 4.02], atol=0.05)


# A tilt that is wrong, and motion without any rest.


def test_a_knock_of_thirty_degrees_is_over_in_five_seconds():
    scene = outside.knocked(moved("hand", 40.0, seed=4), 2000)
    leaning = np.degrees(outside.parts(traced(scene)["quaternion"], scene.truth)[1])
    assert leaning[2000] > 25.0
    assert np.max(leaning[2500:]) < 5.0


@pytest.mark.parametrize("moving", [True, False])
def test_upside_down_is_no_place_to_stay(moving):
    scene = moved("hand", 40.0, seed=4) if moving else outside.level(np.zeros(4000), 0)
    scene = outside.knocked(scene, 2000, 179.9)
    leaning = np.degrees(outside.parts(traced(scene, nine=False)["quaternion"], scene.truth)[1])
    assert leaning[2000] > 170.0
    assert np.max(leaning[2600:]) < 8.0


@pytest.mark.parametrize("count", [3, pytest.param(6, marks=pytest.mark.slow)])
def test_a_vehicle_that_never_rests_goes_straight_on(count):
    """The mean, without a magnetometer; the bias alone would make 90 deg of it."""
    scenes = [
        moved("vehicle", 180.0, seed=seed, start="motion") for seed in range(200, 200 + count)
    ]
    assert np.mean([rms(one, traced(one, nine=False), 0)[0] for one in scenes]) < 35.0


# The heading that a magnetometer holds.


def test_a_bias_that_jumps_in_motion_gets_a_drift_of_the_headings_own():
    scene = outside.swerve(1.0, 0, seconds=300.0)
    trace = traced(scene)
    off = heading(scene, trace)
    assert np.sqrt(np.mean(off**2)) < 4.0
    assert np.mean(np.abs(off) < 3.0 * np.degrees(trace["heading_sigma"][scene.where])) > 0.95


def test_a_rest_after_the_jump_leaves_the_heading_that_a_drift_has_held():
    """It says the bias that the drift stood for; turned back for that it was 21 deg off."""
    scene = outside.swerve(1.0, 0, rest=(200.0, 220.0), seconds=400.0)
    assert rms(scene, traced(scene))[0] < 3.5


@pytest.mark.parametrize("count", [2, pytest.param(4, marks=pytest.mark.slow)])
def test_a_jump_is_found_while_other_cars_disturb_the_field(count):
    """The mean; by trusted fields alone it is 28 deg, of four."""
    scenes = [outside.drive(seed, cars=True, jump=1.0) for seed in range(count)]
    assert np.mean([rms(scene, traced(scene))[0] for scene in scenes]) < 18.0


def test_iron_is_no_drift():
    """Half of the earth's field, across a car: by a drift that it had not it was 107 deg off."""
    scene = outside.with_iron(outside.drive(0), [0.0, 24.0, 0.0])
    assert outside.rms(heading(scene, traced(scene))[15000:] * DEG) < 40.0


def test_iron_is_in_the_deviation_of_the_heading():
    """Of 15 uT, on a car: half of its errors were within three of the deviations without it."""
    scene = outside.with_iron(moved("vehicle", 120.0, seed=2), [10.0, -8.0, 7.5])
    trace = traced(scene)
    off = np.abs(heading(scene, trace))
    assert np.sqrt(np.mean(off**2)) > 10.0
    assert np.mean(off < 3.0 * np.degrees(trace["heading_sigma"][scene.where])) > 0.9


# Lost samples.


def test_a_gyro_that_is_silent_for_a_while_fades():
    """All sensors, three tenths of a second in ten; with the rate taken for zero it was 12 deg."""
    scene = outside.held(moved("hand", 90.0, seed=2), value=np.nan)
    trace = traced(scene, nine=False)
    off, leaning, where = outside.judged(scene, trace["quaternion"], 0)
    assert outside.rms(off) < 9.0
    assert outside.rms(leaning) < 2.0
    assert np.mean(leaning < 3.0 * trace["tilt_sigma"][where]) > 0.95


def test_power_on_forgets_all_rests():
    scene = outside.turntable(5.0, 0)
    used, fresh = (zr.Attitude(scene.rate) for _ in range(2))
    used.process(scene.gyro, scene.accel, scene.mag)
    used.power_on()
    again = [f.process(scene.gyro, scene.accel, scene.mag) for f in (used, fresh)]
    # The matrix is what a sensor keeps.
    apart = outside.parts(again[0], again[1])
    assert max(np.max(np.abs(part)) for part in apart) < 0.5 * DEG


# Offline.


@pytest.mark.every(3)
@pytest.mark.parametrize("kind", ["vehicle", "arm", "circle"])
def test_a_smoothed_heading_without_a_magnetometer_has_a_deviation_of_its_own(kind):
    """Of bias and matrix by the turns made: single kinds hold a third to all within one of them."""
    shares = []
    for seed in (200, 201, 202):
        scene = moved(kind, 60.0, seed=seed)
        smoothed = zr.Attitude(100.0, mag=False).smooth(scene.gyro, scene.accel)
        off, _, where = outside.judged(scene, smoothed["quaternion"], 0)
        sigma = smoothed["heading_sigma"]
        assert sigma[0] < 0.01 * np.max(sigma) + 0.1 * DEG, "it grows from the start"
        shares.append([np.mean(np.abs(off) < k * sigma[where]) for k in (1.0, 3.0)])
    one, three = np.mean(shares, axis=0)
    assert one > 0.3
    assert three > 0.95


def test_a_rest_in_the_middle_serves_the_whole_record():
    """A gyro of 4 deg/s that never rests at either end."""
    first, last = (moved("hand", 40.0, seed=seed, start="motion") for seed in (5, 6))
    still = outside.level(np.zeros(1000), 0, shaken=0.0)
    offset = np.radians([2.0, -2.0, 3.0])
    gyro = np.concatenate([first.gyro, still.gyro, last.gyro]) + offset
    accel = np.concatenate([first.accel, still.accel, last.accel])
    smoothed = zr.Attitude(100.0, mag=False).smooth(gyro, accel)
    apart = np.degrees(smoothed["bias"] - offset)
    # The simulated bias of either hand is of 0.5 deg/s an axis.
    assert np.max(np.abs(apart[:4000].mean(axis=0))) < 1.5
    assert np.max(np.abs(apart[4500])) < 0.1


# What must hold whatever is cured.


def begun(rate, bias=(2.0, -2.0, 4.0), **more):
    """A hand that rests for five seconds, with a gyro of nearly 5 deg/s."""
    motion = zr.simulate_motion("hand", rate, 15.0, seed=4, **more)
    where = np.arange(len(motion.gyro)) >= 6.0 * rate
    gyro = motion.gyro + np.asarray(bias) * DEG
    return outside.Scene(rate, gyro, motion.accel, motion.mag, motion.quaternion, where)


@pytest.mark.parametrize("times", [1, 10, 80])
def test_a_start_at_any_rate(times):
    """Half a second of rest is so many samples more: 100, 1000 and 8000 a second."""
    scene = begun(100.0)
    rng = np.random.default_rng(1)
    # The mean rates of the samples, each in so many parts.
    gyro, accel = (np.repeat(z, times, axis=0) for z in (scene.gyro, scene.accel))
    if times > 1:
        gyro += 0.1 * DEG * np.sqrt(times) * rng.standard_normal(gyro.shape)
    filter_ = zr.Attitude(100.0 * times, mag=False)
    found = {"quaternion": filter_.process(gyro, accel)[times - 1 :: times]}
    off, leaning = rms(scene, found, 600)
    assert off < 2.5
    assert leaning < 1.0


def test_a_start_upside_down():
    scene = outside.level(np.zeros(1500), 0, shaken=0.0)
    turned = np.array([1.0, -1.0, -1.0])
    upside = replace(scene, gyro=(scene.gyro + 4.0 * DEG) * turned, accel=scene.accel * turned)
    trace = traced(upside, nine=False)
    x, y = trace["quaternion"][-1, 1:3]
    assert np.hypot(x, y) == pytest.approx(1.0, abs=1e-4), "half a turn about a level axis"
    np.testing.assert_allclose(np.degrees(trace["bias"][-1]) * turned, 4.0, atol=0.06)


def test_an_engine_that_idles():
    """After a quiet rest, and before anything else was known: the bias stays, and is found."""
    t = outside.times(60.0)[:, None]
    engine = np.sin(2.0 * np.pi * 24.0 * t + np.arange(3.0))
    for begins in (0.0, 20.0):
        on = t >= begins
        scene = outside.level(np.zeros(6000), 0, shaken=0.5 * engine * on)
        scene = replace(scene, gyro=scene.gyro + (2.0 + 0.5 * engine * on) * DEG)
        trace = traced(scene, nine=False)
        np.testing.assert_allclose(np.degrees(trace["bias"][-1]), 2.0, atol=0.06)
        assert np.max(np.abs(heading(scene, trace)[100:])) < 1.0


def test_a_person_who_stands_and_sways_is_no_bias():
    """By half a degree a second about all axes, after three seconds on a table."""
    t = outside.times(90.0)
    rng = np.random.default_rng(3)
    swayed = np.array([outside.smoothed(rng.standard_normal(9000), 1.0) for _ in range(3)])
    rates = (0.7 / swayed.std(axis=1)[:, None] * swayed).T * (t >= 3.0)[:, None]
    turned = Rotation.identity(9000)
    turns = Rotation.from_rotvec(rates * DEG / 100.0)
    for k in range(1, 9000):
        turned[k] = turned[k - 1] * turns[k]
    still = outside.level(np.zeros(9000), 0, shaken=0.0)
    up = turned.inv().apply([0.0, 0.0, outside.G])
    accel = still.accel - [0.0, 0.0, outside.G] + up
    gyro = still.gyro + rates * DEG
    scene = replace(still, gyro=gyro, accel=accel, truth=turned.as_quat(scalar_first=True))
    off, leaning = rms(scene, traced(scene, nine=False))
    assert off < 3.0
    assert leaning < 0.5


@pytest.mark.parametrize("sensor", ["gyro", "accel", "mag"])
def test_a_sensor_that_fails_for_a_second(sensor):
    """One axis of it in motion, and all of it at the first rest."""
    scene = begun(100.0)
    values = getattr(scene, sensor).copy()
    values[100:150] = np.nan
    values[900:1000, 1] = np.nan
    trace = traced(replace(scene, **{sensor: values}))
    assert np.isfinite(trace["quaternion"]).all()
    _, leaning = rms(scene, trace)
    _, alike = rms(scene, traced(scene))
    assert leaning < (12.0 if sensor == "gyro" else alike + 0.5)
    np.testing.assert_allclose(np.degrees(trace["bias"][-1]), [2.0, -2.0, 4.0], atol=1.5)
