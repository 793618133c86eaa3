"""The choice of columns, units and rates."""

import numpy as np
import pytest

from support.tables import TIME, parquet, two_sensors
from zerorate.io import read_log
from zerorate.record import LogError


def test_choice_of_columns(tmp_path):
    path = two_sensors(tmp_path)
    assert read_log(path).names == ("shaft_gyro_x_dps",)
    assert read_log(path, sensor="fixed").names == ("fixed_gyro_x_dps",)
    assert read_log(path, sensor="all").names == ("shaft_gyro_x_dps", "fixed_gyro_x_dps")
    with pytest.raises(LogError, match="'left', which is none of: shaft_gyro, fixed_gyro"):
        read_log(path, sensor="left")
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
