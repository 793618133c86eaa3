"""A start from what there is: rest or motion, with or without velocities, on any clock."""

from dataclasses import replace

import numpy as np
import pytest

import zerorate as zr
from support.recordings import RECORDINGS, needs_recordings
from support.vehicles import simulate_vehicle
from zerorate.geometry.rotations import inverse, product, to_rotation_vectors
from zerorate.navigation.heading import heading_of


@pytest.fixture(scope="module")
def drive():
    return zr.simulate_drive(50.0, 180.0, seed=3)


def degrees_off(track, drive, at, turned=0.0):
    """Error of the heading at a time, of a body whose axes are turned."""
    k = np.searchsorted(track.time, at)
    off = heading_of(track.quaternion[k]) - heading_of(drive.truth_quaternion[k]) + turned
    return abs(np.degrees(np.remainder(off + np.pi, 2 * np.pi) - np.pi))


def cut(fixes, start):
    return fixes.between(start)


def without_velocities(fixes):
    return replace(fixes, velocity=None, velocity_sigma=None)


def cruise(rate):
    """Recording and fixes of 40 s at 10 m/s that turn as steadily."""
    time, at = np.arange(0.0, 40.0, 0.02), np.arange(0.0, 40.0)
    imu = {
        "time_s": time,
        "gyro_radps": np.tile([0.0, 0.0, rate], (time.size, 1)),
        "accel_mps2": np.tile([0.0, 10.0 * rate, -9.81], (time.size, 1)),
    }
    course = rate * at
    velocity = 10.0 * np.column_stack([np.cos(course), np.sin(course), 0.0 * at])
    place = np.cumsum(velocity, axis=0)
    position = np.column_stack([48 + place[:, 0] / 111e3, 11 + place[:, 1] / 74e3, 0.0 * at])
    return zr.read_recording(imu), zr.Fixes(at, position, velocity)


def decided(start):
    return float(start.notes[-1].split(" at ")[1].split(" s")[0])


CASES = {
    "at rest": (0.0, {}),
    "in motion": (72.0, {}),
    "without velocities": (0.0, {"change": without_velocities}),
    "axes turned": (72.0, {"turned": 2.0}),
    "backward": (72.0, {"turned": np.pi}),
}


@pytest.mark.parametrize("name", CASES)
def test_the_motion_tells_the_heading(drive, name):
    first, case = CASES[name]
    turned = case.get("turned", 0.0)
    c, s = np.cos(turned), np.sin(turned)
    imu = zr.record.body_axes(drive.recording(), [[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    fixes = case.get("change", lambda x: x)(cut(drive.fixes, first))
    start = zr.navigation.find_start(imu, fixes)
    assert start.heading_known
    assert start.time >= first
    track = zr.NavigationFilter(start).process(imu, fixes)
    # Of 60 starts the worst is off by 12.8 deg when it is decided, by 2.5 deg a minute later.
    assert degrees_off(track, drive, decided(start) + 0.1, turned) < 15.0
    assert degrees_off(track, drive, decided(start) + 60.0, turned) < 5.0
    rests = first == 0.0
    assert (start.gyro_bias_sigma < np.radians(0.2)) == rests
    assert ("rest from" in start.notes[0]) == rests


@pytest.mark.parametrize("seed", [0, 1, 4])
def test_clocks_that_are_off_turn_no_heading(seed):
    """Positions and velocities a quarter of a second apart: of a fine receiver many deviations."""
    clocks = zr.record.TimeOffset(0.25, 0.0, -0.2, 0.0)
    fine = {"position_sigma": 0.02, "velocity_sigma": 0.05, "fixes_rate": 4.0}
    drive = zr.simulate_drive(50.0, 60.0, seed=seed, time_offset=clocks, **fine)
    start = zr.navigation.find_start(drive.recording(), drive.fixes)
    true = heading_of(drive.truth_quaternion[np.searchsorted(drive.time, start.time)])
    begun = heading_of(start.quaternion)
    assert abs(np.angle(np.exp(1j * (begun - true)))) < 2.0 * start.heading_sigma


def test_a_rest_is_one_of_the_receiver_too(drive):
    """Three seconds suffice; a cruise that the sensors cannot tell from a rest is none."""
    short = zr.navigation.find_start(drive.recording(), cut(drive.fixes, 26.0))
    assert "rest from" in short.notes[0]
    np.testing.assert_allclose(short.gyro_bias, drive.gyro_bias[0], atol=np.radians(0.1))
    start = zr.navigation.find_start(*cruise(0.02), heading="course")
    assert "no rest of 3 s" in start.notes[0]
    assert start.gyro_bias_sigma > np.radians(0.4)


def test_a_heading_may_be_given(drive):
    yaw = float(heading_of(drive.truth_quaternion[0]))
    start = zr.navigation.find_start(drive.recording(), drive.fixes, heading=yaw)
    assert abs(heading_of(start.quaternion) - yaw) < 1e-6
    in_motion = zr.navigation.find_start(drive.recording(), cut(drive.fixes, 72.0), heading=yaw)
    assert in_motion.time == 72.0
    assert abs(heading_of(in_motion.quaternion) - yaw) < 1e-6


def test_what_is_missing_is_said(drive):
    still = zr.simulate_drive(50.0, 40.0, kind="rest")
    with pytest.raises(
        zr.LogError, match=r"from 0.0 to 39.0 s the fixes show no motion .*heading="
    ):
        zr.navigation.find_start(still.recording(), still.fixes)
    with pytest.raises(
        zr.LogError, match=r"which suggests different clocks: time_offset= moves these"
    ):
        zr.navigation.find_start(drive.recording(), drive.fixes.shifted(1e5))
    in_g = {
        "time_s": drive.time,
        "gyro_radps": drive.gyro,
        "accel_mps2": drive.accel / 9.81,
    }
    with pytest.raises(zr.LogError, match=r"mean force from 27.0 to .* is 1 m/s\^2, expected"):
        zr.navigation.find_start(zr.read_recording(in_g), drive.fixes)
    with pytest.raises(
        zr.LogError, match=r"no heading fits the fixes clearly best: .* does not accelerate"
    ):
        zr.navigation.find_start(*cruise(0.0))


@needs_recordings
@pytest.mark.parametrize(("first", "bound"), [(0.0, 3.9), (100.0, 4.4), (230.0, 4.2)])
def test_the_recorded_drive_starts_anywhere(first, bound):
    """Outages of 10 s, m rms, beside 3.3, 4.1 and 3.9; without velocities told nothing changes."""
    mounting = zr.io.read_mounting(RECORDINGS / "drive_imu_100hz.parquet")
    imu = zr.read_recording(RECORDINGS / "drive_imu_100hz.parquet")
    imu = zr.record.body_axes(imu, mounting.body_from_sensor)
    fixes = zr.read_fixes(RECORDINGS / "drive_gnss_4hz.parquet").between(first - 0.125)
    known = {"antenna": mounting.antenna, "time_offset": mounting.time_offset}
    found = zr.navigation.outages(imu, fixes, seconds=10.0, **known)
    assert found[10.0].rms() < bound


@pytest.mark.parametrize(("kind", "seed"), [("drone", 0), ("drone", 4), ("boat", 2), ("robot", 1)])
def test_a_start_in_motion_is_as_good_as_the_true_one(kind, seed):
    """Of vehicles that never rest: with 27 deg of heading to find, drones lost twice the metres."""
    drive = simulate_vehicle(kind, 300.0, seed=seed, rest=0.0)
    imu, fixes = drive.recording(), drive.fixes
    begun = zr.navigation.find_beginning(imu, fixes)
    found, at = begun.start, np.searchsorted(drive.time, begun.start.time)
    truth = drive.truth_quaternion[at]
    off = to_rotation_vectors(product(truth, inverse(np.asarray(found.quaternion))))[2]
    assert abs(off) < 3.0 * found.heading_sigma
    true = replace(
        found,
        quaternion=truth,
        gyro_bias=drive.gyro_bias[at],
        level_sigma=0.005,
        heading_sigma=0.02,
        gyro_bias_sigma=1e-4,
        accel_bias_sigma=0.03,
    )
    rms = [
        zr.navigation.outages(
            imu,
            fixes,
            seconds=10.0,
            nav=replace(begun, start=start).filter(),
            time_offset=begun.time_offset,
        )[10.0].rms()
        for start in (found, true)
    ]
    assert rms[0] < 1.3 * rms[1]


def test_headings_of_starts_in_motion_lie_within_three_sigma_but_one():
    """Of 14 vehicles that never rest: one drone's heading is 8.4 deg off at a σ of 1.3 deg."""
    errors = {}
    for kind, count in (("drone", 6), ("boat", 4), ("car", 2), ("robot", 2)):
        for seed in range(count):
            drive = simulate_vehicle(kind, 300.0, seed=seed, rest=0.0)
            start = zr.navigation.find_beginning(drive.recording(), drive.fixes).start
            truth = drive.truth_quaternion[np.searchsorted(drive.time, start.time)]
            off = to_rotation_vectors(product(truth, inverse(np.asarray(start.quaternion))))[2]
            errors[kind, seed] = abs(off) / start.heading_sigma
    beyond = [vehicle for vehicle, error in errors.items() if error > 3.0]
    assert len(beyond) <= 1, errors
    assert max(errors.values()) < 7.0, errors
