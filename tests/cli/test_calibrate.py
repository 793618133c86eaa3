"""``zerorate calibrate`` and what applies its result: tables, files, and a line for every fault."""

import json
from functools import partial

import numpy as np
import pytest

import zerorate as zr
from support.calibrations import COUNTS, INVALID, calibration, recorded, write_imu
from support.commands import check_line, names, one_line
from support.logs import write_table
from zerorate import read_recording

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
        found, text, errors = cli("--apply", cal, log, *(("-o", out) + options))
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
        check_line(errors, "format and version are ('zerorate calibration', 99), expected")


class TestReplay:
    """``zerorate replay --calibration``."""

    def test_the_gyro_is_corrected_before_it_is_filtered(self, call, cal, log, out):
        options = ("-o", out, "--only", "--no-figure", "--format", "csv")
        code, text, errors = call("replay", "--calibration", cal, log, *options)
        assert (code, errors) == (0, "")
        assert "gyro: corrected by a calibration of 4 rests and 3 turns" in one_line(text)
        found = zr.read_log(out / "run-zerorate.csv")
        _, rate, _ = recorded(calibration())
        corrected = zr.Calibration.from_json(cal).apply(read_recording(log)).gyro
        np.testing.assert_allclose(corrected.data, rate, **EXACT)
        expected = zr.DriftFilter(100.0, channels=3, rest_limit=3.0).process(corrected.data)
        np.testing.assert_array_equal(found.data, expected)

    def test_what_does_not_fit(self, call, cal, tmp_path, out):
        log = write_table(tmp_path / "run.csv", {"gyro_x_dps": np.ones(400)})
        code, _, errors = call("replay", "--calibration", cal, log, "-o", out, "--no-figure")
        assert code == 1
        check_line(errors, "run.csv: a calibration needs the three axes of the gyro, got 1")
        code, _, errors = call("replay", "--calibration", log, log, "-o", out, "--no-figure")
        assert code == 1
        check_line(errors, "run.csv is not a zerorate calibration in JSON")
