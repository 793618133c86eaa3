"""Written logs: round trips, names, columns next to the log."""

import string

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from zerorate.io import read_log, read_recording, write_log
from zerorate.record import Log, LogError
from zerorate.record.names import split_unit

FORMATS = [".csv", ".tsv", ".npz", ".parquet"]


def make_log(data, rate=100.0, names=None, unit="deg/s", start=0.0, extra=None, **meta):
    data = np.asarray(data, dtype=float).reshape(len(data), -1)
    names = names or [f"gyro_{i}_dps" for i in range(data.shape[1])]
    time = start + np.arange(len(data)) / rate
    return Log(time, rate, data, names, unit, meta, extra=extra or {})


def assert_equal(got, expected):
    assert got.names == expected.names
    assert got.unit == expected.unit
    assert got.rate == expected.rate
    np.testing.assert_array_equal(got.data.view(np.int64), expected.data.view(np.int64))
    np.testing.assert_array_equal(got.time, expected.time)


@pytest.mark.parametrize("suffix", FORMATS)
@settings(max_examples=40, deadline=None)
@given(
    data=hnp.arrays(
        np.float64,
        hnp.array_shapes(min_dims=2, max_dims=2, max_side=6),
        elements=st.floats(allow_infinity=False) | st.just(np.nan),
    ),
    rate=st.floats(1e-2, 1e5),
    start=st.floats(-1e4, 1e4),
    unit=st.sampled_from(["deg/s", "rad/s", "deg/h", "g", "unit"]),
)
def test_round_trip_is_exact(tmp_path_factory, suffix, data, rate, start, unit):
    data = np.where(np.isnan(data), np.nan, data)
    names = [f"gyro_{i}" for i in range(data.shape[1])]
    log = make_log(data, rate, names, unit, start)
    path = tmp_path_factory.mktemp("trip") / f"log{suffix}"
    write_log(log, path)
    assert_equal(read_log(path), log)


def writable(name):
    return name == name.strip() and name != "time_s" and split_unit(name)[1] is None


NAMES = st.text(string.ascii_letters + string.digits + " ,;\"'#%_°[]{}.-", min_size=1, max_size=12)


@pytest.mark.parametrize("suffix", FORMATS)
@settings(max_examples=40, deadline=None)
@given(
    names=st.lists(
        NAMES.filter(writable),
        min_size=1,
        max_size=3,
        unique=True,
    )
)
def test_round_trip_of_any_names(tmp_path_factory, suffix, names):
    log = make_log(np.ones((4, len(names))), names=names, unit="furlong")
    path = tmp_path_factory.mktemp("names") / f"log{suffix}"
    write_log(log, path)
    assert read_log(path).names == tuple(names)


@pytest.mark.parametrize("suffix", FORMATS)
def test_sensor_comes_back(tmp_path, suffix):
    write_log(make_log([1.0, 2.0], sensor="ADIS16405"), tmp_path / f"a{suffix}")
    log = read_log(tmp_path / f"a{suffix}")
    assert log.meta["sensor"] == "ADIS16405"
    assert log.meta["source"].endswith(f"a{suffix}")


def test_csv_is_plain_where_its_columns_say_all(tmp_path):
    write_log(make_log([0.5, np.nan], names=["gyro_z"]), tmp_path / "a.csv")
    write_log(make_log([0.5, np.nan], names=["gyro_z_dps"]), tmp_path / "b.csv")
    assert (tmp_path / "b.csv").read_text() == "time_s,gyro_z_dps\n0,0.5\n0.01,nan\n"
    assert (tmp_path / "a.csv").read_text().startswith('# zerorate {"rate": 100.0')
    assert read_log(tmp_path / "a.csv").names == ("gyro_z",)


def test_names_in_another_unit_are_refused(tmp_path):
    log = make_log([1.0], names=["wx_dps"], unit="rad/s")
    with pytest.raises(LogError, match="'wx_dps' is named in deg/s, but the log's unit is rad/s"):
        write_log(log, tmp_path / "a.csv")
    assert not list(tmp_path.iterdir())


def test_infinite_values_are_kept(tmp_path):
    write_log(make_log([np.inf, -np.inf, 0.0]), tmp_path / "a.csv")
    assert read_log(tmp_path / "a.csv").data[:, 0].tolist() == [np.inf, -np.inf, 0.0]


def test_columns_named_alike_after_the_suffix_are_refused(tmp_path):
    log = make_log([[1, 2]], names=["wx", "wx_dps"])
    with pytest.raises(LogError, match="share a name: time_s, wx_dps, wx_dps"):
        write_log(log, tmp_path / "a.csv")


EXTRA = {
    "bias_gyro_x_dps": np.array([0.1, np.nan, 0.3]),
    "at_rest_x": np.array([True, False, True]),
}


@pytest.mark.parametrize("suffix", FORMATS)
@pytest.mark.parametrize("name", ["gyro_x_dps", "gyro_x", "z"])
@pytest.mark.parametrize("other", ["temp", "gyro_y_dps"])
def test_extra_columns_do_not_change_a_log(tmp_path, suffix, name, other):
    log = make_log([1.0, np.nan, 3.0], names=[name], extra={**EXTRA, other: np.zeros(3)})
    write_log(log, tmp_path / f"a{suffix}")
    assert_equal(read_log(tmp_path / f"a{suffix}"), log)


@pytest.mark.parametrize("suffix", [".csv", ".tsv", ".parquet"])
def test_extra_columns_come_back_when_asked_for(tmp_path, suffix):
    log = make_log([1.0, np.nan, 3.0], names=["gyro_x_dps"], extra=EXTRA)
    write_log(log, tmp_path / f"a{suffix}")
    for name, values in EXTRA.items():
        column = read_log(tmp_path / f"a{suffix}", columns=name).data[:, 0]
        np.testing.assert_array_equal(column, values)


def test_extra_columns_of_an_npz_are_arrays_of_their_own(tmp_path):
    write_log(make_log([1.0, 2.0, 3.0], extra=EXTRA), tmp_path / "a.npz")
    with np.load(tmp_path / "a.npz") as arrays:
        for name, values in EXTRA.items():
            np.testing.assert_array_equal(arrays[name], values)


@pytest.mark.parametrize(
    ("suffix", "extra", "message"),
    [
        (".csv", {"time_s": np.zeros(3)}, "share a name: time_s, gyro_0_dps, time_s"),
        (".npz", {"rate": np.zeros(3)}, "a place of its own for: rate"),
    ],
)
def test_extra_columns_that_cannot_be_written(tmp_path, suffix, extra, message):
    log = make_log([1.0, 2.0, 3.0], extra=extra)
    with pytest.raises(LogError, match=message):
        write_log(log, tmp_path / f"a{suffix}")
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("suffix", [".npy", ".xlsx", ""])
def test_unknown_format_to_write(tmp_path, suffix):
    with pytest.raises(ValueError, match=r"known: \.csv, \.tsv, \.npz, \.parquet"):
        write_log(make_log([1.0]), tmp_path / f"a{suffix}")


@pytest.mark.parametrize("suffix", FORMATS)
def test_a_position_comes_back_in_its_units(tmp_path, suffix):
    names = ["latitude_deg", "longitude", "height_m"]
    log = Log(np.arange(4) / 4, 4.0, np.ones((4, 3)), names, ("deg", "deg", "m"))
    write_log(log, tmp_path / f"a{suffix}")
    position = read_recording(tmp_path / f"a{suffix}").position
    assert (position.units, position.rate) == (log.units, 4)
    np.testing.assert_array_equal(position.data, log.data)
