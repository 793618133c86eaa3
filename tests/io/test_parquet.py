"""Parquet files: types, metadata, timestamps and faults."""

import sys

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from support.tables import TIME, miscounted, parquet, two_sensors
from zerorate.io import read_log
from zerorate.io.readers.parquet import RowGroupWriter
from zerorate.record import LogError


def test_parquet_types_and_metadata(tmp_path):
    columns = {
        "angular_velocity.x": pa.array([1, None, 3], pa.int32()),
        "angular_velocity.y": pa.array([0.5, 1.5, None], pa.float32()),
        "note": ["a", "b", "c"],
    }
    log = read_log(parquet(tmp_path, columns, rate="200", unit="rad/s", sensor="X"))
    assert (log.rate, log.unit, log.meta["sensor"]) == (200, "rad/s", "X")
    np.testing.assert_array_equal(log.data, [[1, 0.5], [np.nan, 1.5], [3, np.nan]])


def test_parquet_timestamps(tmp_path):
    stamps = pa.array(1_700_000_000_000_000_000 + 10_000_000 * np.arange(5), pa.timestamp("ns"))
    log = read_log(parquet(tmp_path, {"timestamp": stamps, "wx_dps": TIME}))
    assert (log.rate, log.time[0]) == (100, 1.7e9)


@pytest.mark.parametrize(
    ("columns", "metadata", "message"),
    [
        ({"gyro_x": ["a", "b"]}, {"rate": "1"}, "column 'gyro_x' holds string, expected numbers"),
        ({"gyro_x": pa.array([], pa.float64())}, {"rate": "1"}, "columns but no rows"),
        ({"gyro_x": [1.0]}, {"rate": "fast"}, "metadata's rate is b'fast'"),
        ({"gyro_x": [1.0]}, {"rate": "-1"}, "in the metadata, rate must be"),
        ({"gyro_x": [1.0]}, {}, "give rate="),
        ({"time_s": TIME, "gyro_x": TIME}, {"rate": "50"}, "50 Hz, .* run at 100 Hz"),
        ({"a": [1.0], "b": [2.0]}, {}, "no column looks like a gyro; .*: a, b"),
    ],
)
def test_parquet_faults(tmp_path, columns, metadata, message):
    with pytest.raises(LogError, match=message):
        read_log(parquet(tmp_path, columns, **metadata))


def test_parquet_without_pyarrow_names_the_extra(tmp_path, monkeypatch):
    path = two_sensors(tmp_path)
    monkeypatch.setitem(sys.modules, "pyarrow", None)
    with pytest.raises(ImportError, match=r"pip install '\.\[io\]' in the checkout"):
        read_log(path)


@pytest.mark.parametrize("rows", [1, 39, 63])
def test_a_number_of_rows_that_is_wrong_is_damage(tmp_path, rows):
    path = miscounted(tmp_path / "run.parquet", rows)
    assert pq.ParquetFile(path).metadata.num_rows == rows
    with pytest.raises(LogError, match=f"run.parquet: .*damaged.*{rows} rows"):
        read_log(path)


def test_written_bytes_do_not_depend_on_the_pieces(tmp_path):
    """Nothing is missing in what is written, and the times alone have a least and a largest."""
    n = 300_000
    random = np.random.default_rng(1)
    columns = [np.arange(n) / 100.0, random.normal(size=n), np.arange(n) % 1000 < 3]
    columns[1][5:9] = np.nan
    written = []
    for piece in (n, 32_768, 7_001):
        path = tmp_path / f"{piece}.parquet"
        with RowGroupWriter(path, ["time_s", "gyro_x", "at_rest"], {"rate": "100"}) as file:
            for first in range(0, n, piece):
                file.write([column[first : first + piece] for column in columns])
        written.append(path.read_bytes())
    assert written[0] == written[1] == written[2]
    file = pq.ParquetFile(path)
    for name, column in zip(file.schema_arrow.names, columns, strict=True):
        assert not file.schema_arrow.field(name).nullable
        np.testing.assert_array_equal(file.read([name])[name].to_numpy(), column)
    time, gyro, rest = (file.metadata.row_group(1).column(i) for i in range(3))
    assert time.statistics.min == (1 << 17) / 100.0
    assert gyro.statistics is None
    assert rest.statistics is None
