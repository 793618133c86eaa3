"""``zerorate replay --array``: files, table and figure, and for every fault one line."""

import json
from functools import partial

import numpy as np
import pytest

import zerorate as zr
from support.commands import check_line, names, one_line

RATE = 100.0
N = 4000
TURNED = np.array([[0.0, -1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, -1.0]])


def motion():
    rates = np.zeros((N, 3))
    rates[1500:3000] = 60.0 * np.sin(np.arange(1500)[:, np.newaxis] / [30.0, 47.0, 71.0])
    return rates


def columns(sensors=3, turned=(), label="imu"):
    """Return the columns of sensors that turn together, some of them upside down."""
    random = np.random.default_rng(1)
    found = {"time_s": np.arange(N) / RATE}
    for k in range(1, sensors + 1):
        rates = motion() @ (TURNED if k in turned else np.eye(3))
        rates += random.standard_normal(3) + 0.1 * random.standard_normal((N, 3))
        found |= {f"{label}{k}_gyro_{axis}_dps": rates[:, i] for i, axis in enumerate("xyz")}
    return found


def write(path, found):
    """Write columns as a table of text, which any build reads."""
    lines = np.column_stack([*found.values()])
    np.savetxt(path, lines, "%.9g", ",", header=",".join(found), comments="")
    return path


@pytest.fixture
def cli(call):
    return partial(call, "replay", "--array")


@pytest.fixture(scope="module")
def log(tmp_path_factory):
    return write(tmp_path_factory.mktemp("array") / "board.csv", columns())


@pytest.fixture(scope="module")
def turned(tmp_path_factory):
    return write(tmp_path_factory.mktemp("array") / "board.csv", columns(turned=(2,)))


@pytest.fixture(scope="module")
def with_accel(tmp_path_factory):
    found, random = columns(), np.random.default_rng(2)
    for k in range(1, 4):
        accel = [0.0, 0.0, 1.0] + 0.003 * random.standard_normal((N, 3))
        found |= {f"imu{k}_accel_{axis}_g": accel[:, i] for i, axis in enumerate("xyz")}
    return write(tmp_path_factory.mktemp("array") / "board.csv", found)


class TestFiles:
    def test_it_writes_a_log_and_a_figure(self, cli, log, out):
        code, text, errors = cli(log, "-o", out)
        assert (code, errors) == (0, "")
        assert names(out) == ["board-zerorate.parquet", "board-zerorate.png"]
        assert f"wrote {out / 'board-zerorate.parquet'}" in text
        fused = zr.read_log(out / "board-zerorate.parquet")
        assert (fused.channels, fused.rate, fused.unit) == (3, RATE, "deg/s")
        z = zr.read_log(log, columns=list(columns())[1:]).data.reshape(-1, 3, 3)
        array = zr.GyroArray(RATE, 3, rest_limit=10.0, bias_limit=20.0)
        np.testing.assert_array_equal(fused.data, array.process(z))

    def test_no_figure_and_other_formats(self, cli, log, out):
        assert cli(log, "-o", out, "--no-figure", "--format", "csv")[0] == 0
        assert names(out) == ["board-zerorate.csv"]
        assert cli(log, "-o", out, "--figure-format", "svg", "--format", "npz")[0] == 0
        assert names(out) == ["board-zerorate.csv", "board-zerorate.npz", "board-zerorate.svg"]

    def test_it_replaces_nothing_unasked(self, cli, log, out):
        (out / "board-zerorate.parquet").write_text("mine")
        code, _, errors = cli(log, "-o", out, "--no-figure")
        assert code == 2
        check_line(errors, "--force")
        assert (out / "board-zerorate.parquet").read_text() == "mine"
        assert cli(log, "-o", out, "--no-figure", "--force")[0] == 0

    def test_parts_of_a_log(self, cli, out, tmp_path):
        both = {name: np.concatenate((c, c)) for name, c in columns(sensors=2).items()}
        both["board"] = np.repeat([1.0, 2.0], N)
        path = write(tmp_path / "two.csv", both)
        code, text, errors = cli(path, "-o", out, "--no-figure", "--group-by", "board")
        assert (code, errors) == (0, "")
        assert len(names(out)) == 2
        assert text.count("2 gyros") == 2


class TestTable:
    def test_a_row_a_sensor_and_the_gains(self, cli, log, out):
        _, text, _ = cli(log, "-o", out, "--no-figure")
        lines = text.splitlines()
        assert lines[0].startswith("At rest one sensor has 1.")
        start = lines.index("3 gyros, 4,000 samples at 100 Hz")
        firsts = [line.split("  ")[1] for line in lines[start + 2 : start + 9]]
        assert firsts[:3] == ["imu1", "imu2", "imu3"]
        assert firsts[3:] == ["plain mean", "array", "mean over array", "sensor over array"]
        assert "sqrt(3) is 1.73" in one_line(text)
        assert max(map(len, lines[:12])) <= 100

    def test_own_columns(self, cli, log, out):
        chosen = ",".join(f"imu{k}_gyro_{axis}_dps" for k in (3, 1) for axis in "xyz")
        _, text, _ = cli(log, "-o", out, "--no-figure", "--columns", chosen)
        lines = text.partition("2 gyros, ")[2].splitlines()
        assert [line.split()[0] for line in lines[2:4]] == ["imu3", "imu1"]

    def test_one_axis(self, cli, log, out):
        chosen = "imu1_gyro_z_dps,imu2_gyro_z_dps"
        code, text, _ = cli(log, "-o", out, "--columns", chosen)
        assert code == 0
        assert "2 gyros" in text
        assert zr.read_log(out / "board-zerorate.parquet").names == ("gyro_z",)


class TestRotations:
    def test_sensors_that_are_not_aligned_are_noticed(self, cli, turned, out):
        _, text, _ = cli(turned, "-o", out, "--no-figure")
        message = "not aligned: against imu1 are turned imu2 by 180 deg; --rotations find takes"
        assert message in one_line(text)

    def test_found_rotations_are_printed_and_written(self, cli, turned, out):
        code, text, _ = cli(turned, "-o", out, "--no-figure", "--rotations", "find")
        assert code == 0
        assert names(out) == ["board-zerorate-rotations.json", "board-zerorate.parquet"]
        assert "-y, -x, -z" in text
        assert "not aligned" not in one_line(text)
        fused = zr.read_log(out / "board-zerorate.parquet").data
        # Three sensors of 0.1 deg/s.
        assert np.std(fused[1600:] - motion()[1600:]) < 0.1
        path = out / "board-zerorate-rotations.json"
        again = out / "again"
        code, _, _ = cli(turned, "-o", f"{again}/", "--no-figure", "--rotations", path)
        assert code == 0
        np.testing.assert_array_equal(zr.read_log(again / "board-zerorate.parquet").data, fused)

    def test_motion_is_needed(self, cli, out, tmp_path):
        still = {name: c[:1500] for name, c in columns(sensors=2).items()}
        path = write(tmp_path / "still.csv", still)
        code, _, errors = cli(path, "-o", out, "--rotations", "find")
        assert (code, names(out)) == (1, [])
        check_line(errors, "still.csv: rotations need 3 s of motion")

    def test_a_file_without_a_sensor(self, cli, log, out, tmp_path):
        path = tmp_path / "turns.json"
        head = {"format": "zerorate rotations", "version": 1}
        path.write_text(json.dumps(head | {"rotations": {"imu1": [1, 0, 0, 0]}}))
        code, _, errors = cli(log, "-o", out, "--rotations", path)
        assert code == 2
        check_line(errors, "there is no rotation of imu2, imu3; known: imu1")

    def test_a_file_that_is_none(self, cli, log, out, tmp_path):
        code, _, errors = cli(log, "-o", out, "--rotations", tmp_path / "none.json")
        assert code == 1
        check_line(errors, "none.json: No such file")


class TestAccelerometers:
    def test_they_are_written_beside_the_rate(self, cli, log, with_accel, out):
        code, text, errors = cli(with_accel, "-o", out, "--no-figure")
        assert (code, errors) == (0, "")
        both = zr.read_recording(out / "board-zerorate.parquet")
        assert both.names == ("gyro", "accel")
        # Three of 3 mg.
        assert both.accel.data[:, 0].std() == pytest.approx(0.003 / np.sqrt(3.0), rel=0.05)
        lines = text.splitlines()
        first = lines.index("Fused accelerometers, lever arms not known")
        assert [line.split()[0] for line in lines[first + 2 : first + 5]] == [
            "imu1",
            "imu2",
            "imu3",
        ]
        assert "fused without lever arms" in one_line(text)
        assert "Accelerometers" not in cli(log, "-o", out, "--no-figure", "--force")[1]

    def test_positions_stand_with_the_rotations(self, cli, with_accel, out, tmp_path):
        known = {"format": "zerorate rotations", "version": 1}
        known["rotations"] = {f"imu{k}": [1, 0, 0, 0] for k in (3, 2, 1)}
        known["positions"] = {f"imu{k}": [0.01 * k, 0.0, 0.0] for k in (3, 2, 1)}
        path = tmp_path / "board.json"
        path.write_text(json.dumps(known))
        code, text, _ = cli(with_accel, "-o", out, "--no-figure", "--rotations", path)
        assert code == 0
        assert "Fused accelerometers, at the origin of the positions" in text
        assert "without lever arms" not in one_line(text)

    def test_positions_that_are_none(self, cli, with_accel, out, tmp_path):
        known = {"format": "zerorate rotations", "version": 1, "positions": {"imu1": [0, 0, 0]}}
        known["rotations"] = {f"imu{k}": [1, 0, 0, 0] for k in (1, 2, 3)}
        path = tmp_path / "board.json"
        path.write_text(json.dumps(known))
        code, _, errors = cli(with_accel, "-o", out, "--rotations", path)
        assert (code, names(out)) == (2, [])
        check_line(errors, "there is no position of imu2, imu3")


class TestWeights:
    def test_words_and_numbers(self, cli, log, out):
        z = zr.read_log(log, columns=list(columns())[1:]).data.reshape(-1, 3, 3)
        for typed, weights in (("mean", "mean"), ("white", "white"), ("3,0,1", [3.0, 0.0, 1.0])):
            assert cli(log, "-o", out, "--no-figure", "--force", "--weights", typed)[0] == 0
            array = zr.GyroArray(RATE, 3, weights=weights, rest_limit=10.0, bias_limit=20.0)
            fused = zr.read_log(out / "board-zerorate.parquet").data
            np.testing.assert_array_equal(fused, array.process(z))

    @pytest.mark.parametrize(
        ("typed", "message"),
        [
            (
                "best",
                "--weights takes auto, mean, white or numbers with commas between, got 'best'",
            ),
            ("1,2", "--weights takes one number for each of the 3 sensors, got 2"),
            ("1,-1,0", "sum is above zero on every axis"),
        ],
    )
    def test_what_is_no_weight(self, cli, log, out, typed, message):
        code, _, errors = cli(log, "-o", out, "--weights", typed)
        assert (code, names(out)) == (2, [])
        check_line(errors, message)


class TestFaults:
    @pytest.mark.parametrize(
        ("options", "message"),
        [
            (("--method", "kf"), "--method has no effect on --array"),
            (
                ("--fading", "0.9", "--methods", "kf"),
                "--fading, --methods have no effect on --array",
            ),
            (("--calibration", "x.json"), "--calibration has no effect on --array"),
            (("--no-accel",), "--no-accel has no effect on --array"),
            (("--limit", "-1"), "limit"),
        ],
    )
    def test_options_that_mean_nothing(self, cli, log, out, options, message):
        code, _, errors = cli(log, "-o", out, *options)
        assert (code, names(out)) == (2, [])
        check_line(errors, message)

    def test_options_of_an_array_need_one(self, call, log, out):
        code, _, errors = call("replay", log, "-o", out, "--rotations", "find", "--weights", "mean")
        assert code == 2
        check_line(errors, "only --array takes --rotations and --weights")

    def test_gyros_that_do_not_go_together(self, cli, out, tmp_path):
        found = columns(sensors=2)
        mixed = {name.replace("imu2_gyro_x_dps", "imu2_gyro_w_dps"): c for name, c in found.items()}
        path = write(tmp_path / "mixed.csv", mixed)
        code, _, errors = cli(path, "-o", out)
        assert (code, names(out)) == (1, [])
        check_line(errors, "mixed.csv: the gyros of an array must agree in axes")
