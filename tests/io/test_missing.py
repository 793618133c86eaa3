"""Missing values of every kind, on every path into a log."""

import numpy as np
import pandas as pd
import polars as pl
import pyarrow as pa
import pytest

from zerorate.io import read_log
from zerorate.record import Log, LogError
from zerorate.record.missing import without_masks

MASKED = np.ma.array([0.1, 0.2, 0.3], mask=[False, True, False])
COUNTS = np.ma.array([1, 2, 3], mask=[False, True, False])
NAN = [0.1, np.nan, 0.3]


@pytest.mark.parametrize(
    "values",
    [
        MASKED,
        MASKED.astype(np.float32),
        [0.1, None, 0.3],
        np.array([0.1, None, 0.3], object),
        pd.array([0.1, None, 0.3], "Float64"),
        pd.Series([0.1, pd.NA, 0.3], dtype=object),
        pl.Series([0.1, None, 0.3]),
        pa.array([0.1, None, 0.3]),
    ],
    ids=str,
)
def test_one_column(values):
    for log in (
        read_log({"wx": values}, rate=10),
        read_log({"gyro": values, "other": np.zeros(3)}, rate=10),
        Log(np.arange(3) / 10, 10, values, ["wx"]),
    ):
        # float32 holds seven digits
        np.testing.assert_allclose(log.data[:, 0], NAN, rtol=1e-7)
        assert log.missing_count == 1


def test_masked_whole_numbers_and_flags():
    for values in (COUNTS, COUNTS.astype(bool)):
        assert read_log({"wx": values}, rate=10).missing_count == 1
    assert without_masks(COUNTS).dtype == np.float64


def test_masked_arrays_of_several_axes():
    gyro = np.ma.array(np.ones((4, 3)), mask=False)
    gyro[1, 2] = np.ma.masked
    log = read_log(gyro, rate=10)
    assert np.isnan(log.data).sum() == 1
    assert np.isnan(read_log({"gyro": gyro, "t_s": np.arange(4.0)}).data).sum() == 1
    assert np.isnan(log.with_data(gyro).data).sum() == 1


def test_masked_fields():
    rows = np.ma.zeros(4, [("time_s", "f8"), ("wx", "f4")])
    rows["time_s"] = np.arange(4.0)
    rows["wx"][2] = np.ma.masked
    assert np.isnan(read_log(rows).data[:, 0]).tolist() == [False, False, True, False]


def test_an_array_that_masks_nothing_is_not_copied():
    values = np.ones(5)
    assert without_masks(values) is values
    assert without_masks(np.ma.array(values)).base is values


@pytest.mark.parametrize(
    "time",
    [
        np.ma.array([0.0, 0.1, 0.2], mask=[0, 1, 0]),
        np.array(["2024-01-01", "NaT", "2024-01-03"], "datetime64[ns]"),
        np.array([0.0, None, 0.2], object),
    ],
    ids=["masked", "NaT", "None"],
)
def test_a_stamp_that_is_missing(time):
    with pytest.raises(LogError, match="time column 'time' is not finite in row 1"):
        read_log({"time": time, "wx": np.ones(3)})


@pytest.mark.parametrize("values", [["a", None], [1.0, "2"], [1.0, {}]])
def test_what_is_no_number_is_refused(values):
    with pytest.raises(LogError, match="expected real numbers"):
        read_log({"wx": np.array(values, object)}, rate=10)
