"""HDF5 files, as h5py writes them."""

import sys

import h5py
import numpy as np
import pytest

from zerorate.io import read_log
from zerorate.io.reading import read_sensors
from zerorate.record import LogError

N = 100
TIME = np.arange(N) / 100
GYRO = np.random.default_rng(1).standard_normal((N, 3))


def write(tmp_path, datasets, attributes=(), name="a.h5"):
    """Write data sets by path, and attributes by path and key."""
    with h5py.File(tmp_path / name, "w") as file:
        for path, values in datasets.items():
            file[path] = values
        for path, key, value in attributes:
            file[path].attrs[key] = value
    return tmp_path / name


def test_data_sets_by_name(tmp_path):
    columns = {"time": TIME, "gyro_x_dps": GYRO[:, 0], "temp": TIME, "picture": np.zeros((4, 5, 3))}
    log = read_log(write(tmp_path, columns, name="a.hdf5"))
    assert (log.rate, log.unit, log.names) == (100, "deg/s", ("gyro_x_dps",))
    np.testing.assert_array_equal(log.data, GYRO[:, :1])


def test_one_group_needs_no_path(tmp_path):
    log = read_log(
        write(
            tmp_path,
            {"run/imu/gyro": GYRO, "run/imu/rate": 50.0},
            [("run/imu", "sensor", "X"), ("run/imu/gyro", "units", "rad/s")],
        )
    )
    assert (log.rate, log.unit, log.meta["sensor"]) == (50, "rad/s", "X")
    assert log.names == ("gyro_x_radps", "gyro_y_radps", "gyro_z_radps")


def test_several_groups_and_each_with_its_clock(tmp_path):
    path = write(
        tmp_path,
        {
            "time": np.arange(7.0),
            "slow/time": TIME[:40] * 10,
            "slow/gyro_x_dps": GYRO[:40, 0],
            "fast/time": TIME,
            "fast/gyro_x_dps": GYRO[:, 0],
        },
    )
    assert read_log(path, columns="slow/gyro_x_dps").rate == 10
    assert read_log(path, columns="fast/gyro_x_dps").rate == 100
    with pytest.raises(LogError, match=r"differ in length \('fast/gyro_x_dps' \(100,\), 'slow/"):
        read_log(path, sensor="all")


def test_two_sensors_in_arrays(tmp_path):
    names = {"imu/gyro_dps": GYRO, "imu/accel_g": -GYRO, "imu/time_us": np.arange(N) * 10_000}
    gyro, accelerometer = read_sensors(write(tmp_path, names | {"mag/field": GYRO[:20]}))
    assert (gyro.rate, gyro.unit, accelerometer.unit) == (100, "deg/s", "g")
    assert gyro.names == tuple(f"imu/gyro_{axis}_dps" for axis in "xyz")
    np.testing.assert_array_equal(accelerometer.data, -GYRO)


def test_a_table_of_named_fields(tmp_path):
    rows = np.zeros(N, [("t", "f8"), ("wx_dps", "f4")])
    rows["t"] = TIME
    assert read_log(write(tmp_path, {"imu": rows})).rate == 100


def test_as_an_npz_has_it(tmp_path):
    strings = h5py.string_dtype()
    content = {
        "data": GYRO,
        "time": TIME,
        "unit": "deg/s",
        "names": np.array(["p", "q", "r"], strings),
    }
    log = read_log(write(tmp_path, content))
    assert (log.rate, log.unit, log.names) == (100, "deg/s", ("p", "q", "r"))


@pytest.mark.parametrize(
    ("datasets", "message"),
    [
        ({"time": TIME, "temp": TIME}, "no column looks like a gyro"),
        ({"time": TIME[:50], "gyro_x": TIME}, r"differ in length \('gyro_x' \(100,\), 'time' \(50"),
        ({"gyro": GYRO.T.repeat(2, 1)}, r"'gyro' has shape \(3, 200\), .* transpose it"),
        ({"gyro_x": TIME, "rate": "fast"}, "'rate' has shape .* expected one number"),
        ({}, "no array of samples"),
        ({"time": TIME}, "no array of samples"),
        ({"gyro_x": TIME}, "give rate="),
    ],
)
def test_faults(tmp_path, datasets, message):
    with pytest.raises(LogError, match=message):
        read_log(write(tmp_path, datasets))


@pytest.mark.parametrize("part", [0.005, 0.3, 0.6, 0.99])
def test_truncated(tmp_path, part):
    path = write(tmp_path, {"time": TIME, "gyro": GYRO})
    whole = path.read_bytes()
    path.write_bytes(whole[: int(part * len(whole))])
    with pytest.raises(LogError, match="an HDF5 file: truncated, damaged or of a foreign kind"):
        read_log(path)


def test_without_h5py_the_extra_is_named(tmp_path, monkeypatch):
    path = write(tmp_path, {"gyro": GYRO})
    monkeypatch.setitem(sys.modules, "h5py", None)
    with pytest.raises(ImportError, match=r"an HDF5 file needs h5py: .*'\.\[hdf5\]'"):
        read_log(path)
