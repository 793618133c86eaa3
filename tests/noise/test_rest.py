"""Motion in a record that should be at rest: simulated, and in real recordings."""

import numpy as np
import pytest

import zerorate as zr
from support.recordings import RECORDINGS, needs_recordings
from zerorate import NoiseModel
from zerorate.identification.window_filters import moving_average
from zerorate.io.reading import read_sensors
from zerorate.noise.motion_check import MOTION_SIGMAS, Span, largest_step, moving_spans

RATE = 100.0
NOISE = np.random.default_rng(1).standard_normal(60_000)
SECONDS = np.arange(60_000) / RATE


def simulated(n=20_000):
    model = NoiseModel(angle_random_walk=1e-4, bias_instability=2e-5)
    return zr.simulate(model, RATE, n / RATE, seed=1, axes=3)[0][:, 0].copy()


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


@pytest.mark.parametrize("name", zr.simulation.DEVICES)
def test_simulated_devices_do_not_move(name):
    for seed in range(3):
        z, _ = zr.simulate(zr.simulation.device(name), RATE, 1800.0, seed=seed)
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


class TestLargestStep:
    @pytest.mark.parametrize("exponent", [0, 1, 2])
    def test_noise_at_rest_of_any_colour_is_still(self, exponent):
        z = np.random.default_rng(1).standard_normal(200_000)
        for _ in range(exponent):
            z = np.cumsum(z) / 1000.0
        assert largest_step(z, RATE).size < MOTION_SIGMAS

    def test_a_turn_is_found_and_timed(self):
        z = simulated()
        z[12_000:12_300] += 0.5
        step = largest_step(z, RATE)
        assert step.size > MOTION_SIGMAS
        # The turn lasts from 120 to 123 s, and a step lies between two seconds.
        assert step.time in (120.0, 123.0)

    @pytest.mark.parametrize("z", [np.ones(5000), np.full(5000, np.nan), simulated(300)])
    def test_nothing_is_said_without_enough_to_go_by(self, z):
        assert largest_step(z, RATE).size == 0.0

    def test_missing_samples_do_not_count(self):
        z = simulated()
        z[1000:9950] = np.nan
        assert 0.0 < largest_step(z, RATE).size < MOTION_SIGMAS

    @needs_recordings
    @pytest.mark.parametrize(
        ("name", "rate", "moved"),
        [
            ("adis16405_static_100hz_run1", 100.0, False),
            ("mpu6050_static_100hz", 100.0, False),
            ("broad_05_undisturbed_slow_rotation_with_breaks_B", 2000 / 7, True),
            ("mimu4444_array8_62hz_exp1", None, True),
        ],
    )
    def test_recordings(self, name, rate, moved):
        for log in read_sensors(RECORDINGS / f"{name}.parquet", rate=rate):
            steps = [largest_step(z, log.rate).size for z in log.data.T]
            assert [size > MOTION_SIGMAS for size in steps] == [moved] * log.channels
