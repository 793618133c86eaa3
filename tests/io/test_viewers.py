"""Logs for other programs, opened with their own libraries: MCAP and Gyroflow's text."""

import struct

import numpy as np
import pytest

import zerorate as zr
from zerorate.record import LogError

N = 20_000


def gyro_log(extra, names=("gyro_x_dps", "gyro_y_dps", "gyro_z_dps")):
    data = np.random.default_rng(5).normal(size=(N, len(names)))
    data[7] = np.nan
    return zr.Log(1.7e9 + np.arange(N) / 200, 200.0, data, names, "deg/s", extra=extra)


def accel():
    values = np.random.default_rng(6).normal(size=(3, N))
    return {f"accel_{axis}_g": row for axis, row in zip("xyz", values, strict=True)}


def messages(path):
    """Return the messages of a file by topic, each with its schema's name and text, and its time.

    The reader goes by the index at the end of the file, and checks all checksums.
    """
    reader = pytest.importorskip("mcap.reader")
    found = {}
    with path.open("rb") as file:
        opened = reader.SeekingReader(file, validate_crcs=True)
        summary = opened.get_summary()
        for schema, channel, message in opened.iter_messages():
            told = (schema.name, schema.data.decode(), schema.encoding, channel.message_encoding)
            rows = found.setdefault(channel.topic, (told, []))[1]
            rows.append((message.log_time, message.data))
        assert summary.statistics.message_count == sum(len(rows) for _, rows in found.values())
        file.seek(0)
        straight = reader.NonSeekingReader(file, validate_crcs=True).iter_messages()
        assert sum(1 for _ in straight) == summary.statistics.message_count
    return found


def test_the_gyro_that_viewers_see_is_that_of_the_log(tmp_path):
    log = gyro_log(accel())
    path = tmp_path / "a.mcap"
    zr.write_log(log, path)
    read = zr.read_recording(path)
    np.testing.assert_allclose(read.gyro.data, np.radians(log.data), rtol=1e-15)
    expected = np.column_stack([*log.extra.values()]) * 9.80665
    np.testing.assert_allclose(read.accel.data, expected, rtol=1e-15)
    assert (read.gyro.rate, read.gyro.time[0], read.gyro.unit) == (200, 1.7e9, "rad/s")


def test_topics_with_their_schemas_in_the_order_of_time(tmp_path):
    bias = {f"bias_gyro_{axis}_radps": np.full(N, 0.1 * i) for i, axis in enumerate("xyz", 1)}
    rest = {"at_rest_gyro_x": np.arange(N) % 3 == 0, "bias_sigma_gyro_x_radps": np.full(N, 0.5)}
    path = tmp_path / "a.mcap"
    zr.write_log(gyro_log(bias | rest), path)
    found = messages(path)
    assert {topic: told[0] for topic, (told, _) in found.items()} == {
        "/imu": "sensor_msgs/msg/Imu",
        "/bias": "geometry_msgs/msg/Vector3Stamped",
        "/status": "zerorate_msgs/msg/Status",
    }
    for (_, text, *encodings), rows in found.values():
        assert encodings == ["ros2msg", "cdr"]
        assert text.startswith("std_msgs/Header header\n")
        assert (len(rows), rows[1][0]) == (N, 1_700_000_000_005_000_000)
    _, raw = found["/bias"][1][3]
    stamp = (1_700_000_000, 15_000_000, 7)
    assert struct.unpack("<iII", raw[4:16]) == stamp
    np.testing.assert_allclose(struct.unpack("<3d", raw[28:]), [0.1, 0.2, 0.3], rtol=1e-15)
    told, rows = found["/status"]
    assert "float64 bias_sigma_gyro_x_radps\nbool at_rest_gyro_x" in told[1]
    assert struct.unpack("<d?", rows[3][1][28:]) == (0.5, True)


def test_a_track_has_poses_and_fixes(tmp_path):
    turn = {f"quat_{axis}": np.full(50, 0.5) for axis in "wxyz"}
    log = zr.Log(
        np.arange(50) / 10, 10.0, np.tile([45.0, 7.0, 300.0], (50, 1)),
        ("latitude_deg", "longitude_deg", "height_m"), "deg, deg, m", extra=turn,
    )  # fmt: skip
    path = tmp_path / "a.mcap"
    zr.write_log(log, path)
    found = messages(path)
    assert set(found) == {"/fix", "/pose"}
    raw = found["/fix"][1][0][1]
    assert struct.unpack("<bH", raw[23:24] + raw[24:26]) == (0, 1)
    assert struct.unpack("<3d", raw[28:52]) == (45, 7, 300)
    assert struct.unpack("<7d", found["/pose"][1][0][1][28:]) == (0, 0, 0, 0.5, 0.5, 0.5, 0.5)


def test_any_log_can_be_written_but_none_before_zero(tmp_path):
    one = zr.Log(np.arange(50) / 10, 10.0, np.ones(50), ["gyro z [dps]"], "deg/s")
    zr.write_log(one, tmp_path / "a.mcap")
    (told, rows), = messages(tmp_path / "a.mcap").values()  # fmt: skip
    assert (len(rows), "float64 c0_gyro_z_dps" in told[1]) == (50, True)
    early = zr.Log(np.arange(50) / 10 - 1, 10.0, np.ones(50), ["gyro_z_dps"], "deg/s")
    with pytest.raises(LogError, match="MCAP has no times before 0, got -1 s"):
        zr.write_log(early, tmp_path / "b.mcap")
    assert not (tmp_path / "b.mcap").exists()


def test_gyroflow_reads_the_gyro_and_the_accelerometer(tmp_path):
    log = gyro_log(accel())
    path = tmp_path / "a.gcsv"
    zr.write_log(log, path)
    rows = pytest.importorskip("telemetry_parser").Parser(str(path)).normalized_imu()
    assert len(rows) == N - 1  # one sample is missing
    there = np.delete(np.arange(N), 7)
    gyro = np.array([row["gyro"] for row in rows])
    np.testing.assert_allclose(gyro, log.data[there], rtol=1e-12)
    found = np.array([row["accl"] for row in rows])
    expected = np.column_stack([*accel().values()])[there] * 9.80665
    np.testing.assert_allclose(found, expected, rtol=1e-12)
    times = [row["timestamp_ms"] for row in rows]
    np.testing.assert_allclose(times, 5.0 * there, atol=1e-6)
    again = zr.read_log(path)
    assert (again.rate, again.n) == (200, N)
    np.testing.assert_allclose(again.data[there], log.data[there], rtol=1e-12)


def test_gyroflow_takes_no_single_axis(tmp_path):
    log = zr.Log(np.arange(50) / 10, 10.0, np.ones(50), ["gyro_z_dps"], "deg/s")
    with pytest.raises(LogError, match="Gyroflow takes a gyro of three axes with a unit, got the"):
        zr.write_log(log, tmp_path / "a.gcsv")
