"""Arrow IPC: files, streams and Feather, as pyarrow and polars write them."""

import sys

import numpy as np
import polars as pl
import pyarrow as pa
import pyarrow.feather as feather
import pytest

from zerorate.io import read_log
from zerorate.record import LogError

N = 100
TIME = np.arange(N) / 100
GYRO = np.random.default_rng(1).standard_normal((N, 2))


def table(**metadata):
    columns = {"label": ["a"] * N, "gyro_y_dps": GYRO[:, 1], "time_s": TIME, "gyro_x": GYRO[:, 0]}
    return pa.table(columns).replace_schema_metadata(metadata)


def write(path, content, as_stream=False):
    opened = pa.ipc.new_stream if as_stream else pa.ipc.new_file
    with pa.OSFile(str(path), "wb") as sink, opened(sink, content.schema) as writer:
        writer.write_table(content, max_chunksize=30)
    return path


@pytest.mark.parametrize("suffix", ["arrow", "feather", "ipc"])
@pytest.mark.parametrize("as_stream", [False, True])
def test_files_and_streams(tmp_path, suffix, as_stream):
    path = write(tmp_path / f"a.{suffix}", table(unit="deg/s", sensor="X"), as_stream)
    log = read_log(path)
    assert (log.rate, log.unit, log.names) == (100, "deg/s", ("gyro_x", "gyro_y_dps"))
    assert log.meta["sensor"] == "X"
    np.testing.assert_array_equal(log.data, GYRO)
    np.testing.assert_array_equal(read_log(path, columns=[3]).data[:, 0], GYRO[:, 0])


def test_feather_and_polars(tmp_path):
    feather.write_feather(table(), tmp_path / "a.feather", compression="lz4")
    pl.from_arrow(table()).write_ipc(tmp_path / "b.arrow")
    for name in ("a.feather", "b.arrow"):
        assert read_log(tmp_path / name, unit="deg/s").channels == 2


def test_times_and_elapsed_times(tmp_path):
    nanoseconds = np.arange(N) * 10_000_000
    for kind in (pa.timestamp("ns"), pa.timestamp("ns", "UTC"), pa.duration("ns")):
        content = pa.table({"time": pa.array(nanoseconds, kind), "wx_dps": GYRO[:, 0]})
        log = read_log(write(tmp_path / "a.arrow", content))
        assert (log.rate, log.time[0]) == (100, 0)


@pytest.mark.parametrize("as_stream", [False, True])
@pytest.mark.parametrize("part", [0.01, 0.3, 0.6, 0.99])
def test_truncated(tmp_path, as_stream, part):
    path = write(tmp_path / "a.arrow", table(), as_stream)
    whole = path.read_bytes()
    path.write_bytes(whole[: int(part * len(whole))])
    with pytest.raises(LogError, match="truncated, damaged"):
        read_log(path, unit="deg/s")


@pytest.mark.parametrize(
    ("columns", "message"),
    [
        ({"time": TIME, "temp": TIME}, "no column looks like a gyro; .*: time, temp"),
        ({"gyro_x": ["a"]}, "column 'gyro_x' holds string, expected numbers"),
        ({"gyro_x": pa.array([], pa.float64())}, "columns but no rows"),
        ({}, "no columns"),
    ],
)
def test_faults(tmp_path, columns, message):
    with pytest.raises(LogError, match=message):
        read_log(write(tmp_path / "a.arrow", pa.table(columns)), rate=100)


def test_without_pyarrow_the_extra_is_named(tmp_path, monkeypatch):
    path = write(tmp_path / "a.arrow", table())
    monkeypatch.setitem(sys.modules, "pyarrow", None)
    with pytest.raises(ImportError, match=r"Arrow IPC needs pyarrow: .*'\.\[io\]'"):
        read_log(path)
