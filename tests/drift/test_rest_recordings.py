"""RestDetector on real recordings."""

import numpy as np
import pytest

import zerorate as zr
from support.recordings import column, needs_recordings

pytestmark = needs_recordings

STATIC = {
    "adis16405_static_100hz_run1": ("gyro_{}_dps", 0.999),
    "mpu6050_static_100hz": ("gyro_{}_dps", 0.995),
    # Fixed beside a motor, of which the vibration swells now and then.
    "mpu6050_encoder_yaw_slow_100hz": ("fixed_gyro_{}_dps", 0.99),
}


@pytest.mark.parametrize("axis", "xyz")
@pytest.mark.parametrize("name", STATIC)
def test_recordings_at_rest(name, axis):
    """The first 1.5 s included."""
    pattern, share = STATIC[name]
    rest = zr.RestDetector(100.0).process(column(name, pattern.format(axis)))
    assert np.mean(rest) > share


@pytest.mark.parametrize("axis", "xyz")
def test_a_shaft_that_never_rests(axis):
    """Taken for rest between the first 1.5 s and its first reversal alone."""
    z = column("mpu6050_encoder_yaw_slow_100hz", f"shaft_gyro_{axis}_dps")
    rest = zr.RestDetector(100.0).process(z)
    assert not np.any(rest[500:])


@pytest.mark.parametrize("axis", "xyz")
def test_hand_motion_with_pauses(axis):
    rate = 2000.0 / 7.0
    name = "broad_05_undisturbed_slow_rotation_with_breaks_B"
    rest = zr.RestDetector(rate).process(column(name, f"gyro_{axis}_radps"))
    moving = column(name, "movement").astype(bool)
    begins = np.flatnonzero(np.diff(moving.astype(int)) > 0) + 1
    ends = np.flatnonzero(np.diff(moving.astype(int)) < 0) + 1
    assert len(begins) == len(ends) == 4
    assert np.all(rest[round(1.6 * rate) : begins[0] - round(rate)])
    for begin, end, again in zip(begins, ends, [*begins[1:], len(rest)], strict=True):
        # The hand begins and lets go within a second of what the cameras call motion.
        assert not np.any(rest[begin + 72 : end])
        assert np.all(rest[end + round(3.0 * rate) : again - round(rate)])


@pytest.mark.parametrize("unit", range(1, 9))
@pytest.mark.parametrize("axis", "xyz")
def test_poses_between_turns(unit, axis):
    """Twenty, which the eight sensors of a board show alike, and then 100 s of shaking."""
    z = column("mimu4444_array8_62hz_exp1", f"imu{unit}_gyro_{axis}_dps")
    rest = zr.RestDetector(62.5).process(z)
    begins = np.flatnonzero(np.diff(rest.astype(int)) > 0) / 62.5
    ends = np.flatnonzero(np.diff(rest.astype(int)) < 0) / 62.5
    assert len(ends) == 20
    # The last begins after the shaking.
    assert np.all(begins[20:] > 598.0)
    # 23 s of a pose less the 1.5 s to tell it, a tick, and what a hand takes to let go.
    assert np.all(ends - begins[:20] > 19.0)
