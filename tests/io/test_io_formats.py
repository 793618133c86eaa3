"""NumPy and Parquet files, the choice of columns, units and rates."""

import subprocess
import sys

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from zerorate.io import LogError, read_log
from zerorate.io.names import canonical_unit, looks_like_gyro, looks_like_time, split_unit

TIME = np.arange(5) / 100


def parquet(tmp_path, columns, **metadata):
    path = tmp_path / "log.parquet"
    pq.write_table(pa.table(columns).replace_schema_metadata(metadata), path)
    return path


def two_sensors(tmp_path):
    names = ["time_s", "temp", "shaft_gyro_x_dps", "shaft_accel_x_g", "fixed_gyro_x_dps"]
    return parquet(tmp_path, {name: TIME + i for i, name in enumerate(names)})


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


@pytest.mark.parametrize("suffix", ["parquet", "npy", "npz"])
def test_truncated_files(tmp_path, suffix):
    path = tmp_path / f"a.{suffix}"
    if suffix == "parquet":
        path = parquet(tmp_path, {"wx": np.zeros(100)}, rate="1")
    else:
        (np.save if suffix == "npy" else np.savez)(path, np.zeros(100))
    path.write_bytes(path.read_bytes()[:-50])
    with pytest.raises(LogError, match=r"truncated|damaged"):
        read_log(path, rate=1)


@pytest.mark.parametrize(
    ("name", "content", "message"),
    [
        ("a.parquet", b"1,2\n", "by its suffix Parquet, by its content something else"),
        ("a.npy", b"1,2\n", "by its suffix an .npy array"),
        ("a.csv", b"PAR1....", "by its suffix a text table, by its content Parquet"),
        ("a.xls", b"1", "unknown suffix '.xls'; known: .csv"),
        ("a", b"1", "unknown suffix ''"),
        ("a.npz", b"", "the file is empty, expected an .npz"),
    ],
)
def test_files_that_lie(tmp_path, name, content, message):
    (tmp_path / name).write_bytes(content)
    with pytest.raises(LogError) as caught:
        read_log(tmp_path / name)
    assert message in str(caught.value)


def test_missing_file_and_folder(tmp_path):
    with pytest.raises(FileNotFoundError, match=r"a\.csv does not exist"):
        read_log(tmp_path / "a.csv")
    with pytest.raises(IsADirectoryError, match="is a folder"):
        read_log(tmp_path)


def test_no_reader_is_loaded_before_it_is_needed():
    extras = "{'pyarrow', 'h5py', 'scipy', 'rosbags', 'pandas', 'polars'}"
    script = f"import sys, zerorate; print({extras} & sys.modules.keys())"
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True)
    assert (done.stdout.strip(), done.stderr) == ("set()", "")


def test_parquet_without_pyarrow_names_the_extra(tmp_path, monkeypatch):
    path = two_sensors(tmp_path)
    monkeypatch.setitem(sys.modules, "pyarrow", None)
    with pytest.raises(ImportError, match=r"pip install 'zerorate\[io\]'"):
        read_log(path)


def test_choice_of_columns(tmp_path):
    path = two_sensors(tmp_path)
    assert read_log(path).names == ("shaft_gyro_x_dps", "fixed_gyro_x_dps")
    assert read_log(path, columns="fixed_gyro_x_dps").data[0, 0] == 4
    assert read_log(path, columns=-1).names == ("fixed_gyro_x_dps",)
    assert read_log(path, columns=[4, "shaft_gyro_x_dps"]).data[0].tolist() == [4, 2]
    assert read_log(path, columns="shaft_accel_x_g").unit == "g"


@pytest.mark.parametrize(
    ("columns", "message"),
    [
        ("fixed_gyro_x", "no column 'fixed_gyro_x'; close: fixed_gyro_x_dps.*the file has: time_s"),
        (9, "no column 9: the file has 5 columns"),
        ([], "empty"),
        ([2, 2], "twice: shaft_gyro_x_dps"),
        ([True], "names and indices, got True"),
        ([2, 3], "'shaft_gyro_x_dps' in deg/s, 'shaft_accel_x_g' in g"),
        ([1, 2], "'temp' of unknown unit"),
    ],
)
def test_faults_in_columns(tmp_path, columns, message):
    with pytest.raises(LogError, match=message):
        read_log(two_sensors(tmp_path), columns=columns)


def test_given_unit(tmp_path):
    path = parquet(tmp_path, {"time_s": TIME, "gyro_x": TIME, "gyro_y_dps": TIME})
    assert read_log(path, columns="gyro_x").unit == "unit"
    assert read_log(path, columns="gyro_x", unit="°/s").unit == "deg/s"
    assert read_log(path, unit="dps").unit == "deg/s"
    with pytest.raises(LogError, match="'rad/s' was given, but column 'gyro_y_dps' is in deg/s"):
        read_log(path, unit="rad/s")
    with pytest.raises(ValueError, match="unknown unit 'rpm'; known: rad/s, deg/s, deg/h"):
        read_log(path, unit="rpm")


@pytest.mark.parametrize("rate", [0, -1, np.nan, np.inf, "100", True, [1]])
def test_bad_rates(tmp_path, rate):
    with pytest.raises(ValueError, match="positive finite number of Hz"):
        read_log(two_sensors(tmp_path), rate=rate)


GYROS = """
gyro_x_dps wx gx gyroX GyroscopeZ angular_velocity.x imu1_gyro_z rate_x w_x imu_wz rate wz_radps
field.angular_velocity.y AngularVelocityX rotationRateZ
"""
OTHERS = """
accel_x_g mag_x gyro_temp time_s x angular_velocity_covariance[0] ax sample_rate
bias_gyro_x bias_sigma_gyro_x_dps at_rest_gyro_x
"""


@pytest.mark.parametrize("name", [*GYROS.split(), "w_RS_S_x [rad s^-1]", "Gyro X (deg/s)"])
def test_gyro_names(name):
    assert looks_like_gyro(name)


@pytest.mark.parametrize("name", OTHERS.split())
def test_other_names(name):
    assert not looks_like_gyro(name)


def test_time_names():
    for name in [
        "time",
        "t",
        "Time [s]",
        "timestamp_ns",
        "header.stamp",
        "TimeStamp",
        "imu_time_us",
    ]:
        assert looks_like_time(name), name
    for name in ["x_t", "temperature", "timeout", "gyro_x", "ms"]:
        assert not looks_like_time(name), name


@pytest.mark.parametrize(
    ("name", "unit"),
    [
        ("wx_radps", "rad/s"),
        ("w (deg/s)", "deg/s"),
        ("a_x_mps2", "m/s^2"),
        ("g", None),
        ("wx", None),
    ],
)
def test_unit_in_a_name(name, unit):
    assert split_unit(name)[1] == unit


def test_unit_spellings():
    spellings = ["dps", "DEG/S", "°/s", "radps", "degph", "m/s^2"]
    units = ["deg/s", "deg/s", "deg/s", "rad/s", "deg/h", "m/s^2"]
    assert [canonical_unit(s) for s in spellings] == units
