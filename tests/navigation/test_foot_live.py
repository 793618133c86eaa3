"""A sensor on a foot live: what must hold besides the laws, and how near it is to the track."""

import numpy as np
import pytest

import zerorate as zr

WALK = zr.simulate_walk(strides=20, seed=3)


def off(foot, walk, place=None):
    """Level error at the end, per cent of the way."""
    place = foot.position if place is None else place
    return 100.0 * float(np.hypot(*(place - walk.position[-1])[:2])) / walk.distance


@pytest.mark.parametrize("rate", [50.0, 200.0, 1000.0])
def test_it_ends_where_the_walk_does(rate):
    walk = zr.simulate_walk(rate, strides=10, seed=1)
    foot = zr.FootFilter(rate, floor="level", gyro_range=20.0)
    told = foot.process(walk.gyro, walk.accel)
    assert abs(foot.delay - 0.1) < 0.025
    late = round(foot.delay * rate)
    # Nothing is reported before a rest has lasted half a second.
    known = late + round(0.5 * rate)
    assert np.isnan(told[: known - round(0.03 * rate) - 1]).all()
    assert np.isfinite(told[known + round(0.15 * rate) :]).all()
    assert off(foot, walk) < 0.5
    assert foot.stance_count == 11
    error = np.hypot(*(told[late:] - walk.position[: len(told) - late])[:, :2].T)
    assert np.nanmax(error) < 0.01 * walk.distance
    assert foot.standing
    assert foot.at_rest


def test_it_is_the_track_of_the_recording_but_for_what_comes_later():
    track = zr.FootNavigation(floor="level").process(WALK.recording())
    foot = zr.FootFilter(WALK.rate, floor="level")
    foot.process(WALK.gyro, WALK.accel)
    assert np.abs(foot.position - track.position[-1]).max() < 0.002 * WALK.distance
    assert np.abs(foot.gyro_bias - track.gyro_bias[-1]).max() < np.radians(0.01)
    assert abs(foot.sigma[8] / track.sigma[-1, 8] - 1.0) < 0.1


def test_axes_may_look_anywhere_and_it_may_start_in_motion():
    usual = zr.FootFilter(200.0)
    usual.process(WALK.gyro, WALK.accel)
    for turn in (np.diag([1.0, -1.0, -1.0]), np.eye(3)[[1, 2, 0]]):
        foot = zr.FootFilter(200.0)
        foot.process(WALK.gyro @ turn.T, WALK.accel @ turn.T)
        ends = [np.hypot(*one.position[:2]) for one in (foot, usual)]
        assert abs(ends[0] - ends[1]) < 1e-6 * WALK.distance
    walk = zr.simulate_walk(strides=20, seed=2, rest=0.0)
    foot = zr.FootFilter(200.0)
    foot.process(walk.gyro, walk.accel)
    assert foot.sigma[8] > np.radians(3.0)
    assert off(foot, walk) < 400.0 * np.hypot(*foot.sigma[:2]) / walk.distance


def test_missing_samples_and_gaps():
    gyro, accel = WALK.gyro.copy(), WALK.accel.copy()
    gyro[1000:1010], accel[2000:2010] = np.nan, np.inf
    foot = zr.FootFilter(200.0)
    assert np.isfinite(foot.process(gyro, accel)[150:]).all()
    assert off(foot, WALK) < 2.0
    gyro[2500:3600] = np.nan
    lost = zr.FootFilter(200.0)
    told = lost.process(gyro, accel)
    assert np.isnan(told[3590]).all()
    assert np.isfinite(told[-1]).all()
    assert lost.sigma[0] > 5.0


def test_clipped_rates_are_restored_and_believed_less():
    walk = zr.simulate_walk(strides=40, seed=5, gyro_range=6.5)
    whole = zr.simulate_walk(strides=40, seed=5)
    told, left, usual = (
        zr.FootFilter(200.0, gyro_range=6.5),
        zr.FootFilter(200.0),
        zr.FootFilter(200.0),
    )
    for foot, walked in ((told, walk), (left, walk), (usual, whole)):
        foot.process(walked.gyro, walked.accel)
    assert off(told, walk) < off(left, walk)
    assert told.sigma[1] > usual.sigma[1]


def test_a_cart_that_drives_smoothly_never_turns_as_a_foot_does():
    draws = np.random.default_rng(0)
    foot = zr.FootFilter(200.0)
    accel = draws.normal(0.0, 0.03, (6000, 3)) + np.array([0.0, 0.0, 9.81])
    accel[1000:5000, 0] += np.sin(2.0 * np.pi * np.arange(4000) / 4000)
    foot.process(draws.normal(0.0, 1e-3, (6000, 3)), accel)
    assert foot.fastest < np.radians(100.0)


def test_faults():
    for options, match in (
        ({"rate": 40.0}, "rate must be from 48 to 1200 samples a second, got 40.0"),
        ({"rate": 200.0, "floor": "flat"}, "floor must be None or 'level', got 'flat'"),
        ({"rate": 200.0, "gyro_range": 0.0}, "gyro_range must be a positive number of rad/s"),
        ({"rate": 200.0, "channels": 0}, "channels must be at least 1"),
    ):
        with pytest.raises(ValueError, match=match):
            zr.FootFilter(**options)
    foot = zr.FootFilter(200.0)
    with pytest.raises(ValueError, match="accel must"):
        foot.process(np.zeros((5, 3)), np.zeros((4, 3)))
