"""What a recording holds next to the logs of its sensors."""

import json
import pickle

import numpy as np
import pytest

import zerorate as zr
from support.ulogs import flight, message, stamps, write_ulog
from zerorate.record import LogError

N = 400
TIME = np.arange(N) / 100.0
TURN = [[0.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]


def imu():
    return {"time_s": TIME, "gyro_radps": np.zeros((N, 3)), "accel_mps2": np.ones((N, 3))}


def gnss(time="time_s", scale=1.0):
    seconds = np.arange(4) * scale
    places = {"latitude_deg": 45.0 + 1e-5 * np.arange(4), "longitude_deg": np.full(4, 7.0)}
    return {time: seconds, **places, "height_m": np.full(4, 200.0)}


def csv(path, table):
    rows = np.column_stack([*table.values()])
    np.savetxt(path, rows, delimiter=",", header=",".join(table), comments="")
    return path


def together():
    """A table of an IMU in which every hundredth row has a fix."""
    sparse = {name: np.full(N, np.nan) for name in gnss() if name != "time_s"}
    for name, column in sparse.items():
        column[::100] = gnss()[name]
    rates = {f"gyro_{axis}_radps": np.zeros(N) for axis in "xyz"}
    return {"time_s": TIME, **rates, **sparse}


class TestFixes:
    def test_they_are_those_of_read_fixes(self, tmp_path):
        path = csv(tmp_path / "a.csv", together())
        recording, fixes = zr.read_recording(path), zr.read_fixes(path)
        np.testing.assert_array_equal(recording.fixes.position, fixes.position)
        np.testing.assert_array_equal(recording.fixes.time, [0.0, 1.0, 2.0, 3.0])
        assert recording.fixes is recording.fixes
        assert recording.fixes.notes == fixes.notes

    def test_of_objects_and_of_several_sources(self, tmp_path):
        for source in (together(), [imu(), gnss()], [imu(), csv(tmp_path / "b.csv", gnss())]):
            assert len(zr.read_recording(source).fixes) == 4
        assert zr.read_recording(imu()).fixes is None
        bare = csv(tmp_path / "c.csv", {"time_s": TIME, "wx": TIME})
        assert zr.read_recording(bare).fixes is None

    def test_a_file_is_read_for_them_when_they_are_asked_for(self, tmp_path):
        path = csv(tmp_path / "a.csv", together())
        recording = pickle.loads(pickle.dumps(zr.read_recording(path)))
        path.unlink()
        with pytest.raises(FileNotFoundError, match="does not exist"):
            _ = recording.fixes

    def test_places_that_are_no_fixes_leave_the_sensors_alone(self, tmp_path):
        table = together()
        del table["longitude_deg"]
        for source in (table, csv(tmp_path / "a.csv", table)):
            recording = zr.read_recording(source)
            assert recording.gyro.n == N
            with pytest.raises(LogError, match="no column is a longitude"):
                _ = recording.fixes

    def test_their_time_is_the_one_that_was_stated(self):
        table = {**together(), "count": 1000.0 * TIME + 5000.0}
        recording = zr.read_recording(table, time="count", time_unit="ms")
        assert recording.gyro.time[0] == pytest.approx(5.0)
        np.testing.assert_allclose(recording.fixes.time, [5.0, 6.0, 7.0, 8.0])

    def test_a_simulated_drive_has_its_own(self):
        drive = zr.simulate_drive(duration=1.0)
        assert drive.recording().fixes is drive.fixes

    def test_parts_of_a_recording_keep_them(self):
        recording = zr.read_recording([imu(), gnss()])
        turned = zr.record.body_axes(recording, TURN)
        assert turned.fixes is recording.fixes


class TestMounting:
    def written(self, path, **said):
        arrow = pytest.importorskip("pyarrow")
        from pyarrow import parquet

        names = {f"gyro_{axis}_radps": np.zeros(N) for axis in "xyz"}
        table = arrow.table({"time_s": TIME, **names}).replace_schema_metadata(said)
        parquet.write_table(table, path)
        return path

    def test_it_is_that_of_the_metadata_until_axes_are_the_body_s(self, tmp_path):
        said = {"body_from_sensor": json.dumps(TURN), "antenna_from_imu_m": "0.5,0,-1"}
        recording = zr.read_recording(self.written(tmp_path / "a.parquet", **said))
        np.testing.assert_array_equal(recording.mounting.body_from_sensor, TURN)
        turned = zr.record.body_axes(recording, recording.mounting.body_from_sensor)
        assert turned.mounting.body_from_sensor is None
        np.testing.assert_array_equal(turned.mounting.antenna, [0.5, 0.0, -1.0])

    def test_wrong_metadata_leave_the_sensors_alone(self, tmp_path):
        path = self.written(tmp_path / "a.parquet", antenna_from_imu_m="high")
        recording = zr.read_recording(path)
        assert recording.gyro.n == N
        with pytest.raises(LogError, match="metadata on the mounting is wrong"):
            _ = recording.mounting

    def test_there_is_none_where_nothing_is_stated(self, tmp_path):
        assert zr.read_recording(self.written(tmp_path / "a.parquet")).mounting is None
        assert zr.read_recording(imu()).mounting is None


class TestTables:
    def log(self, path):
        status = {"timestamp": stamps(N, 5000), "gyro_clipping": np.ones((N, 3), np.float32)}
        write_ulog(path, {**flight(N), ("vehicle_imu_status", 0): status})
        key = b"char[4] sys_uuid"
        path.write_bytes(path.read_bytes() + message("I", bytes([len(key)]) + key + b"a01b"))
        return path

    def test_they_are_loaded_by_the_beginnings_of_their_names(self, tmp_path):
        recording = zr.read_recording(self.log(tmp_path / "a.ulg"))
        ((name, columns),) = recording.tables("vehicle_imu_status", "nothing")
        assert name == "vehicle_imu_status"
        assert columns["gyro_clipping[1]"].tolist() == [1.0] * N
        assert recording.device == "a01b"

    def test_a_recording_of_arrays_has_none(self):
        recording = zr.read_recording(imu())
        assert list(recording.tables("")) == []
        assert recording.device is None
