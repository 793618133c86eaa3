"""The track of a sensor on a foot: what must hold."""

import pickle
from dataclasses import replace

import numpy as np
import pytest

import zerorate as zr
from support.recordings import RECORDINGS, needs_recordings


def of(time, gyro, accel, rate=200.0):
    def log(values, kind, unit):
        return zr.Log.at(time, rate, values, tuple(f"{kind}_{a}" for a in "xyz"), unit, {})

    return zr.Recording({"gyro": log(gyro, "gyro", "rad/s"), "accel": log(accel, "accel", "m/s^2")})


def walked(walk, gyro=None, accel=None, time=None, **options):
    given = (walk.gyro if gyro is None else gyro, walk.accel if accel is None else accel)
    recording = of(walk.time if time is None else time, *given, walk.rate)
    return zr.FootNavigation(**options).process(recording)


def off(track, walk):
    """Level error at the end, per cent of the way."""
    error = track.position[-1, :2] - walk.position[-1, :2]
    return 100.0 * float(np.hypot(*error)) / walk.distance


WALK = zr.simulate_walk(strides=20, seed=3)


def test_a_walk_ends_where_it_does():
    track = walked(WALK, floor="level")
    strides = track.smooth().strides()
    assert off(track, WALK) < 0.3
    assert abs(track.distance - WALK.distance) < 0.01 * WALK.distance
    assert len(strides) == WALK.stride_count
    assert abs(np.nanmedian(strides.stride_time) - 1.05) < 0.03
    assert abs(strides.cadence - 2.0 * 60.0 / 1.05) < 4.0
    assert not track.rejection_count
    assert not track.clipped


def test_the_smoother_leaves_the_end_and_mends_the_way():
    track = walked(zr.simulate_walk(strides=20, seed=1, gyro_range=6.5))
    best = track.smooth()
    assert np.abs(best.position[-1] - track.position[-1]).max() < 1e-3
    # Between steps of the covariance, four samples apart, the filter keeps its deviation.
    assert (best.sigma[::4, :2] <= track.sigma[::4, :2] + 1e-9).all()
    again = pickle.loads(pickle.dumps(track))
    assert np.array_equal(again.smooth().position, best.position)
    with pytest.raises(ValueError, match="is smoothed"):
        best.smooth()


def test_clipped_rates_are_restored_and_believed_less():
    walk = zr.simulate_walk(strides=40, seed=5, gyro_range=6.5)
    whole, restored = walked(zr.simulate_walk(strides=40, seed=5)), walked(walk)
    left = walked(walk, restore=False)
    assert {(one.axis, one.sign) for one in restored.clipped} == {("y", 1), ("y", -1)}
    assert abs(restored.clipped[0].limit - 6.5) < 1e-9
    assert off(restored, walk) < off(left, walk)
    assert np.hypot(*restored.sigma[-1, :2]) > np.hypot(*whole.sigma[-1, :2])


def test_axes_may_look_anywhere():
    """Down, upside down, along the shin: only where x looks at the start changes."""
    usual = walked(WALK)
    for turn in (np.diag([1.0, -1.0, -1.0]), np.eye(3)[[1, 2, 0]], np.eye(3)[[2, 0, 1]]):
        track = walked(WALK, WALK.gyro @ turn.T, WALK.accel @ turn.T)
        ends = [np.hypot(*one.position[-1, :2]) for one in (track, usual)]
        assert abs(ends[0] - ends[1]) < 1e-6 * WALK.distance
        assert abs(track.position[-1, 2] - usual.position[-1, 2]) < 1e-6


def test_a_constant_bias_is_found():
    offset = np.radians([0.2, 0.2, 0.2])
    track, usual = walked(WALK, WALK.gyro + offset), walked(WALK)
    assert np.hypot(*(track.position - usual.position)[-1, :2]) < 5e-4 * WALK.distance
    assert np.abs(track.gyro_bias[-1] - usual.gyro_bias[-1] - offset).max() < np.radians(0.01)


@pytest.mark.parametrize("rate", [50.0, 100.0, 400.0, 1000.0])
def test_rates(rate):
    walk = zr.simulate_walk(rate, strides=10, seed=1)
    assert off(walked(walk, floor="level"), walk) < 0.5


def test_a_start_in_motion_is_told():
    walk = zr.simulate_walk(strides=20, seed=2, rest=0.0)
    track = walked(walk)
    assert "never rests" in track.notes[0]
    assert off(track, walk) < 100.0 * 4.0 * np.hypot(*track.sigma[-1, :2]) / walk.distance
    assert track.sigma[-1, 8] > np.radians(3.0)


def test_stairs_are_climbed_and_the_floor_stays_level():
    stairs = zr.simulate_walk(strides=20, seed=4, step_height=0.17)
    up = walked(stairs, floor="level")
    assert abs(up.position[-1, 2] - 20 * 0.17) < 0.1
    assert np.allclose(up.strides().height_change, 0.17, atol=0.02)
    assert abs(walked(WALK, floor="level").position[-1, 2]) < 0.02


def test_stillness_stays():
    walk = zr.simulate_walk(strides=1, rest=30.0)
    still = slice(0, 5900)
    track = zr.FootNavigation().process(of(walk.time[still], walk.gyro[still], walk.accel[still]))
    assert np.abs(track.position[-1]).max() < 1e-2
    assert not len(track.strides())


def test_a_foot_that_never_rests_says_how_little_it_knows():
    walk = zr.simulate_walk(strides=20, seed=2)
    draws = np.random.default_rng(0)
    shaken = walk.accel + draws.normal(0.0, 30.0, walk.accel.shape)
    track = walked(walk, walk.gyro + draws.normal(0.0, 5.0, walk.gyro.shape), shaken)
    assert not len(track.rests)
    known = track.navigating
    assert np.isfinite(track.position[known]).all()
    assert np.hypot(*track.sigma[known][-1, :2]) > 10.0


def test_missing_samples_and_gaps():
    gyro, accel = WALK.gyro.copy(), WALK.accel.copy()
    gyro[1000:1010], accel[2000:2010] = np.nan, np.inf
    track = walked(WALK, gyro, accel)
    assert np.isfinite(track.position).all()
    assert off(track, WALK) < 2.0
    time = WALK.time.copy()
    time[3000:] += 20.0
    after = walked(WALK, time=time)
    assert np.isfinite(after.position[-1]).all()
    assert after.sigma[-1, 0] > 10.0
    assert np.isfinite(after.smooth().position[-1]).all()
    gyro[3000:3600] = np.nan
    lost = walked(WALK, gyro)
    assert not lost.navigating[3500]
    assert lost.navigating[-1]
    assert lost.sigma[-1, 0] > 3.0


def test_stamps_that_wander():
    draws = np.random.default_rng(1)
    time = WALK.time + draws.uniform(-2e-4, 2e-4, len(WALK.time))
    assert off(walked(WALK, time=time, floor="level"), WALK) < 1.0


def test_both_sensors_clipped():
    walk = zr.simulate_walk(strides=20, seed=1, gyro_range=6.0)
    track = walked(walk, accel=np.clip(walk.accel, -15.0, 15.0))
    assert np.isfinite(track.position).all()
    error = np.hypot(*(track.position[-1] - walk.position[-1])[:2])
    assert error < 3.0 * np.hypot(*track.sigma[-1, :2])


def cart(shaken):
    """It stands, drives for 20 s while its motor shakes it, and stands."""
    time = np.arange(6000) / 200.0
    drives = (time > 5.0) & (time < 25.0)
    draws = np.random.default_rng(0)
    gyro = draws.normal(0.0, 1e-3, (6000, 3))
    accel = draws.normal(0.0, 0.03, (6000, 3)) + np.array([0.0, 0.0, 9.81])
    accel[drives, 0] += np.sin(2.0 * np.pi * (time[drives] - 5.0) / 20.0)
    accel[drives] += draws.normal(0.0, 1.0, (drives.sum(), 3)) * shaken
    return of(time, gyro, accel)


def test_a_machine_that_shakes_is_refused():
    with pytest.raises(ValueError, match=r"turns by .* deg/s at most, and a foot by more"):
        zr.FootNavigation().process(cart(3.0))


def test_a_machine_that_drives_smoothly_cannot_be_told_from_one_that_stands():
    track = zr.FootNavigation().process(cart(0.0))
    assert any("a smoothly driving machine" in note for note in track.notes)


def test_headings_are_as_sure_as_their_deviation_says():
    """Minutes of a gyro as the filter takes it: two of three are within a deviation."""
    noise, relative, bias = np.radians(0.05), 0.001, np.radians(0.3)
    for rest in (2.0, 0.0):
        ratios = []
        for seed in range(20):
            walk = zr.simulate_walk(
                100.0, 57, seed=seed, rest=rest, gyro_noise=noise, gyro_bias=bias
            )
            size = relative * np.sqrt(walk.rate) * np.linalg.norm(walk.gyro, axis=1)
            white = np.random.default_rng(1000 + seed).standard_normal(walk.gyro.shape)
            track = walked(walk, walk.gyro + size[:, np.newaxis] * white)
            w, x, y, z = track.quaternion[-1]
            heading = np.arctan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))
            ratios.append(abs(heading) / track.sigma[-1, 8])
        assert 0.6 <= np.mean(np.array(ratios) < 1.0) <= 0.8, rest


def test_hostile_numbers_stay_finite_or_missing():
    for value in (0.0, 1e-300, 9e3, -9e3, 1e150, -1e300):
        gyro, accel = WALK.gyro.copy(), WALK.accel.copy()
        gyro[2000:2400], accel[2200:2600] = value, value
        track = walked(WALK, gyro, accel)
        known = track.navigating
        assert np.isfinite(track.position[known]).all()
        assert np.isfinite(track.sigma[known]).all()


def test_faults():
    for options, match in (
        ({"rate": -1.0}, "rate must be a positive"),
        ({"floor": "flat"}, "floor must be None or 'level'"),
        ({"rate": 100.0}, "rate must be that of the recording, 200 Hz"),
    ):
        with pytest.raises(ValueError, match=match):
            walked(WALK, **options)
    slow = zr.simulate_walk(rate=40.0, strides=5)
    with pytest.raises(ValueError, match="48 samples a second or more"):
        walked(slow)
    with pytest.raises(TypeError, match="must be a Recording"):
        zr.FootNavigation().process(WALK)
    with pytest.raises(ValueError, match="only the track was kept"):
        zr.FootNavigation().process(WALK.recording(), keep="track").smooth()


def test_a_track_on_the_earth():
    track = replace(walked(WALK), position=np.array([[0.0, 0.0, 0.0], [100.0, 0.0, 2.0]]))
    place = track.georeference(48.0, 11.0, heading=90.0, height=500.0).position
    assert np.allclose(place[0], [48.0, 11.0, 500.0])
    assert abs(place[1, 0] - 48.0) < 1e-6
    assert abs(place[1, 1] - 11.0 - 100.0 / 74_629.0) < 1e-6
    assert place[1, 2] == pytest.approx(502.0)
    with pytest.raises(ValueError, match=r"latitude must be within 89.5 deg"):
        track.georeference(90.0, 0.0)


def test_a_log_of_the_track():
    track = walked(WALK)
    log = track.to_log()
    assert log.names == ("x_m", "y_m", "z_m")
    assert log.extra["standing"].sum() > 100


def test_restoring_leaves_what_was_not_clipped():
    found = zr.restore_clipped(WALK.gyro, WALK.rate)
    assert np.array_equal(found.gyro, WALK.gyro)
    assert not found.restored.any()
    assert found.clipped == ()


def test_restoring_with_missing_samples():
    walk = zr.simulate_walk(strides=20, seed=5, gyro_range=6.5)
    gyro = walk.gyro.copy()
    gyro[:3], gyro[700] = np.nan, np.nan
    found = zr.restore_clipped(gyro, 200.0)
    assert np.array_equal(np.isnan(found.gyro), np.isnan(gyro))
    assert found.restored.any()
    assert np.abs(found.gyro[found.restored]).max() > 6.5
    empty = zr.restore_clipped(np.full((5, 3), np.nan), 200.0)
    assert np.isnan(empty.gyro).all()
    for bad, match in (((np.zeros(5), 200.0), r"shape \(n, 3\)"), ((gyro, 0.0), "rate must be")):
        with pytest.raises(ValueError, match=match):
            zr.restore_clipped(*bad)


# Length, m, and end error after the smoother, per cent, as the trials of the method printed them.
PUBLISHED = {
    "vicon_20171122112203": (27.8, 0.29),
    "vicon_20171122114044": (40.1, 0.28),
    "vicon_20171127111153": (25.1, 0.01),
    "vicon_20171127112512": (52.8, 0.09),
    "vicon_20171215180305": (47.5, 0.26),
    "walk_SensorConnectData_35": (55.5, 6.5),
    "walk_SensorConnectData_37": (109.1, 0.09),
}


def end_error(name):
    """Of the track turned to fit its reference: per cent of the reference's length; and that, m."""
    path = RECORDINGS / f"foot_{name}_200hz.parquet"
    track = zr.FootNavigation(floor="level").process(zr.read_recording(path)).smooth()
    import pyarrow.parquet as pq

    table = pq.read_table(path, columns=["ref_x_m", "ref_y_m"])
    truth = np.column_stack([column.to_numpy() for column in table.columns]).astype(float)
    known = np.flatnonzero(np.isfinite(truth[:, 0]))
    if "vicon" in name:
        known = np.unique(np.append(known[::50], known[-1]))
    z, w = (p[known] @ [1.0, 1j] for p in (track.position[:, :2], truth))
    z, w = z - z[0], w - w[0]
    turn = (np.conj(z) * w).sum()
    length = np.abs(np.diff(w)).sum()
    return length, 100.0 * abs(z[-1] * turn / abs(turn) - w[-1]) / length


@needs_recordings
@pytest.mark.parametrize("name", PUBLISHED)
def test_recorded_walks_end_as_the_trials_did(name):
    length, error = end_error(name)
    expected, percent = PUBLISHED[name]
    assert abs(length - expected) < 0.1
    assert error < percent + max(0.05 * percent, 0.03)


def test_a_recording_is_restored_where_that_is_certain():
    walk = zr.simulate_walk(strides=20, seed=5, gyro_range=6.5)
    noisy = replace(walk, gyro=walk.gyro + 1e-3 * np.sin(np.arange(len(walk.time)))[:, np.newaxis])
    for one, certain in ((walk, True), (noisy, False)):
        found, sides = zr.checks.restore_recording(one.recording())
        assert [side.certain for side in sides] == [certain] * 2
        assert (found.gyro.data[:, 1].max() > 7.0) == certain
        again, _ = zr.checks.restore_recording(one.recording(), certain=False)
        assert again.gyro.data[:, 1].max() > 7.0
    whole = zr.simulate_walk(strides=5).recording()
    assert zr.checks.restore_recording(whole)[0] is whole
