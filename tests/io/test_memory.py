"""Long logs: columns are read piece by piece, and are not in memory twice."""

import tracemalloc

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

import zerorate as zr
from zerorate.io.readers import arrow

ROWS = 300_000


def written(folder, columns, rows):
    path = folder / "long.parquet"
    pq.write_table(pa.table(columns), path, row_group_size=rows)
    return path


def test_a_long_log_takes_less_than_twice_what_it_holds(tmp_path):
    random = np.random.default_rng(1)
    columns = {"time_s": np.arange(ROWS) / 100.0}
    for name in ("gyro_{}_dps", "accel_{}_mps2"):
        columns |= {name.format(axis): random.standard_normal(ROWS) for axis in "xyz"}
    path = written(tmp_path, columns, 50_000)
    zr.read_recording(path)  # what is imported
    tracemalloc.start()
    recording = zr.read_recording(path)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert recording.gyro.time is recording.accel.time
    holds = sum(log.data.nbytes for log in recording.values()) + recording.gyro.time.nbytes
    assert peak < 2.0 * holds
    for axis, column in zip("xyz", recording.accel.data.T, strict=True):
        np.testing.assert_array_equal(column, columns[f"accel_{axis}_mps2"])


@pytest.mark.parametrize("rows", [7, 100])
def test_pieces_of_a_column_are_what_the_whole_is(tmp_path, monkeypatch, rows):
    """Nulls in one piece alone, whole numbers, flags, dates: the piece's type is the whole's."""
    n = 40
    counts = [k if k != 33 else None for k in range(n)]
    columns = {
        "time": pa.array([1_700_000_000_000_000_000 + 10_000_000 * k for k in range(n)],
                         pa.timestamp("ns")),
        "gyro_x": pa.array(counts, pa.int16()),
        "gyro_y": pa.array([0.5 * k for k in range(n)], pa.float32()),
        "gyro_z": pa.array([k % 3 == 0 for k in range(n)]),
    }  # fmt: skip
    path = written(tmp_path, columns, rows)
    whole = zr.read_log(path, unit="deg/s")
    monkeypatch.setattr(arrow, "_MAX_ROWS_AT_ONCE", 10)
    parts = zr.read_log(path, unit="deg/s")
    np.testing.assert_array_equal(parts.data, whole.data)
    np.testing.assert_array_equal(parts.time, whole.time)
    assert np.isnan(parts.data[33, 0])
