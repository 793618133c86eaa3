"""The real recordings, read as logs."""

import pytest

from support.recordings import RECORDINGS, needs_recordings
from zerorate.io import read_log
from zerorate.record import LogError

RATES = {
    "adis16405_static_100hz_run1": (100.0, 1_000_000, 3, "deg/s"),
    "mpu6050_static_100hz": (100.0, 44_930, 3, "deg/s"),
    "broad_05_undisturbed_slow_rotation_with_breaks_B": (2000 / 7, 59_212, 3, "rad/s"),
    "mimu4444_array8_62hz_exp1": (62.5, 37_439, 24, "deg/s"),
}


@needs_recordings
@pytest.mark.parametrize("name", RATES)
def test_recordings(name):
    rate, n, channels, unit = RATES[name]
    log = read_log(RECORDINGS / f"{name}.parquet", rate=rate, sensor="all")
    assert (log.rate, log.n, log.channels, log.unit) == (rate, n, channels, unit)
    assert log.missing_count == 0
    assert all("gyro" in channel for channel in log.names)


@needs_recordings
def test_recording_statistics():
    log = read_log(RECORDINGS / "mpu6050_static_100hz.parquet", rate=100)
    assert log.data.mean(axis=0) == pytest.approx([-3.34, 1.09, -0.498], rel=5e-3)
    assert log.data.std(axis=0) == pytest.approx([0.0746, 0.111, 0.0936], rel=5e-3)


@needs_recordings
def test_recording_with_late_and_repeated_stamps():
    log = read_log(RECORDINGS / "mpu6050_encoder_yaw_slow_100hz.parquet")
    clock = log.meta["clock"]
    # One step of two periods is never made up for; the other 26 follow a repeated stamp.
    assert (clock.repeated_count, clock.missing_count, clock.backward_count) == (26, 1, 0)
    assert log.n == 149_828
    assert log.rate == pytest.approx(149_827 / (1701.925 - 202.022), rel=1e-5)
    assert "26 repeated stamps" in clock.summary()


@needs_recordings
def test_recording_without_timestamps_asks_for_the_rate():
    with pytest.raises(LogError, match="give rate="):
        read_log(RECORDINGS / "mpu6050_static_100hz.parquet")
