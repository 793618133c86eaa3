"""MAT files: versions 5 to 7 as SciPy writes them, 7.3 as HDF5 the way MATLAB writes it."""

import sys

import h5py
import numpy as np
import pytest
from scipy.io import savemat

from zerorate.io import read_log
from zerorate.record import LogError

N = 100
TIME = np.arange(N) / 100
GYRO = np.random.default_rng(1).standard_normal((N, 3))


def write(tmp_path, variables, compressed=False):
    savemat(tmp_path / "a.mat", variables, do_compression=compressed, oned_as="column")
    return tmp_path / "a.mat"


def write_73(tmp_path, variables):
    """Write as MATLAB does: columns as rows, texts as codes, and a text before the HDF5."""
    path = tmp_path / "a.mat"
    with h5py.File(path, "w", userblock_size=512) as file:
        for name, value in variables.items():
            text = isinstance(value, str)
            codes = np.array([[ord(letter)] for letter in value], np.uint16) if text else value
            file[name] = codes if text else np.atleast_2d(value).T
            file[name].attrs["MATLAB_class"] = np.bytes_("char" if text else "double")
        file["#refs#/a"] = np.zeros(3)
    with path.open("rb+") as file:
        file.write(b"MATLAB 7.3 MAT-file, Platform: GLNXA64".ljust(116) + bytes(8) + b"\0\2IM")
    return path


@pytest.mark.parametrize("compressed", [False, True])
def test_variables(tmp_path, compressed):
    variables = {"t": TIME, "gyro": GYRO, "temp": TIME, "unit": "deg/s", "gyro_bias": np.zeros(3)}
    log = read_log(write(tmp_path, variables, compressed))
    assert (log.rate, log.unit, log.names) == (100, "deg/s", ("gyro_x", "gyro_y", "gyro_z"))
    np.testing.assert_array_equal(log.data, GYRO)


def test_vectors_lie_or_stand(tmp_path):
    for vector in (TIME[:, np.newaxis], TIME[np.newaxis]):
        log = read_log(write(tmp_path, {"time": vector, "wx_dps": vector}))
        assert (log.rate, log.n, log.names) == (100, N, ("wx_dps",))


def test_a_structure(tmp_path):
    fields = {"time": TIME, "gyro_radps": GYRO, "accel_g": GYRO, "sensor": "X"}
    log = read_log(write(tmp_path, {"imu": fields}))
    assert (log.rate, log.unit, log.meta["sensor"]) == (100, "rad/s", "X")
    log = read_log(write(tmp_path, {"imu": fields, "mag": {"time": TIME[:9], "field": TIME[:9]}}))
    assert log.names == tuple(f"imu/gyro_{axis}_radps" for axis in "xyz")
    assert log.rate == 100


def test_as_an_npz_has_it(tmp_path):
    names = np.array(["p", "q", "r"], object)
    log = read_log(write(tmp_path, {"data": GYRO, "rate": 50, "names": names}))
    assert (log.rate, log.names) == (50, ("p", "q", "r"))


def test_version_7_3(tmp_path):
    variables = {"imu/t": TIME, "imu/gyro": GYRO, "imu/unit": "deg/s"}
    log = read_log(write_73(tmp_path, variables))
    assert (log.rate, log.unit, log.names) == (100, "deg/s", ("gyro_x", "gyro_y", "gyro_z"))
    np.testing.assert_array_equal(log.data, GYRO)


@pytest.mark.parametrize(
    ("variables", "message"),
    [
        ({"time": TIME, "temp": TIME}, "no column looks like a gyro"),
        ({"time": TIME[:50], "gyro_x": TIME}, r"differ in length \('gyro_x' \(100,\), 'time' \(50"),
        ({"gyro": GYRO.T}, r"'gyro' has shape \(3, 100\), .* transpose it"),
        ({"text": "nothing"}, "no array of samples"),
        ({"gyro_x": TIME}, "give rate="),
    ],
)
def test_faults(tmp_path, variables, message):
    with pytest.raises(LogError, match=message):
        read_log(write(tmp_path, variables))


@pytest.mark.every(3)
@pytest.mark.parametrize("compressed", [False, True])
@pytest.mark.parametrize("part", [0.02, 0.3, 0.6, 0.99])
def test_truncated(tmp_path, compressed, part):
    path = write(tmp_path, {"time": TIME, "gyro": GYRO}, compressed)
    whole = path.read_bytes()
    path.write_bytes(whole[: int(part * len(whole))])
    with pytest.raises(LogError, match="a MAT file: truncated, damaged or of a foreign kind"):
        read_log(path)


def test_version_7_3_without_a_gyro(tmp_path):
    with pytest.raises(LogError, match="no column looks like a gyro"):
        read_log(write_73(tmp_path, {"time": TIME, "temp": TIME}))


def test_version_7_3_truncated(tmp_path):
    path = write_73(tmp_path, {"t": TIME, "gyro": GYRO})
    path.write_bytes(path.read_bytes()[:3000])
    with pytest.raises(LogError, match="a MAT file: truncated, damaged or of a foreign kind"):
        read_log(path)


def test_without_scipy_or_h5py_the_extra_is_named(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "scipy", None)
    with pytest.raises(ImportError, match=r"a MAT file needs scipy: .*'\.\[mat\]'"):
        read_log(write(tmp_path, {"gyro": GYRO}))
    path = write_73(tmp_path, {"gyro": GYRO})
    monkeypatch.setitem(sys.modules, "h5py", None)
    with pytest.raises(ImportError, match=r"a MAT file needs h5py: .*'\.\[hdf5\]'"):
        read_log(path)


@pytest.mark.parametrize("name", ["sampling_rate", "fs", "SampleRate"])
def test_a_number_that_is_called_like_a_rate_is_one(tmp_path, name):
    log = read_log(write(tmp_path, {"imu_gyr": GYRO, name: 100.0}))
    assert log.rate == 100.0
    assert any(note == f"rate 100 Hz by '{name}'" for note in log.meta["notes"])


def test_a_column_that_is_called_like_a_rate_is_none(tmp_path):
    log = read_log(write(tmp_path, {"t": TIME, "gyro": GYRO, "fs": TIME}))
    assert log.rate == pytest.approx(100.0)
