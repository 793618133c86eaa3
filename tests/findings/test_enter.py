"""What a report has to enter in other programs, and what it says to record next."""

import re

import numpy as np
import pytest

import zerorate as zr
from zerorate.findings.external_settings import SECTION as ENTER
from zerorate.findings.next_recording import SECTION as RECORD


@pytest.fixture(scope="module")
def posed():
    """Return the report on a session of twenty poses, of known noise."""
    return zr.report(zr.simulation.simulate_session(20, seed=3).recording)


def of(report, section):
    return {one.kind: one for one in report.findings if one.section == section}


def still(n=9000, density=0.01):
    random = np.random.default_rng(2)
    table = {"time_s": np.arange(n) / 100.0}
    for i, axis in enumerate("xyz"):
        table |= {
            f"gyro_{axis}_dps": density * 10.0 * random.standard_normal(n),
            f"accel_{axis}_mps2": 9.80665 * (i == 2) + 0.02 * random.standard_normal(n),
        }
    return zr.read_recording(table)


def test_poses_give_the_offsets_that_autopilots_take(posed):
    calibration = zr.calibrate(zr.simulation.simulate_session(20, seed=3).recording)
    entered = of(posed, ENTER)
    assert entered["ArduPilot"].code == calibration.to_ardupilot()
    assert "CAL_ACC0_XOFF" in entered["PX4, sensors"].code
    assert not any("poses" in one.text for one in of(posed, RECORD).values())


def test_noise_at_rest_is_written_as_other_programs_read_it():
    entered = of(zr.report(still()), ENTER)
    assert set(entered) == {"PX4, EKF2", "Kalibr", "robot_localization"}
    found = re.search(r"gyroscope_noise_density: (\S+)", entered["Kalibr"].code)
    assert float(found[1]) == pytest.approx(np.radians(0.01), rel=0.1)
    assert "update_rate: 1.00000e+02" in entered["Kalibr"].code


def test_both_numbers_of_a_noise_are_told():
    """The page's own is one-sided, that which other programs take is not."""
    (told,) = (one for one in zr.report(still()).findings if one.kind == "gyro noise")
    assert told.value == pytest.approx(0.01 * np.sqrt(2.0), rel=0.1)
    assert float(re.search(r"Allan deviation: (\S+)\.$", told.text)[1]) == pytest.approx(
        0.01, rel=0.1
    )


def test_what_is_not_identifiable_comes_with_the_record_that_tells_it():
    texts = [one.text for one in zr.report(still()).findings if one.section == RECORD]
    assert any("Ten hours at rest" in one and "rate random walk" in one for one in texts)
    assert any("poses" in one and "accelerometer" in one for one in texts)
    assert all(one.endswith(".") for one in texts)


def test_a_log_without_a_rest_enters_nothing_and_asks_for_one():
    motion = zr.simulate_motion("hand", duration=30.0, start="motion").recording()
    found = zr.report(motion)
    assert of(found, ENTER) == {}
    assert any("Ten seconds at rest" in o.text for o in found.findings if o.section == RECORD)
