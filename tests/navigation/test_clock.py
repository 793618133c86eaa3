"""The clock of a receiver, found from a record."""

from dataclasses import replace

import numpy as np
import pytest

import zerorate as zr
from support.recordings import RECORDINGS, needs_recordings
from zerorate.navigation import find_start, find_time_offset
from zerorate.record import TimeOffset


def driven(seed, seconds=200.0, **options):
    return zr.simulate_drive(50.0, seconds, seed=seed, **options)


def found_of(drive, fixes, about=0.0):
    start = find_start(drive.recording(), fixes, time_offset=about)
    return find_time_offset(drive.recording(), fixes, start, time_offset=about)


@pytest.mark.parametrize(("seed", "late"), [(1, 0.05), (3, 0.3)])
def test_an_offset_is_found_with_its_error(seed, late):
    drive = driven(seed)
    found = found_of(drive, drive.fixes.shifted(late))
    assert found.identifiable
    assert found.velocity_sigma < 0.02
    assert abs(found.velocity_seconds + late) < 3.5 * found.velocity_sigma
    assert abs(found.seconds + late) < 3.5 * found.sigma < 0.25


def test_two_offsets_and_a_rate():
    """Within four deviations of 40 blocks; of 40 drives two thirds are within one."""
    off = []
    for seed, rate in ((0, 3e-4), (2, -4e-4)):
        drive = driven(seed, 400.0)
        time, middle = drive.fixes.time, float(drive.fixes.time.mean())
        apart = (-0.2, 0.15)
        own = [(time - offset + rate * middle) / (1.0 + rate) for offset in apart]
        fixes = replace(drive.fixes, time=own[0], velocity_time=own[1])
        found = found_of(drive, fixes)
        drift = rate * (found.middle - middle)
        off.append((found.seconds - apart[0] - drift) / found.sigma)
        off.append((found.velocity_seconds - apart[1] - drift) / found.velocity_sigma)
        # The slowness of walks: two of three are told.
        assert abs(found.rate - rate) < 4.0 * found.rate_sigma
        assert found.nis == pytest.approx(1.0, abs=0.2)
        assert abs(found.velocity_seconds - apart[1] - drift) < 0.02
        assert abs(found.seconds - apart[0] - drift) < 0.06
    assert np.abs(off).max() < 4.0


def normalised_errors(seed, seconds, clocks=None, spoilt=lambda fixes: fixes, **options):
    """Return those of both offsets of a drive whose positions and velocities lie on own clocks."""
    drawn = np.random.default_rng(seed).uniform(-0.3, 0.3, 2)
    position, velocity = drawn if clocks is None else clocks
    true = TimeOffset(position, 0.0, velocity, 0.0)
    drive = driven(seed, seconds, time_offset=true, **options)
    found = found_of(drive, spoilt(drive.fixes))
    return (
        (found.seconds - position) / found.sigma,
        (found.velocity_seconds - velocity) / found.velocity_sigma,
    )


@pytest.mark.parametrize("seed", [100, 151, 159])
def test_positions_are_not_taken_for_as_late_as_velocities(seed):
    """Where both seem to be of one time, which of them comes first is no slope."""
    assert np.abs(normalised_errors(seed, 200.0)).max() < 3.0


@pytest.mark.parametrize("clocks", [(-0.2594, 0.2052), (-0.22, 0.26), (0.25, -0.25)])
def test_nor_for_those_of_the_fix_before(clocks):
    """Two fixes a second are used, of which clocks half a second apart bring two together."""
    errors = normalised_errors(303, 200.0, clocks, fixes_rate=10.0)
    assert np.abs(errors).max() < 3.0


def wrong_positions(fixes):
    """One in twenty some 30 m off, one of the first among them."""
    random = np.random.default_rng(1)
    position, wrong = fixes.position.copy(), random.random(len(fixes)) < 0.05
    wrong[34] = True
    position[wrong, :2] += random.standard_normal((wrong.sum(), 2)) * 3e-4
    return replace(fixes, position=position)


def wrong_velocities(fixes):
    """One in twenty some 3 m/s off."""
    random = np.random.default_rng(1)
    velocity, wrong = fixes.velocity.copy(), random.random(len(fixes)) < 0.05
    velocity[wrong] += random.standard_normal((wrong.sum(), 3)) * 3.0
    return replace(fixes, velocity=velocity)


@pytest.mark.parametrize(
    ("seed", "spoilt"),
    [
        (408, wrong_positions),
        (436, wrong_positions),
        (309, wrong_velocities),
        (428, wrong_velocities),
    ],
)
def test_wrong_fixes_are_left_out(seed, spoilt):
    errors = np.array(normalised_errors(seed, 200.0, spoilt=spoilt))
    assert np.isfinite(errors).all()
    assert np.abs(errors).max() < 3.0


@pytest.mark.slow
@pytest.mark.parametrize("seconds", [100.0, 150.0, 200.0])
def test_deviations_of_short_drives_cover(seconds):
    errors = np.array([normalised_errors(seed, seconds) for seed in range(200, 240)])
    # An offset that is not told is NaN over infinity.
    told = errors[np.isfinite(errors[:, 0])]
    assert len(told) > 30
    assert (np.sqrt((told**2).mean(axis=0)) < 1.3).all()
    assert (np.mean(np.abs(told) < 1.0, axis=0) > 0.55).all()


@pytest.mark.parametrize("seed", [0, 1, 4, 9])
def test_the_clocks_of_a_fine_receiver_are_told(seed):
    """Beside centimetres a tenth of a second is far: no start may hang on it."""
    true = TimeOffset(0.25, 0.0, -0.2, 0.0, 3e-4, 0.0, 100.0)
    fine = {"position_sigma": 0.02, "velocity_sigma": 0.05, "fixes_rate": 4.0}
    drive = driven(seed, time_offset=true, **fine)
    found = found_of(drive, drive.fixes)
    drift = true.rate * (found.middle - true.middle)
    assert abs(found.seconds - true.seconds - drift) < 0.01
    assert abs(found.velocity_seconds - true.velocity_seconds - drift) < 0.015


def test_each_at_its_own_time_is_as_good_as_together():
    drive = driven(1)
    start = find_start(drive.recording(), drive.fixes)
    late = replace(drive.fixes, velocity_time=drive.fixes.time + 0.2)
    apart = TimeOffset(0.0, 0.01, -0.2, 0.01)
    tracks = [
        zr.NavigationFilter(start).process(drive.recording(), fixes, time_offset=offset)
        for fixes, offset in ((drive.fixes, 0.0), (late, 0.0), (late, TimeOffset(0.0, 0.01)))
    ]
    told, wrong, same = tracks
    assert told.fix_count == wrong.fix_count
    np.testing.assert_array_equal(wrong.position, same.position)
    back = zr.NavigationFilter(start).process(
        drive.recording(), replace(drive.fixes), time_offset=TimeOffset(0.0, 0.01, 0.0, 0.01)
    )
    # A position and a velocity of one moment, one after the other.
    np.testing.assert_allclose(back.position[-1], told.position[-1], rtol=0, atol=5e-3)
    moved = apart.applied(replace(drive.fixes, velocity_time=None))
    np.testing.assert_array_equal(moved.velocity_time, drive.fixes.time - 0.2)
    np.testing.assert_array_equal(moved.between(50.0).velocity_time[:3], moved.velocity_time[50:53])
    assert np.nanmean(wrong.nis()[:, 1]) > 1.2 * np.nanmean(told.nis()[:, 1])
    assert len(wrong.fixes) == len(drive.fixes)


def test_outliers_do_not_matter_much():
    drive = driven(2)
    velocity = drive.fixes.velocity.copy()
    velocity[40::46] += 1.0
    fixes = replace(drive.fixes.shifted(0.1), velocity=velocity)
    found = found_of(drive, fixes)
    assert abs(found.velocity_seconds + 0.1) < 0.04


def test_what_does_not_fit_at_all_is_not_told():
    """A receiver that understates its deviation fivefold: innovations are not of the clock."""
    drive = driven(2)
    n = len(drive.fixes)
    told = {"position_sigma": np.full((n, 3), 0.2), "velocity_sigma": np.full((n, 3), 0.02)}
    found = found_of(drive, replace(drive.fixes, **told))
    assert not found.identifiable
    assert found.nis > 4.0


def test_a_vehicle_that_stands_tells_nothing():
    drive = zr.simulate_drive(50.0, 100.0, kind="rest")
    start = zr.align(drive.recording(), latitude=48.0, heading=0.0)
    found = find_time_offset(drive.recording(), drive.fixes, start)
    assert not found.identifiable
    assert np.isnan(found.seconds)
    assert "not identifiable" in str(found)


def test_wrong_input_is_refused():
    drive = driven(0)
    start = find_start(drive.recording(), drive.fixes)
    with pytest.raises(ValueError, match="adapt is not used here"):
        find_time_offset(drive.recording(), drive.fixes, start, adapt="free")
    with pytest.raises(ValueError, match="no fix can be used to find an offset"):
        find_time_offset(drive.recording(), drive.fixes.shifted(1e4), start)
    with pytest.raises(TypeError, match="gnss must be Fixes"):
        find_time_offset(drive.recording(), [1], start)
    with pytest.raises(ValueError, match="time_offset must be a number of seconds, got nan"):
        find_start(drive.recording(), drive.fixes, time_offset=float("nan"))


@needs_recordings
def test_the_clocks_of_the_recorded_drive():
    mounting = zr.io.read_mounting(RECORDINGS / "drive_imu_100hz.parquet")
    imu = zr.read_recording(RECORDINGS / "drive_imu_100hz.parquet")
    imu = zr.record.body_axes(imu, mounting.body_from_sensor)
    fixes = zr.read_fixes(RECORDINGS / "drive_gnss_4hz.parquet")
    lever = {"antenna": mounting.antenna}
    start = find_start(imu, fixes, **lever)
    found = find_time_offset(imu, fixes, start, **lever)
    # To a tenth of what a prototype found: 0.202 and 0.074 s, 2.8e-4.
    assert found.seconds == pytest.approx(0.202, abs=0.01)
    assert found.velocity_seconds == pytest.approx(0.074, abs=0.0075)
    assert found.rate == pytest.approx(2.8e-4, rel=0.1)
    start = find_start(imu, fixes, time_offset=found, **lever)
    nav = zr.NavigationFilter(start, **lever)
    track = nav.copy().process(imu, fixes, time_offset=found, keep="track")
    # Of 9.7 and 9.6 with the offset of the metadata.
    assert (np.nanmean(track.nis(), axis=0) < (1.8, 2.5)).all()
    outages = zr.navigation.outages(imu, fixes, seconds=10.0, nav=nav, time_offset=found)
    assert outages[10.0].rms() < 3.0
