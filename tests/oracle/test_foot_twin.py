"""The track of a foot beside its twin."""

import numpy as np
import pytest

import zerorate as zr
from oracle.foot import Foot
from support.recordings import RECORDINGS, needs_recordings
from zerorate.record.samples import Samples

TOLERANCE = 1e-9
FLIP = (1.0, -1.0, -1.0)


def check_twin(recording, floor):
    samples = Samples.of(recording, mag=False)
    track = zr.FootNavigation(floor=floor).process(recording)
    twin = Foot(samples.time, samples.gyro, samples.accel, level=floor is not None)
    places = twin.run()
    assert len(track.stances) == len(twin.stances)
    assert np.abs(track.position * FLIP - places).max() < TOLERANCE
    last = (track.n - 1) // twin.every * twin.every
    # The swings, lifts and the samples before the first stance add to the variance of positions.
    sigma = track.sigma[last].copy()
    added = np.zeros(3)
    if track._more_variance is not None:
        added += track._more_variance[last]
    if track._lead is not None:
        at_begin = track.sigma[track._lead.begin]
        added += track._lead.variance(track.time, track.position, at_begin)[last]
    sigma[:3] = np.sqrt(sigma[:3] ** 2 - added)
    assert np.abs(sigma - twin.sigma).max() < TOLERANCE
    return track


def test_a_simulated_walk_is_that_of_the_twin():
    walk = zr.simulate_walk(strides=5, seed=2, gyro_range=7.0, step_height=0.17, turn=0.2)
    assert check_twin(walk.recording(), "level").clipped


def test_a_start_in_motion_is_that_of_the_twin():
    recording = zr.simulate_walk(rate=100.0, strides=6, rest=0.0).recording()
    assert not len(check_twin(recording, None).rests)


@needs_recordings
@pytest.mark.slow
@pytest.mark.parametrize("name", ["foot_vicon_20171127111153", "foot_vicon_20171122114044"])
def test_a_recorded_walk_is_that_of_the_twin(name):
    check_twin(zr.read_recording(RECORDINGS / f"{name}_200hz.parquet"), "level")
