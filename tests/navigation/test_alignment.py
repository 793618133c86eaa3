"""What is known of a vehicle at rest."""

import math

import numpy as np
import pytest

import zerorate as zr
from zerorate.geometry.earth import earth_rate, normal_gravity
from zerorate.geometry.rotations import euler_angles

LATITUDE = 48.0


def resting(roll, pitch, yaw, bias=(0.0, 0.0, 0.0), seconds=20.0, rate=50.0, noise=1e-4):
    """A recording of a body at rest, and its quaternion."""
    from scipy.spatial.transform import Rotation

    turned = Rotation.from_euler("ZYX", [yaw, pitch, roll])
    n, random = round(seconds * rate), np.random.default_rng(1)
    gravity = np.array([0.0, 0.0, -float(normal_gravity(math.radians(LATITUDE)))])
    force = turned.inv().apply(gravity) + noise * random.standard_normal((n, 3))
    turn = turned.inv().apply(earth_rate(math.radians(LATITUDE))) + np.array(bias)
    table = {
        "time_s": np.arange(n) / rate,
        "gyro_radps": turn + 0.1 * noise * random.standard_normal((n, 3)),
        "accel_mps2": force,
    }
    return zr.read_recording(table), turned.as_quat(scalar_first=True)


@pytest.mark.parametrize("angles", [(0.0, 0.0, 0.0), (0.2, -0.3, 2.5), (-3.0, 1.2, -1.0)])
def test_level_and_bias_are_those_of_the_body(angles):
    bias = (1e-3, -2e-3, 5e-4)
    imu, truth = resting(*angles, bias=bias)
    start = zr.align(imu, latitude=LATITUDE, heading=angles[2])
    assert abs(abs(start.quaternion @ truth) - 1.0) < 1e-8
    np.testing.assert_allclose(start.gyro_bias, bias, atol=5 * start.gyro_bias_sigma + 1e-9)
    assert start.gyro_bias_sigma < 1e-5
    assert start.heading_known
    assert not start.course


def test_without_a_heading_the_rate_of_the_earth_is_in_doubt():
    imu, _ = resting(0.1, 0.2, 1.0)
    start = zr.align(imu, latitude=LATITUDE)
    horizontal = float(earth_rate(math.radians(LATITUDE))[0])
    assert start.gyro_bias_sigma >= horizontal
    assert np.abs(start.gyro_bias).max() <= 1.01 * horizontal + 1e-6
    roll, pitch, _ = euler_angles(start.quaternion[np.newaxis])[0]
    assert (roll, pitch) == pytest.approx((0.1, 0.2), abs=1e-4)
    nav = zr.NavigationFilter(start)
    track = nav.process(imu, zr.Fixes([16.0], [[LATITUDE, 11.0, 0.0]], [[5.0, 0.0, 0.0]]))
    assert nav.status == "no heading"
    assert not track.navigating.any()
    assert "no heading" in str(start)


def test_time_is_where_the_rest_ended():
    imu, _ = resting(0.0, 0.0, 0.0, seconds=20.0)
    assert zr.align(imu, latitude=LATITUDE, span=(2.0, 12.0)).time == 12.0
    late = zr.align(imu, latitude=LATITUDE, heading=0.0, span=(2.0, 12.0))
    fixes = zr.Fixes([5.0, 13.0], [[LATITUDE, 11.0, 0.0]] * 2, [[0.0, 0.0, 0.0]] * 2)
    nav = zr.NavigationFilter(late)
    track = nav.process(imu, fixes)
    assert nav.fix_count == {"used": 1, "rejected": 0, "refused": 1}
    assert track.time[track.navigating][0] == pytest.approx(13.0)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"latitude": 91.0}, "latitude must be within 89.5 deg, got 91"),
        ({"latitude": math.nan}, "latitude must be within 89.5 deg, got nan"),
        ({"latitude": 0.0, "heading": "north"}, "heading must be an angle in rad, 'course' or"),
        ({"latitude": 0.0, "heading": 90.0}, "heading must be within 12.57 rad, got 90"),
        ({"latitude": 0.0, "span": (3.0, 3.5)}, "span must be at least 1 s long, got 3 to 3.5 s"),
        ({"latitude": 0.0, "accel_bias_sigma": 0.0}, "accel_bias_sigma must be above 0"),
        ({"latitude": 0.0, "heading_sigma": math.inf}, "heading_sigma must be above 0"),
    ],
)
def test_wrong_arguments_are_refused(options, message):
    imu, _ = resting(0.0, 0.0, 0.0)
    with pytest.raises(ValueError, match=message):
        zr.align(imu, **options)


def test_records_that_are_no_rest_are_refused():
    imu, _ = resting(0.0, 0.0, 0.0, seconds=8.0)
    with pytest.raises(zr.LogError, match=r"does not rest for 10 s.* span="):
        zr.align(imu, latitude=LATITUDE)
    with pytest.raises(zr.LogError, match=r"there are 0 samples from 30 to 50 s"):
        zr.align(imu, latitude=LATITUDE, span=(30.0, 50.0))
    in_g = zr.read_recording(
        {
            "time_s": np.arange(1000) / 50,
            "gyro_radps": np.zeros((1000, 3)),
            "accel_mps2": np.tile([0.0, 0.0, -1.0], (1000, 1)),
        }
    )
    with pytest.raises(zr.LogError, match=r"the force from .* is 1.00 m/s\^2, expected that of"):
        zr.align(in_g, latitude=LATITUDE, span=(0.0, 15.0))
    only_gyro = zr.read_recording({"time_s": np.arange(1000) / 50, "gyro_dps": np.zeros((1000, 3))})
    with pytest.raises(zr.LogError, match="an alignment needs an accelerometer"):
        zr.align(only_gyro, latitude=LATITUDE, span=(0.0, 15.0))
