"""Parquet files of a few columns."""

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

TIME = np.arange(5) / 100


def parquet(folder, columns, **metadata):
    """Write columns and metadata of the file; return the path."""
    path = folder / "log.parquet"
    pq.write_table(pa.table(columns).replace_schema_metadata(metadata), path)
    return path


def two_sensors(folder):
    names = ["time_s", "temp", "shaft_gyro_x_dps", "shaft_accel_x_g", "fixed_gyro_x_dps"]
    return parquet(folder, {name: TIME + i for i, name in enumerate(names)})
