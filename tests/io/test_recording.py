"""Recordings: which logs there are, their units, their clocks, and what is noted."""

from typing import ClassVar

import h5py
import numpy as np
import pandas as pd
import pytest

import zerorate as zr
from support.bags import KINDS, values, write_recording
from support.recordings import RECORDINGS, needs_recordings
from zerorate.record import Log, LogError, Recording
from zerorate.record.names import meaning_of

N = 400
TIME = np.arange(N) / 100
RNG = np.random.default_rng(2)
GYRO, ACCEL = RNG.standard_normal((2, N, 3))


def imu(**more):
    return {"time_s": TIME, "gyro_dps": GYRO, "accel_g": ACCEL, **more}


def test_each_sensor_is_a_log_with_its_unit():
    recording = zr.read_recording(
        imu(mag_ut=GYRO, temp_degc=TIME, ref_quat_w=TIME, pos_m=GYRO, vel_mps=ACCEL)
    )
    units = {name: log.unit for name, log in recording.items()}
    assert units == {
        "gyro": "deg/s",
        "accel": "g",
        "mag": "uT",
        "temperature": "degC",
        "reference": "1",
        "position": "m",
        "velocity": "m/s",
    }
    assert {log.rate for log in recording.values()} == {100}
    np.testing.assert_array_equal(recording.gyro.data, GYRO)
    np.testing.assert_array_equal(recording["velocity"].data, ACCEL)
    assert recording.mag.names == ("mag_x_ut", "mag_y_ut", "mag_z_ut")


def test_what_is_not_there_is_none():
    recording = zr.read_recording({"gyro": GYRO}, 100)
    assert recording.names == ("gyro",)
    for name in ("accel", "mag", "temperature", "reference", "position"):
        assert getattr(recording, name) is None
    with pytest.raises(KeyError, match="no 'accel'; the recording has: gyro"):
        recording["accel"]
    assert ("gyro" in recording, "accel" in recording, len(recording)) == (True, False, 1)
    assert repr(recording) == "Recording(dict; gyro: 3 at 100 Hz, unit)"


def test_further_sensors_of_a_kind_are_numbered():
    columns = {f"{place}_gyro_{axis}_dps": TIME for place in ("fixed", "shaft") for axis in "xyz"}
    recording = zr.read_recording({"t": TIME, **columns, "shaft_gyro_temp_c": TIME})
    assert recording.names == ("gyro", "gyro_1", "temperature")
    assert recording["gyro_1"].names == tuple(f"shaft_gyro_{axis}_dps" for axis in "xyz")
    assert recording.of_kind("gyro") == (recording.gyro, recording["gyro_1"])
    # A log of all of them is what `read_log` gives.
    together = zr.read_log({"t": TIME, **columns}, sensor="all")
    assert together.names == recording.gyro.names + recording["gyro_1"].names


def test_a_standard_deviation_is_no_measurement():
    recording = zr.read_recording(
        {"t": TIME, "sigma_north_m": TIME, "north_m": TIME, "sigma_velocity_mps": TIME}
    )
    assert recording.names == ("position_sigma", "position", "velocity_sigma")


@pytest.mark.parametrize("stamped", [True, False])
@pytest.mark.parametrize("first", [0, 3])
def test_a_slower_sensor_has_a_clock_of_its_own(stamped, first):
    temperature = np.full(N, np.nan)
    temperature[first::25] = np.arange(len(temperature[first::25]))
    temperature[first + 100] = np.nan
    table = imu(temperature=temperature)
    rate = None if stamped else 100
    log = zr.read_recording(table if stamped else drop(table, "time_s"), rate).temperature
    assert (log.rate, log.n, log.time[0]) == (4, N // 25, first / 100)
    assert (log.meta["clock"].gap_count, log.missing_count) == (1, 1)
    assert log.data[[0, 5], 0].tolist() == [0, 5]


def drop(table, name):
    return {key: values for key, values in table.items() if key != name}


def test_a_sensor_with_gaps_keeps_the_clock_of_the_table():
    reference = np.tile(TIME, (4, 1)).T
    reference[50:250] = np.nan
    columns = {f"quat_{letter}": reference[:, i] for i, letter in enumerate("xyzw")}
    recording = zr.read_recording(imu(**columns))
    assert (recording.reference.n, recording.reference.missing_count) == (N, 200)
    assert recording.reference.names == ("quat_w", "quat_x", "quat_y", "quat_z")
    np.testing.assert_array_equal(recording.reference.time, recording.gyro.time)


def test_rows_of_two_sensors_between_each_other():
    fast = pd.DataFrame({"t_s": TIME, "wx_dps": GYRO[:, 0]})
    slow = pd.DataFrame({"t_s": 0.003 + np.arange(16) / 4, "lat_deg": 1.0, "lon_deg": 2.0})
    recording = zr.read_recording(pd.concat([fast, slow]).sort_values("t_s"))
    assert (recording.gyro.rate, recording.gyro.n, recording.gyro.missing_count) == (100, N, 0)
    assert (recording.position.rate, recording.position.n) == (4, 16)
    np.testing.assert_array_equal(recording.gyro.data[:, 0], GYRO[:, 0])


def test_several_sources_keep_their_clocks(tmp_path):
    gnss = {"time_s": 5 + np.arange(9) / 4, "lat_deg": np.ones(9), "height_m": np.ones(9)}
    zr.write_log(zr.read_recording(imu()).gyro, tmp_path / "imu.csv")
    recording = zr.read_recording([tmp_path / "imu.csv", gnss])
    assert (recording.gyro.rate, recording.position.rate) == (100, 4)
    assert recording.position.time[0] == 5
    assert recording.position.units == ("deg", "m")
    assert recording.source == f"{tmp_path / 'imu.csv'}, dict"


def test_the_rate_is_that_of_the_gyro():
    gnss = {"t_s": np.arange(9) / 4, "lat": np.ones(9)}
    assert zr.read_recording([{"gyro": GYRO}, gnss], 100).position.rate == 4
    with pytest.raises(LogError, match="dict: the rate is stated as 50 Hz"):
        zr.read_recording(imu(), 50)
    with pytest.raises(LogError, match="give rate="):
        zr.read_recording({"gyro": GYRO})


def test_columns_and_units_that_are_asked_for():
    table = {"t": TIME, "a": TIME, "b": TIME, "angle_deg": TIME, "ax": TIME}
    recording = zr.read_recording(
        table, columns=["a", "b"], reference="angle_deg", unit={"gyro": "dps", "accel": "g"}
    )
    assert recording.names == ("gyro", "reference", "accel")
    assert [log.unit for log in recording.values()] == ["deg/s", "deg", "g"]
    assert zr.read_recording(table, columns="a", unit="rad/s").gyro.unit == "rad/s"
    with pytest.raises(LogError, match="no column 'c'"):
        zr.read_recording(table, reference="c")
    with pytest.raises(ValueError, match="unknown unit 'rpm'"):
        zr.read_recording(table, unit="rpm")


def test_only_some_kinds():
    assert zr.read_recording(imu(), only=["accel"]).names == ("accel",)
    with pytest.raises(ValueError, match="no kind of log 'sound'; known: gyro, accel, mag"):
        zr.read_recording(imu(), only=["sound"])


def test_what_is_left_out_is_noted():
    recording = zr.read_recording(
        imu(mag=np.full((N, 3), np.nan), temp=TIME[:50], fix=TIME, temp_2=np.array(["a"] * N))
    )
    assert recording.names == ("gyro", "accel")
    notes = "\n".join(recording.notes)
    assert "mag_x, mag_y, mag_z: left out, for all samples are missing" in notes
    assert "temp: left out, for the arrays differ in length" in notes
    assert "no sensor is known by the name of: fix" in notes


def test_a_gyro_that_cannot_be_read_is_an_error():
    with pytest.raises(LogError, match="holds <U1, expected real numbers"):
        zr.read_recording({"t": TIME, "wx": np.array(["a"] * N), "ax": TIME})


@pytest.mark.parametrize("source", [{"time": TIME, "fix": TIME}, {"fix": TIME, "count": TIME}])
def test_nothing_that_looks_like_a_sensor(source):
    with pytest.raises(LogError, match=r"dict: no column looks like a sensor; .* from: .*fix"):
        zr.read_recording(source)


@pytest.mark.parametrize("source", [[], None, [1.0, 2.0]])
def test_what_is_no_source(source):
    with pytest.raises((LogError, TypeError), match=r"no source|expected|read from a file"):
        zr.read_recording(source)


def test_a_table_without_names_is_a_gyro():
    recording = zr.read_recording(np.column_stack((TIME, GYRO)))
    assert (recording.names, recording.gyro.channels) == (("gyro",), 3)


def test_names_that_the_file_lists(tmp_path):
    log = Log(TIME, 100, ACCEL, ["p", "q", "r"], "m/s^2", extra={"temp_c": TIME})
    zr.write_log(log, tmp_path / "a.csv")
    recording = zr.read_recording(tmp_path / "a.csv")
    assert recording.names == ("accel", "temperature")
    np.testing.assert_array_equal(recording.accel.data, ACCEL)


def test_groups_with_clocks_of_their_own(tmp_path):
    with h5py.File(tmp_path / "a.h5", "w") as file:
        for name, rate in {"imu": 100, "baro": 10}.items():
            file[f"{name}/time_s"] = np.arange(rate) / rate
        file["imu/gyro_dps"], file["baro/temperature_degc"] = GYRO[:100], TIME[:10]
    recording = zr.read_recording(tmp_path / "a.h5")
    assert (recording.gyro.rate, recording.temperature.rate) == (100, 10)


@pytest.mark.parametrize("kind", KINDS)
def test_every_topic_of_a_ros_recording(tmp_path, kind):
    path = write_recording(tmp_path, kind, ["/left/imu", "/right/imu"])
    recording = zr.read_recording(path)
    assert recording.names == ("gyro", "accel", "gyro_1", "accel_1")
    assert recording["gyro_1"].meta["sensor"] == "/right/imu"
    np.testing.assert_array_equal(recording["accel_1"].data, values(50)[:, 3:])
    assert zr.read_recording(path, topic="/right/imu").gyro.meta["sensor"] == "/right/imu"


def test_a_recording_of_logs_in_memory():
    log = Log(TIME, 100, GYRO, ["wx", "wy", "wz"], "deg/s")
    recording = Recording({"gyro": log, "gyro_1": log}, notes=("made up",))
    assert (recording.gyro, recording.source, recording.notes) == (
        log,
        "the recording",
        ("made up",),
    )
    assert list(recording) == ["gyro", "gyro_1"]


@pytest.mark.parametrize(
    ("name", "meaning"),
    {
        "gyro_x_dps": ("gyro", "gyro", "deg/s"),
        "imu1_wz": ("gyro", "imu1_w", None),
        "yaw_rate": ("gyro", "_rate", None),
        "gyro_2": ("gyro", "gyro", None),
        "AccelX [g]": ("accel", "accel", "g"),
        "magnetic_field.x": ("mag", "magnetic_field", None),
        "my_ut": ("mag", "m", "uT"),
        "mag_z_g": ("mag", "mag", "gauss"),
        "GyroTemp": ("temperature", "gyro_temp", None),
        "temp [°C]": ("temperature", "temp", "degC"),
        "gravityX": ("gravity", "gravity", None),
        "GRAVITY X (m/s²)": ("gravity", "gravity", "m/s^2"),
        "motionGravityX(G)": ("gravity", "motion_gravity", "g"),
        "encoder_deg": ("reference", "encoder", "deg"),
        "ref_quat_w": ("reference", "ref_quat", None),
        "ref_pos_x_m": ("position", "ref_pos", "m"),
        "lat": ("position", "", None),
        "altitude_msl_m": ("position", "", "m"),
        "vel_n_m_s": ("velocity", "vel", "m/s"),
        "vn": ("velocity", "v", None),
        "sigma_up_m": ("position_sigma", "", "m"),
        "position_sigma_up_m": ("position_sigma", "position", "m"),
        "velocity_sigma_north_mps": ("velocity_sigma", "velocity", "m/s"),
    }.items(),
)
def test_the_meaning_of_a_name(name, meaning):
    assert meaning_of(name)[:3] == meaning


@pytest.mark.parametrize("name", ["gravity", "acceleration_without_gravity_x", "noGravityX"])
def test_what_is_no_gravity_vector(name):
    assert meaning_of(name) is None


def test_gravity_has_the_unit_of_the_accelerometer():
    """As a watch writes them, without units."""
    names = ("rotationRate", "gravity", "acceleration")
    table = {f"{name}{axis}": GYRO[:, i] for name in names for i, axis in enumerate("XYZ")}
    recording = zr.read_recording(table, 100.0, unit={"gyro": "rad/s", "accel": "g"})
    assert recording.names == ("gyro", "gravity", "accel")
    assert (recording["gravity"].unit, recording.accel.unit) == ("g", "g")


@pytest.mark.parametrize(
    "name",
    [
        "x",
        "fix",
        "satellites",
        "movement",
        "template",
        "magnitude",
        "baro_alt",
        "gyro_bias_x",
        "accel_mag",
        "mag_status",
        "temperature_setpoint",
        "ref_time",
        "sigma_gyro_x",
        "std_foo",
        "heading",
    ],
)
def test_names_of_no_sensor(name):
    assert meaning_of(name) is None


KINDS_OF = {
    "adis16405_static_100hz_run1": (100, {"gyro": "deg/s", "accel": "g"}),
    "broad_05_undisturbed_slow_rotation_with_breaks_B": (
        2000 / 7,
        {"gyro": "rad/s", "accel": "m/s^2", "mag": "uT", "reference": "1", "position": "m"},
    ),
    "mpu6050_encoder_yaw_slow_100hz": (
        None,
        {"reference": "deg", "gyro": "deg/s", "accel": "g", "gyro_1": "deg/s", "accel_1": "g"},
    ),
    "drive_imu_100hz": (None, {"gyro": "rad/s", "accel": "m/s^2"}),
    "drive_gnss_4hz": (
        None,
        {
            "position": "deg, deg, m",
            "position_sigma": "m",
            "velocity": "m/s",
            "velocity_sigma": "m/s",
        },
    ),
}


@needs_recordings
@pytest.mark.parametrize("name", KINDS_OF)
def test_real_recordings(name):
    rate, units = KINDS_OF[name]
    recording = zr.read_recording(RECORDINGS / f"{name}.parquet", rate)
    assert {name: log.unit for name, log in recording.items()} == units


@needs_recordings
def test_the_array_of_eight():
    recording = zr.read_recording(RECORDINGS / "mimu4444_array8_62hz_exp1.parquet")
    assert (len(recording.of_kind("gyro")), len(recording.of_kind("accel"))) == (8, 8)
    assert recording["gyro_7"].names == tuple(f"imu8_gyro_{axis}_dps" for axis in "xyz")


@needs_recordings
def test_a_drive_in_two_files():
    drive = [RECORDINGS / "drive_imu_100hz.parquet", RECORDINGS / "drive_gnss_4hz.parquet"]
    recording = zr.read_recording(drive)
    assert recording.gyro.rate == pytest.approx(100, rel=1e-3)
    assert (recording.position.rate, recording.position.n) == (4, 2197)


class TestRolesByHand:
    TABLE: ClassVar = {
        "t": np.arange(8) / 100,
        **{name: np.full(8, float(i)) for i, name in enumerate("abcdefghi")},
    }

    def test_columns_of_each_kind(self):
        columns = {"gyro": ["a", "b", "c"], "accel": ["f", "e", "d"], "mag": [7, 8, 9]}
        recording = zr.read_recording(self.TABLE, columns=columns)
        assert list(recording) == ["gyro", "accel", "mag"]
        assert recording.gyro.names == ("a", "b", "c")
        np.testing.assert_array_equal(recording.accel.data[0], [5.0, 4.0, 3.0])
        assert recording.mag.names == ("g", "h", "i")

    def test_others_are_found_by_their_names(self):
        table = {**self.TABLE, **{f"gyro_{axis}": np.ones(8) for axis in "xyz"}}
        recording = zr.read_recording(table, columns={"accel": ["a", "b", "c"]})
        assert recording.gyro.names == ("gyro_x", "gyro_y", "gyro_z")
        assert recording.accel.names == ("a", "b", "c")

    def test_of_a_kind_that_is_none(self):
        with pytest.raises(ValueError, match="columns= takes those of gyro, accel, mag, got 'imu'"):
            zr.read_recording(self.TABLE, columns={"imu": ["a"]})


def test_without_names_the_columns_of_several_sensors_are_taken(tmp_path):
    path = tmp_path / "bare.csv"
    shown = np.random.default_rng(1).standard_normal((200, 6))
    np.savetxt(path, np.column_stack((np.arange(200) / 100.0, shown)), "%.4f", ",")
    columns = {"gyro": (4, 5, 6), "accel": (1, 2, 3)}
    found = zr.read_recording(path, columns=columns, unit={"gyro": "deg/s", "accel": "g"})
    assert (found.gyro.channels, found.accel.channels) == (3, 3)
    assert (found.gyro.unit, found.accel.unit) == ("deg/s", "g")


def test_nobody_is_asked_for_the_unit_of_a_magnetometer():
    shown = np.random.default_rng(1).standard_normal(50)
    table = {"t_s": np.arange(50) / 10.0, "gyro_x": shown, "mag_x": shown}
    found = zr.read_recording(table)
    assert any("the unit of gyro_x is not known" in one for one in found.gyro.meta["notes"])
    assert not any("unit" in one for one in found["mag"].meta["notes"])
