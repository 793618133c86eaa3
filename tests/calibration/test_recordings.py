"""Real recordings of hand turns: what is reached on turns that were not fitted."""

import numpy as np
import pytest

import zerorate as zr
from support.recordings import RECORDINGS, needs_recordings

DEG = np.pi / 180.0
pytestmark = needs_recordings


@pytest.fixture(scope="module")
def units():
    recording = zr.read_recording(RECORDINGS / "mimu4444_array8_62hz_exp1.parquet")
    names = [name for name in recording if name.startswith("gyro")]
    return [zr.calibration.calibrate(recording, gyro=name) for name in names]


def test_the_eight_units_of_the_array(units):
    assert len(units) == 8
    assert all(one.valid and one.held_out for one in units)
    norms = np.array([one.norm_error for one in units])
    carries = np.array([one.carry_error for one in units])
    assert np.median(norms) <= 0.5e-3
    assert norms.max() <= 1.7e-3
    assert carries.max() <= 0.62 * DEG
    assert all(one.norm_error_raw > 15e-3 for one in units)
    assert all(one.carry_error_raw > 0.9 * DEG for one in units)


def test_units_on_one_board_turn_alike(units):
    """Those on the top share axes: their turns have one angle, whatever their scale."""
    angles = np.array([[turn.angle for turn in one.turns if turn.used][-18:] for one in units[::2]])
    assert np.ptp(angles, axis=0).max() < 3.0 * DEG
    assert [one.turns[-1].reason[:4] for one in units] == ["long"] * 8


def test_slow_motion_with_breaks_is_refused():
    recording = zr.read_recording(
        RECORDINGS / "broad_05_undisturbed_slow_rotation_with_breaks_B.parquet", rate=2000 / 7
    )
    message = "5 rests and 3 of 4 turns can be used, .*; 17 of 18 parameters are not identifiable"
    with pytest.raises(zr.calibration.CalibrationError, match=message) as refusal:
        zr.calibration.calibrate(recording)
    found = refusal.value.calibration
    assert not found.valid
    assert int((~found.identifiable[:24]).sum()) == 17


def test_a_log_at_rest_has_one_rest_and_its_bias():
    recording = zr.read_recording(RECORDINGS / "mpu6050_static_100hz.parquet", rate=100.0)
    with pytest.raises(
        zr.calibration.CalibrationError, match=r"1 rest and 0 turns .* -3.345, 1.089, -0.49"
    ):
        zr.calibration.calibrate(recording)
