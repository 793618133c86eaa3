"""What a file is taken for, column by column, and the formats that are known."""

import numpy as np

from support.dataflash import flight, write_dataflash, write_text
from zerorate.io import explain
from zerorate.io.explaining import list_formats
from zerorate.io.formats import FORMATS


def write(path, header, width):
    rows = np.column_stack([np.arange(50) / 100, np.random.default_rng(2).normal(size=(50, width))])
    np.savetxt(path, rows, delimiter=",", header=header, comments="")
    return path


def test_every_column_of_a_table(tmp_path):
    header = "time_s,gyro_x_dps,gyro_y_dps,gyro_z_dps,accel_x,accel_y,accel_z,battery_v"
    told = explain(write(tmp_path / "a.csv", header, 7))
    assert (told.format, told.reason) == (
        "text",
        "by its suffix .csv, and no other format begins so",
    )
    (topic,) = told.topics
    assert [tuple(one) for one in topic.columns] == [
        ("time_s", "time", "s, by its name", "time"),
        *((f"gyro_{a}_dps", f"gyro {a}", "deg/s, by its name", "gyro") for a in "xyz"),
        *((f"accel_{a}", f"accel {a}", "not known", "accel") for a in "xyz"),
        ("battery_v", "", "", ""),
    ]
    assert told.logs["gyro"].rate == 100
    assert any("the unit of accel_x, accel_y, accel_z is not known" in str(n) for n in told.notes)


def test_a_table_without_any_sensor_says_why_nothing_is_read(tmp_path):
    told = explain(write(tmp_path / "a.csv", "time_s,humidity", 1))
    assert not told.logs
    assert "no log is read: " in told.notes[0]
    assert "no column looks like a sensor" in told.notes[0]
    assert [one.log for one in told.topics[0].columns] == ["time", ""]


def test_topics_that_are_read_and_others(tmp_path):
    told = explain(write_dataflash(tmp_path / "a.bin", flight(60)))
    assert told.reason == "by its suffix .bin and its first bytes"
    assert [one.name for one in told.topics] == ["IMU", "IMU_1", "MAG", "BARO", "GPS", "ATT"]
    assert told.topics[1].columns[1].log == "gyro_1"
    assert "PARM" in told.others
    told = explain(write_text(tmp_path / "a.log", flight(60)))
    assert told.reason == "a text that begins with FMT, which declares messages"


def test_formats_are_those_that_are_read():
    known = list_formats()
    assert len(known) == len(FORMATS)
    written = {suffix for one in known for suffix in one.written}
    assert written == {".csv", ".tsv", ".npz", ".parquet", ".mcap", ".gcsv"}
    assert {one.extra for one in known} == {"", "io", "hdf5", "mat", "ros", "camera"}
    assert all(one.is_installed for one in known if not one.extra)
