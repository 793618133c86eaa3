"""The rest that an alignment finds where a vehicle moves off as gently as its sensors are noisy."""

import numpy as np
import pytest

import zerorate as zr

NOISY = {
    "gyro": zr.NoiseModel(angle_random_walk=np.radians(0.05), rate_random_walk=1e-5),
    "accel": zr.NoiseModel(angle_random_walk=0.02, rate_random_walk=5e-4, quantity="acceleration"),
}


def aligned(recording):
    return zr.align(recording, latitude=48.0, heading="course")


@pytest.mark.parametrize("noise", [{}, NOISY])
@pytest.mark.parametrize("seed", range(5, 9))
def test_it_ends_before_the_vehicle_moves(noise, seed):
    drive = zr.simulate_drive(duration=80.0, seed=seed, **noise)
    start = aligned(drive.recording())
    speed = np.linalg.norm(drive.truth_velocity, axis=1)
    assert 20.0 < start.time < drive.time[np.argmax(speed > 0.1)]
    off = start.gyro_bias - drive.gyro_bias[round(start.time * drive.rate)]
    # The earth turns, and where to is not known.
    assert np.abs(off).max() < 5.0 * start.gyro_bias_sigma


def test_missing_seconds_are_no_motion():
    drive = zr.simulate_drive(duration=80.0, seed=5)
    recording = drive.recording()
    recording.gyro.data[1000:1150] = np.nan
    assert aligned(recording).time == pytest.approx(aligned(drive.recording()).time)


def test_what_never_rests_says_so():
    drive = zr.simulate_drive(duration=80.0, seed=5, rest=4.0)
    with pytest.raises(zr.LogError, match="does not rest for 10 s"):
        aligned(drive.recording())
