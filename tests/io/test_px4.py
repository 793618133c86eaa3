"""PX4's ULog files: made byte by byte, and the real one."""

import numpy as np
import pytest

import zerorate as zr
from support.recordings import RECORDINGS, needs_recordings
from support.ulogs import MAGIC, flight, sensor, stamps, write_ulog
from zerorate.io.reading import read_sensors
from zerorate.record import LogError

N = 400
INVALID = 0x7FFFFFFF
COMBINED = ("sensor_combined", 0)


def vectors(n=N, seed=7):
    return np.random.default_rng(seed).standard_normal((n, 3)).astype(np.float32)


def test_the_gyro_that_the_autopilot_flies_with(tmp_path):
    topics = flight(N)
    log = zr.read_log(write_ulog(tmp_path / "a.ulg", topics))
    assert log.names == ("gyro_x_radps", "gyro_y_radps", "gyro_z_radps")
    assert (log.rate, log.unit, log.time[0], log.n) == (200, "rad/s", 1.0, N)
    assert (log.meta["format"], log.meta["sensor"]) == ("ulog", "sensor_combined")
    np.testing.assert_array_equal(log.data, topics[COMBINED]["gyro_rad"])


def test_an_accelerometer_without_a_new_sample_is_missing(tmp_path):
    topics = flight(N)
    topics[COMBINED]["accelerometer_timestamp_relative"][[3, 7]] = INVALID
    gyro, accel = read_sensors(write_ulog(tmp_path / "a.ulg", topics))
    assert (gyro.missing_count, accel.missing_count, accel.unit) == (0, 2, "m/s^2")
    expected = topics[COMBINED]["accelerometer_m_s2"]
    np.testing.assert_array_equal(accel.data[4:7], expected[4:7])


def test_increments_are_means_over_their_time(tmp_path):
    angle, velocity = vectors(), vectors(seed=8)
    fields = {
        "timestamp": stamps(N, 5000),
        "timestamp_sample": stamps(N, 5000, 999_000),
        "delta_angle": angle,
        "delta_velocity": velocity,
        "delta_angle_dt": np.full(N, 5000, np.uint32),
        "delta_velocity_dt": np.full(N, 4000, np.uint32),
    }
    fields["delta_angle_dt"][5] = 0
    gyro, accel = read_sensors(write_ulog(tmp_path / "a.ulg", {("vehicle_imu", 0): fields}))
    assert (gyro.time[0], gyro.rate) == (0.999, 200)
    np.testing.assert_array_equal(gyro.data[:5], angle[:5].astype(float) / (1e-6 * 5000))
    np.testing.assert_array_equal(accel.data, velocity.astype(float) / (1e-6 * 4000))
    assert not np.isfinite(gyro.data[5]).any()


@pytest.mark.parametrize("sampled", [True, False])
def test_the_time_of_the_sample_where_the_driver_tells_it(tmp_path, sampled):
    told = stamps(N, 5000, 900_000) if sampled else np.zeros(N, np.uint64)
    fields = sensor(N, 5000, vectors(), timestamp_sample=told)
    log = zr.read_log(write_ulog(tmp_path / "a.ulg", {("sensor_gyro", 0): fields}))
    assert log.time[0] == (0.9 if sampled else 1.0)


def instances():
    return flight(N) | {
        ("sensor_accel", 0): sensor(20, 100_000, vectors(20), 31.0),
        ("sensor_gyro", 0): sensor(20, 100_000, vectors(20, 9), 30.0),
        ("sensor_gyro", 1): sensor(40, 50_000, vectors(40), 29.0),
        ("vehicle_magnetometer", 0): {
            "timestamp": stamps(100, 20_000),
            "magnetometer_ga": vectors(100),
        },
        ("vehicle_angular_velocity", 0): {"timestamp": stamps(N, 5000), "xyz": vectors()},
        ("cpuload", 0): {
            "timestamp": stamps(4, 500_000),
            "load": np.ones(4, np.float32),
            "gyro_rate_hz": np.ones(4, np.float32),
        },
    }


def test_every_instance_is_a_log_of_its_own(tmp_path):
    recording = zr.read_recording(write_ulog(tmp_path / "a.ulg", instances()))
    rates = {name: round(log.rate, 6) for name, log in recording.items()}
    assert rates == {
        "gyro": 200, "accel": 200,
        "gyro_1": 10, "temperature": 10, "gyro_2": 20, "temperature_1": 20,
        "accel_1": 10, "temperature_2": 10,
        "mag": 50,
    }  # fmt: skip
    assert recording["gyro_2"].meta["sensor"] == "sensor_gyro_1"
    assert (recording.mag.unit, recording.temperature.unit) == ("gauss", "degC")
    assert recording["temperature_1"].data[0, 0] == 29.0
    np.testing.assert_array_equal(recording["gyro_1"].data, vectors(20, 9))


def test_a_topic_is_chosen_by_name(tmp_path):
    path = write_ulog(tmp_path / "a.ulg", instances())
    for topic, rate in {"sensor_gyro": 10, "sensor_gyro_0": 10, "sensor_gyro_1": 20}.items():
        assert zr.read_log(path, topic=topic).rate == rate
    assert zr.read_log(path, topic="vehicle_angular_velocity").rate == 200
    assert zr.read_log(path, topic="cpuload", columns="load").rate == 2
    assert zr.read_recording(path, topic="sensor_gyro_1").gyro.rate == 20
    with pytest.raises(LogError, match=r"no topic 'imu'; the log has: cpuload, sensor_accel, "):
        zr.read_log(path, topic="imu")


@pytest.mark.parametrize("old", [True, False])
def test_fixes_in_degrees_and_metres(tmp_path, old):
    n = 12
    fields = {"timestamp": stamps(n, 200_000), "fix_type": np.full(n, 3, np.uint8)}
    if old:
        fields |= {
            "lat": np.full(n, 473977418, np.int32),
            "lon": np.full(n, -85455942, np.int32),
            "alt": np.full(n, 488123, np.int32),
        }
    else:
        fields |= {
            "latitude_deg": np.full(n, 47.3977418),
            "longitude_deg": np.full(n, -8.5455942),
            "altitude_msl_m": np.full(n, 488.123),
        }
    fields |= {f"vel_{way}_m_s": np.full(n, i, np.float32) for i, way in enumerate("ned")}
    fields["fix_type"][4] = 0
    name = "vehicle_gps_position" if old else "sensor_gps"
    recording = zr.read_recording(write_ulog(tmp_path / "a.ulg", flight() | {(name, 0): fields}))
    position, velocity = recording.position, recording["velocity"]
    assert (position.rate, position.units) == (5, ("deg", "deg", "m"))
    # Half a unit in the last place of a product with 1e-7.
    np.testing.assert_allclose(position.data[0], [47.3977418, -8.5455942, 488.123], rtol=1e-15)
    assert (position.missing_count, velocity.missing_count) == (1, 1)
    assert (velocity.unit, velocity.data[0].tolist()) == ("m/s", [0, 1, 2])


def test_the_magnetometer_of_old_logs_has_a_log_at_its_own_rate(tmp_path):
    topics, mag = flight(N), vectors()
    topics[COMBINED]["magnetometer_timestamp_relative"] = (-5000 * (np.arange(N) % 4)).astype(
        np.int32
    )
    topics[COMBINED]["magnetometer_ga"] = mag
    recording = zr.read_recording(write_ulog(tmp_path / "a.ulg", topics))
    assert (recording.gyro.rate, recording.mag.rate) == (200, 50)
    np.testing.assert_array_equal(recording.mag.data, mag[::4])


def test_the_true_orientation_of_a_simulated_flight_is_a_reference(tmp_path):
    q = np.tile(np.float32([1, 0, 0, 0]), (N, 1))
    truth = {("vehicle_attitude_groundtruth", 0): {"timestamp": stamps(N, 5000), "q": q}}
    recording = zr.read_recording(write_ulog(tmp_path / "a.ulg", flight(N) | truth))
    assert (recording.reference.unit, recording.reference.channels) == ("1", 4)


def test_an_estimated_attitude_is_a_reference_that_says_so(tmp_path):
    q = np.tile(np.float32([1, 0, 0, 0]), (N, 1))
    own = {("vehicle_attitude", 0): {"timestamp": stamps(N, 5000), "q": q}}
    recording = zr.read_recording(write_ulog(tmp_path / "a.ulg", flight(N) | own))
    assert recording.reference.meta["sensor"] == "vehicle_attitude"
    assert any("the autopilot's own estimate" in note for note in recording.notes)
    truth = {("vehicle_attitude_groundtruth", 0): {"timestamp": stamps(N, 5000), "q": q}}
    recording = zr.read_recording(write_ulog(tmp_path / "a.ulg", flight(N) | own | truth))
    assert recording.reference.meta["sensor"] == "vehicle_attitude_groundtruth"
    assert "reference_1" not in recording.names


def fifo(counts, samples, period, scale):
    """Return the rows of a topic of samples, (n, 3) in whole numbers, so many in each."""
    ends = np.cumsum(counts)
    fields = {
        "timestamp": (1_000_500 + period * ends).astype(np.uint64),
        "timestamp_sample": (1_000_000 + period * (ends - 1)).astype(np.uint64),
        "device_id": np.full(len(counts), 7, np.uint32),
        "dt": np.full(len(counts), period, np.float32),
        "scale": np.full(len(counts), scale, np.float32),
        "samples": np.asarray(counts, np.uint8),
    }
    for i, axis in enumerate("xyz"):
        rows = np.zeros((len(counts), 32), np.int16)
        for row, end, count in zip(rows, ends, counts, strict=True):
            row[:count] = samples[end - count : end, i]
        fields[axis] = rows
    return fields


def test_samples_that_come_many_in_a_row(tmp_path):
    counts = [8, 32, 20, 31] * 5
    samples = np.random.default_rng(6).integers(-3000, 3000, (sum(counts), 3))
    topics = {("sensor_gyro_fifo", 0): fifo(counts, samples, 125, 0.001)}
    path = write_ulog(tmp_path / "a.ulg", flight(N) | topics)
    log = zr.read_log(path, topic="sensor_gyro_fifo")
    assert (log.rate, log.time[0], log.n) == (8000, 1.0, len(samples))
    np.testing.assert_array_equal(log.data, samples * float(np.float32(0.001)))
    notes = zr.read_log(path).meta["notes"]
    assert any("faster samples are read by topic=: sensor_gyro_fifo" in str(n) for n in notes)
    assert "gyro_1" not in zr.read_recording(path).names
    alone = write_ulog(tmp_path / "b.ulg", topics)
    assert zr.read_log(alone).rate == 8000


def test_topics_of_one_device_are_told(tmp_path):
    one, other = ({"device_id": np.full(N, number, np.uint32)} for number in (7, 9))
    imu = {
        "timestamp": stamps(N, 5000),
        "gyro_device_id": np.full(N, 9, np.uint32),
        **{f"delta_{kind}": vectors() for kind in ("angle", "velocity")},
        **{f"delta_{kind}_dt": np.full(N, 5000, np.uint32) for kind in ("angle", "velocity")},
    }
    topics = {
        ("vehicle_imu", 0): imu,
        ("sensor_gyro", 0): sensor(N, 5000, vectors(), **one),
        ("sensor_gyro", 1): sensor(N, 5000, vectors(), **other),
    }
    recording = zr.read_recording(write_ulog(tmp_path / "a.ulg", topics))
    assert "sensor_gyro_1 and vehicle_imu are of one device" in recording["gyro_2"].meta["notes"]
    assert not any("one device" in str(note) for note in recording["gyro_1"].meta["notes"])


def test_the_calibration_among_the_parameters(tmp_path):
    parameters = {"CAL_GYRO0_XOFF": 0.0125, "CAL_GYRO0_ID": 3, "SYS_AUTOSTART": 4001}
    log = zr.read_log(write_ulog(tmp_path / "a.ulg", flight(N), parameters=parameters))
    expected = {"CAL_GYRO0_XOFF": pytest.approx(0.0125), "CAL_GYRO0_ID": 3}
    assert log.meta["calibration"] == expected


def test_what_the_logger_lost_is_a_gap_and_noted(tmp_path):
    topics = flight(N)
    kept = np.delete(np.arange(N), range(100, 120))
    topics[COMBINED] = {name: values[kept] for name, values in topics[COMBINED].items()}
    log = zr.read_log(write_ulog(tmp_path / "a.ulg", topics, dropouts=[(1_500_000, 100)]))
    assert (log.missing_count, log.meta["clock"].gap_count) == (20, 1)
    assert "1 dropout of the logger, 0.1 s in all" in log.meta["notes"]


def test_a_log_that_was_cut_off_is_read_as_far_as_it_goes(tmp_path):
    path = write_ulog(tmp_path / "a.ulg", flight(N))
    path.write_bytes(path.read_bytes()[:-7])
    log = zr.read_log(path)
    assert log.n == N - 1
    assert any("it was cut off" in note for note in log.meta["notes"])


def test_damaged_messages_are_left_out_and_noted(tmp_path, capsys):
    path = write_ulog(tmp_path / "a.ulg", flight(N))
    raw = bytearray(path.read_bytes())
    raw[-30 * 41 : -28 * 41] = bytes(2 * 41)
    path.write_bytes(raw)
    told = "82 of its 16605 bytes are damaged or unknown: they are left out"
    assert told in zr.read_log(path).meta["notes"]
    assert capsys.readouterr().out == ""


@pytest.mark.parametrize("size", [9, 17, 40, 150, 200])
def test_a_log_cut_off_before_its_data(tmp_path, size):
    path = write_ulog(tmp_path / "a.ulg", flight(3))
    path.write_bytes(path.read_bytes()[:size])
    with pytest.raises(LogError, match="cannot be read as a ULog: truncated, damaged or"):
        zr.read_log(path)


def test_a_log_of_an_unknown_version(tmp_path):
    path = write_ulog(tmp_path / "a.ulg", flight(3))
    raw = bytearray(path.read_bytes())
    raw[16 + 3 + 8] = 0x80  # an incompatible flag
    path.write_bytes(raw)
    with pytest.raises(LogError, match="cannot be read as a ULog"):
        zr.read_log(path)


def test_a_log_without_a_gyro(tmp_path):
    topics = {("sensor_accel", 0): sensor(20, 100_000, vectors(20))}
    path = write_ulog(tmp_path / "a.ulg", topics)
    with pytest.raises(LogError, match=r"no topic holds a gyro, .*; the log has: sensor_accel$"):
        zr.read_log(path)
    assert zr.read_recording(path).names == ("accel",)


def test_a_log_without_any_message(tmp_path):
    with pytest.raises(LogError, match=r"no topic holds a gyro, .*; the log has: none$"):
        zr.read_log(write_ulog(tmp_path / "a.ulg", {}))
    with pytest.raises(LogError, match="no topic holds a gyro"):
        zr.read_recording(tmp_path / "a.ulg")


def test_fields_of_an_unknown_version_keep_their_names(tmp_path):
    fields = {"timestamp": stamps(20, 10_000), "roll_rate": np.ones(20, np.float32)}
    log = zr.read_log(write_ulog(tmp_path / "a.ulg", {("sensor_gyro", 0): fields}))
    assert (log.names, log.unit) == (("roll_rate",), "unit")


def test_something_else_by_that_name(tmp_path):
    (tmp_path / "a.ulg").write_bytes(b"PAR1....")
    with pytest.raises(LogError, match="by its suffix a ULog, by its content Parquet"):
        zr.read_log(tmp_path / "a.ulg")
    (tmp_path / "a.csv").write_bytes(MAGIC)
    with pytest.raises(LogError, match="by its content a ULog"):
        zr.read_log(tmp_path / "a.csv")


SAMPLE = RECORDINGS / "px4_sample_log_small.ulg"


@needs_recordings
def test_the_gyro_of_a_real_flight():
    log = zr.read_log(SAMPLE)
    clock = log.meta["clock"]
    assert (log.channels, log.unit) == (3, "rad/s")
    # 1 298 samples of 6.5 s, and a gap of 0.16 s where the logger lost messages.
    assert (log.n - log.missing_count, clock.gap_count) == (1298, 1)
    assert log.rate == pytest.approx(204.6, abs=0.1)
    assert np.abs(log.data[np.isfinite(log.data)]).max() < 10.0


@needs_recordings
def test_all_sensors_of_a_real_flight():
    recording = zr.read_recording(SAMPLE)
    counts = {kind: len(recording.of_kind(kind)) for kind in ("gyro", "accel", "mag", "position")}
    assert counts == {"gyro": 7, "accel": 7, "mag": 3, "position": 1}
    assert np.linalg.norm(np.nanmean(recording.accel.data, axis=0)) == pytest.approx(9.8, abs=1.5)
    assert np.nanmean(recording.position.data, axis=0)[:2] == pytest.approx([63.4, 10.4], abs=0.1)
    assert recording.position.rate == pytest.approx(5, rel=0.01)
