"""What a report finds in a log: faults put in one at a time, and nothing in a clean one."""

import json
import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import zerorate as zr
from support.recordings import RECORDINGS, needs_recordings
from zerorate.findings import LIMITS
from zerorate.findings.report import SECTIONS

RATE = 100.0
N = 6000
_SOME = slice(2000, 2010)
PAGE = Path(__file__).parents[2] / "docs/reference/report.md"


def columns(seed=1, imus=1):
    """Return a log that rests, turns and rests, of IMUs that are alike but for their noise."""
    random = np.random.default_rng(seed)
    t = np.arange(N) / RATE
    on = np.clip(np.minimum(t - 15.0, 45.0 - t) / 2.0, 0.0, 1.0)
    turns = 60.0 * on[:, None] * np.sin(2 * np.pi * t[:, None] * [0.31, 0.23, 0.17])
    found = {"time_s": t}
    for k in range(imus):
        gyro = turns + 0.05 * random.standard_normal((N, 3))
        accel = [0.3, -0.2, 9.79] + (0.02 + on[:, None]) * random.standard_normal((N, 3))
        for i, axis in enumerate("xyz"):
            found[f"imu{k + 1}_gyro_{axis}_dps"] = gyro[:, i]
            found[f"imu{k + 1}_accel_{axis}_mps2"] = accel[:, i]
    return found


def kinds(table, severity):
    found = zr.report(zr.read_recording(table)).findings
    # Its gravity does not turn with it.
    apart = ("Units and axes", "Attitude")
    return {one.kind for one in found if one.severity == severity and one.section not in apart}


def test_a_clean_log_passes_no_limit():
    found = zr.report(zr.simulate_motion("hand", duration=60.0).recording())
    assert (found.count("act"), found.count("look")) == (0, 0)
    count = sum(one.severity == "good" and one.value is not None for one in found.findings)
    assert found.summary.startswith(f"All within limits: {count} numbers of clock, samples, rest")
    assert kinds(columns(imus=2), "act") | kinds(columns(imus=2), "look") == set()


def test_a_gyro_at_its_limit_is_told_with_share_and_span():
    table = columns()
    table["imu1_gyro_x_dps"] = np.clip(table["imu1_gyro_x_dps"], -55.0, 55.0)
    found = zr.report(zr.read_recording(table))
    (one,) = [one for one in found.findings if one.kind == "at its limit"]
    assert (one.severity, one.unit) == ("act", "%")
    at = np.abs(table["imu1_gyro_x_dps"]) == 55.0
    # Samples that come within 0.2 % of it by themselves count too.
    assert one.value == pytest.approx(100.0 * at.mean(), rel=0.01)
    assert one.spans[0][0] == pytest.approx(table["time_s"][at][0], abs=1e-6)


@pytest.mark.parametrize(
    ("kind", "severity", "change"),
    [
        ("gyro bias", "act", lambda t: t["imu1_gyro_z_dps"].__iadd__(5.2)),
        ("gyro bias", "look", lambda t: t["imu1_gyro_z_dps"].__iadd__(3.5)),
        ("bias moves", "look", lambda t: t["imu1_gyro_y_dps"][3000:].__iadd__(0.2)),
        ("gravity", "act", lambda t: t["imu1_accel_z_mps2"].__isub__(0.5)),
        ("equal samples", "act", lambda t: t["imu1_accel_x_mps2"][2000:2120].__imul__(0.0)),
        ("missing samples", "look", lambda t: t["imu1_gyro_x_dps"].__setitem__(_SOME, math.nan)),
        ("repeated stamps", "look", lambda t: t["time_s"].__setitem__(2000, t["time_s"][1999])),
    ],
)
def test_a_fault_is_found_and_no_other(kind, severity, change):
    table = columns()
    change(table)
    assert kinds(table, severity) == {kind}
    assert kinds(table, "act" if severity == "look" else "look") == set()


@pytest.mark.parametrize("rate", [6.0, 200.0])
def test_an_even_turn_is_no_bias_that_asks_to_act(rate):
    """A rate table: the accelerometer shows gravity alone, the gyro the same rate all along."""
    random = np.random.default_rng(5)
    gyro = [0.0, 0.0, rate] + 0.05 * random.standard_normal((N, 3))
    accel = [0.0, 0.0, 9.81] + 0.02 * random.standard_normal((N, 3))
    table = {"time_s": np.arange(N) / RATE}
    for i, axis in enumerate("xyz"):
        table |= {f"gyro_{axis}_dps": gyro[:, i], f"accel_{axis}_mps2": accel[:, i]}
    found = zr.report(zr.read_recording(table)).findings
    assert [one.kind for one in found if one.severity == "act"] == []
    (one,) = [one for one in found if one.kind == "gyro bias"]
    assert one.severity == "look"
    assert "a bias, or a steady rotation about the vertical" in one.text


def test_a_gyro_without_a_number_asks_to_act():
    table = columns()
    table["imu1_gyro_x_dps"][100:5000] = math.nan
    assert "missing samples" in kinds(table, "act")


def test_two_imus_that_differ_at_rest_are_told():
    table = columns(imus=2)
    table["imu2_gyro_x_dps"] += 2.6
    table["imu1_gyro_x_dps"] -= 2.6
    assert kinds(table, "act") == {"gyros differ"}


def test_lost_samples_cost_what_a_straight_line_is_wrong_by():
    table = columns()
    kept = np.ones(N, dtype=bool)
    for first in range(1800, 4200, 200):
        kept[first : first + 60] = False
    found = zr.report(zr.read_recording({name: one[kept] for name, one in table.items()}))
    (gaps,) = [o for o in found.findings if o.kind == "gaps" and o.text.startswith("gyro")]
    assert (gaps.severity, len(gaps.spans)) == ("act", 12)
    errors = []
    turns = np.stack([table[f"imu1_gyro_{axis}_dps"] for axis in "xyz"], axis=1)
    for first in range(1800, 4200, 200):
        inside = turns[first - 1 : first + 61]
        errors.append(np.linalg.norm(30.0 * (inside[0] + inside[-1]) - inside[1:-1].sum(axis=0)))
    assert gaps.value == pytest.approx(np.sqrt(np.sum(np.square(errors))) / RATE, rel=0.5)


def test_a_number_far_from_its_limit_is_good_and_one_within_two_errors_only_a_look():
    limit = LIMITS["gyros differ"]
    assert limit.severity(1.0) == "good"
    assert limit.severity(5.5, 0.1) == "act"
    assert limit.severity(5.5, 0.3) == "look"


def test_what_a_report_needs_is_said():
    with pytest.raises(zr.LogError, match="needs a gyro or an accelerometer of three axes"):
        zr.report(zr.Recording({"mag": zr.simulate_motion("hand", duration=5.0).recording().mag}))
    with pytest.raises(zr.LogError, match="no timestamps for the sampling rate; give rate="):
        zr.report(np.zeros(3))


@pytest.mark.parametrize("value", [0.0, math.nan, 1e150])
def test_hostile_numbers_are_reported_on(value):
    table = {name: np.full(300, value) for name in columns() if name != "time_s"}
    found = zr.report(zr.read_recording({"time_s": np.arange(300) / RATE, **table}))
    json.loads(found.to_json(), parse_constant=pytest.fail)


def test_json_has_every_finding_and_the_sections_without_data():
    found = zr.report(zr.read_recording(columns()))
    content = json.loads(found.to_json())
    assert len(content["findings"]) == len(found.findings)
    assert content["no_data"] == [
        "What the autopilot wrote", "IMUs against one another", "Magnetometer", "Receiver",
        "What to enter",
    ]  # fmt: skip
    sections = list(dict.fromkeys(one["section"] for one in content["findings"]))
    assert sections == [name for name in SECTIONS if name in sections]


def test_the_page_of_limits_is_the_table():
    from zerorate.show.report_page import limit_text

    page = PAGE.read_text(encoding="utf-8")
    for name, one in LIMITS.items():
        cells = (name, one.what, limit_text(one.look), limit_text(one.act), one.unit, one.source)
        assert f"| {' | '.join(cells)} |" in page, name


def test_every_limit_of_our_own_has_a_reason():
    assert {one.source for one in LIMITS.values() if len(one.source) < len("own: one")} == set()


def test_lost_samples_are_counted_once():
    table = columns()
    kept = np.ones(N, dtype=bool)
    kept[1000:1050] = kept[3000:3020] = False
    found = zr.report(zr.read_recording({name: column[kept] for name, column in table.items()}))
    (gaps,) = [one for one in found.findings if one.kind in ("gaps", "lost samples")]
    assert "1.2 % of samples are lost in 2 gaps" in gaps.text
    others = [one.text for one in found.findings if one.section == gaps.section and one != gaps]
    assert not any("missing" in text or "regular" in text or "gap" in text for text in others)


def test_a_log_without_stamps_is_worth_a_look():
    table = {name: column for name, column in columns().items() if name != "time_s"}
    found = zr.report(zr.read_recording(table, rate=100.0))
    (one,) = [one for one in found.findings if one.kind == "no stamps"]
    assert (one.severity, "lost samples do not show" in one.text) == ("look", True)


def test_all_imus_are_compared_and_the_odd_one_of_six_has_its_name():
    table = columns(imus=6)
    table["imu4_gyro_x_dps"] = table["imu4_gyro_x_dps"] + 7.0
    found = zr.report(zr.read_recording(table)).findings
    pairs = [one for one in found if one.kind == "gyros differ"]
    assert len(pairs) == 15
    assert sum(one.severity == "act" for one in pairs) == 5
    (odd,) = [one for one in found if one.kind == "outlier"]
    assert odd.text.startswith("Of 6 IMUs, imu4 is the outlier in the gyro's bias: at least 6.99")


@needs_recordings
def test_a_px4_log_says_what_the_autopilot_wrote():
    found = zr.report(zr.read_recording(RECORDINGS / "px4_motor_failure.ulg"))
    (one,) = [one for one in found.findings if one.kind == "estimator vibration"]
    assert one.severity == "act"
    assert one.value == pytest.approx(0.110, abs=0.001)  # as another reader's rows have it


@needs_recordings
def test_samples_that_the_clock_lost_are_no_samples_without_a_number():
    found = zr.report(zr.read_recording(RECORDINGS / "px4_motor_failure.ulg"))
    assert {one.kind for one in found.urgent_findings} == {
        "estimator vibration",
        "slow",
        "lost samples",
    }


@needs_recordings
def test_an_ardupilot_log_says_what_the_autopilot_wrote():
    found = zr.report(zr.read_recording(RECORDINGS / "formats" / "ardupilot_test.BIN"))
    wrote = [one for one in found.findings if one.section == "What the autopilot wrote"]
    assert [one.kind for one in wrote] == ["vibration", "clips", "clips", "clips"]
    assert wrote[0].value == pytest.approx(0.215, abs=0.001)


@pytest.mark.parametrize(
    ("share", "severity"), [(0.005, "good"), (0.03, "look"), (0.12, "act"), (0.3, "act")]
)
@pytest.mark.parametrize("seed", [1, 2])
def test_the_share_of_lost_samples_is_judged_whatever_they_cost(share, severity, seed):
    """A slow motion is bridged well; what was lost is lost all the same."""
    motion = zr.simulate_motion("vehicle", duration=60.0, seed=seed).recording()
    lost = np.random.default_rng(seed).random(motion["gyro"].n) < share
    data = np.where(lost[:, None], np.nan, motion["gyro"].data)
    found = zr.report(replace(motion, logs={**motion, "gyro": replace(motion["gyro"], data=data)}))
    kinds = [one for one in found.findings if one.kind in ("gaps", "lost samples")]
    assert [one.severity for one in kinds] == [severity]
    assert found.findings_from("none") == ()
    assert set(found.findings_from("act")) <= set(found.findings_from("look"))
