"""Tables of data scientists: indices of times, columns of several levels, bytes and addresses."""

import io
import sys

import numpy as np
import pytest

import zerorate as zr
from zerorate.record import LogError

pd = pytest.importorskip("pandas")
pytest.importorskip("pyarrow")

N = 300
RATES = np.random.default_rng(1).normal(size=(N, 3)).round(6)
AXES = [f"gyro_{axis}" for axis in "xyz"]
INDICES = {
    "dates": pd.date_range("2024-05-01", periods=N, freq="10ms"),
    "dates of a zone": pd.date_range("2024-05-01", periods=N, freq="10ms", tz="Europe/Berlin"),
    "durations": pd.to_timedelta(np.arange(N) * 10, unit="ms"),
    "seconds": np.arange(N) / 100 + 7.25,
}


def check(log, data=RATES):
    assert log.rate == pytest.approx(100.0)
    np.testing.assert_array_equal(log.data, data)


@pytest.mark.parametrize("name", [None, "zeit", "t"])
@pytest.mark.parametrize("index", INDICES)
def test_an_index_of_times(tmp_path, index, name):
    frame = pd.DataFrame(RATES, columns=AXES, index=pd.Index(INDICES[index], name=name))
    check(zr.read_log(frame))
    frame.to_parquet(tmp_path / "a.parquet")
    check(zr.read_log(tmp_path / "a.parquet"))
    frame.reset_index().to_feather(tmp_path / "a.feather")
    check(zr.read_log(tmp_path / "a.feather"))


def test_a_counted_index_is_no_clock():
    with pytest.raises(LogError, match="give rate="):
        zr.read_log(pd.DataFrame(RATES, columns=AXES))


@pytest.mark.parametrize("stored", [False, True])
def test_columns_of_sensor_and_axis(tmp_path, stored):
    levels = [["left_sensor", "right_sensor"], ["gyr_x", "gyr_y", "gyr_z"]]
    columns = pd.MultiIndex.from_product(levels)
    frame = pd.DataFrame(np.hstack([RATES, -RATES]), columns=columns)
    frame.index = pd.Index(INDICES["seconds"], name="time [s]")
    source = frame
    if stored:
        source = tmp_path / "a.parquet"
        frame.to_parquet(source)
    recording = zr.read_recording(source)
    check(recording["gyro"])
    check(recording["gyro_1"], -RATES)
    assert recording["gyro"].names == tuple(f"left_sensor/gyr_{axis}" for axis in "xyz")
    check(zr.read_log(source, sensor="right"), -RATES)


def test_deviations_of_a_frame_keep_its_names():
    assert zr.allan(pd.DataFrame(RATES, columns=AXES), rate=100).names == tuple(AXES)


def test_bytes_and_addresses(tmp_path):
    frame = pd.DataFrame(RATES, columns=AXES, index=INDICES["dates"])
    frame.to_parquet(tmp_path / "a.parquet")
    frame.to_csv(tmp_path / "a.csv", index_label="time")
    for name in ("a.parquet", "a.csv"):
        check(zr.read_log(io.BytesIO((tmp_path / name).read_bytes())))
        check(zr.read_recording(f"file://{tmp_path / name}").gyro)


def test_an_address_without_pyarrow_names_the_extra(monkeypatch):
    monkeypatch.setitem(sys.modules, "pyarrow.fs", None)
    with pytest.raises(ImportError, match=r"\[io\]"):
        zr.read_log("s3://bucket/a.parquet")
