"""A magnetometer calibrated from ordinary motion by the gyro."""

import math
from dataclasses import replace

import numpy as np
import pytest

import zerorate as zr
from zerorate.calibration.magnet.fit import fit
from zerorate.calibration.magnet.spans import partition_spans
from zerorate.calibration.magnet.ticks import Ticks

IRON = np.array([9.0, -14.0, 6.0])


def moved(iron=IRON, matrix=None, kind="hand", unit="uT", factor=1.0, duration=60.0, seed=100):
    """A recording with iron on the sensor, and the samples without."""
    errors = zr.simulation.MotionErrors(field_wander=math.radians(4.5))
    recording = zr.simulate_motion(kind, 100, duration, seed=seed, errors=errors).recording()
    log, matrix = recording.mag, np.eye(3) if matrix is None else matrix
    spoilt = replace(log, data=factor * (log.data @ matrix.T + iron), unit=unit)
    logs = dict(recording)
    logs["mag"] = spoilt
    return replace(recording, logs=logs), log.data


def with_mag(recording, data):
    logs = dict(recording)
    logs["mag"] = logs["mag"].with_data(data)
    return replace(recording, logs=logs)


@pytest.fixture(scope="module")
def found():
    recording, true = moved()
    return recording, true, zr.calibration.calibrate_magnetometer(recording)


def test_hard_iron_is_found_within_its_errors(found):
    recording, true, mag = found
    assert mag.model == "b"
    assert mag.valid
    for one, b in zip(mag.hard_iron, IRON, strict=True):
        assert one.identifiable
        assert abs(one - b) < 3.0 * one.sigma
    left = mag.apply(recording).mag.data - true
    assert np.abs(left).max() < 1.0
    assert np.degrees(mag.heading_error(before=True)).max() > 20.0
    assert np.degrees(mag.heading_error()).max() < 3.0


def test_field_and_dip_are_found(found):
    _, _, mag = found
    assert abs(mag.field - 48.0) < 3.0 * mag.field.sigma + 1.0
    assert abs(math.degrees(mag.dip) - 65.0) < 3.0


@pytest.mark.parametrize(("unit", "factor"), [("gauss", 0.01), ("1", 6.842)])
def test_units_do_not_matter(found, unit, factor):
    recording, _ = moved(unit=unit, factor=factor)
    other = zr.calibration.calibrate_magnetometer(recording)
    mine = np.array(found[2].hard_iron)
    np.testing.assert_allclose(np.array(other.hard_iron) / factor, mine, rtol=1e-6)
    assert other.unit == unit
    assert other.model == found[2].model


def test_without_iron_samples_stay_to_the_bit():
    recording, _ = moved(np.zeros(3))
    mag = zr.calibration.calibrate_magnetometer(recording)
    assert not mag.applied
    np.testing.assert_array_equal(mag.apply(recording).mag.data, recording.mag.data)


def test_soft_iron_is_found():
    matrix = np.array([[1.08, 0.04, -0.02], [0.04, 0.95, 0.03], [-0.02, 0.03, 0.97]])
    recording, _ = moved(matrix=matrix, duration=120.0)
    mag = zr.calibration.calibrate_magnetometer(recording)
    assert mag.model == "b+symmetric"
    np.testing.assert_allclose(np.array(mag.soft_iron), matrix, atol=0.02)


def test_a_magnet_that_comes_and_goes():
    recording, _ = moved(np.zeros(3), duration=120.0)
    log = recording.mag
    late = (log.sampled >= 40.0) & (log.sampled < 80.0)
    mag = zr.calibration.calibrate_magnetometer(
        with_mag(recording, log.data + late[:, None] * [40.0, 0, 60.0])
    )
    irons = [mag.groups[span.group].hard_iron[2] for span in mag.spans]
    assert max(irons) == pytest.approx(60.0, abs=3.0)
    assert {group.applied for group in mag.groups} == {True, False}
    assert any("something was attached" in sentence for sentence in mag.advice)
    # What is shown is what the magnet did, not the longer time without it.
    assert mag.groups[mag.longest_applied].applied
    before, after = (mag.heading_error(raw, mag.longest_applied) for raw in (True, False))
    assert np.degrees(before).max() > 20.0
    assert np.degrees(after).max() < 4.0
    assert "deg corrected" in mag.table()


def test_a_stuck_magnetometer_is_refused():
    recording, _ = moved(np.zeros(3), duration=30.0)
    constant = zr.calibration.calibrate_magnetometer(
        with_mag(recording, np.full_like(recording.mag.data, 20.0))
    )
    assert not constant.valid
    assert not constant.applied
    data = recording.mag.data.copy()
    data[:, 1] = 3.0
    stuck = zr.calibration.calibrate_magnetometer(with_mag(recording, data))
    assert not stuck.valid
    assert "y never changes" in stuck.problems[0]
    assert "not identifiable" in str(stuck)


def test_no_magnetometer_and_too_few_samples_are_refused():
    recording, _ = moved(duration=20.0)
    logs = {name: log for name, log in dict(recording).items() if name != "mag"}
    with pytest.raises(zr.LogError, match="there is no magnetometer"):
        zr.calibration.calibrate_magnetometer(replace(recording, logs=logs))
    data = recording.mag.data.copy()
    data[500:] = np.nan
    with pytest.raises(zr.LogError, match="ten seconds"):
        zr.calibration.calibrate_magnetometer(with_mag(recording, data))


def test_missing_samples_and_a_lower_rate(found):
    recording, _, _ = found
    data = recording.mag.data.copy()
    data[np.arange(len(data)) % 5 != 0] = np.nan
    data[3000:3500] = np.nan
    mag = zr.calibration.calibrate_magnetometer(with_mag(recording, data))
    np.testing.assert_allclose(np.array(mag.hard_iron), IRON, atol=2.0)


def test_json_keeps_every_bit(found, tmp_path):
    path = tmp_path / "mag.json"
    text = found[2].to_json(path)
    again = zr.calibration.MagnetometerCalibration.from_json(path)
    assert again.to_json() == text
    assert again.hard_iron == found[2].hard_iron
    with pytest.raises(ValueError, match="not a magnetometer calibration"):
        zr.calibration.MagnetometerCalibration.from_json("{}")


def test_arrays_are_checked(found):
    with pytest.raises(ValueError, match="samples"):
        found[2].apply([[1.0, 2.0]])
    with pytest.raises(ValueError, match="time"):
        found[2].apply(np.zeros((3, 3)), [0.0])


def without(recording, *names):
    return replace(recording, logs={k: v for k, v in dict(recording).items() if k not in names})


def test_a_sphere_without_a_gyro(found):
    recording, _, _ = found
    part = without(recording, "gyro", "accel")
    mag = zr.calibration.calibrate_magnetometer(part)
    assert mag.model == "b"
    assert "without a gyro a sphere was fitted" in mag.notes[0]
    for one, b in zip(mag.hard_iron, IRON, strict=True):
        assert abs(one - b) < 3.0 * one.sigma
    assert not mag.dip.identifiable
    assert "dip          not identifiable\n" in mag.table()
    mag.plot()
    # A few directions are no sphere.
    few = zr.calibration.calibrate_magnetometer(
        with_mag(part, np.tile(part.mag.data[:200], (30, 1)))
    )
    assert not few.applied
    assert "each side of the sensor" in few.advice[0]


def test_the_end_of_the_range_is_left_out(found):
    recording, _, _ = found
    data = recording.mag.data.copy()
    data[:, 2] = np.minimum(data[:, 2], np.quantile(data[:, 2], 0.95))
    mag = zr.calibration.calibrate_magnetometer(with_mag(recording, data))
    assert mag.valid
    assert "z is at the end of its range" in mag.notes[0]
    np.testing.assert_allclose(np.array(mag.hard_iron), IRON, atol=2.0)
    data[:, 2] = np.minimum(data[:, 2], np.quantile(data[:, 2], 0.5))
    mag = zr.calibration.calibrate_magnetometer(with_mag(recording, data))
    assert not mag.valid
    assert "z is at the end of its range" in mag.problems[0]


def test_the_field_of_the_place(found):
    recording, _, _ = found
    dip = math.radians(65.0)
    assert zr.calibration.calibrate_magnetometer(recording, field=48.0, dip=dip).valid
    wrong = zr.calibration.calibrate_magnetometer(recording, field=25.0, dip=-dip)
    assert "that of the place 25 uT" in wrong.problems[0]
    assert "that of the place -65 deg" in wrong.problems[1]
    with pytest.raises(ValueError, match="field must be that of a place on earth"):
        zr.calibration.calibrate_magnetometer(recording, field=0.48)
    with pytest.raises(ValueError, match="dip must be an angle"):
        zr.calibration.calibrate_magnetometer(recording, dip=65.0)


def test_the_calibration_of_another_device_is_refused(found):
    _, _, mag = found
    other, _ = moved(np.zeros(3), duration=20.0, seed=3)
    with pytest.raises(zr.LogError, match="is of another device, or its magnets have moved"):
        mag.apply(replace(other, source="other"))
    counts, _ = moved(0.1 * IRON, factor=10.0, duration=20.0)
    with pytest.raises(zr.LogError, match="of another device or place"):
        mag.apply(replace(counts, source="other"))
    own, true = moved(duration=20.0, seed=3)
    assert np.abs(mag.apply(replace(own, source="other")).mag.data - true).max() < 1.5
    with pytest.raises(zr.LogError, match="is of a magnetometer in uT, found one in gauss"):
        mag.apply(moved(unit="gauss", duration=20.0)[0])


def test_exports(found):
    _, _, mag = found
    px4 = dict(line.split("\t")[2:4] for line in mag.to_px4(instance=1).splitlines()[2:])
    ardupilot = dict(line.split(",") for line in mag.to_ardupilot(compass=2).splitlines()[1:])
    for k, axis in enumerate("XYZ"):
        iron = mag.hard_iron[k].value
        assert float(px4[f"CAL_MAG1_{axis}OFF"]) == pytest.approx(iron / 100.0)
        assert float(ardupilot[f"COMPASS_OFS2_{axis}"]) == pytest.approx(-10.0 * iron)
        assert float(px4[f"CAL_MAG1_{axis}SCALE"]) == 1.0
        assert float(ardupilot[f"COMPASS_ODI2_{axis}"]) == 0.0
    x, *others = mag.hard_iron
    hidden = type(x)(x.value, x.sigma, False, x.value + x.sigma)
    unknown = replace(mag, hard_iron=(hidden, *others))
    with pytest.raises(ValueError, match="hard iron's x is not known"):
        unknown.to_px4()
    assert "# WARNING: the hard iron's x is not known" in unknown.to_px4(doubtful=True)
    with pytest.raises(ValueError, match="none of a magnetic field"):
        replace(mag, unit="1").to_ardupilot()


def test_attitudes_take_it_off(found):
    recording, _, mag = found
    samples = (recording.gyro.data, recording.accel.data)
    corrected = mag.apply(recording.mag.data)
    live = zr.Attitude(100.0, magnetometer=mag)
    answers = live.process(*samples, recording.mag.data)
    plain = zr.Attitude(100.0)
    np.testing.assert_allclose(answers, plain.process(*samples, corrected), rtol=0.0, atol=1e-9)
    again = zr.Attitude.from_bytes(live.to_bytes())
    assert "magnetometer=..." in repr(again)
    assert again.to_bytes() == live.to_bytes()
    offline = live.smooth(*samples, recording.mag.data)["quaternion"]
    smoothed = plain.smooth(*samples, corrected)["quaternion"]
    np.testing.assert_allclose(offline, smoothed, rtol=0.0, atol=1e-9)
    estimate = zr.estimate_attitude(recording, magnetometer=mag)
    assert np.degrees(estimate.errors().heading) < 3.0
    assert np.degrees(zr.estimate_attitude(recording).errors().heading) > 20.0


def test_attitudes_refuse_what_is_none(found):
    with pytest.raises(TypeError, match="magnetometer must be a MagnetometerCalibration, got int"):
        zr.Attitude(100.0, magnetometer=3)
    with pytest.raises(ValueError, match="magnetometer has no effect with mag=False"):
        zr.Attitude(100.0, mag=False, magnetometer=found[2])
    with pytest.raises(ValueError, match="magnetometer has no effect on method 'ekf'"):
        zr.Attitude(100.0, method="ekf", magnetometer=found[2])
    nothing = replace(found[2], groups=(replace(found[2].groups[0], applied=False),))
    assert "magnetometer" not in repr(zr.Attitude(100.0, magnetometer=nothing))


def turning(n=600, iron=(0.3, -0.2, 0.4), seed=0):
    """Exact ticks of a sensor that turns about all axes."""
    from scipy.spatial.transform import Rotation

    t = 0.1 * np.arange(n)
    angles = np.column_stack([0.9 * t, 0.8 * np.sin(0.5 * t), 0.7 * np.sin(0.33 * t)])
    turn = Rotation.from_euler("ZYX", angles).as_matrix()
    field = np.array([0.0, 0.45, -0.9])
    y = turn.transpose(0, 2, 1) @ field + iron
    y = y + np.random.default_rng(seed).normal(0.0, 0.01, y.shape)
    e = (turn @ y[:, :, None])[:, :, 0]
    return Ticks(np.arange(n), e, turn, y, 1.0)


def test_fit_of_exact_ticks():
    ticks = turning()
    assert len(partition_spans(ticks)) == 1
    iron = fit(ticks, np.zeros(600, dtype=int)).iron[0]
    np.testing.assert_allclose(iron, [0.3, -0.2, 0.4], atol=0.003)


def test_a_place_tells_field_and_dip(monkeypatch):
    motion = zr.simulate_motion("hand", 100.0, 40.0, seed=3)
    recording = motion.recording()
    there = zr.calibration.calibrate_magnetometer(recording, place=(48.1, 11.6))
    assert there.valid
    assert any("by the World Magnetic Model" in note for note in there.notes)
    south = zr.calibration.calibrate_magnetometer(recording, place=(-48.1, 11.6, 500.0))
    assert any("the dip is" in problem for problem in south.problems)
    with pytest.raises(ValueError, match="place determines field and dip"):
        zr.calibration.calibrate_magnetometer(recording, place=(48.1, 11.6), dip=1.1)
    with pytest.raises(ValueError, match="place takes latitude, longitude"):
        zr.calibration.calibrate_magnetometer(recording, place=(48.1,))


def test_positions_of_the_recording_are_the_place():
    motion = zr.simulate_motion("hand", 100.0, 40.0, seed=3)
    recording = motion.recording()
    time = recording.mag.time
    places = np.tile([-48.1, 11.6, 500.0], (len(time), 1))
    places[:50] = np.nan
    names = ("latitude_deg", "longitude_deg", "height_m")
    log = zr.Log(time, recording.mag.rate, places, names, "deg, deg, m", {}, None)
    moved = replace(recording, logs={**recording, "position": log})
    assert any(
        "the dip is" in problem for problem in zr.calibration.calibrate_magnetometer(moved).problems
    )
    assert zr.calibration.calibrate_magnetometer(moved, dip=float(motion_dip(recording))).valid


def motion_dip(recording):
    return zr.calibration.calibrate_magnetometer(recording).dip.value
