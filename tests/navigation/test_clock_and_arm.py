"""The clock and the antenna of a receiver found together, with velocities and without."""

from functools import cache

import numpy as np
import pytest

import zerorate as zr
from support.recordings import RECORDINGS, needs_recordings
from support.vehicles import simulate_vehicle
from zerorate.checks.spikes import find_spikes
from zerorate.navigation import check_navigation, find_start, find_time_offset
from zerorate.navigation.clock_equations import ClockEquations, Slopes, Weights

FINE = {"position_sigma": 0.01, "velocity_sigma": 0.03, "fixes_rate": 5.0}
COARSE = {"position_sigma": 2.0, "velocity_sigma": 0.1, "fixes_rate": 1.0}
ARM = (-1.2, -0.4, -1.5)


@cache
def driven(seed, seconds=200.0, arm=ARM, offset=0.0, fine=True):
    receiver = FINE if fine else COARSE
    return zr.simulate_drive(50.0, seconds, seed=seed, antenna=arm, time_offset=offset, **receiver)


OFF_ARM = (-1.0, -0.4, -1.5)


def positions_alone(fixes, position=None):
    place = fixes.position if position is None else position
    return zr.Fixes(fixes.time, place, position_sigma=fixes.position_sigma)


def clock_of(drive, fixes, about=0.0):
    imu = drive.recording()
    start = find_start(imu, fixes, time_offset=about, antenna_sigma=1.0)
    return find_time_offset(imu, fixes, start, time_offset=about)


def assert_arm(found, arm):
    off = (np.array(found.antenna) - arm) / found.antenna_sigma
    assert np.abs(off).max() < 3.0
    assert found.antenna_sigma[0] < 0.7


@pytest.mark.parametrize(("seed", "arm"), [(6, ARM), (8, (1.0, 0.0, -1.0)), (6, (0.0, 0.0, 0.0))])
def test_an_antenna_is_no_clock(seed, arm):
    drive = driven(seed, arm=arm)
    found = clock_of(drive, drive.fixes)
    assert abs(found.seconds) < 3.0 * found.sigma < 0.03
    assert abs(found.velocity_seconds) < 3.0 * found.velocity_sigma < 0.03
    assert_arm(found, arm)


@pytest.mark.parametrize("fine", [True, False])
@pytest.mark.parametrize("offset", [0.3, -0.4])
def test_positions_alone_tell_a_clock(fine, offset):
    drive = driven(3, 300.0, offset=offset, fine=fine)
    found = clock_of(drive, positions_alone(drive.fixes))
    assert abs(found.seconds - offset) < 3.0 * found.sigma < 0.3
    assert np.isnan(found.velocity_seconds)
    assert_arm(found, ARM)


def test_the_track_of_an_untold_antenna():
    squares = []
    for seed, arm in ((6, ARM), (9, (-1.2, 0.6, -1.0)), (11, (0.5, -0.8, -0.7))):
        drive = driven(seed, 300.0, arm)
        told, untold = (
            zr.navigate(drive.recording(), drive.fixes, antenna=place).track
            for place in (arm, None)
        )
        late = told.time > 80.0
        off = [track.errors(drive.truth_position)[late] for track in (told, untold)]
        height = off[1][:, 2] / untold.sigma[late, 2]
        squares.append([*((one[:, :2] ** 2).sum(axis=1).mean() for one in off), (height**2).mean()])
        assert any(note.startswith("the antenna is ") for note in untold.notes)
    told, untold, height = np.sqrt(np.mean(squares, axis=0))
    assert untold < 1.2 * told < 0.03
    assert 0.5 < height < 1.5


@pytest.mark.parametrize(("seed", "leap"), [(0, 18.0), (1, -18.0), (2, 37.0)])
def test_leap_seconds_are_named(seed, leap):
    drive = driven(seed, 300.0, fine=False)
    fixes = positions_alone(drive.fixes).shifted(leap)
    (found,) = check_navigation(drive.recording(), fixes).mistakes
    assert found.what == "clock"
    assert abs(found.value + leap) < 0.5
    assert f"leap seconds, {abs(leap):g} s" in found.text
    track = zr.navigate(drive.recording(), fixes).track
    off = track.errors(drive.truth_position)[track.time > 100.0, :2]
    assert np.sqrt((off**2).sum(axis=1).mean()) < 4.0


def test_fixes_of_another_vehicle_tell_no_clock():
    for seed in (0, 1, 2):
        imu, other = driven(seed, 200.0).recording(), driven(seed + 10, 200.0)
        checks = check_navigation(imu, positions_alone(other.fixes))
        assert not checks.mistakes
        (doubt,) = (one for one in checks.findings if one.what == "clock")
        assert "rotate differently" in doubt.text


def test_a_straight_road_turns_too_little():
    drive = zr.simulate_drive(50.0, 60.0, seed=0, rest=50.0, **FINE)
    checks = check_navigation(drive.recording(), positions_alone(drive.fixes))
    (doubt,) = (one for one in checks.findings if one.what == "clock")
    assert "hardly changes" in doubt.text or "too few" in doubt.text


def jumped(fixes, by, alone):
    """Return fixes whose clock jumps half way."""
    late = np.arange(len(fixes)) >= len(fixes) // 2
    there = np.ones(len(fixes), dtype=bool)
    if by < 0.0:
        # Its stamps would step back.
        since = fixes.time - fixes.time[len(fixes) // 2]
        there = (since < 0.0) | (since > 0.5 - by)
    time = (fixes.time + by * late)[there]
    own = fixes.chosen(there)
    velocity = None if alone else own.velocity
    return zr.Fixes(time, own.position, velocity=velocity, position_sigma=own.position_sigma)


@pytest.mark.parametrize("alone", [False, True])
@pytest.mark.parametrize("kind", ["car", "robot", "boat", "walker"])
@pytest.mark.parametrize(("seed", "by"), [(0, 3.0), (1, 3.0), (6, -3.0)])
def test_a_jump_of_the_clock_is_no_other_clock(seed, by, alone, kind):
    receiver = COARSE if kind in ("car", "boat") else FINE
    drive = simulate_vehicle(kind, 400.0, seed=seed, **receiver)
    fixes = jumped(drive.fixes, by, alone)
    (found,) = check_navigation(drive.recording(), fixes).mistakes
    assert found.what == "jump"
    assert found.value == pytest.approx(-by, abs=0.8)


@pytest.mark.parametrize("duration", [120.0, 150.0])
@pytest.mark.parametrize("kind", ["car", "robot"])
def test_a_jump_in_a_short_record_is_no_other_clock(kind, duration):
    """Positions alone: the longest lines that one lag fits hide it; what is said is not wrong."""
    said = {"jump": [], "other clock": []}
    for seed in range(6):
        receiver = COARSE if kind == "car" else FINE
        drive = simulate_vehicle(kind, duration, seed=seed, **receiver)
        for case, fixes in (
            ("jump", jumped(drive.fixes, 3.0, alone=True)),
            ("other clock", positions_alone(drive.fixes.shifted(3.0))),
        ):
            found = check_navigation(drive.recording(), fixes).mistakes
            said[case] += [one.what for one in found if one.what in ("clock", "jump")]
    assert said["jump"].count("jump") >= 4
    assert said["jump"].count("clock") <= 1
    assert "jump" not in said["other clock"]
    assert said["other clock"].count("clock") >= 4


def test_a_start_in_motion_that_loses_to_a_velocity_held_is_said():
    noise = {
        "gyro": zr.NoiseModel(angle_random_walk=3e-2),
        "accel": zr.NoiseModel(angle_random_walk=1.0, quantity="acceleration"),
    }
    bad = zr.simulate_drive(50.0, 300.0, seed=3, rest=0.0, **noise)
    good = zr.simulate_drive(50.0, 300.0, seed=3, rest=0.0)
    said = [
        any("without fixes for 10 s the filter is off" in note for note in found.notes)
        for found in (zr.navigate(drive.recording(), drive.fixes) for drive in (bad, good))
    ]
    assert said == [True, False]


def spoilt(fixes, seed=1):
    random = np.random.default_rng(seed)
    position, wrong = fixes.position.copy(), random.random(len(fixes)) < 0.05
    position[wrong, :2] += random.standard_normal((wrong.sum(), 2)) * 3e-4
    return positions_alone(fixes, position), wrong


@pytest.mark.parametrize("fine", [True, False])
def test_wrong_positions_alone_do_not_lose_the_filter(fine):
    drive = driven(4, 300.0, fine=fine)
    errors = []
    for fixes in (positions_alone(drive.fixes), spoilt(drive.fixes)[0]):
        found = zr.navigate(drive.recording(), fixes, antenna=ARM, time_offset=0.0)
        off = found.track.errors(drive.truth_position)[found.track.time > 80.0, :2]
        errors.append(np.sqrt((off**2).sum(axis=1).mean()))
    assert errors[1] < 1.5 * errors[0]
    assert any("far off the line" in note for note in found.notes)


@pytest.mark.parametrize("fine", [True, False])
def test_spikes_are_those_that_were_wrong(fine):
    drive = driven(4, 300.0, fine=fine)
    clean, _ = find_spikes(positions_alone(drive.fixes))
    fixes, wrong = spoilt(drive.fixes)
    found, _ = find_spikes(fixes)
    assert clean.mean() < 0.01
    far = np.abs(fixes.position - drive.fixes.position)[:, 0] > 2e-4
    assert found[far & wrong][1:-1].mean() > 0.95
    assert (found & ~wrong).mean() < 0.02


def considered(drive, sigma, **options):
    """Return the track of a filter that considers an antenna 0.2 m forward of the true one."""
    start = find_start(drive.recording(), drive.fixes, antenna=OFF_ARM)
    nav = zr.NavigationFilter(start, antenna=OFF_ARM, antenna_sigma=sigma, **options)
    return nav, nav.process(drive.recording(), drive.fixes)


def test_a_considered_antenna_stays_and_its_deviation_counts():
    drive = driven(6)
    nav, track = considered(drive, (0.2, 0.02, 0.05), consider_antenna=True)
    known, _ = considered(drive, 0.0)
    np.testing.assert_array_equal(nav.antenna, OFF_ARM)
    np.testing.assert_allclose(nav.antenna_sigma, (0.2, 0.02, 0.05), rtol=1e-9)
    settled = track.time > 80.0
    off = track.errors(drive.truth_position)[settled, :2] / track.sigma[settled, :2]
    assert 0.5 < np.sqrt((off**2).mean()) < 1.3
    assert (nav.sigma[:3] > known.sigma[:3]).all()
    best = track.smooth()
    off = best.errors(drive.truth_position)[settled, :2] / best.sigma[settled, :2]
    assert 0.5 < np.sqrt((off**2).mean()) < 1.3


def test_a_considered_antenna_of_no_deviation_changes_nothing():
    drive = driven(6)
    (_, one), (_, other) = (considered(drive, 0.0, consider_antenna=x) for x in (False, True))
    np.testing.assert_array_equal(one.position, other.position)
    np.testing.assert_array_equal(one.sigma, other.sigma)


def test_heading_of_slow_robots_whose_antenna_is_not_told():
    receiver = {"position_sigma": 0.02, "velocity_sigma": 0.05, "fixes_rate": 5.0}
    ratios = []
    for seed in range(5):
        drive = simulate_vehicle(
            "robot", 300.0, seed=seed, speed=0.4, antenna=(0.2, -0.1, -0.3), **receiver
        )
        track = zr.navigate(drive.recording(), drive.fixes).track
        truth = drive.truth_position, drive.truth_velocity, drive.truth_quaternion
        off = track.errors(*truth)[track.time > 80.0, 8] / track.sigma[track.time > 80.0, 8]
        ratios.append(np.sqrt((off**2).mean()))
    assert 0.7 < np.sqrt(np.mean(np.square(ratios))) < 1.3


def equations(seed, noise, free=(0, 1, 2)):
    """Return those of innovations that change with three numbers, the third not at all."""
    random = np.random.default_rng(seed)
    slopes = np.zeros((200, 6, 3))
    slopes[..., :2] = random.normal(size=(200, 6, 2))
    step = np.array([0.5, -0.3, 0.0])
    scalars = slopes @ step + 1e-3 * random.normal(size=(200, 6))
    own = [slopes + noise * random.normal(size=slopes.shape) for _ in range(2)]
    weights = Weights.of(scalars, np.arange(200.0))
    return ClockEquations.of(weights, Slopes(*own), np.array(free), np.ones(6), np.zeros(3))


def test_what_is_not_seen_is_known_as_before():
    found = equations(0, 0.0)
    np.testing.assert_allclose(found.solve()[:2], [0.5, -0.3], atol=5e-3)
    sigma = found.sigmas()
    assert sigma[2] == pytest.approx(1.0)
    assert sigma[:2].max() < 0.05


def test_noise_of_slopes_does_not_feign_knowledge():
    """Slopes of noise alone: the mean's square is large, forward times backward is not."""
    found = equations(1, 0.3)
    assert found.normal[2, 2] > 30.0
    assert found.sigmas()[2] > 0.5
    exact = equations(1, 0.0).solve()
    np.testing.assert_allclose(found.remaining()[:2], exact[:2], rtol=0.1)


@needs_recordings
def test_the_drive_with_velocities_and_without():
    imu = zr.read_recording(RECORDINGS / "drive_imu_100hz.parquet")
    fixes = zr.read_fixes(RECORDINGS / "drive_gnss_4hz.parquet")
    begun = zr.navigation.find_beginning(imu, fixes, time_offset=0.125, noise="stated")
    one, other = (
        find_time_offset(begun.recording, some, begun.start, time_offset=0.125)
        for some in (fixes, positions_alone(fixes))
    )
    assert one.seconds == pytest.approx(0.202, abs=0.005)
    assert abs(one.seconds - other.seconds) < 0.01
    assert np.abs(np.array(one.antenna) - (0.0, -0.05, 0.0)).max() < 0.1
