"""Logs from objects in memory: frames, Arrow tables, dicts and arrays."""

import sys

import numpy as np
import pandas as pd
import polars as pl
import pyarrow as pa
import pytest

import zerorate as zr
from zerorate.io import read_log
from zerorate.record import LogError

N = 100
TIME = np.arange(N) / 100
GYRO = np.random.default_rng(1).standard_normal(N)
COLUMNS = {"time_s": TIME, "label": ["a"] * N, "gyro_x_dps": GYRO}


class Stream:
    """The least that an object of Arrow must have."""

    def __init__(self, table):
        self._table = table

    def __arrow_c_stream__(self, requested_schema=None):
        return self._table.__arrow_c_stream__(requested_schema)


def structured():
    rows = np.zeros(N, [("time_s", "f8"), ("gyro_x_dps", "f8")])
    rows["time_s"], rows["gyro_x_dps"] = TIME, GYRO
    return rows


OBJECTS = {
    "pandas DataFrame": pd.DataFrame(COLUMNS),
    "polars DataFrame": pl.DataFrame(COLUMNS),
    "pyarrow Table": pa.table(COLUMNS),
    "pyarrow RecordBatch": pa.RecordBatch.from_pydict(COLUMNS),
    f"{Stream.__module__.partition('.')[0]} Stream": Stream(pa.table(COLUMNS)),
    "dict": {"time_s": TIME, "gyro_x_dps": list(GYRO)},
    "numpy ndarray": structured(),
}


@pytest.mark.parametrize("label", OBJECTS)
def test_each_object(label):
    log = read_log(OBJECTS[label])
    assert (log.rate, log.unit, log.names) == (100, "deg/s", ("gyro_x_dps",))
    assert log.meta["source"] == label
    np.testing.assert_array_equal(log.data[:, 0], GYRO)


@pytest.mark.parametrize("label", OBJECTS)
def test_what_is_wrong_names_the_object(label):
    with pytest.raises(LogError, match=f"^{label}: there is no column 'wx'"):
        read_log(OBJECTS[label], columns="wx")


def test_arrays_without_names():
    assert read_log(np.column_stack((TIME, GYRO))).rate == 100
    assert read_log(GYRO, rate=50).duration == 2
    frame = pd.DataFrame(np.column_stack((TIME, GYRO)))
    assert read_log(frame).names == ("column_1",)


def test_fields_of_three_axes():
    rows = np.zeros(N, [("t", "f8"), ("gyro_dps", "f4", (3,))])
    rows["t"] = TIME
    assert read_log(rows).names == ("gyro_x_dps", "gyro_y_dps", "gyro_z_dps")


def test_a_dict_says_what_an_npz_says():
    log = read_log({"data": np.ones((5, 2)), "rate": 50, "unit": "deg/s", "names": ["p", "q"]})
    assert (log.rate, log.unit, log.names) == (50, "deg/s", ("p", "q"))


def test_gaps_as_in_a_file():
    kept = np.delete(np.arange(N), [20, 21])
    for frame in (pd.DataFrame, pl.DataFrame, dict):
        log = read_log(frame({"t": TIME[kept], "wx": GYRO[kept]}))
        assert (log.n, log.missing_count, log.meta["clock"].gap_count) == (N, 2, 1)


@pytest.mark.parametrize(
    "index",
    [
        pd.date_range("2024-01-01", periods=N, freq="10ms"),
        pd.date_range("2024-01-01", periods=N, freq="10ms", tz="Europe/Berlin"),
        pd.timedelta_range(0, periods=N, freq="10ms"),
        pd.Index(TIME, name="t"),
    ],
)
def test_the_index_of_pandas_as_time(index):
    assert read_log(pd.DataFrame({"wx_dps": GYRO}, index)).rate == 100
    assert read_log(pd.DataFrame(GYRO[:, np.newaxis], index)).rate == 100


def test_types_and_attributes_of_pandas():
    frame = pd.DataFrame({"wx": pd.array([1, None, 3], "Int64"), "wy": [True, False, True]})
    frame["wz"] = pd.array([1, 2, 3], "Int32")
    frame.attrs |= {"rate": 10.0, "unit": "deg/s", "author": "me"}
    log = read_log(frame)
    assert (log.rate, log.unit) == (10, "deg/s")
    np.testing.assert_array_equal(log.data, [[1, 1, 1], [np.nan, 0, 2], [3, 1, 3]])


def test_columns_of_two_levels():
    frame = pd.DataFrame({("gyro", "x"): GYRO, ("gyro", "time"): TIME})
    assert read_log(frame).names == ("gyro/x",)


def test_types_of_polars():
    frame = pl.DataFrame({"wx": [1, None, 3], "wy": [True, None, False]})
    log = read_log(frame.with_columns(time=pl.Series([0, 10, 20]).cast(pl.Duration("ms"))))
    assert log.rate == 100
    np.testing.assert_array_equal(log.data, [[1, 1], [np.nan, np.nan], [3, 0]])


def test_the_metadata_of_arrow():
    table = pa.table({"wx": GYRO}).replace_schema_metadata({"rate": "50", "unit": "rad/s"})
    assert (read_log(table).rate, read_log(Stream(table)).unit) == (50, "rad/s")


@pytest.mark.parametrize(
    ("source", "message"),
    [
        (pd.DataFrame({"wx": ["a"]}), "column 'wx' holds str|object, expected numbers"),
        (pl.DataFrame({"wx": ["a"]}), "column 'wx' holds String, expected numbers"),
        ({"wx": ["a"]}, "column 'wx' holds <U1, expected real numbers"),
        ({"wx": [1.0, [2.0]]}, "dict: 'wx' is ragged"),
        ({"time": TIME, "wx": GYRO[:5]}, r"differ in length \('wx' \(5,\), 'time' \(100,\)\)"),
        ({}, "no array of samples"),
        (pd.DataFrame(), "no columns"),
        (pl.DataFrame(), "no columns"),
        (pa.table({}), "no columns"),
        (pl.Series([1.0]), "no table of Arrow"),
        (pd.DataFrame({"temp": GYRO}), "no column looks like a gyro"),
        (pl.DataFrame({"wx": []}, {"wx": pl.Float64}), "columns but no rows"),
        (pd.DataFrame({"wx": []}, dtype=float), "columns but no rows"),
    ],
)
def test_faults(source, message):
    with pytest.raises(LogError, match=message):
        read_log(source, rate=100)


@pytest.mark.parametrize("source", [None, 3, [1.0, 2.0], pl.LazyFrame(COLUMNS)])
def test_what_is_no_log(source):
    with pytest.raises(TypeError, match="file, a data frame, a table or arrays, got"):
        read_log(source)


def test_frames_need_no_pyarrow(monkeypatch):
    monkeypatch.setitem(sys.modules, "pyarrow", None)
    for label in ("pandas DataFrame", "polars DataFrame", "dict"):
        assert read_log(OBJECTS[label]).n == N
    with pytest.raises(ImportError, match=r"Stream needs pyarrow: .*\[io\]"):
        read_log(Stream(pa.table(COLUMNS)))


def test_an_object_is_filtered_like_a_file(tmp_path):
    zr.write_log(read_log(OBJECTS["dict"]), tmp_path / "a.npz")
    np.testing.assert_array_equal(read_log(tmp_path / "a.npz").data[:, 0], GYRO)
