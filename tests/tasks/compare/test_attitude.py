"""Comparison of filters of attitude: what they are fed with, judged by, and how it is shown."""

import json
import math
from dataclasses import replace

import numpy as np
import pytest

import zerorate as zr
from support.recordings import RECORDINGS, needs_recordings
from zerorate.geometry import rotations
from zerorate.geometry.frames import FRAMES, in_enu
from zerorate.record import Log, LogError, Recording
from zerorate.show.compare_tables import format_compare
from zerorate.show.tables import WIDTH
from zerorate.tasks.compare import ATTITUDE_METHODS, Trial, compare_attitude, read_trial
from zerorate.tasks.compare.as_json import as_json
from zerorate.tasks.compare.imu import Imu
from zerorate.tasks.compare.peers import PEERS, Peer, is_missing

DEG = math.radians(1.0)
OWN = [name for name in ATTITUDE_METHODS if name not in PEERS and "+" not in name]
BROAD = "broad_05_undisturbed_slow_rotation_with_breaks_B.parquet"


@pytest.fixture(scope="module")
def motion():
    return zr.simulate_motion("hand", 50.0, 40.0, seed=3)


@pytest.fixture(scope="module")
def recording(motion):
    return motion.recording()


def with_log(recording, **logs):
    return Recording({**recording, **logs}, recording.source)


def without(recording, *names):
    return Recording({name: log for name, log in recording.items() if name not in names})


def values_of(comparison):
    return {row.method: dict(row.values) for row in comparison.rows}


def untimed(values):
    return {name: value for name, value in values.items() if not name.startswith("time")}


class TestTrial:
    def test_it_has_the_other_sensors(self, recording):
        trial = Trial.of(recording)
        assert (trial.accel, trial.mag) == (recording.accel, recording.mag)
        assert Trial.of(without(recording, "reference")).accel is None

    def test_they_are_those_of_the_gyros_name(self):
        table = {f"{name}_gyro_{a}_dps": np.ones(50) for name in ("left", "right") for a in "xyz"}
        for size, name in enumerate(("left", "right"), 1):
            table |= {f"{name}_accel_{a}_g": np.full(50, float(size)) for a in "xyz"}
        table |= {f"ref_quat_{a}": np.full(50, 0.5) for a in "wxyz"}
        chosen = [f"right_gyro_{a}_dps" for a in "xyz"]
        reading = {"rate": 50.0, "quaternion": [f"ref_quat_{a}" for a in "wxyz"]}
        trial = read_trial(table, columns=chosen, **reading)
        assert trial.accel.names == ("right_accel_x_g", "right_accel_y_g", "right_accel_z_g")
        assert trial.mag is None

    def test_of_several_others_none_is(self):
        table = {f"gyro_{a}_dps": np.ones(50) for a in "xyz"}
        table |= {f"{one}_accel_{a}_g": np.ones(50) for one in ("left", "right") for a in "xyz"}
        table |= {f"ref_quat_{a}": np.full(50, 0.5) for a in "wxyz"}
        assert read_trial(table, rate=50.0).accel is None


class TestImu:
    def test_units_and_clocks(self, recording):
        accel, mag = recording.accel, recording.mag
        slow = Log(mag.time[::5], 10.0, mag.data[::5], mag.names, mag.unit)
        in_g = replace(accel, data=accel.data / zr.units.UNITS["g"].amount, unit="g")
        imu = Imu.of(Trial.of(with_log(recording, accel=in_g, mag=slow)))
        np.testing.assert_allclose(imu.accel, accel.data, rtol=1e-14)  # there and back
        assert (imu.rate, imu.accel_rate, imu.mag_rate) == (50.0, 50.0, 10.0)
        np.testing.assert_array_equal(imu.mag[::5], mag.data[::5])
        assert np.isnan(np.delete(imu.mag, np.s_[::5], axis=0)).all()

    def test_the_first_orientation(self):
        clean = zr.simulate_motion("arm", duration=1.0, errors=zr.simulation.MotionErrors.none())
        imu = Imu.of(Trial.of(clean.recording()))
        begun = np.array([imu.first_orientation(), imu.six_axes().first_orientation()])
        truth = np.tile(clean.quaternion[0], (2, 1))
        # Rounding of a few products.
        assert zr.metrics.orientation_errors(begun[:1], truth[:1]).total < 1e-14
        assert zr.metrics.orientation_errors(begun, truth).inclination < 1e-14

    def test_missing_samples_are_filled_for_those_who_know_none(self, recording):
        imu = Imu.of(Trial.of(recording))
        gappy = replace(imu, gyro=imu.gyro.copy(), accel=imu.accel.copy(), mag=imu.mag.copy())
        gappy.gyro[[0, 9], 1], gappy.accel[5, 2], gappy.mag[6] = np.nan, np.nan, np.nan
        filled = gappy.fill_missing()
        assert (filled.gyro[0] == 0.0).all()
        np.testing.assert_array_equal(filled.gyro[9], imu.gyro[8])
        assert not filled.accel[5].any()
        assert not filled.mag[6].any()
        np.testing.assert_array_equal(filled.mag[7:], imu.mag[7:])

    def test_frames_of_the_earth(self):
        """North, west and up; north, east and down: what their axes are in east, north and up."""
        vectors = {"e": (1, 0, 0), "n": (0, 1, 0), "u": (0, 0, 1), "w": (-1, 0, 0), "d": (0, 0, -1)}
        for frame in FRAMES:
            turn = in_enu(np.array([[1.0, 0.0, 0.0, 0.0]]), frame)[0]
            # Rounding of the square root of a half.
            np.testing.assert_allclose(
                rotations.rotate(turn, np.eye(3)), [vectors[letter] for letter in frame], atol=1e-15
            )

    @pytest.mark.parametrize(
        ("change", "match"),
        [
            ({"accel": None}, "needs an accelerometer of three axes"),
            ({"accel_unit": "unit"}, "an accelerometer of a known unit, got 'unit'"),
            ({"gyros": 2}, "needs three gyros, got gyro_x_radps, gyro_y_radps$"),
            ({"mag": math.nan}, "mag_x_ut, mag_y_ut, mag_z_ut: no sample is there in all axes"),
            ({"reference": None}, "there is no orientation to compare attitudes with"),
        ],
    )
    def test_refusals(self, recording, change, match):
        trial = Trial.of(recording)
        if "accel" in change:
            trial = replace(trial, accel=None)
        if "accel_unit" in change:
            trial = replace(trial, accel=replace(trial.accel, unit="unit"))
        if "gyros" in change:
            log = trial.log
            trial = replace(trial, log=replace(log, data=log.data[:, :2], names=log.names[:2]))
        if "mag" in change:
            trial = replace(trial, mag=trial.mag.with_data(np.full(trial.mag.data.shape, np.nan)))
        if "reference" in change:
            trial = replace(trial, orientation=None)
        with pytest.raises(LogError, match=match):
            compare_attitude([trial], OWN)


class TestCompare:
    @pytest.mark.parametrize("method", OWN)
    def test_methods_are_judged_where_the_reference_moves(self, recording, motion, method):
        (values,) = values_of(compare_attitude([recording], [method])).values()
        nine = zr.Attitude(50.0, method=method).process(motion.gyro, motion.accel, motion.mag)
        six = zr.Attitude(50.0, mag=False, method=method).process(motion.gyro, motion.accel)
        # From rest it gathers speed: what is taken for motion begins some samples later.
        moving = motion.time > 5.5
        absolute = zr.metrics.orientation_errors(nine, motion.quaternion, where=moving)
        relative = zr.metrics.orientation_errors(
            six, motion.quaternion, where=moving, heading="relative"
        )
        assert values["total"] == pytest.approx(absolute.total, rel=0.02)
        assert values["heading"] == pytest.approx(absolute.heading, rel=0.02)
        assert values["inclination"] == pytest.approx(absolute.inclination, rel=0.02)
        assert values["inclination_6"] == pytest.approx(relative.inclination, rel=0.02)
        # Errors of the first sample judged, which this one is relative to.
        assert values["heading_6"] == pytest.approx(relative.heading, abs=0.2 * DEG)
        assert 0.0 < values["time_6"] < 1.0

    def test_smoothing_sees_the_whole_record(self, recording, motion):
        found = compare_attitude([recording], ["auto", "auto+smooth"])
        assert [row.causal for row in found.rows] == [True, False]
        values = values_of(found)
        assert values["auto+smooth"]["inclination"] < values["auto"]["inclination"]
        text = format_compare([found])
        assert "\n  auto+smooth‡  " in text
        assert text.count("‡: uses later samples") == 1
        # It was known, not found by trying.
        assert "on the first half" not in text

    def test_smoothing_peers_want_whole_records(self, recording):
        gappy = recording.mag.data.copy()
        gappy[100] = np.nan
        holed = with_log(recording, mag=recording.mag.with_data(gappy))
        for name in (name for name in PEERS if not PEERS[name].causal and not is_missing(name)):
            (values,) = values_of(compare_attitude([holed], [name])).values()
            assert math.isnan(values["total"])
            assert values["inclination_6"] < 4.0 * DEG

    @pytest.mark.parametrize("frame", ["ned", "nwu"])
    def test_the_frame_of_the_reference(self, recording, frame):
        back = rotations.inverse(np.array(FRAMES[frame]))
        reference = recording.reference
        turned_to = reference.with_data(rotations.product(back, reference.data))
        found = compare_attitude([with_log(recording, reference=turned_to)], ["auto"], frame=frame)
        expected = compare_attitude([recording], ["auto"])
        for name, value in untimed(values_of(expected)["auto"]).items():
            # Orientations twice turned: rounding of angles of a hundredth.
            assert values_of(found)["auto"][name] == pytest.approx(value, rel=1e-9)

    def test_without_a_magnetometer_there_are_six_axes(self, recording):
        found = compare_attitude([without(recording, "mag")], ["auto"])
        assert set(values_of(found)["auto"]) == {"heading_6", "inclination_6", "time_6"}
        text = format_compare([found])
        assert "nine axes: with" in text
        assert "Attitude in motion, nine axes:" not in text
        assert "Attitude in motion, six axes:" in text

    def test_a_reference_that_stands_still_says_nothing(self, recording):
        still = recording.reference.with_data(
            np.tile([1.0, 0.0, 0.0, 0.0], (recording.reference.n, 1))
        )
        found = compare_attitude([with_log(recording, reference=still)], ["auto"])
        assert all(map(math.isnan, (values_of(found)["auto"][n] for n in ("total", "heading_6"))))

    def test_other_clocks_are_noted(self, recording):
        mag = recording.mag
        slow = Log(mag.time[::5], 10.0, mag.data[::5], mag.names, mag.unit)
        found = compare_attitude([with_log(recording, mag=slow)], ["auto"])
        assert found.notes == (
            "simulated hand, seed 3: mag_x_ut, mag_y_ut, mag_z_ut at 10 Hz, each sample at the "
            "nearest one of the gyro",
        )

    def test_peers_that_are_absent_are_left_out(self, recording, monkeypatch):
        monkeypatch.setitem(PEERS, "vqf", Peer("no_such_package", PEERS["vqf"].run))
        found = compare_attitude([recording], ["vqf", "auto"])
        assert found.methods == ("auto",)
        assert found.notes == ("not installed, so left out: no_such_package",)

    def test_peers_that_are_installed_find_their_way(self, recording):
        """Each in its own frame and units: a mistake there is no matter of a few degrees."""
        installed = [name for name in PEERS if not is_missing(name)]
        known = values_of(compare_attitude([recording], ["auto", *installed]))
        for name in installed:
            assert known[name]["total"] < 8.0 * DEG, name
            assert known[name]["inclination_6"] < 4.0 * DEG, name

    def test_tables_and_json(self, recording):
        other = zr.simulate_motion("circle", duration=20.0, seed=4).recording()
        found = compare_attitude([recording, other], ["auto"])
        text = format_compare([found])
        assert "Attitude in motion, nine axes: mean and worst of 2 recordings\n" in text
        assert max(map(len, text.split("\n"))) <= WIDTH
        alone = format_compare([found], per_axis=True)
        assert "Attitude in motion, six axes: simulated circle, seed 4\n" in alone
        (row, _) = json.loads(as_json([found]))["kinds"]["attitude"]["rows"]
        assert row["method"] == "auto"
        assert row["total"] == found.rows[0].values["total"]

    def test_progress_reaches_the_end(self, recording):
        told = []
        compare_attitude([recording] * 2, ["auto"], lambda step, part: told.append((step, part)))
        assert told == [("attitude", 0.5), ("attitude", 1.0)]

    @pytest.mark.parametrize(
        ("methods", "frame", "match"),
        [
            (["best"], "enu", "no method of attitude 'best'; known: auto, .*vqf, imufusion"),
            (["auto", "auto"], "enu", "must all be different, got auto, auto"),
            (["auto"], "eun", "frame must be one of enu, ned, nwu, got 'eun'"),
        ],
    )
    def test_refusals(self, recording, methods, frame, match):
        with pytest.raises(ValueError, match=match):
            compare_attitude([recording], methods, frame=frame)


@needs_recordings
def test_slow_rotation_with_breaks():
    trial = read_trial(RECORDINGS / BROAD, rate=2000 / 7)
    values = values_of(compare_attitude([trial], ["auto"]))["auto"]
    # 1.11, 1.06, 0.33 and 1.27 deg; 1.03, 1.00, 0.33 and 1.09 by rests of ten seconds, in which no
    # gyro of 5 deg/s is known.
    assert values["total"] <= 1.15 * DEG
    assert values["heading"] <= 1.1 * DEG
    assert values["inclination"] <= 0.36 * DEG
    assert values["heading_6"] <= 1.3 * DEG
