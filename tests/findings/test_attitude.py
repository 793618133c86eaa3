"""What a report says of inclination: as rests begin, and of the log's own estimate."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import zerorate as zr
from support.recordings import RECORDINGS, needs_recordings
from zerorate.findings.attitude import up_direction
from zerorate.geometry.rotations import product


@pytest.fixture(scope="module")
def motion():
    return zr.simulate_motion("hand", duration=60.0, seed=4)


def tilted(motion, degrees):
    """Return the log with the true orientation, turned about the sensor's x axis."""
    half = np.radians(degrees) / 2.0
    turned = product(motion.quaternion, np.array([np.cos(half), np.sin(half), 0.0, 0.0]))
    recording = motion.recording()
    reference = recording["reference"].with_data(turned)
    return zr.Recording({**recording, "reference": reference}, "log")


def finding(recording, kind):
    (one,) = [one for one in zr.report(recording).findings if one.kind == kind]
    return one


@pytest.mark.parametrize(("degrees", "severity"), [(0.0, "good"), (3.5, "look"), (7.0, "act")])
def test_a_log_whose_vertical_is_off_at_rest_is_told(motion, degrees, severity):
    rested = tilted(motion, degrees)
    one = finding(rested, "log inclination")
    assert one.severity == severity
    assert one.value == pytest.approx(degrees, abs=1.0)  # its bias tilts gravity


def test_a_vertical_off_in_motion_is_apart_from_that_of_the_sensors(motion):
    one = finding(tilted(motion, 8.0), "attitudes differ")
    assert one.severity == "look"
    assert one.value == pytest.approx(8.0, abs=1.5)


@pytest.mark.parametrize(("scale", "severity"), [(1.0, "good"), (1.1, "look")])
def test_a_gyro_of_a_wrong_scale_is_off_as_a_rest_begins(scale, severity):
    """A rest, a turn of 120 deg about x within 0.6 s, a rest."""
    t = np.arange(4000) / 100.0
    rate = np.where((t > 19.9) & (t <= 20.5), 200.0, 0.0)
    angle = np.radians(np.cumsum(rate) / 100.0)
    zero = 0.0 * t
    random = np.random.default_rng(3)
    gyro = np.stack([scale * rate, zero, zero], 1) + 0.05 * random.standard_normal((4000, 3))
    force = 9.80665 * np.stack([zero, np.sin(angle), np.cos(angle)], 1)
    force += 0.02 * random.standard_normal((4000, 3))
    table = {"time_s": t}
    for i, axis in enumerate("xyz"):
        table |= {f"gyro_{axis}_dps": gyro[:, i], f"accel_{axis}_mps2": force[:, i]}
    one = finding(zr.read_recording(table), "inclination")
    assert one.severity == severity
    assert one.value == pytest.approx(120.0 * (scale - 1.0), abs=1.5)


def test_up_is_the_third_row_of_the_rotation():
    q = np.random.default_rng(1).standard_normal((20, 4))
    expected = Rotation.from_quat(q, scalar_first=True).as_matrix()[:, 2]
    np.testing.assert_allclose(up_direction(q), expected, atol=1e-12)


@needs_recordings
def test_the_attitude_of_a_px4_is_compared_with_gravity():
    one = finding(zr.read_recording(RECORDINGS / "px4_sample_log_small.ulg"), "log inclination")
    assert one.severity == "good"
    assert one.value == pytest.approx(0.07, abs=0.01)
