"""What a report says of a receiver: its clock, contradictions, innovations."""

import numpy as np
import pytest

import zerorate as zr

SECTION = "Receiver"


@pytest.fixture(scope="module")
def drive():
    return zr.simulate_drive(duration=200.0, seed=2)


def told(recording, fixes):
    found = zr.report(recording, fixes=fixes).findings
    return {one.kind: one for one in found if one.section == SECTION}


def test_a_receiver_that_agrees_passes_no_limit(drive):
    found = told(drive.recording(), drive.fixes)
    assert {one.severity for one in found.values()} == {"good"}
    assert found["receiver's clock"].value < 4.0 * found["receiver's clock"].sigma
    assert found["innovations"].value == pytest.approx(1.0, abs=0.3)


def test_a_clock_that_is_late_is_told_with_its_error(drive):
    one = told(drive.recording(), drive.fixes.shifted(0.4))["receiver's clock"]
    assert (one.severity, one.unit) == ("look", "s")
    assert abs(one.value - 0.4) < 4.0 * one.sigma < 0.2
    assert "s late, their velocities" in one.text


def test_a_clock_far_off_asks_to_act_once(drive):
    found = told(drive.recording(), drive.fixes.shifted(30.0))
    assert [kind for kind, one in found.items() if one.severity == "act"] == ["receiver: clock"]


def test_a_gyro_in_another_unit_contradicts_the_fixes(drive):
    recording = drive.recording()
    wrong = recording["gyro"].with_data(np.radians(recording["gyro"].data))
    found = told(zr.Recording({**recording, "gyro": wrong}, "drive"), drive.fixes)
    assert found["receiver: gyro"].severity == "act"
    assert "receiver's clock" not in found


def test_few_fixes_tell_nothing(drive):
    assert told(drive.recording(), drive.fixes.between(0.0, 10.0)) == {}
