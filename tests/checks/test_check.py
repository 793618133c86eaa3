"""What motion shows of units, signs and axes: mistakes put in are named, and nothing else is."""

import json
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

import zerorate as zr
from support.recordings import RECORDINGS, needs_recordings
from zerorate.checks.axis_permutations import SENSES, count_mistakes, format_sense

DEGREE = np.pi / 180


@cache
def moved(kind, seed=1, duration=60.0, **errors):
    errors = zr.simulation.MotionErrors(**errors) if errors else None
    return zr.simulate_motion(kind, 100.0, duration, seed=seed, errors=errors).recording()


def having(recording, **logs):
    """A recording with other values in some logs."""
    changed = {name: replace(recording[name], data=data) for name, data in logs.items()}
    return zr.Recording({**recording, **changed})


def mistaken(recording, sense, factor=1.0):
    """A recording whose gyro must be multiplied by the sense to be right again."""
    return having(recording, gyro=factor * recording.gyro.data @ sense)


@pytest.mark.every(9)
@pytest.mark.parametrize("place", [1, 5, 9, 16, 23, 24, 30, 38, 47])
@pytest.mark.parametrize("kind", ["hand", "circle"])
def test_axes_are_named_where_the_motion_shows_all(kind, place):
    recording = moved(kind, 1 + place % 3, 120.0)
    found = zr.check(mistaken(recording, SENSES[place]), scale_errors=False).gyro
    assert (found.status, found.likely) == ("mistake", format_sense(SENSES[place]))
    np.testing.assert_array_equal(found.matrix, SENSES[place])
    assert found.alarm
    assert found.exact
    assert found.spans
    assert found.ratio > 4.0


@pytest.mark.parametrize(
    ("named", "factor", "unit"), [("deg/s", 1.0, "rad/s"), ("rad/s", 1 / DEGREE, "deg/s")]
)
def test_units_are_named(named, factor, unit):
    recording = moved("hand")
    gyro = replace(recording.gyro, data=recording.gyro.data * factor, unit=named)
    wrong = zr.Recording({**recording, "gyro": gyro})
    checks = zr.check(wrong)
    assert checks.gyro.unit == unit
    assert checks.alarms == (f"the gyro's values are in {unit}, not in {named}",)
    right = checks.apply(wrong)
    assert right.gyro.unit == unit
    assert "as the motion shows" in right.gyro.meta["notes"][-1]
    assert zr.check(right).gyro.status == "agrees"


def test_a_unit_converted_twice_is_a_factor():
    recording = moved("hand")
    wrong = mistaken(recording, np.eye(3), DEGREE)
    checks = zr.check(wrong)
    assert "0.01745 times the values in rad/s" in checks.gyro.text
    np.testing.assert_allclose(checks.apply(wrong).gyro.data, recording.gyro.data, rtol=1e-14)


def test_both_mistakes_at_once_are_put_right():
    recording = moved("hand", 2)
    wrong = mistaken(recording, SENSES[20], 1 / DEGREE)
    checks = zr.check(wrong)
    assert "deg/s" in checks.gyro.text
    assert checks.gyro.likely == format_sense(SENSES[20])
    right = checks.apply(wrong)
    rates = zr.units.convert(right.gyro.data, right.gyro.unit, "rad/s")
    np.testing.assert_allclose(rates, recording.gyro.data, rtol=1e-12, atol=1e-15)
    assert right.accel is wrong.accel


@pytest.mark.every(2)
@pytest.mark.parametrize(
    "kind", ["hand", "circle", "arm", "spinning pendulum", "pendulum", "vehicle"]
)
@pytest.mark.parametrize("seed", [4, 5])
def test_no_alarm_of_what_is_right(kind, seed):
    checks = zr.check(moved(kind, seed, 90.0), scale_errors=False)
    assert not checks.alarms
    assert kind != "hand" or checks.gyro.status == checks.magnetometer.status == "agrees"


@pytest.mark.parametrize("place", [2, 16, 25, 44])
@pytest.mark.parametrize("kind", ["arm", "spinning pendulum", "pendulum", "vehicle"])
def test_no_wrong_name_where_the_motion_shows_less(kind, place):
    found = zr.check(mistaken(moved(kind, 2), SENSES[place]), scale_errors=False).gyro
    assert not found.alarm or format_sense(SENSES[place]) in found.alternatives
    assert kind != "pendulum" or not found.alarm


@pytest.mark.every(2)
@pytest.mark.parametrize(
    "errors",
    [
        {"gyro_bias": (0.17, -0.1, 0.05)},
        {"gyro_matrix": np.diag([0.9, 1.1, 0.9])},
        {"accel_bias": (0.3, -0.3, 0.3), "gyro_misalignment": 0.1},
        {"lost": 0.02, "gyro_walk": 0.1 * DEGREE},
    ],
    ids=["bias", "scale", "misaligned", "lost"],
)
@pytest.mark.parametrize("kind", ["hand", "arm", "vehicle", "pendulum"])
def test_errors_of_a_sensor_are_no_mistake(kind, errors):
    recording = moved(kind, 3, **errors) if "gyro_matrix" not in errors else _scaled(kind)
    assert not zr.check(recording, scale_errors=False).gyro.alarm


def _scaled(kind):
    recording = moved(kind, 3)
    return having(recording, gyro=recording.gyro.data * [0.9, 1.1, 0.9])


def test_a_late_gyro_and_a_clipped_one_are_no_mistake():
    recording = moved("hand", 6)
    late = np.roll(recording.gyro.data, 5, axis=0)
    ends = np.quantile(np.abs(recording.gyro.data), 0.97)
    for data in (late, recording.gyro.data.clip(-ends, ends)):
        assert not zr.check(having(recording, gyro=data), scale_errors=False).gyro.alarm


def test_units_of_the_accelerometer_do_not_matter():
    recording = mistaken(moved("hand"), SENSES[3])
    accel = replace(recording.accel, data=recording.accel.data / 9.80665, unit="g")
    one, other = zr.check(recording), zr.check(zr.Recording({**recording, "accel": accel}))
    assert one.gyro.text == other.gyro.text
    assert one.gyro.ratio == pytest.approx(other.gyro.ratio, rel=1e-9)  # rounding


def test_rotated_axes_rotate_the_answer():
    recording, turn = moved("hand"), SENSES[13]
    wrong = SENSES[24 + 7]
    both = having(
        recording, gyro=recording.gyro.data @ wrong @ turn.T, accel=recording.accel.data @ turn.T
    )
    np.testing.assert_array_equal(zr.check(both).gyro.matrix, turn @ wrong @ turn.T)


def test_two_signs_may_be_one_of_the_accelerometer():
    checks = zr.check(mistaken(moved("hand"), np.diag([1.0, -1.0, -1.0])))
    assert checks.alarms == (
        "the gyro's y and z axes have the opposite sign to the accelerometer's, or the "
        "accelerometer's x axis has the wrong sign",
    )


@pytest.mark.parametrize("place", [1, 10, 23])
def test_axes_of_a_magnetometer(place):
    recording = moved("hand", 2, 90.0)
    wrong = having(recording, mag=recording.mag.data @ SENSES[place])
    found = zr.check(wrong, scale_errors=False)
    assert not found.gyro.alarm
    # No motion tells a sense from its negative.
    both = {format_sense(SENSES[place]), format_sense(-SENSES[place])}
    assert found.magnetometer.status == "mistake"
    assert set(found.magnetometer.alternatives) == both
    assert found.apply(wrong) is wrong


def test_scale_delay_and_dip_are_told():
    recording = moved("hand", 1, 120.0)
    late = having(recording, gyro=np.roll(recording.gyro.data, 4, axis=0))
    checks = zr.check(late)
    truth = np.diagonal(zr.simulate_motion("hand", 100.0, 120.0, seed=1).gyro_matrix)
    # Within four deviations, and what the matrix does not tell.
    for found, expected in zip(checks.scale, truth, strict=True):
        assert found.identifiable
        assert abs(found.value - expected) < 4 * found.sigma + 0.002
    # A sample of the simulation is the mean over the interval before it: half of one later.
    assert checks.delay.value == pytest.approx(0.045, abs=0.015)
    assert np.degrees(checks.dip) == pytest.approx(65.0, abs=3.0)
    assert not any(one.identifiable for one in zr.check(moved("pendulum")).scale)


@pytest.mark.parametrize("name", ["short", "missing", "constant", "zero", "still", "huge"])
def test_nothing_is_said_where_nothing_is_seen(name):
    recording = moved("hand")
    n, wild = recording.gyro.n, {"constant": 1.0, "zero": 0.0, "missing": np.nan, "huge": 1e200}
    if name == "short":
        cut = {k: replace(v, time=v.time[:1900], data=v.data[:1900]) for k, v in recording.items()}
        checks = zr.check(zr.Recording(cut))
    elif name == "still":
        rng = np.random.default_rng(1)
        accel = [0.0, 0.0, 9.8] + 0.01 * rng.standard_normal((n, 3))
        checks = zr.check(having(recording, gyro=1e-3 * rng.standard_normal((n, 3)), accel=accel))
    else:
        both = np.full((n, 3), wild[name])
        checks = zr.check(having(recording, gyro=both, accel=both, mag=both))
    assert not checks.alarms
    assert not checks.notes
    assert checks.gyro.status in ("cannot tell", "doubt")
    json.loads(checks.to_json())
    assert "Notes" in str(checks)


def test_what_is_missing_is_said():
    recording = moved("hand")
    without = {k: v for k, v in recording.items() if k != "accel"}
    assert zr.check(zr.Recording(without)).gyro.text == "there is no accel"
    unknown = replace(recording.gyro, unit="unit")
    assert "not known" in zr.check(zr.Recording({**recording, "gyro": unknown})).gyro.text


def test_sizes_of_another_unit_are_told():
    recording = moved("hand")
    accel, mag = (replace(recording[name], unit=u) for name, u in (("accel", "g"), ("mag", "nT")))
    checks = zr.check(zr.Recording({**recording, "accel": accel, "mag": mag}))
    assert [note.rpartition(" ")[2] for note in checks.notes] == ["m/s^2", "uT"]
    assert not zr.check(recording).notes


def test_a_result_as_text_json_and_figure():
    checks = zr.check(mistaken(moved("hand", 1, 90.0), SENSES[24]))
    assert str(checks).splitlines()[0] == checks.alarms[0]
    content = json.loads(checks.to_json())
    assert content["gyro"]["alarm"]
    assert content["gyro"]["matrix"] == SENSES[24].tolist()
    assert len(checks.plot().axes) == 1
    assert repr(checks) == "Checks(gyro mistake, magnetometer agrees)"


def test_changes_count_mistakes():
    assert [count_mistakes(SENSES[k]) for k in (0, 24)] == [0, 1]
    assert sorted({count_mistakes(sense) for sense in SENSES}) == [0, 1, 2, 3, 4]


RECORDED = {
    "broad_05_undisturbed_slow_rotation_with_breaks_B": {},
    "broad_32_disturbed_attached_magnet_1cm": {},
    "drive_imu_100hz": {},
    "foot_walk_SensorConnectData_37_200hz": {},
    "foot_vicon_20171122114044_200hz": {},
    "mpu6050_static_100hz": {"rate": 100.0},
}


@cache
def recorded(name):
    rate = 2000 / 7 if name.startswith("broad") else RECORDED[name].get("rate")
    return zr.read_recording(RECORDINGS / f"{name}.parquet", rate=rate)


@needs_recordings
@pytest.mark.parametrize("name", RECORDED)
def test_recordings_are_right(name):
    checks = zr.check(recorded(name))
    assert not checks.alarms
    assert not checks.notes


@pytest.mark.every(4)
@needs_recordings
@pytest.mark.parametrize("place", [4, 19, 26, 41])
@pytest.mark.parametrize("name", RECORDED)
def test_recordings_with_mistakes(name, place):
    found = zr.check(mistaken(recorded(name), SENSES[place]), scale_errors=False).gyro
    assert not found.alarm or format_sense(SENSES[place]) in found.alternatives
    if name.startswith("broad"):
        np.testing.assert_array_equal(found.matrix, SENSES[place])


def stamped(motion, hertz, **stated):
    """A gyro and an accelerometer whose stamps run at a rate, read with maybe another."""
    columns = {"time_s": np.arange(len(motion.gyro)) / hertz}
    for name, values in (("gyro_{}_radps", motion.gyro), ("accel_{}_mps2", motion.accel)):
        columns |= {name.format(axis): values[:, i] for i, axis in enumerate("xyz")}
    return zr.read_recording(columns, **stated)


def test_a_rate_that_the_stamps_contradict_is_told():
    """One per cent of the rate is one per cent of every turn."""
    motion = zr.simulate_motion("hand", 100.0, 30.0, seed=2)
    wrong, right = stamped(motion, 99.2, rate=100.0), stamped(motion, 99.2)
    (message,) = zr.check(wrong, scale_errors=False).alarms
    assert message == (
        "the gyro's rate is stated as 100 Hz, its stamps run at 99.2: every turn comes out 0.8 % "
        "too small; omit the rate to use that of the stamps"
    )
    assert message in zr.check(wrong, scale_errors=False).table()
    assert json.loads(zr.check(wrong, scale_errors=False).to_json())["clock"] == message
    assert "0.8 % too small; omit the rate" in str(zr.estimate_attitude(wrong).notes)
    assert zr.check(right, scale_errors=False).alarms == ()
    assert right.gyro.rate == pytest.approx(99.2, rel=1e-6)
    # A hair is no fault.
    assert zr.check(stamped(motion, 99.95, rate=100.0), scale_errors=False).clock == ""
