"""What names of columns say: gyros, times, units."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import zerorate as zr
from zerorate.io.clocks.names import find_time_unit, has_time_name, looks_like_time, may_be_time
from zerorate.record.names import canonical_unit, looks_like_gyro, split_unit

GYROS = """
gyro_x_dps wx gx gyroX GyroscopeZ angular_velocity.x imu1_gyro_z rate_x w_x imu_wz rate wz_radps
field.angular_velocity.y AngularVelocityX rotationRateZ
"""


OTHERS = """
accel_x_g mag_x gyro_temp time_s x angular_velocity_covariance[0] ax sample_rate
bias_gyro_x bias_sigma_gyro_x_dps at_rest_gyro_x stuck_gyro_x saturated_gyro_x
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
        assert not has_time_name(name), name


def test_names_that_may_be_of_the_time():
    names = "millis micros Seconds ts ts_us elapsed elapsedMs date datetime nanoseconds"
    for name in names.split():
        assert may_be_time(name) != looks_like_time(name), name
    units = [find_time_unit(name) for name in names.split()]
    assert units == ["ms", "us", "s", None, "us", None, "ms", None, None, "ns"]


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


@settings(max_examples=300, deadline=None)
@given(names=st.lists(st.text("/ _xwzgyro[]().°s\n\0ı", max_size=7), min_size=1, max_size=5))
def test_arrays_of_any_name_are_read_or_refused(names):
    arrays = {name: np.arange(4.0) for name in names}
    for read in (zr.read_log, zr.read_recording):
        for asked in (None, 0):
            try:
                read(arrays, rate=10, columns=asked)
            except zr.record.LogError as error:
                assert "\n" not in str(error)  # noqa: PT017
