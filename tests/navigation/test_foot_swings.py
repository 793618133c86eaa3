"""Which motion is a foot's, where a walk begins, how far it climbs: by the bodies of the study."""

import runpy
from pathlib import Path

import numpy as np
import pytest

import zerorate as zr
from support.recordings import RECORDINGS, needs_recordings
from zerorate.record import LogError

BODIES = runpy.run_path(str(Path(__file__).parents[2] / "examples" / "foot_bodies.py"))
SECONDS = 20.0


def recording(time, gyro, accel, rate):
    return BODIES["recording"](time, rate, gyro, accel)


def navigated(time, gyro, accel, rate, **options):
    return zr.FootNavigation(**options).process(recording(time, gyro, accel, rate))


@pytest.mark.parametrize("kind", BODIES["FEET"])
def test_feet_are_navigated(kind):
    for seed in range(3):
        _, rate, *samples = BODIES["foot"](seed, kind, seconds=SECONDS)
        track = navigated(*samples, rate)
        assert track.foot_share >= 0.8, (seed, rate)
        assert not any("on a foot" in note for note in track.notes)


@pytest.mark.parametrize("kind", BODIES["OTHERS"])
def test_other_bodies_are_refused_or_noted(kind):
    for seed in range(3):
        _, rate, *samples = BODIES["other"](seed, kind, seconds=SECONDS)
        forced = navigated(*samples, rate, assume_foot=True)
        assert len(forced.position) == len(samples[0])
        if forced.swings.are_judged and forced.foot_share < 0.5:
            with pytest.raises(LogError, match="this sensor is not on a foot"):
                navigated(*samples, rate)
        else:
            assert any("on a foot" in note or "never swings" in note for note in forced.notes), seed


def test_the_test_that_fails_most_is_named():
    _, rate, *samples = BODIES["other"](0, "phone", 100.0, SECONDS)
    with pytest.raises(LogError, match=r"in \d+ % of its swings it does not stand between swings"):
        navigated(*samples, rate)


def test_what_steps_on_the_spot_is_noted():
    walk = zr.simulate_walk(strides=20, length=0.02, seed=1)
    track = zr.FootNavigation().process(walk.recording())
    assert any("steps on the spot" in note for note in track.notes)


def test_a_hand_before_a_walk_is_a_span():
    """Live the share says so after six swings; the foot's own begins later."""
    rate = 100.0
    hand = BODIES["other"](3, "trousers", rate, 30.0)[2:]
    foot = BODIES["foot"](1, "walking", rate, 40.0)[2:]
    time, gyro, accel = BODIES["joined"](hand, foot, rate=rate)
    track = navigated(time, gyro, accel, rate, assume_foot=True)
    (start, end), *more = track.swings.stray_spans()
    assert not more
    assert time[start] < 5.0
    assert 25.0 < time[end] < 37.0
    assert any("s it is not on a foot" in note for note in track.notes)
    assert track.sigma[-1, 0] > 40.0
    live = zr.FootFilter(rate)
    live.process(gyro[: 28 * 100], accel[: 28 * 100])
    assert live.foot_share < 0.5
    live.process(gyro[28 * 100 :], accel[28 * 100 :])
    assert live.foot_share == 1.0


def test_live_and_batch_judge_alike():
    for seed in range(0, 12, 3):
        for body in ("foot", "other"):
            _, rate, time, gyro, accel = BODIES[body](seed, seconds=SECONDS)
            live = zr.FootFilter(rate)
            live.process(gyro, accel)
            track = navigated(time, gyro, accel, rate, assume_foot=True)
            if len(track.swings) >= 12:
                assert (live.foot_share >= 0.5) == (track.foot_share >= 0.5), (body, seed)


@pytest.mark.parametrize("kind", ["walking", "fast", "running", "stairs"])
def test_a_start_anywhere_in_a_stride_climbs_as_the_whole_does(kind):
    rng = np.random.default_rng(1)
    ratios = []
    for seed in range(8):
        _, rate, time, gyro, accel = BODIES["foot"](seed, kind, 200.0, 25.0)
        whole = navigated(time, gyro, accel, rate, assume_foot=True).position[:, 2]
        k = round(len(time) * rng.uniform(0.2, 0.45))
        track = navigated(time[k:], gyro[k:], accel[k:], rate)
        assert np.array_equal(track.position[0], np.zeros(3))
        climb = track.position[-1, 2] - (whole[-1] - whole[k])
        ratios.append(climb / track.sigma[-1, 2])
        best = track.smooth()
        assert np.abs(best.position[0]).max() < 1e-12
        assert np.abs(best.position[-1] - track.position[-1])[2] < 0.1 + track.sigma[-1, 2]
    assert np.abs(ratios).max() < 3.0
    assert np.sqrt(np.mean(np.square(ratios))) < 1.3


def test_a_clipped_pitch_widens_the_climb():
    """What stances take away in one direction alone has made height."""
    ratios, wider = [], []
    for seed in range(6):
        walk = zr.simulate_walk(strides=30, seed=seed, turn=0.1, gyro_range=np.radians(250.0))
        track = zr.FootNavigation().process(walk.recording())
        ratios.append((track.position[-1] - walk.position[-1])[2] / track.sigma[-1, 2])
        whole = zr.simulate_walk(strides=30, seed=seed, turn=0.1).recording()
        wider.append(track.sigma[-1, 2] / zr.FootNavigation().process(whole).sigma[-1, 2])
        live = zr.FootFilter(200.0)
        live.process(walk.gyro, walk.accel)
        assert abs(live.position[2] - walk.position[-1, 2]) < 3.0 * live.sigma[2]
    assert np.sqrt(np.mean(np.square(ratios))) < 1.0
    assert min(wider) > 3.0


def test_lifts_are_noted_and_make_the_height_uncertain():
    for seed in range(8):
        time, gyro, accel, height = BODIES["lift"](seed)
        track = navigated(time, gyro, accel, 100.0)
        (ride,) = track.rides
        assert abs(ride.height - height) < 1.0 + 0.05 * abs(height)
        assert track.sigma[-1, 2] > 0.9 * abs(height)
        assert track.smooth().sigma[-1, 2] > 0.9 * abs(height)
        assert any("ride a lift" in note for note in track.notes)
        level = navigated(time, gyro, accel, 100.0, floor="level")
        assert not level.rides


def test_walks_ride_no_lift():
    for seed in range(18):
        _, rate, *samples = BODIES["foot"](seed, seconds=SECONDS)
        assert not navigated(*samples, rate).rides, seed


def test_another_tilt_is_recovered_from():
    for seed in range(6):
        time, gyro, accel, seam = BODIES["spliced"](seed)
        track = navigated(time, gyro, accel, 100.0)
        after = track.lowest[time[track.lowest] > seam]
        speed = np.linalg.norm(track.velocity[after[10:]], axis=1)
        assert speed.max() < 0.3, seed
        live = zr.FootFilter(100.0)
        live.process(gyro, accel)
        assert live.rejection_count < 100
        assert live.foot_share > 0.8


def test_a_live_filter_finds_the_range_of_its_gyro():
    walk = zr.simulate_walk(strides=60, seed=5, gyro_range=6.5)
    ends = []
    for options in ({}, {"gyro_range": 1e3}):
        foot = zr.FootFilter(200.0, **options)
        foot.process(walk.gyro, walk.accel)
        ends.append(np.hypot(*(foot.position - walk.position[-1])[:2]))
    assert ends[0] < 0.7 * ends[1]


@needs_recordings
@pytest.mark.parametrize("path", sorted(RECORDINGS.glob("foot_*.parquet")), ids=lambda p: p.stem)
def test_recorded_feet_are_feet(path):
    track = zr.FootNavigation().process(zr.read_recording(path))
    assert track.foot_share >= 0.9
    assert not track.rides


@needs_recordings
@pytest.mark.parametrize(
    ("name", "rate"), [("broad_05", 2000.0 / 7.0), ("broad_32", 2000.0 / 7.0), ("drive_imu", 100.0)]
)
def test_recorded_hands_and_cars_are_refused(name, rate):
    (path,) = RECORDINGS.glob(f"{name}*.parquet")
    with pytest.raises(LogError, match="not on a foot"):
        zr.FootNavigation().process(zr.read_recording(path, rate=rate))
