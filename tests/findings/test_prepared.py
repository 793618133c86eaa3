"""A report says what the preparation finds, once, in the words of the commands' alarms."""

import numpy as np
import pytest

import zerorate as zr
from zerorate.checks.preparation import prepare


def hand():
    return zr.simulate_motion("hand", duration=60.0, seed=1).recording()


def changed(name, change):
    recording = hand()
    return zr.Recording({**recording, name: change(recording[name])}, "hand.csv")


def linear(accel):
    """Acceleration to and fro with pauses, as a phone gives it."""
    t = accel.time[:, None]
    bursts = np.maximum(np.sin(0.6 * t), 0.0)
    return accel.with_data(3.0 * bursts * np.sin(2.0 * np.pi * t * [0.5, 0.7, 1.1]))


def dead(gyro):
    return gyro.with_data(gyro.data * [1.0, 0.0, 1.0])


def frozen(mag):
    data = mag.data.copy()
    data[1000:3000] = data[1000]
    return mag.with_data(data)


def mirrored(gyro):
    return gyro.with_data(gyro.data * [1.0, -1.0, 1.0])


def steady():
    """A gyro with a bias of 25 deg/s on a table."""
    t, random = np.arange(3000) / 100.0, np.random.default_rng(1)
    noise = 1e-3 * random.standard_normal((3000, 6))
    gyro = zr.Log(t, 100.0, noise[:, :3] + np.radians([25.0, 0, 0]), tuple("xyz"), "rad/s")
    accel = zr.Log(t, 100.0, noise[:, 3:] + [0, 0, 9.81], ("a", "b", "c"), "m/s^2")
    return zr.Recording({"gyro": gyro, "accel": accel}, "table.csv")


def impossible(gyro):
    data = gyro.data.copy()
    data[[700, 1500, 2100], 0] = 500.0
    return gyro.with_data(data)


CASES = {
    "impossible rates": ("gyro", impossible),
    "gravity absent": ("accel", linear),
    "dead axis": ("gyro", dead),
    "frozen magnetometer": ("mag", frozen),
    "axes": ("gyro", mirrored),
}


def plain(text):
    return str(text).rstrip(".").lower()


@pytest.mark.parametrize("kind", CASES)
def test_an_alarm_of_the_commands_is_a_finding(kind):
    recording = changed(*CASES[kind])
    found = zr.report(recording)
    (one,) = (one for one in found.findings if one.kind == kind and one.severity == "act")
    alarm = next(
        text
        for text in prepare(recording, zr.checks.preparation.Choices(gravity=False)).alarms
        if plain(one.text).split(",")[0].split(":")[0] in plain(text)
    )
    assert plain(one.text) in plain(alarm)
    assert one.text in found.alarms


def test_a_steady_rate_is_told_once():
    found = zr.report(steady())
    (one,) = (one for one in found.findings if one.kind == "gyro bias")
    assert one.value == pytest.approx(25.0, abs=0.01)
    assert prepare(steady()).alarms[0].startswith("table.csv: x, y, z: 25.0 deg/s throughout")
    assert not any(one.kind == "axes" and one.severity == "act" for one in found.findings)


def test_an_absent_half_is_left_out_and_said():
    recording = hand()
    zeros = recording.gyro.with_data(np.zeros_like(recording.gyro.data))
    logs = {"gyro": zeros, "gyro_1": recording.gyro, "accel": recording.accel}
    found = zr.report(zr.Recording(logs, "both.csv"))
    (note,) = (note for note in found.notes if "measures nothing" in note)
    assert "0, 0, 0 in every sample" in note
    assert {*found.recording} == {"accel", "gyro"}


def test_fixes_that_are_held_are_left_out_and_said():
    drive = zr.simulate_drive(duration=150.0, seed=2)
    fixes = drive.fixes
    rows = np.repeat(np.arange(len(fixes)), 10)
    time = fixes.time[rows] + np.tile(np.arange(10) * 0.1, len(fixes))
    held = zr.Fixes(time, fixes.position[rows], fixes.velocity[rows])
    kinds = {one.kind: one for one in zr.report(drive.recording(), fixes=held).findings}
    assert "repeat the one before and are left out" in kinds["held fixes"].text
    assert kinds["fixes"].value == pytest.approx(len(fixes), abs=30)
    assert "innovations" in kinds
