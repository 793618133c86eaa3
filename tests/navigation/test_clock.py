"""The clock of a receiver, found from a record."""

import numpy as np
import pytest

import zerorate as zr


def driven(seed, **options):
    drive = zr.simulate_drive(50.0, 200.0, seed=seed, **options)
    return drive, zr.align(drive.recording(), latitude=48.0, heading="course", span=(0.0, 29.0))


@pytest.mark.parametrize(("seed", "late"), [(0, 0.0), (1, 0.05), (2, -0.1), (3, 0.3)])
def test_an_offset_is_found_with_its_error(seed, late):
    drive, start = driven(seed)
    found = zr.navigation.find_time_offset(drive.recording(), drive.fixes.shifted(late), start)
    assert found.identifiable
    assert found.sigma < 0.02
    assert abs(found.seconds + late) < 3.5 * found.sigma


def test_outliers_and_understated_noise_do_not_matter_much():
    drive, start = driven(2)
    velocity = drive.fixes.velocity.copy()
    velocity[40::23] += 3.0
    n = len(velocity)
    fixes = zr.Fixes(
        drive.fixes.time + 0.1,
        drive.fixes.position,
        velocity,
        np.full((n, 3), 2.0),
        np.full((n, 3), 0.03),
    )
    found = zr.navigation.find_time_offset(drive.recording(), fixes, start)
    assert abs(found.seconds + 0.1) < 0.04


def test_a_vehicle_that_stands_tells_nothing():
    drive = zr.simulate_drive(50.0, 100.0, kind="rest")
    start = zr.align(drive.recording(), latitude=48.0, heading=0.0)
    found = zr.navigation.find_time_offset(drive.recording(), drive.fixes, start)
    assert not found.identifiable
    assert np.isnan(found.seconds)
    assert "not identifiable" in str(found)


def test_wrong_input_is_refused():
    drive, start = driven(0)
    with pytest.raises(ValueError, match="adapt is not used here"):
        zr.navigation.find_time_offset(drive.recording(), drive.fixes, start, adapt="free")
    alone = zr.Fixes(drive.fixes.time, drive.fixes.position)
    for fixes in (drive.fixes.shifted(1e4), alone):
        with pytest.raises(ValueError, match="no velocity is used, by which an offset is found"):
            zr.navigation.find_time_offset(drive.recording(), fixes, start)
    with pytest.raises(TypeError, match="gnss must be Fixes"):
        zr.navigation.find_time_offset(drive.recording(), [1], start)
