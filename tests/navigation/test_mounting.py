"""Sensors that are mounted otherwise."""

import numpy as np
import pytest

import zerorate as zr

TURN = np.array([[0.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])


def test_all_sensors_are_turned_and_nothing_else():
    n = 100
    random = np.random.default_rng(1)
    table = {
        "time_s": np.arange(n) / 100,
        "gyro_dps": random.standard_normal((n, 3)),
        "accel_mps2": random.standard_normal((n, 3)),
        "temp_degc": np.full(n, 20.0),
    }
    before = zr.read_recording(table)
    after = zr.record.body_axes(before, TURN)
    for name in ("gyro", "accel"):
        np.testing.assert_allclose(after[name].data, before[name].data @ TURN.T)
        assert after[name].unit == before[name].unit
    assert after["temperature"] is before["temperature"]


@pytest.mark.parametrize(
    ("matrix", "message"),
    [
        (np.eye(2), r"must be a matrix of shape \(3, 3\)"),
        ("x", r"must be a matrix of shape \(3, 3\)"),
        (2.0 * np.eye(3), "must be a rotation"),
        (np.diag([1.0, 1.0, -1.0]), "not mirrored"),
        (np.full((3, 3), np.nan), "must be a rotation"),
    ],
)
def test_what_is_no_rotation_is_refused(matrix, message):
    drive = zr.simulate_drive(duration=1.0)
    with pytest.raises(ValueError, match=message):
        zr.record.body_axes(drive.recording(), matrix)


def written(path, **said):
    """A Parquet file with metadata."""
    arrow = pytest.importorskip("pyarrow")
    from pyarrow import parquet

    table = arrow.table({"time_s": [0.0, 0.1]}).replace_schema_metadata(said)
    parquet.write_table(table, path)
    return path


def test_a_file_says_how_it_was_mounted(tmp_path):
    said = {"body_from_sensor": str(TURN.tolist()), "antenna_from_imu_m": "0.5,0,-1"}
    mounting = zr.io.read_mounting(
        written(tmp_path / "a.parquet", imu_time_offset_s="-0.1", **said)
    )
    np.testing.assert_array_equal(mounting.body_from_sensor, TURN)
    np.testing.assert_array_equal(mounting.antenna, [0.5, 0.0, -1.0])
    assert mounting.time_offset == 0.1
    other = zr.io.read_mounting(written(tmp_path / "o.parquet", time_offset_s="0.1"))
    assert other.time_offset == mounting.time_offset
    nothing = zr.io.read_mounting(written(tmp_path / "b.parquet"))
    assert nothing.body_from_sensor is nothing.antenna is nothing.time_offset is None
    text = tmp_path / "c.csv"
    text.write_text("time,gyro\n0,1\n")
    assert zr.io.read_mounting(text).antenna is None


@pytest.mark.parametrize(
    "said",
    [
        {"body_from_sensor": "[[1, 0], [0, 1]]"},
        {"body_from_sensor": "no JSON"},
        {"antenna_from_imu_m": "1,2"},
        {"imu_time_offset_s": "soon"},
    ],
)
def test_what_it_says_wrongly_is_refused(tmp_path, said):
    with pytest.raises(zr.LogError, match="its metadata on the mounting is wrong"):
        zr.io.read_mounting(written(tmp_path / "a.parquet", **said))
