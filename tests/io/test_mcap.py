"""MCAP files by any writer: all compressions, orders of messages and of bytes; and their size."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from rosbags import rosbag2
from rosbags.typesys import Stores, get_typestore

import zerorate as zr
from support.bags import EPOCH, IMU, imu_message, values
from zerorate.io import read_log
from zerorate.io.readers.mcap_file import McapReader
from zerorate.io.readers.ros import decode_cdr_imu, read_cdr_imus
from zerorate.record import LogError

mcap_writer = pytest.importorskip("mcap.writer")
STORE = get_typestore(Stores.ROS2_HUMBLE)
COMPRESSIONS = mcap_writer.CompressionType


def write_imus(path, rng, n, compression=COMPRESSIONS.LZ4, **options):
    """Write messages of two topics, with frames and bytes of any order, received in any order.

    The other reader takes messages without chunks in the order of time alone.
    """
    late = 4 if options.get("use_chunking", True) else 1
    with path.open("wb") as file:
        writer = mcap_writer.Writer(file, compression=compression, **options)
        writer.start("ros2", "test")
        text = STORE.generate_msgdef(IMU)[0].encode()
        schema = writer.register_schema(IMU, "ros2msg", text)
        channels = [writer.register_channel(topic, "cdr", schema) for topic in ("/a", "/b")]
        for i, row in enumerate(values(n)):
            frame = "f" * int(rng.integers(9))
            message = imu_message(STORE, EPOCH + i * 10_000_000, row, frame)
            raw = STORE.serialize_cdr(message, IMU, little_endian=bool(rng.integers(2)))
            received = EPOCH + i * 10_000_000 + int(rng.integers(late)) * 9_000_000
            channel = channels[int(rng.integers(2))]
            writer.add_message(channel, received, bytes(raw), received)
        writer.finish()


@pytest.mark.parametrize("compression", COMPRESSIONS)
@pytest.mark.parametrize("options", [{}, {"chunk_size": 2000}, {"use_chunking": False}], ids=str)
@given(seed=st.integers(0, 2**32))
def test_messages_are_those_of_another_reader(tmp_path_factory, compression, options, seed):
    path = tmp_path_factory.mktemp("mcap") / "a.mcap"
    write_imus(path, np.random.default_rng(seed), 40, compression, **options)
    with rosbag2.Reader(path) as reader:
        expected = [(c.topic, time, bytes(raw)) for c, time, raw in reader.messages()]
    own = McapReader(path)
    found = [(c.topic, time, raw) for c, time, raw in own.messages(own.connections)]
    assert found == sorted(expected, key=lambda message: message[1])
    rows = [decode_cdr_imu(raw) for topic, _, raw in found if topic == "/a"]
    wanted = [c for c in own.connections if c.topic == "/a"]
    got = read_cdr_imus(own, wanted)
    assert got["seconds"].tolist() == [row[0] for row in rows]
    assert got["nanoseconds"].tolist() == [row[1] for row in rows]
    expected = np.array([row[2:] for row in rows]).reshape(-1, 6)
    np.testing.assert_array_equal(np.hstack([got["gyro"], got["accel"]]), expected)


def test_a_compression_that_nobody_knows_is_told(tmp_path):
    path = tmp_path / "a.mcap"
    write_imus(path, np.random.default_rng(1), 30)
    path.write_bytes(path.read_bytes().replace(b"\x03\0\0\0lz4", b"\x03\0\0\0xz5"))
    with pytest.raises(LogError, match=r"compression 'xz5', expected lz4, zstd or none"):
        read_log(path)


@pytest.mark.parametrize("step", [0.0, 1e-3])
def test_a_log_takes_at_most_twice_the_bytes_of_parquet(tmp_path, step):
    """Whether samples are of any digits, or of a converter's steps."""
    n = 20_000
    numbers = np.random.default_rng(1).standard_normal((n, 6))
    numbers = np.round(numbers / step) * step if step else numbers
    names = [f"gyro_{axis}_radps" for axis in "xyz"]
    extra = {f"accel_{axis}_mps2": numbers[:, 3 + i] for i, axis in enumerate("xyz")}
    log = zr.Log(np.arange(n) / 1000, 1000.0, numbers[:, :3], names, "rad/s", extra=extra)
    paths = [tmp_path / "a.mcap", tmp_path / "a.parquet"]
    for path in paths:
        zr.write_log(log, path)
    packed, parquet = (path.stat().st_size for path in paths)
    assert packed < 2 * parquet
    np.testing.assert_array_equal(read_log(paths[0]).data, log.data)
