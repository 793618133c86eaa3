"""What a report says of a magnetometer: iron, its changes, and a field that no iron explains."""

import numpy as np
import pytest

import zerorate as zr
from support.recordings import RECORDINGS, needs_recordings

SECTION = "Magnetometer"


def told(recording):
    found = zr.report(recording).findings
    return {one.kind: one for one in found if one.section == SECTION}


@pytest.mark.parametrize(("iron", "severity"), [(0.0, "good"), (15.0, "act")])
def test_a_hard_iron_is_told_by_what_it_does_to_a_heading(iron, severity):
    recording = zr.simulate_motion("hand", duration=60.0, seed=3).recording()
    mag = recording["mag"].with_data(recording["mag"].data + np.array([iron, 0.0, 0.0]))
    one = told(zr.Recording({**recording, "mag": mag}, "log"))["heading error"]
    assert one.severity == severity
    if iron:
        assert float(one.text.split()[4]) == pytest.approx(iron, abs=1.0)
    assert (one.value is None) == (iron == 0.0)


def test_a_log_that_does_not_turn_says_so():
    n = 6000
    random = np.random.default_rng(1)
    table = {"time_s": np.arange(n) / 100.0}
    for i, axis in enumerate("xyz"):
        table |= {
            f"gyro_{axis}_dps": 0.05 * random.standard_normal(n),
            f"accel_{axis}_mps2": 9.8 * (i == 2) + 0.02 * random.standard_normal(n),
            f"mag_{axis}_ut": 20.0 + 0.3 * random.standard_normal(n),
        }
    assert [one.severity for one in told(zr.read_recording(table)).values()] == ["good"]


@needs_recordings
def test_a_magnet_that_comes_and_goes_is_found_with_its_times():
    path = RECORDINGS / "broad_32_disturbed_attached_magnet_1cm.parquet"
    found = told(zr.read_recording(path, rate=2000 / 7))
    assert found["heading error"].severity == "act"
    assert found["iron changes"].severity == "look"
    (first, _), *_ = found["disturbed"].spans
    assert first == pytest.approx(38.0, abs=2.0)
