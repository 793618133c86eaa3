"""Speed of MCAP logs, rows/s, compared with other libraries, and size compared with Parquet.

    python benches/mcap_ratios.py [ROWS]

The log has a gyro and an accelerometer of three axes as ``sensor_msgs/Imu``, in steps of 0.001.
Times are the minimum of five rounds. The library of the format writes messages of the same size.
rosbags reads and decodes a tenth of the rows once.
"""

import sys
import tempfile
import time
from pathlib import Path

import numpy as np

import zerorate as zr
from versions import print_versions


def logged(rows):
    """Return a log with six axes."""
    numbers = np.random.default_rng(1).normal(size=(rows, 6)).round(3)
    names = [f"gyro_{axis}_radps" for axis in "xyz"]
    accel = {f"accel_{axis}_mps2": numbers[:, 3 + i] for i, axis in enumerate("xyz")}
    return zr.Log(np.arange(rows) / 1000, 1000.0, numbers[:, :3], names, "rad/s", extra=accel)


def main():
    print_versions("mcap", "rosbags")
    rows = int(sys.argv[1]) if len(sys.argv) > 1 else 1_000_000
    log = logged(rows)
    with tempfile.TemporaryDirectory() as name:
        path, other = Path(name) / "a.mcap", Path(name) / "b.mcap"
        ours = rows / least(lambda: zr.write_log(log, path, force=True))
        zr.write_log(log, Path(name) / "a.parquet")
        size, parquet = path.stat().st_size, (Path(name) / "a.parquet").stat().st_size
        print(f"{rows} rows, {1e-6 * size:.0f} MB, {size / parquet:.2f} times Parquet's")
        theirs = library(other, rows // 10)
        print(f"written: {ours:.3g} rows/s; mcap {theirs:.3g}; {ours / theirs:.1f} times as fast")
        ours = rows / least(lambda: zr.io.read_log(path))
        zr.write_log(logged(rows // 10), other, force=True)
        theirs = decoded(other)
        print(f"read: {ours:.3g} rows/s; rosbags {theirs:.3g}; {ours / theirs:.1f} times as fast")


def least(work):
    """Return the seconds of the fastest of five rounds."""
    taken = []
    for _ in range(5):
        begun = time.perf_counter()
        work()
        taken.append(time.perf_counter() - begun)
    return min(taken)


def decoded(path):
    """Return the number of rows per second that rosbags reads and decodes."""
    from rosbags.rosbag2 import Reader
    from rosbags.typesys import Stores, get_typestore

    store, rows = get_typestore(Stores.ROS2_HUMBLE), 0
    begun = time.perf_counter()
    with Reader(path) as reader:
        for connection, _, raw in reader.messages():
            store.deserialize_cdr(raw, connection.msgtype)
            rows += 1
    return rows / (time.perf_counter() - begun)


def library(path, rows):
    """Return the number of rows per second that the library of the format writes."""
    from mcap.writer import CompressionType, Writer

    with path.open("wb") as file:
        writer = Writer(file, compression=CompressionType.NONE)
        writer.start("ros2", "mcap")
        schema = writer.register_schema("sensor_msgs/msg/Imu", "ros2msg", b"")
        channel = writer.register_channel("/imu", "cdr", schema)
        data = bytes(324)
        begun = time.perf_counter()
        for i in range(rows):
            writer.add_message(channel, 1_000_000 * i, data, 1_000_000 * i, i)
        writer.finish()
        return rows / (time.perf_counter() - begun)


if __name__ == "__main__":
    main()
