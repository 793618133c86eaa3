"""Axes that a format has by convention: a level body comes out level."""

import numpy as np
import pytest

import zerorate as zr
from support.recordings import RECORDINGS, needs_recordings
from support.ulogs import flight, write_ulog

COMBINED = ("sensor_combined", 0)


def level(tmp_path, n=2000):
    """A PX4 that stands level: its axes point forward, right and down."""
    topics = flight(n)
    topics[COMBINED]["gyro_rad"] *= np.float32(1e-3)
    force = topics[COMBINED]["accelerometer_m_s2"]
    force *= np.float32(1e-2)
    force[:, 2] -= np.float32(9.81)
    return zr.read_recording(write_ulog(tmp_path / "level.ulg", topics))


def test_a_level_autopilot_has_no_roll(tmp_path):
    recording = level(tmp_path)
    assert recording.gyro.meta["axes"] == "forward, right, down"
    found = zr.estimate_attitude(recording)
    assert found.frame == "ned"
    assert np.degrees(np.abs(found.euler[400:, :2])).max() < 1.0  # noise of 1 mg
    assert found.notes[0] == (
        "the log's axes point forward, right, down: angles are to north, east, down"
    )


def test_a_frame_that_is_asked_for_is_kept_and_said(tmp_path):
    recording = level(tmp_path)
    found = zr.estimate_attitude(recording, frame="enu")
    assert np.degrees(np.abs(found.euler[-1, 0])) > 179.0
    assert "roll is 180 deg in this frame" in found.notes[0]
    assert not any(
        "axes point" in note for note in zr.estimate_attitude(recording, frame="ned").notes
    )


def test_other_logs_are_to_east_north_up():
    recording = zr.simulate_motion("hand", duration=20.0).recording()
    found = zr.estimate_attitude(recording)
    assert found.frame == "enu"
    assert not any("axes" in note for note in found.notes)


@needs_recordings
@pytest.mark.parametrize("name", ["px4_sample_log_small", "px4_motor_failure"])
def test_recorded_flights_are_not_upside_down(name):
    found = zr.estimate_attitude(zr.read_recording(RECORDINGS / f"{name}.ulg"))
    # The one stands level; the other flies, in turns of up to 30 deg.
    assert np.degrees(np.abs(np.median(found.euler[:, :2], axis=0))).max() < 10.0
