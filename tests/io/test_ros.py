"""ROS 1 and 2 bags and MCAP files, as the package `rosbags` writes them."""

import sys

import numpy as np
import pytest
from rosbags import rosbag2
from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin
from rosbags.typesys import Stores, get_typestore

from support import bags
from support.bags import EPOCH, IMU, KINDS, WIND, imu_message, values, write_own, write_recording
from zerorate.io import read_fixes, read_log, read_recording
from zerorate.io.readers.ros import decode_cdr_imu
from zerorate.io.reading import read_sensors
from zerorate.record import LogError


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("frame", ["", "imu", "imu_link", "a_frame_of_odd_length"])
def test_the_gyro_of_a_recording(tmp_path, kind, frame):
    log = read_log(write_recording(tmp_path, kind, ["/imu"], frame=frame))
    assert log.names == tuple(f"angular_velocity_{axis}_radps" for axis in "xyz")
    assert (log.rate, log.unit, log.meta["sensor"]) == (100, "rad/s", "/imu")
    assert log.time[0] == EPOCH / 1e9
    assert log.meta["clock"].jitter_max < 1e-9  # stamps in whole nanoseconds
    np.testing.assert_array_equal(log.data, values(50)[:, :3])


def test_the_accelerometer_next_to_it(tmp_path):
    gyro, accelerometer = read_sensors(write_recording(tmp_path, "mcap", ["/imu"]))
    assert (gyro.unit, accelerometer.unit) == ("rad/s", "m/s^2")
    np.testing.assert_array_equal(accelerometer.data, values(50)[:, 3:])


@pytest.mark.parametrize("kind", KINDS)
def test_a_topic_is_chosen_by_name(tmp_path, kind):
    path = write_recording(tmp_path, kind, ["/left/imu", "/right/imu"])
    with pytest.raises(LogError, match=r"2 topics hold .*topic= from: /left/imu, /right/imu"):
        read_log(path)
    assert read_log(path, topic="/right/imu").meta["sensor"] == "/right/imu"
    with pytest.raises(LogError, match=r"no topic '/imu' .*; the recording has: /left/imu, /right"):
        read_log(path, topic="/imu")


@pytest.mark.parametrize("kind", KINDS)
def test_a_recording_without_a_gyro(tmp_path, kind):
    path = write_recording(tmp_path, kind, ["/wind"], msgtype=WIND)
    with pytest.raises(LogError, match=f"no topic holds {IMU}"):
        read_log(path)


def test_lost_messages_are_missing_samples(tmp_path):
    log = read_log(write_recording(tmp_path, "bag", ["/imu"], lost=(20, 21, 40)))
    assert (log.n, log.missing_count, log.meta["clock"].gap_count) == (50, 3, 2)
    np.testing.assert_array_equal(log.data[22:40], values(50)[22:40, :3])


@pytest.mark.parametrize("kind", ["bag", "db3", "mcap"])
@pytest.mark.parametrize("part", [0.02, 0.3, 0.6, 0.9, 0.99])
def test_a_truncated_recording(tmp_path, kind, part):
    path = write_recording(tmp_path, kind, ["/imu"], n=500)
    whole = path.read_bytes()
    path.write_bytes(whole[: int(part * len(whole))])
    with pytest.raises(LogError, match="truncated, damaged or of a foreign kind"):
        read_log(path)


def test_an_mcap_of_another_profile(tmp_path):
    path = write_recording(tmp_path, "mcap", ["/imu"])
    path.write_bytes(path.read_bytes().replace(b"ros2", b"ros1", 1))
    with pytest.raises(LogError, match=r"of a foreign kind \(Profile is not ros2\)"):
        read_log(path)


def test_either_order_of_bytes():
    store = get_typestore(Stores.ROS2_HUMBLE)
    row = values(1)[0]
    message = imu_message(store, EPOCH, row, frame="imu")
    for little in (True, False):
        raw = bytes(store.serialize_cdr(message, IMU, little_endian=little))
        assert decode_cdr_imu(raw) == (*divmod(EPOCH, 1_000_000_000), *row)


def test_a_bag_folder_without_its_file(tmp_path):
    path = write_recording(tmp_path, "folder", ["/imu"])
    next(path.glob("*.db3")).unlink()
    with pytest.raises(LogError, match="truncated, damaged or of a foreign kind"):
        read_log(path)


def test_one_message_gives_no_rate(tmp_path):
    with pytest.raises(LogError, match="one row gives no rate"):
        read_log(write_recording(tmp_path, "mcap", ["/imu"], n=1))


def test_no_message(tmp_path):
    with pytest.raises(LogError, match="columns but no rows"):
        read_log(write_recording(tmp_path, "mcap", ["/imu"], n=0))


def test_a_clock_that_stands(tmp_path):
    with pytest.raises(LogError, match="do not advance"):
        read_log(write_recording(tmp_path, "mcap", ["/imu"], period=0))


def test_only_recordings_have_topics(tmp_path):
    np.save(tmp_path / "a.npy", np.zeros(5))
    for source in (tmp_path / "a.npy", np.zeros(5)):
        with pytest.raises(LogError, match="topic= chooses among the topics of a ROS recording"):
            read_log(source, rate=1, topic="/imu")


@pytest.mark.parametrize("kind", KINDS)
def test_without_rosbags_the_extra_is_named(tmp_path, monkeypatch, kind):
    path = write_recording(tmp_path, kind, ["/imu"])
    monkeypatch.setitem(sys.modules, "rosbags", None)
    with pytest.raises(ImportError, match=r"pip install '\.\[ros\]' in the checkout"):
        read_log(path)


@pytest.mark.parametrize("kind", ["bag", "mcap", "folder"])
def test_messages_of_ones_own_whose_fields_tell(tmp_path, kind):
    path = write_own(tmp_path, kind)
    recording = read_recording(path)
    gyro, accel = recording.gyro, recording.accel
    assert gyro.names == ("gyro_radps[0]", "gyro_radps[1]", "gyro_radps[2]")
    assert (gyro.rate, gyro.unit, gyro.time[0]) == (100, "rad/s", EPOCH / 1e9)
    np.testing.assert_array_equal(gyro.data, values(50)[:, :3])
    np.testing.assert_array_equal(accel.data, values(50)[:, 3:].astype(np.float32))
    assert "/motion holds my_msgs/msg/Motion, read by the names of its fields" in gyro.meta["notes"]
    assert (recording.position.rate, recording.position.units) == (20, ("deg", "deg", "m"))
    fixes = read_fixes(path)
    assert (len(fixes), fixes.position[1, 0]) == (10, 45.000005)


def test_topics_of_any_type_are_listed(tmp_path):
    with pytest.raises(LogError, match=r"no topic '/imu' .*; the recording has: /fix, /motion"):
        read_log(write_own(tmp_path, "mcap"), topic="/imu")


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("marked", [False, True])
def test_gyro_and_accelerometer_in_topics_of_their_own_are_joined(tmp_path, kind, marked):
    """What a message has not is zero in all of them, or marked by its covariance."""
    store = get_typestore(Stores.ROS1_NOETIC if kind == "bag" else Stores.ROS2_HUMBLE)
    rows = values(120)
    path = tmp_path / ("run.bag" if kind == "bag" else f"run_{kind}")
    with bags._writer(path, kind) as writer:
        for name, half, step in (("gyro", slice(0, 3), 1), ("accel", slice(3, 6), 3)):
            connection = writer.add_connection(f"/{name}/sample", IMU, typestore=store)
            for i in range(0, 120, step):
                row = rows[i] * 1.0 if marked else np.zeros(6)
                row[half] = rows[i, half]
                stamp = EPOCH + i * 5_000_000
                message = imu_message(store, stamp, row, "imu")
                for other, field in (
                    ("accel", "angular_velocity"),
                    ("gyro", "linear_acceleration"),
                ):
                    covariance = np.zeros(9)
                    covariance[0] = -1.0 if marked and other == name else 0.0
                    object.__setattr__(message, f"{field}_covariance", covariance)
                writer.write(connection, stamp, bags._bytes(store, message, kind))
    source = next(path.glob(f"*.{kind}")) if kind in ("db3", "mcap") else path
    recording = read_recording(source)
    assert recording.names == ("gyro", "accel")
    np.testing.assert_array_equal(recording.gyro.data, rows[:, :3])
    np.testing.assert_array_equal(recording.accel.data, rows[::3, 3:])
    assert recording.gyro.rate == pytest.approx(200.0)
    assert read_log(source).n == 120
    assert any("absent" in note for note in recording.gyro.meta["notes"])


@pytest.mark.parametrize("mode", ["FILE", "MESSAGE"])
def test_compressed_recordings_of_ros_2(tmp_path, mode):
    store = get_typestore(Stores.ROS2_HUMBLE)
    writer = rosbag2.Writer(tmp_path / "run", version=9, storage_plugin=StoragePlugin.SQLITE3)
    writer.set_compression(CompressionMode[mode], CompressionFormat.ZSTD)
    rows = values(50)
    with writer:
        connection = writer.add_connection("/imu", IMU, typestore=store)
        for i, row in enumerate(rows):
            stamp = EPOCH + i * 10_000_000
            message = imu_message(store, stamp, row, "imu")
            writer.write(connection, stamp, store.serialize_cdr(message, IMU))
    np.testing.assert_array_equal(read_log(tmp_path / "run").data, rows[:, :3])
