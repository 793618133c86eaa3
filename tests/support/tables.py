"""Parquet files of a few columns."""

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from zerorate.io import write_log
from zerorate.record import Log

TIME = np.arange(5) / 100


def parquet(folder, columns, **metadata):
    """Write columns and metadata of the file; return the path."""
    path = folder / "log.parquet"
    pq.write_table(pa.table(columns).replace_schema_metadata(metadata), path)
    return path


def two_sensors(folder):
    names = ["time_s", "temp", "shaft_gyro_x_dps", "shaft_accel_x_g", "fixed_gyro_x_dps"]
    return parquet(folder, {name: TIME + i for i, name in enumerate(names)})


def miscounted(path, rows):
    """Write a log of 40 rows whose footer says that it has others; return the path."""
    data = np.random.default_rng(1).standard_normal((40, 3))
    log = Log(np.arange(40) / 100, 100.0, data, ["gyro_x", "gyro_y", "gyro_z"], "deg/s")
    write_log(log, path)
    content = bytearray(path.read_bytes())
    footer = len(content) - 8 - int.from_bytes(content[-8:-4], "little")
    # The first 40 of the footer, as Thrift writes it: twice the number.
    content[content.index(2 * 40, footer)] = 2 * rows
    path.write_bytes(content)
    return path
