"""``zerorate calibrate`` and what applies its result: tables, files, and a line for every fault."""

import json
from functools import partial

import numpy as np
import pytest

import zerorate as zr
from support.calibrations import COUNTS, INVALID, calibration, recorded, write_imu
from support.commands import check_line, names, one_line
from support.logs import write_table
from support.recordings import RECORDINGS, needs_recordings
from zerorate import read_recording
from zerorate.simulation.session import GyroErrors

EXACT = {"rtol": 1e-10, "atol": 1e-10}


@pytest.fixture
def cli(call):
    """Run ``zerorate calibrate``; return its code, stdout and stderr."""
    return partial(call, "calibrate")


@pytest.fixture
def cal(tmp_path):
    path = tmp_path / "cal.json"
    calibration(rests=5).to_json(path)
    return path


@pytest.fixture
def log(tmp_path):
    return write_imu(tmp_path / "run.csv", recorded(calibration())[0])


class TestApply:
    def test_it_writes_the_corrected_log(self, cli, cal, log, out):
        code, text, errors = cli("--apply", cal, log, "-o", out)
        assert (code, errors) == (0, "")
        assert names(out) == ["run-zerorate-calibrated.parquet"]
        found = read_recording(out / "run-zerorate-calibrated.parquet")
        _, rate, force = recorded(calibration())
        np.testing.assert_allclose(found.gyro.data, rate, **EXACT)
        np.testing.assert_allclose(found.accel.data, force, **EXACT)
        assert (found.gyro.unit, found.accel.unit) == ("deg/s", "g")
        assert "gyro: corrected by a calibration of 4 rests and 3 turns" in text
        assert f"wrote {out}" in text

    @pytest.mark.parametrize("suffix", ["csv", "npz", "parquet"])
    def test_it_is_what_the_library_gives(self, cli, cal, log, out, suffix):
        assert cli("--apply", cal, log, "-o", out / f"a.{suffix}")[0] == 0
        found = read_recording(out / f"a.{suffix}")
        expected = zr.Calibration.from_json(cal).apply(read_recording(log))
        np.testing.assert_array_equal(found.gyro.data, expected.gyro.data)
        np.testing.assert_array_equal(found.accel.data, expected.accel.data)

    def test_counts_become_si(self, cli, tmp_path, out):
        made = calibration(units=COUNTS, scales=(1670.0, 7509.0))
        made.to_json(tmp_path / "cal.json")
        recording, rate, _ = recorded(made)
        log = write_imu(tmp_path / "run.csv", recording)
        assert cli("--apply", tmp_path / "cal.json", log, "-o", out)[0] == 0
        found = read_recording(out / "run-zerorate-calibrated.parquet")
        assert (found.gyro.unit, found.accel.unit) == ("rad/s", "m/s^2")
        np.testing.assert_allclose(found.gyro.data, rate, **EXACT)

    def test_sensors_on_clocks_of_their_own_are_files_of_their_own(self, cli, cal, tmp_path, out):
        n = 400
        columns = {f"gyro_{x}_dps": np.random.default_rng(1).normal(size=n) for x in "xyz"}
        slow = np.full((n, 3), np.nan)
        slow[::4] = [0.1, 0.2, 1.0]
        columns |= {f"accel_{x}_g": slow[:, i] for i, x in enumerate("xyz")}
        log = write_table(tmp_path / "run.csv", columns)
        assert cli("--apply", cal, log, "-o", out)[0] == 0
        assert names(out) == [
            "run-zerorate-calibrated-accel.parquet",
            "run-zerorate-calibrated.parquet",
        ]
        assert read_recording(out / "run-zerorate-calibrated-accel.parquet").accel.rate == 25.0

    def test_one_that_is_not_valid_says_so(self, cli, log, tmp_path, out):
        calibration(**INVALID).to_json(tmp_path / "bad.json")
        code, text, errors = cli("--apply", tmp_path / "bad.json", log, "-o", out)
        assert (code, errors) == (0, "")
        assert "that was applied is not valid: the scale of the gyro's x axis" in one_line(text)

    @pytest.mark.parametrize(
        ("options", "code", "match"),
        [
            (("--frame", "z"), 2, "--frame has no effect with --apply"),
            (("--gravity", "9.8"), 2, "--gravity has no effect with --apply"),
            (("--no-figure",), 2, "--no-figure has no effect with --apply"),
            (("--unit", "deg/s,rad/s"), 2, "--unit takes one unit of each kind, such as deg/s,g"),
            (("--unit", "furlongs"), 2, "unknown unit 'furlongs'"),
            (("-o", "a.png"), 2, "-o takes a folder, or a file as parquet, csv, npz"),
            (("--gyro", "gyro_7"), 1, "run.csv: there is no gyro_7 and no accel_7; the recording"),
        ],
    )
    def test_refusals(self, cli, cal, log, out, options, code, match):
        found, text, errors = cli("--apply", cal, log, "-o", out, *options)
        assert (found, text) == (code, "")
        check_line(errors, match)
        assert names(out) == []

    def test_units_that_do_not_fit(self, cli, cal, tmp_path, out):
        log = write_table(tmp_path / "run.csv", {f"gyro_{x}": np.ones(40) for x in "xyz"})
        code, _, errors = cli("--apply", cal, log, "-o", out)
        assert code == 2
        check_line(
            errors, "the calibration is of a gyro in deg/s, and these samples are of unknown"
        )
        assert cli("--apply", cal, log, "-o", out, "--unit", "deg/s")[0] == 0

    def test_what_is_no_calibration(self, cli, cal, log, tmp_path, out):
        for path, match in (
            (tmp_path / "none.json", "none.json: No such file"),
            (log, "run.csv is not a zerorate calibration in JSON"),
        ):
            code, _, errors = cli("--apply", path, log, "-o", out)
            assert code == 1
            check_line(errors, match)
        content = json.loads(cal.read_text())
        cal.write_text(json.dumps({**content, "version": 99}))
        code, _, errors = cli("--apply", cal, log, "-o", out)
        check_line(
            errors, "it is of version 99, and this zerorate reads version 1: calibrate again"
        )


class TestReplay:
    """``zerorate replay --calibration``."""

    def test_the_gyro_is_corrected_before_it_is_filtered(self, call, cal, log, out):
        options = ("-o", out, "--no-figure", "--format", "csv")
        code, text, errors = call("replay", "--calibration", cal, log, *options)
        assert (code, errors) == (0, "")
        assert "gyro: corrected by a calibration of 4 rests and 3 turns" in one_line(text)
        found = zr.read_log(out / "run-zerorate.csv")
        _, rate, _ = recorded(calibration())
        corrected = zr.Calibration.from_json(cal).apply(read_recording(log)).gyro
        np.testing.assert_allclose(corrected.data, rate, **EXACT)
        expected = zr.DriftFilter(100.0, channels=3, rest_limit=10.0).process(corrected.data)
        np.testing.assert_array_equal(found.data, expected)

    def test_of_several_accelerometers_the_first_is_taken(self, call, cal, tmp_path, out):
        recording = recorded(calibration())[0]
        columns = {
            f"imu{k}_{name}_{axis}_{'dps' if name == 'gyro' else 'g'}": log.data[:, i]
            for k in (1, 2)
            for name, log in recording.items()
            for i, axis in enumerate("xyz")
        }
        log = write_table(tmp_path / "two.csv", columns)
        code, text, _ = call("replay", "--calibration", cal, log, "-o", out, "--no-figure")
        assert code == 0
        assert "- of 2 accelerometers accel is used as the force on the gyro" in text

    def test_what_does_not_fit(self, call, cal, tmp_path, out):
        log = write_table(tmp_path / "run.csv", {"gyro_x_dps": np.ones(400)})
        code, _, errors = call("replay", "--calibration", cal, log, "-o", out, "--no-figure")
        assert code == 1
        check_line(errors, "run.csv: a calibration needs three axes of a gyro, got 1")
        code, _, errors = call("replay", "--calibration", log, log, "-o", out, "--no-figure")
        assert code == 1
        check_line(errors, "run.csv is not a zerorate calibration in JSON")


STEM = "turns-zerorate-calibration"


@pytest.fixture(scope="module")
def session():
    return zr.simulation.simulate_session(14, seed=3, rest=4.0)


@pytest.fixture(scope="module")
def turns(session, tmp_path_factory):
    return write_imu(tmp_path_factory.mktemp("session") / "turns.csv", session.recording)


@pytest.fixture(scope="module")
def few(tmp_path_factory):
    """Too few poses to calibrate anything by."""
    recording = zr.simulation.simulate_session(5, seed=3, rest=4.0).recording
    return write_imu(tmp_path_factory.mktemp("few") / "few.csv", recording)


class TestCalibrate:
    def test_table_files_and_exports(self, cli, turns, out):
        exports = "kalibr,imu_tk,px4,ardupilot"
        options = ("--export", exports, "--gravity", "9.81", "--frame", "z")
        code, text, errors = cli(turns, "-o", out, *options)
        assert (code, errors) == (0, "")
        assert text.startswith("Calibration: valid\n\nAccelerometer, raw in g\n")
        assert names(out) == sorted(
            [
                f"{STEM}-ardupilot.param",
                f"{STEM}-imu_tk_acc.calib",
                f"{STEM}-imu_tk_gyro.calib",
                f"{STEM}-kalibr.yaml",
                f"{STEM}-px4.params",
                f"{STEM}.json",
                f"{STEM}.png",
            ]
        )
        assert all(f"wrote {out / name}" in text for name in names(out))
        found = zr.Calibration.from_json(out / f"{STEM}.json")
        expected = zr.calibrate(read_recording(turns), gravity=9.81, frame="z")
        assert found.to_json() == expected.to_json()
        assert text.startswith(str(expected))
        assert (out / f"{STEM}-kalibr.yaml").read_text() == expected.to_kalibr()
        assert (out / f"{STEM}-imu_tk_gyro.calib").read_text() == expected.to_imu_tk().gyro
        assert (out / f"{STEM}-px4.params").read_text() == expected.to_px4()
        assert (out / f"{STEM}-ardupilot.param").read_text() == expected.to_ardupilot()

    def test_options_reach_the_fit(self, cli, turns, out):
        options = ("--g-sensitivity", "off", "--saturation", "100", "--no-figure")
        code, text, _ = cli(turns, "-o", out / "a.json", *options)
        assert names(out) == ["a.json"]
        expected = zr.calibrate(read_recording(turns), g_sensitivity=False, saturation=100.0)
        assert (out / "a.json").read_text() == expected.to_json()
        assert code == (0 if expected.valid else 1)
        assert "end of the gyro's range" in text

    def test_the_temperature_of_the_same_log(self, cli, tmp_path, out, turns):
        slope = GyroErrors(temperature=np.radians([[0.2, -0.1, 0.15]]))
        session = zr.simulation.simulate_session(
            14, seed=3, rest=4.0, temperature=(20.0, 32.0), gyro=slope
        )
        log = write_imu(tmp_path / "warm.csv", session.recording)
        code, text, _ = cli(log, "-o", out, "--temperature", "--export", "px4")
        assert code == 0
        assert names(out) == [
            "warm-zerorate-calibration-px4.params",
            "warm-zerorate-calibration-temperature.png",
            "warm-zerorate-calibration.json",
            "warm-zerorate-calibration.png",
        ]
        cal = out / "warm-zerorate-calibration.json"
        found = zr.Calibration.from_json(cal)
        assert found.temperature_model is not None
        assert str(found.temperature_model).splitlines()[0] in text
        assert "TC_G0_TREF" in (out / "warm-zerorate-calibration-px4.params").read_text()
        code, text, _ = cli("--apply", cal, log, "-o", out)
        assert "- the bias is corrected for temperature" in text
        code, _, errors = cli(turns, "-o", out, "--temperature", "--no-figure")
        assert code == 1
        check_line(errors, "turns.csv: there is no temperature to make a model of; the recording")

    def test_an_earlier_calibration(self, cli, turns, out):
        assert cli(turns, "-o", out / "old.json", "--no-figure", "--frame", "z")[0] == 0
        options = ("-o", out / "new.json", "--no-figure", "--compare", out / "old.json")
        code, text, errors = cli(turns, *options)
        assert (code, errors) == (0, "")
        compared = text.partition("Compared with the earlier calibration (first column)\n")[2]
        assert "gyro.matrix.xx [%]" in compared
        assert "  moved" not in compared

    def test_what_is_compared_with_is_not_replaced(self, cli, turns, tmp_path):
        old = tmp_path / "old.json"
        assert cli(turns, "-o", old, "--no-figure")[0] == 0
        before = old.read_bytes()
        (tmp_path / "link.json").symlink_to(old)
        for name in ("old.json", "link.json"):
            options = ("-o", tmp_path / name, "--compare", old, "--no-figure", "--force")
            code, text, errors = cli(turns, *options)
            assert (code, text) == (2, "")
            check_line(errors, f"{name} is read as well, and is not replaced: give another -o")
        assert old.read_bytes() == before

    def test_its_result_corrects_the_log(self, cli, turns, out, session):
        assert cli(turns, "-o", out, "--no-figure")[0] == 0
        assert cli("--apply", out / f"{STEM}.json", turns, "-o", out)[0] == 0
        found = read_recording(out / "turns-zerorate-calibrated.parquet")
        before, after = (
            np.linalg.norm(one.accel.data[50:350], axis=1).mean() - 1.0
            for one in (session.recording, found)
        )
        assert abs(after) < 0.1 * abs(before)

    def test_one_of_several_imus(self, cli, session, tmp_path, out):
        logs = session.recording.logs
        two = {f"imu{k}_{name}": log for k in (1, 2) for name, log in logs.items()}
        columns = {
            f"{name}_{axis}_{'dps' if 'gyro' in name else 'g'}": log.data[:, i]
            for name, log in two.items()
            for i, axis in enumerate("xyz")
        }
        log = write_table(tmp_path / "two.csv", columns)
        code, _, errors = cli(log, "-o", out, "--no-figure")
        assert code == 2
        check_line(errors, "two.csv: there are 2 IMUs: imu1, imu2; choose one, ")
        assert errors.endswith("such as --sensor imu1\n")
        assert cli(log, "-o", out, "--no-figure", "--sensor", "imu2")[0] == 0
        of_sensor = out / "two-zerorate-calibration-imu2.json"
        assert cli(log, "-o", out, "--no-figure", "--gyro", "gyro_1")[0] == 0
        found = zr.Calibration.from_json(out / "two-zerorate-calibration.json")
        named = zr.Calibration.from_json(of_sensor)
        np.testing.assert_array_equal(named.values, found.values)
        np.testing.assert_allclose(found.values, zr.calibrate(session.recording).values, rtol=1e-6)
        cal = out / "two-zerorate-calibration.json"
        assert cli("--apply", cal, log, "-o", out, "--gyro", "gyro_1")[0] == 0
        first, second = read_recording(out / "two-zerorate-calibrated.parquet").of_kind("gyro")
        np.testing.assert_allclose(first.data, session.recording.gyro.data, rtol=1e-12)
        assert np.abs(second.data - first.data).max() > 0.1

    def test_one_that_is_not_valid_ends_with_1_and_is_written(self, cli, few, out):
        code, text, errors = cli(few, "-o", out)
        assert code == 1
        assert text.startswith("Calibration: NOT VALID\n")
        assert "Advice\n- hold " in text
        check_line(errors, "few.csv: the calibration is not valid: ")
        assert names(out) == [f"few-zerorate-calibration.{end}" for end in ("json", "png")]
        assert not zr.Calibration.from_json(out / "few-zerorate-calibration.json").valid

    @needs_recordings
    def test_a_real_record_of_too_little_is_refused(self, cli, out):
        """The rests of BROAD 05 are all in one pose."""
        log = RECORDINGS / "broad_05_undisturbed_slow_rotation_with_breaks_B.parquet"
        code, text, errors = cli(log, "--rate", "285.714", "-o", out, "--no-figure")
        assert code == 1
        check_line(errors, "the calibration is not valid: ")
        assert "17 of 18 parameters are not identifiable" in one_line(text)
        assert text.index("NOT VALID") < text.index("Accelerometer")

    def test_no_rest_at_all(self, cli, tmp_path, out):
        rng = np.random.default_rng(1)
        columns = {f"gyro_{x}_dps": 50 * rng.standard_normal(900).cumsum() for x in "xyz"}
        columns |= {f"accel_{x}_g": rng.standard_normal(900) for x in "xyz"}
        code, text, errors = cli(write_table(tmp_path / "run.csv", columns), "-o", out)
        assert (code, text) == (1, "")
        check_line(errors, "run.csv: ")
        assert names(out) == []

    @pytest.mark.parametrize(
        ("options", "code", "match"),
        [
            (("--gravity", "-1"), 2, "gravity must be"),
            (("--saturation", "0"), 2, "saturation must be"),
            (("--gyro", "gyro_3"), 1, "turns.csv: there is no 'gyro_3'; the recording has: gyro"),
            (("--export", "kalibr,vins"), 2, "--export takes some of kalibr, imu_tk, px4, ardu"),
            (
                ("--format", "csv"),
                2,
                "--format is the format of the corrected log: give it with --apply",
            ),
            (("--frame", "q"), 2, "--frame takes x, z or symmetric, got 'q'"),
            (("-o", "a.csv"), 2, "-o takes a folder, or a file as json, got 'a.csv'"),
            (("--columns", "gyro_x_dps"), 1, "turns.csv: the gyro must have three axes"),
            (("--compare", "none.json"), 1, "none.json: No such file"),
        ],
    )
    def test_refusals(self, cli, turns, out, options, code, match):
        found, text, errors = cli(turns, "--no-figure", "-o", out, *options)
        assert (found, text) == (code, "")
        check_line(errors, match)
        assert names(out) == []

    def test_counts_cannot_become_kalibrs_file(self, cli, session, tmp_path, out):
        recording = session.recording
        columns = {f"gyro_{x}": 131 * recording.gyro.data[:, i] for i, x in enumerate("xyz")}
        columns |= {f"accel_{x}": 16384 * recording.accel.data[:, i] for i, x in enumerate("xyz")}
        log = write_table(tmp_path / "raw.csv", columns)
        code, text, _ = cli(log, "-o", out, "--no-figure")
        assert code == 0
        assert "Gyro, raw unit not known" in text
        code, _, errors = cli(log, "-o", out, "--no-figure", "--force", "--export", "kalibr")
        assert code == 2
        check_line(errors, "Kalibr takes samples in rad/s and m/s^2, and the unit of the acceler")
        code, text, _ = cli(
            *(log, "-o", out, "--no-figure", "--force", "--export", "kalibr"),
            *("--scale", "1/131,1/16384", "--unit", "deg/s,g"),
        )
        assert code == 0
        assert "Gyro, raw in deg/s" in text


@pytest.fixture(scope="module")
def moved(tmp_path_factory):
    """A log of a hand's motion with iron beside the magnetometer."""
    recording = zr.simulate_motion("hand", duration=30.0, seed=100).recording()
    log, logs = recording.mag, dict(recording)
    logs["mag"] = log.with_data(log.data + np.array([9.0, -14.0, 6.0]))
    path = tmp_path_factory.mktemp("mag") / "hand.csv"
    return write_imu(path, zr.Recording(logs, recording.source))


class TestMagnetometer:
    def test_it_is_written_exported_and_applied(self, cli, call, moved, out):
        typed = ("--magnetometer", "--export", "px4,ardupilot", "--field", "48", "--dip", "65")
        code, text, errors = cli(moved, *typed, "-o", out)
        assert (code, errors) == (0, "")
        assert text.startswith("applied      b")
        name = "hand-zerorate-magnetometer"
        ends = ("-ardupilot.param", "-px4.params", ".json", ".png")
        assert names(out) == [f"{name}{end}" for end in ends]
        found = zr.calibration.MagnetometerCalibration.from_json(out / f"{name}.json")
        assert (out / f"{name}-px4.params").read_text() == found.to_px4()
        asked = (moved, "--no-figure", "-o", out, "--force")
        code, text, _ = call("attitude", *asked, "--magnetometer", out / f"{name}.json")
        expected = zr.estimate_attitude(read_recording(moved), magnetometer=found)
        assert (code, text.startswith(expected.table())) == (0, True)

    def test_faults_are_one_line(self, cli, call, moved, tmp_path, out):
        for typed, said in (
            (("--magnetometer", "--export", "kalibr"), "is one of json, px4, ardupilot"),
            (("--field", "48"), "--field acts with --magnetometer"),
            (("--magnetometer", "--temperature"), "no effect with --magnetometer"),
            (("--magnetometer", "--field", "0.5"), "must be that of a place on earth"),
        ):
            code, _, errors = cli(moved, *typed, "-o", out)
            assert (code, said in one_line(errors)) == (2, True), errors
        code, _, errors = cli(moved, "--magnetometer", "--field", "25", "-o", out)
        assert (code, "that of the place 25 uT" in one_line(errors)) == (1, True)
        code, _, errors = call("attitude", moved, "--no-mag", "--magnetometer", "x", "-o", out)
        assert (code, "no effect with --no-mag" in one_line(errors)) == (2, True)
        code, _, errors = cli(at_rest(tmp_path), "--magnetometer", "-o", out, "--force")
        assert (code, "does not show the hard iron" in one_line(errors)) == (1, True)


def at_rest(folder):
    """A log of a device that nobody moved."""
    recording = zr.simulate_motion("hand", duration=15.0, seed=1).recording()
    rng, logs = np.random.default_rng(1), {}
    for name, log in recording.items():
        still = log.data[:1] * (name != "gyro")
        logs[name] = log.with_data(still + rng.normal(0.0, 1e-3, log.data.shape))
    return write_imu(folder / "still.csv", zr.Recording(logs, "still"))
