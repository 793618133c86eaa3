"""Rests: found where the sensor is still, whatever its unit, rate and gaps."""

import numpy as np
import pytest

import zerorate as zr
from support.calibrated import log, session, sigmas, with_data


def test_every_rest_is_found_and_none_has_motion_in_it():
    simulated = session()
    found = zr.calibration.find_rests(simulated.recording)
    spans = np.array([(rest.first, rest.last) for rest in found])
    assert len(found) == len(simulated.rests) == 20
    assert (spans[:, 0] >= simulated.rests[:, 0]).all()
    assert (spans[:, 1] <= simulated.rests[:, 1]).all()
    # Half a window and what is cut off is lost at each end, and what rounds to whole blocks.
    assert (spans[:, 1] - spans[:, 0] >= 500).all()
    assert [rest.reason for rest in found] == [""] * 20


def test_a_rest_has_the_means_of_both_sensors_in_their_units():
    simulated = session()
    gyro, accel = simulated.recording.gyro, simulated.recording.accel
    rest = zr.calibration.find_rests(simulated.recording)[3]
    np.testing.assert_allclose(rest.gyro, gyro.data[rest.first : rest.last].mean(axis=0))
    np.testing.assert_allclose(rest.accel, accel.data[rest.first : rest.last].mean(axis=0))
    assert rest.start == pytest.approx(rest.first / 100.0)
    assert rest.stop == pytest.approx(rest.last / 100.0)
    assert np.linalg.norm(rest.direction) == pytest.approx(1.0)
    # Pose error of 0.3 mg and white noise of 400 ug/sqrt(Hz) over 5.4 s.
    np.testing.assert_allclose(rest.accel_sigma, 0.35e-3, rtol=0.3)


@pytest.mark.parametrize("name", ["gyro", "accel"])
def test_one_sensor_is_enough(name):
    simulated = session()
    found = zr.calibration.find_rests(simulated.recording[name])
    both = zr.calibration.find_rests(simulated.recording)
    assert len(found) == 20
    assert np.allclose([r.start for r in found], [r.start for r in both], atol=0.31)
    other = {"gyro": "accel", "accel": "gyro"}[name]
    assert np.isnan([getattr(rest, other) for rest in found]).all()


@pytest.mark.parametrize("scale", [1e-9, 1e9])
def test_units_do_not_matter(scale):
    simulated = session()
    scaled = with_data(simulated.recording, *(scale * x.data for x in simulated.recording.values()))
    first, second = (
        zr.calibration.find_rests(simulated.recording),
        zr.calibration.find_rests(scaled),
    )
    assert [(r.first, r.last) for r in first] == [(r.first, r.last) for r in second]


def still(seconds, rate=100.0, seed=1):
    rng = np.random.default_rng(seed)
    data = rng.standard_normal((round(seconds * rate), 3))
    return zr.Log(np.arange(len(data)) / rate, rate, data, ["gyro_x", "gyro_y", "gyro_z"], "deg/s")


def test_what_never_moves_is_one_rest():
    record = still(20.0)
    assert [(r.start, r.stop) for r in zr.calibration.find_rests(record)] == [(0.1, 19.9)]
    constant = zr.calibration.find_rests(record.with_data(np.ones((record.n, 3))))
    assert [(r.start, r.stop) for r in constant] == [(0.1, 19.9)]


def test_a_gap_splits_a_rest_and_a_lost_sample_does_not():
    record = still(20.0)
    lost = record.data.copy()
    lost[::37] = np.nan
    assert len(zr.calibration.find_rests(record.with_data(lost))) == 1
    gap = record.data.copy()
    gap[1000:1100] = np.nan
    before, after = zr.calibration.find_rests(record.with_data(gap))
    assert before.stop <= 10.0
    assert after.start >= 11.0
    np.testing.assert_allclose(before.gyro, gap[before.first : before.last].mean(axis=0))


def test_a_knock_is_passed_over_and_a_second_of_rest_too_short():
    record = still(20.0)
    moving = record.data.copy()
    moving[400:1000] *= 100.0
    moving[1140:1600] *= 100.0
    assert len(zr.calibration.find_rests(record.with_data(moving))) == 2


@pytest.mark.every(2)
@pytest.mark.parametrize("name", ["gyro", "accel"])
@pytest.mark.parametrize("samples", [1, 2])
def test_a_wild_sample_in_a_rest_is_named_and_left_out(name, samples):
    """It makes neither two rests of one, nor a turn between them that no gyro can have made."""
    simulated = session()
    data = {kind: log.data.copy() for kind, log in simulated.recording.items()}
    rest = zr.calibration.find_rests(simulated.recording)[4]
    place = (rest.first + rest.last) // 2
    value = [2000.0, -1.5, 0.25] if name == "gyro" else [16.0, 0.0, 1.0]
    data[name][place : place + samples] = value
    wild = with_data(simulated.recording, data["gyro"], data["accel"])
    assert len(zr.calibration.find_rests(wild)) == 20
    found, clean = zr.calibration.calibrate(wild), zr.calibration.calibrate(simulated.recording)
    assert found.valid
    assert len(found.turns) == 19
    # Of one rest of twenty a sample or two are missing.
    assert (np.abs(found.values - clean.values) <= 0.1 * sigmas(clean)).all()
    listed = ", ".join(f"{x:g}" for x in value)
    (note,) = [note for note in found.notes if "outlier" in note]
    assert f"the {name} " in note
    assert f"{listed} {simulated.recording[name].unit} at {place / 100.0:.3f} s" in note


def test_nothing_stands_alone_in_a_usual_record():
    assert not any(
        "outlier" in note for note in zr.calibration.calibrate(session().recording).notes
    )


@pytest.mark.parametrize("rate", [10.0, 62.5, 500.0])
def test_the_rate_hardly_matters(rate):
    simulated = zr.simulation.simulate_session(6, seed=3, rate=rate)
    found = zr.calibration.find_rests(simulated.recording)
    begun = simulated.rests[:, 0] / rate
    assert np.allclose([rest.start for rest in found], begun, atol=0.65)


def test_sensors_may_have_clocks_of_their_own():
    fast = session().recording
    accel = zr.Log(
        fast.accel.time[1::2], 50.0, fast.accel.data[1::2], fast.accel.names, fast.accel.unit
    )
    found = zr.calibration.find_rests(zr.Recording({"gyro": fast.gyro, "accel": accel}))
    both = zr.calibration.find_rests(fast)
    assert np.allclose([r.start for r in found], [r.start for r in both], atol=0.21)
    np.testing.assert_allclose(
        [rest.accel for rest in found], [rest.accel for rest in both], atol=2e-3
    )


def test_coarse_steps_are_no_motion():
    """At rest most windows are constant, and some toggle between two values."""
    record = still(60.0)
    fine = 0.2 * record.data
    fine[3000:3200] += 40.0 * np.hanning(200)[:, np.newaxis]
    assert len(zr.calibration.find_rests(record.with_data(np.round(fine)))) == 2


def test_motion_in_a_rest_is_named():
    simulated = session()
    found = zr.calibration.find_rests(simulated.recording)[7]
    accel = simulated.recording.accel.data.copy()
    span = slice(found.first - 10, found.last + 10)
    accel[span, 0] += np.linspace(-0.01, 0.01, found.last - found.first + 20)
    moved = zr.calibration.find_rests(with_data(simulated.recording, accel=accel))
    assert [rest.reason != "" for rest in moved].index(True) == 7
    assert moved[7].reason.startswith("moving: its parts differ by")
    assert moved[7].accel_sigma[0] > 10.0 * found.accel_sigma[0]
    np.testing.assert_allclose(moved[7].accel_sigma[1:], found.accel_sigma[1:], rtol=1.1)


def test_what_is_no_record_of_motion_is_refused():
    mag = still(5.0)
    with pytest.raises(zr.LogError, match=r"rests are found by a gyro or an accel; .* mag"):
        zr.calibration.find_rests(zr.Recording({"mag": mag}))
    with pytest.raises(TypeError, match="expected a Recording or a Log, got list"):
        zr.calibration.find_rests([1.0, 2.0])
    two = zr.Log(mag.time, mag.rate, mag.data[:, :2], ["gyro_x", "gyro_y"], "deg/s")
    with pytest.raises(zr.LogError, match="three axes that hold samples, got 2: gyro_x, gyro_y"):
        zr.calibration.find_rests(two)
    with pytest.raises(zr.LogError, match="no sample of all three axes"):
        zr.calibration.find_rests(log(mag, np.full((mag.n, 3), np.nan)))
