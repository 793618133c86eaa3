"""Logs as MCAP: rows a second, and how much faster than the format's own library.

    python benches/mcap_ratios.py [ROWS]

A gyro and an accelerometer of three axes as ``sensor_msgs/Imu``, least of five rounds; the
library writes as many bytes a message, once, for a tenth of the rows.
"""

import sys
import tempfile
import time
from pathlib import Path

import numpy as np

import zerorate as zr
from versions import print_versions


def main():
    print_versions("mcap")
    rows = int(sys.argv[1]) if len(sys.argv) > 1 else 1_000_000
    rng = np.random.default_rng(1)
    names = [f"gyro_{axis}_radps" for axis in "xyz"]
    rates = rng.normal(size=(rows, 3))
    accel = {f"accel_{axis}_mps2": rng.normal(size=rows) for axis in "xyz"}
    log = zr.Log(np.arange(rows) / 1000, 1000.0, rates, names, "rad/s", extra=accel)
    with tempfile.TemporaryDirectory() as name:
        path, taken = Path(name) / "a.mcap", []
        for _ in range(5):
            begun = time.perf_counter()
            zr.write_log(log, path, force=True)
            taken.append(time.perf_counter() - begun)
        ours = rows / min(taken)
        print(f"{rows} rows, {1e-6 * path.stat().st_size:.0f} MB: {ours:.3g} rows/s")
        theirs = library(Path(name) / "b.mcap", rows // 10)
        print(f"mcap: {theirs:.3g} rows/s; write_log is {ours / theirs:.0f} times as fast")


def library(path, rows):
    """Return the rows a second that the format's library writes."""
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
