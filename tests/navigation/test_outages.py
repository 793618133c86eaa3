"""Outages: errors by hand, what is held, and the recorded drive."""

import math
from functools import cache

import numpy as np
import pytest

import zerorate as zr
from support.recordings import RECORDINGS, needs_recordings
from zerorate.geometry.earth import local_ned

EXACT = {"gyro": None, "accel": None, "gyro_bias": 0.0, "accel_bias": 0.0}
EXACT |= {"position_sigma": 0.0, "velocity_sigma": 0.0}
LEVER = (1.0, -0.5, -1.5)


@cache
def drive(seconds=160.0, **options):
    return zr.simulate_drive(duration=seconds, seed=4, **options)


def start(driven, heading="course"):
    return zr.align(driven.recording(), latitude=48.0, heading=heading, span=(0.0, 25.0))


@cache
def found(smooth=True):
    driven = drive()
    return zr.navigation.outages(driven.recording(), driven.fixes, seconds=(10, 20), smooth=smooth)


def distance(one, other):
    return float(np.hypot(*local_ned(one, other)[:2]))


def test_outages_stand_where_they_should():
    one = found()[10.0]
    begun = one.spans[0, 0] - 60.0
    assert 30.0 < begun < 45.0
    expected = begun + 60.0 + 40.0 * np.arange(one.n)
    np.testing.assert_allclose(one.spans, np.column_stack([expected, expected + 10.0]))
    assert expected[-1] + 50.0 > 159.0
    # Fixes come each second.
    assert one.time.size == 10 * one.n
    np.testing.assert_array_equal(np.bincount(one.outage), 10)


@pytest.mark.parametrize("more", [1, 2])
def test_smoothing_needs_two_fixes_after_an_outage(more):
    driven, until = drive(), found()[10.0].spans[1, 1]
    fixes = driven.fixes.chosen(driven.fixes.time <= until + more + 0.5)
    told = zr.navigation.outages(driven.recording(), fixes, seconds=10.0, smooth=True)
    assert np.isfinite(told[10.0].end["smoothed"]).tolist() == [True, more == 2]
    assert np.isfinite(told[10.0].end["filter"]).all()
    assert any("fewer than two fixes" in note for note in told.notes) == (more == 1)


def test_threads_change_nothing():
    driven, beside = drive(), found()
    alone = zr.navigation.outages(
        driven.recording(), driven.fixes, seconds=(10, 20), smooth=True, threads=1
    )
    for one, other in zip(alone.lengths, beside.lengths, strict=True):
        for name, errors in one.errors.items():
            np.testing.assert_array_equal(errors, other.errors[name])
    for wrong in (0, 1.5):
        with pytest.raises(ValueError, match="threads"):
            zr.navigation.outages(driven.recording(), driven.fixes, threads=wrong)


def test_errors_are_those_of_a_run_without_these_fixes():
    driven = drive()
    imu, fixes = driven.recording(), driven.fixes
    nav = zr.NavigationFilter(zr.navigation.find_start(imu, fixes))
    one = zr.navigation.outages(imu, fixes, seconds=20, nav=nav, smooth=True)[20.0]
    kept = ~np.isin(driven.fixes.time, one.time)
    track = nav.process(driven.recording(), driven.fixes.chosen(kept))
    best = track.smooth()
    for k, (before, last) in enumerate(one.spans):
        # Each fix is at the time of a sample.
        at = round(last * driven.rate)
        fix, held = driven.fixes.position[round(last)], driven.fixes.position[round(before)]
        # By a plane at one end or at the other, metres apart.
        assert one.end["filter"][k] == pytest.approx(distance(track.position[at], fix), abs=1e-5)
        inside = [
            distance(best.position[round(t * driven.rate)], driven.fixes.position[round(t)])
            for t in np.arange(before + 1.0, last + 0.5)
        ]
        assert one.end["smoothed"][k] == pytest.approx(max(inside), abs=1e-6)
        assert one.end["position held"][k] == pytest.approx(distance(held, fix), rel=1e-3)
        carried = local_ned(held, fix)[:2] + 20.0 * driven.fixes.velocity[round(before), :2]
        assert one.end["velocity held"][k] == pytest.approx(np.hypot(*carried), rel=1e-3)


def test_an_antenna_is_where_it_is_said_to_be():
    driven = drive(antenna=LEVER, **EXACT)
    imu, fixes = driven.recording(), driven.fixes
    first = zr.align(imu, latitude=48.0, heading="course", span=(0.0, 25.0))
    nav = zr.NavigationFilter(first, antenna=LEVER)
    right = zr.navigation.outages(imu, fixes, seconds=10.0, nav=nav)
    wrong = zr.navigation.outages(imu, fixes, seconds=10.0, nav=zr.NavigationFilter(first))
    with pytest.raises(
        ValueError, match="antenna cannot be combined with nav; set it on the Navig"
    ):
        zr.navigation.outages(imu, fixes, nav=nav, antenna=LEVER)
    assert right[10.0].rms() < 0.3
    assert wrong[10.0].rms() > 0.8


def test_the_template_is_not_changed():
    driven = drive()
    nav = zr.NavigationFilter(start(driven))
    before = nav.to_bytes()
    first = zr.navigation.outages(driven.recording(), driven.fixes, seconds=10, nav=nav)
    second = zr.navigation.outages(driven.recording(), driven.fixes, seconds=10, nav=nav)
    assert nav.to_bytes() == before
    np.testing.assert_array_equal(first[10].end["filter"], second[10].end["filter"])


def test_without_velocities_the_last_two_positions_tell_one():
    driven = drive(**EXACT)
    bare = zr.Fixes(driven.fixes.time, driven.fixes.position)
    nav = zr.NavigationFilter(start(driven, 0.0))
    one = zr.navigation.outages(driven.recording(), bare, seconds=10.0, nav=nav)
    known = zr.navigation.outages(driven.recording(), driven.fixes, seconds=10.0, nav=nav)
    assert "from the last two positions" in one.notes[0]
    assert known.notes == ()
    before = one[10.0].spans[0, 0].round().astype(int)
    way = -local_ned(bare.position[before - 1], bare.position[before])[:2]
    step = one[10.0].errors["velocity held"] - one[10.0].errors["position held"]
    np.testing.assert_allclose(step[0], way, rtol=1e-3, atol=1e-3)


def test_a_time_offset_moves_the_fixes():
    driven = drive()
    moved = driven.fixes.shifted(-3.25)
    one, other = (
        zr.navigation.outages(driven.recording(), fixes, seconds=(10, 20), time_offset=offset)
        for fixes, offset in ((moved, 3.25), (driven.fixes, 0.0))
    )
    np.testing.assert_allclose(one[10.0].spans, other[10.0].spans)
    np.testing.assert_allclose(one[10.0].end["filter"], other[10.0].end["filter"], rtol=1e-6)


def test_heights_may_be_missing():
    driven = drive()
    place = driven.fixes.position.copy()
    place[:, 2] = np.nan
    flat = zr.Fixes(driven.fixes.time, place, driven.fixes.velocity)
    one = zr.navigation.outages(driven.recording(), flat, seconds=10.0)
    assert all(np.isfinite(values).all() for values in one[10.0].end.values())


def test_an_outage_in_which_the_filter_is_lost_leaves_the_rest_alone():
    driven, whole = drive(), found(smooth=False)[10.0]
    recording = driven.recording()
    gap = (driven.time > whole.spans[0, 0] + 3.0) & (driven.time < whole.spans[0, 0] + 6.0)
    recording.gyro.data[gap] = np.nan
    nav = zr.NavigationFilter(start(driven))
    some = zr.navigation.outages(recording, driven.fixes, seconds=10.0, nav=nav)
    one = some[10.0]
    assert np.isnan(one.end["filter"][0])
    assert one.rms() == pytest.approx(math.sqrt((one.end["filter"][1:] ** 2).mean()))
    assert one.largest() < 100.0
    assert np.isfinite(one.end["position held"]).all()
    assert f": 1 of {one.n}" in str(some)


def test_a_receiver_with_gaps_has_fewer():
    driven = drive()
    gap = found()[10.0].spans[0] + [2.0, 20.0]
    there = (driven.fixes.time < gap[0]) | (driven.fixes.time > gap[1])
    one = zr.navigation.outages(driven.recording(), driven.fixes.chosen(there), seconds=10.0)
    assert one[10.0].n == found()[10.0].n - 1
    assert "outages of 10 s left out where the receiver has gaps itself: 1" in one.notes


def test_what_it_says():
    said = str(found())
    assert said.index("position held") < said.index("velocity held") < said.index("filter")
    assert "smoothed, largest inside" in said
    assert "smoothed" not in str(found(smooth=False))
    assert repr(found()).startswith(f"Outages({found()[10].n} of 10 s: ")
    one = found()[10.0]
    assert one.rms() == pytest.approx(math.sqrt((one.end["filter"] ** 2).mean()))
    assert one.median("smoothed") <= one.largest("smoothed")
    with pytest.raises(KeyError):
        found()[15.0]


@pytest.mark.parametrize(
    ("options", "match"),
    [
        ({"seconds": ()}, "seconds must be a number or several"),
        ({"seconds": -1.0}, "seconds must be"),
        ({"seconds": (10.0, math.nan)}, "seconds must be"),
        ({"seconds": 100.0}, "there is no room for an outage of 100 s: the filter started at"),
        ({"seconds": 10.0, "first": 200.0}, "200 s later there are 0 s of fixes left"),
        ({"first": -1.0}, "first must be a number from 0, got -1"),
        ({"between": 0.0}, "between must be"),
        ({"seconds": 10.0, "between": 0.5}, "between must leave a fix between outages"),
        ({"antenna": (1.0, 2.0)}, "antenna must be three finite numbers"),
        ({"time_offset": math.nan}, "time_offset must be a number"),
        ({"seconds": 10.0, "rest": np.zeros(3, bool)}, "rest must be an array of bool"),
    ],
)
def test_refusals(options, match):
    driven = drive()
    with pytest.raises(ValueError, match=match):
        zr.navigation.outages(driven.recording(), driven.fixes, **options)


def test_filters_that_are_of_no_use():
    driven = drive()
    imu, fixes = driven.recording(), driven.fixes
    used = zr.NavigationFilter(start(driven))
    used.process(imu)
    with pytest.raises(ValueError, match="that has seen no sample, this one has 16000"):
        zr.navigation.outages(imu, fixes, nav=used)
    with pytest.raises(zr.LogError, match="did not start: the heading is not known, and"):
        zr.navigation.outages(imu, fixes, nav=zr.NavigationFilter(start(driven, None)))
    with pytest.raises(
        zr.LogError, match="the fixes from 10000 to 10159 s, which suggests different"
    ):
        zr.navigation.outages(imu, fixes.shifted(1e4), time_offset=0.0)
    with pytest.raises(zr.LogError, match="there are no fixes"):
        zr.navigation.outages(imu, fixes.between(1e3))
    with pytest.raises(TypeError, match="gnss must be Fixes"):
        zr.navigation.outages(imu, imu)


@needs_recordings
@pytest.mark.parametrize("wheels", [{}, {"vehicle": "wheeled", "axle": (-1.0, 0.0, 1.3)}])
def test_the_recorded_drive(wheels):
    path = RECORDINGS / "drive_imu_100hz.parquet"
    mounting = zr.io.read_mounting(path)
    imu = zr.record.body_axes(zr.read_recording(path), mounting.body_from_sensor)
    fixes = zr.read_fixes(RECORDINGS / "drive_gnss_4hz.parquet")
    begin = zr.align(imu, latitude=fixes.position[0, 0], heading="course", span=(0.0, 36.0))
    nav = zr.NavigationFilter(begin, antenna=mounting.antenna, **wheels)
    one = zr.navigation.outages(
        imu,
        fixes,
        nav=nav,
        smooth=True,
        time_offset=mounting.time_offset,
    )
    assert [length.n for length in one.lengths] == [11, 7, 5]
    assert one[10.0].rms() < 4.2
    assert one[30.0].rms("smoothed") < 2.0
    assert one[10.0].rms("velocity held") > 35.0
    if wheels:
        assert one[30.0].median() < 4.0
        assert one[60.0].rms() < 18.0
