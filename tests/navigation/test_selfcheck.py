"""What sensors and receiver say of each other: each mistake by its name."""

import re
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

import zerorate as zr
from support.recordings import RECORDINGS, needs_recordings
from support.vehicles import simulate_vehicle
from zerorate.navigation import check_navigation

FLIP = np.diag([1.0, -1.0, 1.0])
EXCHANGED = np.array([[0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])


@cache
def simulated(seed=0, seconds=400.0):
    drive = zr.simulate_drive(50.0, seconds, seed=seed)
    return drive.recording(), drive.fixes


@cache
def recorded():
    mounting = zr.io.read_mounting(RECORDINGS / "drive_imu_100hz.parquet")
    imu = zr.read_recording(RECORDINGS / "drive_imu_100hz.parquet")
    fixes = zr.read_fixes(RECORDINGS / "drive_gnss_4hz.parquet").shifted(mounting.time_offset)
    return zr.record.body_axes(imu, mounting.body_from_sensor), fixes


def sensors(imu, gyro=None, accel=None):
    """A recording with its samples times a matrix each."""
    changed = {
        name: replace(imu[name], data=imu[name].data @ np.asarray(matrix).T)
        for name, matrix in (("gyro", gyro), ("accel", accel))
        if matrix is not None
    }
    return replace(imu, logs={**imu.logs, **changed})


def both(imu, matrix):
    return sensors(imu, matrix, matrix)


def fixes_by(fixes, **matrices):
    return replace(fixes, **{name: getattr(fixes, name) @ m for name, m in matrices.items()})


def jumped(fixes):
    return replace(fixes, time=fixes.time + 3.0 * (np.arange(len(fixes)) >= len(fixes) // 2))


def frozen(imu, name):
    data = imu[name].data.copy()
    half = len(data) // 2
    data[half : half + round(10.0 * imu[name].rate)] = data[half]
    return replace(imu, logs={**imu.logs, name: replace(imu[name], data=data)})


ONE = np.eye(3)
BACK, RIGHT = np.diag([-1.0, -1.0, 1.0]), np.array([[0.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [0, 0, 1]])
RADIANS = np.diag(np.radians([1.0, 1.0, np.degrees(1.0)]))
MISTAKES = {
    "gyro in deg/s": (lambda i, f: (sensors(i, np.degrees(1.0) * ONE), f), "gyro", "in deg/s, not"),
    "gyro in rad/s": (lambda i, f: (sensors(i, np.radians(1.0) * ONE), f), "gyro", "in rad/s, not"),
    "gyro's sign": (lambda i, f: (sensors(i, -ONE), f), "gyro", "the wrong sign"),
    "force's sign": (lambda i, f: (sensors(i, accel=-ONE), f), "force", "the wrong sign"),
    "y mirrored": (lambda i, f: (both(i, FLIP), f), "axes", "left-handed"),
    "z mirrored": (lambda i, f: (both(i, np.diag([1.0, 1.0, -1.0])), f), "axes", "left-handed"),
    "backward": (lambda i, f: (both(i, BACK), f), "mount", "backward"),
    "y forward": (lambda i, f: (both(i, RIGHT), f), "mount", r"forward is (89|9.) deg .* left"),
    "km/h": (lambda i, f: (i, fixes_by(f, velocity=3.6 * ONE)), "velocity", "in km/h"),
    "knots": (lambda i, f: (i, fixes_by(f, velocity=ONE / 0.514444)), "velocity", "in knots"),
    "velocities exchanged": (
        lambda i, f: (i, fixes_by(f, velocity=EXCHANGED)),
        "velocity",
        "north and east are exchanged",
    ),
    "radians": (lambda i, f: (i, fixes_by(f, position=RADIANS)), "position", "in rad, not in deg"),
    "3 s": (lambda i, f: (i, f.shifted(3.0)), "clock", "another clock, [23].* s ahead"),
    "60 s": (lambda i, f: (i, f.shifted(60.0)), "clock", "another clock, (60|59).* s ahead"),
    "Unix time": (lambda i, f: (i, f.shifted(1.7e9)), "clock", "another clock"),
    # The clock of the recorded drive gains 0.08 s between the middles of its halves.
    "jump": (lambda i, f: (i, jumped(f)), "jump", r"jumps by (3.0|2.9) s"),
    "frozen gyro": (lambda i, f: (frozen(i, "gyro"), f), "frozen", "the gyro repeats its values"),
    "frozen force": (lambda i, f: (frozen(i, "accel"), f), "frozen", "meter repeats its values"),
}


@pytest.mark.parametrize("name", MISTAKES)
def test_a_mistake_is_named_alone(name):
    change, what, words = MISTAKES[name]
    (found,) = check_navigation(*change(*simulated())).findings
    assert (found.what, found.status) == (what, "mistake")
    assert re.search(words, found.text)


def test_mistakes_of_other_vehicles_are_named():
    """Robots, boats and walkers: 458 of 480 of 24 with the car, and no other mistake in any."""
    named, count = 0, 0
    receiver = {"fixes_rate": 5.0, "position_sigma": 0.02, "velocity_sigma": 0.05}
    for kind, seed in (("robot", 0), ("boat", 0), ("walker", 0)):
        drive = simulate_vehicle(kind, 400.0, seed=seed, **receiver)
        assert not check_navigation(drive.recording(), drive.fixes).mistakes
        for change, what, _ in MISTAKES.values():
            found = check_navigation(*change(drive.recording(), drive.fixes)).mistakes
            assert {one.what for one in found} <= {what}
            named, count = named + len(found), count + 1
    assert named >= 0.95 * count


@pytest.mark.every(3)
@needs_recordings
@pytest.mark.parametrize("name", MISTAKES)
def test_of_the_recorded_drive_too(name):
    change, what, words = MISTAKES[name]
    (found,) = check_navigation(*change(*recorded())).findings
    assert (found.what, found.status) == (what, "mistake")
    assert re.search(words, found.text)


def test_latitude_and_longitude_are_exchanged():
    imu, fixes = simulated()
    (found,) = check_navigation(imu, fixes_by(fixes, position=EXCHANGED)).mistakes
    assert (found.what, found.text) == ("position", "latitude and longitude are exchanged")


def test_a_vertical_velocity_that_is_up():
    """Where it is large enough to be seen, on hills; in a plain it is not told."""
    imu, fixes = simulated()
    hills = 4.0 * np.sin(fixes.time / 10.0)
    down = fixes.position + np.outer(40.0 * (1.0 - np.cos(fixes.time / 10.0)), [0.0, 0.0, 1.0])
    velocity = np.column_stack([fixes.velocity[:, :2], hills])
    wrong = replace(fixes, position=down, velocity=velocity)
    assert "up, not down" in str(check_navigation(imu, wrong))


@pytest.mark.every(2)
@pytest.mark.parametrize("seed", range(20, 26))
def test_nothing_is_found_where_all_is_well(seed):
    imu, fixes = simulated(seed, 150.0)
    found = check_navigation(imu, fixes)
    assert found.findings == ()
    assert abs(found.lag) < 0.3
    plain = replace(fixes, velocity=None, velocity_sigma=None)
    assert check_navigation(imu, plain).mistakes == ()


@needs_recordings
def test_nor_in_parts_of_the_recorded_drive():
    imu, fixes = recorded()
    for span in ((0.0, 600.0), (0.0, 270.0), (270.0, 600.0), (150.0, 350.0)):
        assert check_navigation(imu, fixes.between(*span)).findings == (), span


def test_fixes_of_another_recording_are_not_matched():
    imu, _ = simulated(0)
    # Two of thirty pairs are, by chance, where 150 s are short and the overlap is whole.
    for seed in (1, 2, 4, 5, 6):
        (found,) = check_navigation(imu, simulated(seed, 150.0)[1]).findings
        assert (found.what, found.status) == ("clock", "cannot tell")


def test_axes_are_found_with_their_error():
    from scipy.spatial.transform import Rotation

    off, told = [], []
    for seed in range(8):
        drive = zr.simulate_drive(50.0, 400.0, seed=seed)
        mount = Rotation.random(random_state=seed).as_matrix()
        imu = zr.record.body_axes(drive.recording(), mount)
        axes = check_navigation(imu, drive.fixes, mounted=False).axes
        assert axes.certain
        turn = Rotation.from_matrix(axes.body_from_sensor @ mount).as_rotvec(degrees=True)
        off.append(turn)
        told.append(np.degrees(axes.yaw_sigma))
    off = np.array(off)
    # Of 40 mounts 0.62 deg RMS, 1.27 at worst; tilt 0.13.
    assert np.sqrt((off[:, 2] ** 2).mean()) < 0.9
    assert np.abs(off[:, 2]).max() < 1.7
    assert np.hypot(off[:, 0], off[:, 1]).max() < 0.5
    assert 0.3 < np.mean(told) < 1.2


@needs_recordings
def test_axes_of_the_recorded_drive():
    mounting = zr.io.read_mounting(RECORDINGS / "drive_imu_100hz.parquet")
    imu = zr.read_recording(RECORDINGS / "drive_imu_100hz.parquet")
    fixes = zr.read_fixes(RECORDINGS / "drive_gnss_4hz.parquet")
    axes = check_navigation(imu, fixes, mounted=False).axes
    assert axes.certain
    turn = axes.body_from_sensor @ mounting.body_from_sensor.T
    angle = np.degrees(np.arccos(0.5 * (np.trace(turn) - 1.0)))
    # Yaw 0.6 and tilt 0.4 deg from what the metadata say.
    assert angle < 1.0
    assert np.degrees(axes.yaw_sigma) < 1.0
