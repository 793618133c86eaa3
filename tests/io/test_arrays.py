"""NumPy files: one array, and several by name."""

import numpy as np
import pytest

from support.tables import TIME
from zerorate.io import read_log
from zerorate.record import LogError


@pytest.mark.parametrize("dtype", ["f8", "f4", ">f8", "i2", "u1"])
def test_npy_of_any_number(tmp_path, dtype):
    np.save(tmp_path / "a.npy", np.array([[3, 1], [2, 5], [7, 0]], dtype=dtype))
    log = read_log(tmp_path / "a.npy", rate=10)
    assert log.data.tolist() == [[3, 1], [2, 5], [7, 0]]
    assert log.data.dtype == np.float64


def test_npy_with_time_in_front_and_with_names(tmp_path):
    np.save(tmp_path / "a.npy", np.column_stack((TIME, [3, 1, 4, 1, 5])))
    assert read_log(tmp_path / "a.npy").rate == 100
    rows = np.zeros(5, [("t", "f8"), ("wx_radps", "f4")])
    rows["t"] = TIME
    np.save(tmp_path / "b.npy", rows)
    log = read_log(tmp_path / "b.npy")
    assert (log.rate, log.names, log.unit) == (100, ("wx_radps",), "rad/s")


@pytest.mark.parametrize(
    ("array", "message"),
    [
        (np.array([{}, 1]), "Python objects"),
        (np.zeros((0, 3)), r"shape \(0, 3\), expected \(n,\) or \(n, k\)"),
        (np.float64(1), r"shape \(\)"),
        (np.zeros((3, 1000)), "transpose it"),
        (np.array(["a", "b"]), "holds <U1, expected real numbers"),
        (np.zeros(3, complex), "complex128"),
    ],
)
def test_npy_faults(tmp_path, array, message):
    np.save(tmp_path / "a.npy", array)
    with pytest.raises(LogError, match=message):
        read_log(tmp_path / "a.npy", rate=10)


def test_npz_forms(tmp_path):
    data = np.arange(10.0).reshape(5, 2)
    np.savez(tmp_path / "a.npz", t=TIME, data=data, unit="rad/s", names=["p", "q"])
    log = read_log(tmp_path / "a.npz")
    assert (log.rate, log.names, log.unit) == (100, ("p", "q"), "rad/s")
    np.savez(tmp_path / "b.npz", rate=50.0, gyro_x_dps=data[:, 0], other=data[:, 1])
    log = read_log(tmp_path / "b.npz")
    assert (log.rate, log.names, log.unit) == (50, ("gyro_x_dps",), "deg/s")
    np.savez(tmp_path / "c.npz", time=TIME, gyro=data)
    assert read_log(tmp_path / "c.npz").channels == 2


@pytest.mark.parametrize(
    ("arrays", "message"),
    [
        ({"time": TIME}, "no array of samples"),
        ({"time": TIME[:3], "data": np.zeros(5)}, "differ in length"),
        ({"data": np.zeros((5, 2)), "names": ["a"]}, "1 names for 2 columns"),
        ({"data": np.zeros(5), "rate": np.zeros(2)}, "'rate' has shape"),
        ({"data": np.zeros(5), "rate": 0.0}, "positive finite"),
        ({"data": np.array([None])}, "Python objects"),
    ],
)
def test_npz_faults(tmp_path, arrays, message):
    np.savez(tmp_path / "a.npz", **arrays)
    with pytest.raises(LogError, match=message):
        read_log(tmp_path / "a.npz")
