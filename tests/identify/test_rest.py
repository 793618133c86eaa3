"""When a sensor was moved: simulated motion and noise, and real recordings."""

import numpy as np
import pytest

import zerorate as zr
from support.recordings import RECORDINGS, needs_recordings
from zerorate.identify.rest import Span, moving_spans
from zerorate.identify.window_filters import moving_average

RATE = 100.0
NOISE = np.random.default_rng(1).standard_normal(60_000)
SECONDS = np.arange(60_000) / RATE


def column(name, axis, rate=None):
    log = zr.read_log(RECORDINGS / name, rate=rate, columns=axis)
    return log.data[:, 0]


@needs_recordings
@pytest.mark.parametrize("axis", "xyz")
def test_movement_of_a_recording_is_found(axis):
    rate = 2000.0 / 7.0
    name = "broad_05_undisturbed_slow_rotation_with_breaks_B.parquet"
    spans = moving_spans(column(name, f"gyro_{axis}_radps", rate), rate)
    marked = [(35.4, 68.1), (76.0, 101.2), (124.6, 147.2), (157.4, 178.8)]
    # Windows of a second, and the hand is on the sensor up to a second before and after.
    np.testing.assert_allclose(spans, marked, rtol=0, atol=2.0)
    for (start, end), (first, last) in zip(spans, marked, strict=True):
        # A tenth of a second of faint motion does not make a window move.
        assert start <= first + 0.1
        assert end >= last - 0.1


@needs_recordings
@pytest.mark.parametrize("axis", "xyz")
@pytest.mark.parametrize("name", ["adis16405_static_100hz_run1", "mpu6050_static_100hz"])
def test_recordings_at_rest_do_not_move(name, axis):
    assert moving_spans(column(f"{name}.parquet", f"gyro_{axis}_dps", RATE), RATE) == ()


@needs_recordings
@pytest.mark.parametrize("axis", "xyz")
def test_a_shaft_that_never_rests_moves_throughout(axis):
    z = column("mpu6050_encoder_yaw_slow_100hz.parquet", f"shaft_gyro_{axis}_dps")
    moving = sum(span.end - span.start for span in moving_spans(z, RATE))
    # It turns about z; y feels little of it, and a pause of six seconds among 1500.
    assert moving > 0.99 * z.size / RATE


@needs_recordings
def test_every_turn_between_poses_is_found():
    z = column("mimu4444_array8_62hz_exp1.parquet", "imu1_gyro_x_dps")
    assert len(moving_spans(z, 62.5)) == 20


@pytest.mark.parametrize("name", zr.DEVICES)
def test_simulated_devices_do_not_move(name):
    for seed in range(3):
        z, _ = zr.simulate(zr.device(name), RATE, 1800.0, seed=seed)
        assert moving_spans(z, RATE) == ()


@pytest.mark.parametrize(
    "z",
    [
        NOISE,
        np.cumsum(NOISE),
        NOISE + np.cumsum(NOISE),
        NOISE + np.linspace(0.0, 1000.0, NOISE.size),
        moving_average(NOISE, 5),
        moving_average(NOISE, 1000),
        np.round(0.5 * NOISE),
        np.round(0.25 * NOISE),
        np.zeros(60_000),
        np.where(np.arange(60_000) % 7 < 3, np.nan, NOISE),
        np.where(np.arange(60_000) // 5000 % 2, np.nan, NOISE),
    ],
)
def test_noise_does_not_move(z):
    assert moving_spans(z, RATE) == ()


@pytest.mark.parametrize("period", [5.0, 8.0, 20.0])
def test_motion_without_a_pause_is_found(period):
    z = NOISE + 100.0 * np.sin(2.0 * np.pi * SECONDS / period)
    assert moving_spans(z, RATE) == (Span(0.0, 600.0),)


def test_short_motions_are_found_and_short_pauses_bridged():
    z = 5.0 + NOISE
    for start, end in [(100, 103), (107, 110), (300, 301)]:
        z[start * 100 : end * 100] += 40.0 * np.sin(np.arange((end - start) * 100) / 10.0)
    expected = (Span(100.0, 110.0), Span(300.0, 301.0))
    assert moving_spans(z, RATE) == expected
    # Powers of two round nothing.
    assert moving_spans(2.0**-60 * z, RATE) == expected


def test_turning_steadily_is_seen_where_it_begins_and_ends():
    z = NOISE + 30.0 * ((SECONDS >= 200.0) & (SECONDS < 300.0))
    assert moving_spans(z, RATE) == (Span(199.0, 201.0), Span(299.0, 301.0))


def test_slow_records_have_longer_windows():
    z = NOISE[:2000].copy()
    z[1000:1020] += 40.0 * np.sin(np.arange(20))
    assert moving_spans(z, 1.0) == (Span(1000.0, 1020.0),)


def test_short_records_cannot_tell():
    z = NOISE.copy()
    z[500:600] += 1000.0
    assert moving_spans(z[:1999], RATE) == ()


def test_wrong_input_is_refused_in_a_sentence():
    with pytest.raises(ValueError, match="rate must be a positive finite number of Hz, got -1"):
        moving_spans(NOISE, -1)
    with pytest.raises(ValueError, match="z must be one axis"):
        moving_spans(NOISE.reshape(-1, 2), RATE)
    with pytest.raises(ValueError, match="z holds no finite sample"):
        moving_spans([np.nan], RATE)
