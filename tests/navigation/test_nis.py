"""Normalised innovations squared of a track's fixes."""

import numpy as np
import pytest

import zerorate as zr

DRIVE = zr.simulate_drive(duration=200.0, seed=6)


def filter_(**options):
    start = zr.align(DRIVE.recording(), latitude=48.0, heading="course", span=(0.0, 25.0))
    return zr.NavigationFilter(start, **options)


def test_they_are_those_of_a_loop():
    track = filter_().process(DRIVE.recording(), DRIVE.fixes)
    nav, expected = filter_(), []
    fixes = iter(zip(DRIVE.fixes.time, DRIVE.fixes.position, DRIVE.fixes.velocity, strict=True))
    fix = next(fixes, None)
    for t, gyro, accel in zip(DRIVE.time, DRIVE.gyro, DRIVE.accel, strict=True):
        nav.update(t, gyro, accel)
        while fix is not None and fix[0] <= t:
            verdict = nav.update_gnss(*fix)
            expected.append(nav.nis if verdict != "refused" else [np.nan, np.nan])
            fix = next(fixes, None)
    np.testing.assert_array_equal(track.nis(), expected)


def test_they_tell_whether_the_deviations_are_right():
    track = filter_(adapt="fixed").process(DRIVE.recording(), DRIVE.fixes)
    assert np.nanmean(track.nis(), axis=0) == pytest.approx(3.0, abs=0.6)
    with pytest.raises(ValueError, match="this track is smoothed"):
        track.smooth().nis()


def test_without_velocities_there_is_none_of_them():
    bare = zr.Fixes(DRIVE.fixes.time, DRIVE.fixes.position)
    start = zr.align(DRIVE.recording(), latitude=48.0, heading=1.0, span=(0.0, 25.0))
    track = zr.NavigationFilter(start).process(DRIVE.recording(), bare)
    nis = track.nis()
    assert np.isnan(nis[:, 1]).all()
    assert np.isfinite(nis[30:, 0]).all()
