"""The command line: files, tables, and for every fault one line and an exit code."""

import os
import subprocess
import sys

import numpy as np
import pytest

from zerorate import DEVICES, DriftFilter, Log, __version__, read_log, write_log
from zerorate.cli import run


def recording(path, n=1500, axes=2, missing=slice(0, 0), unit="deg/s"):
    data = 0.5 + 0.1 * np.random.default_rng(1).standard_normal((n, axes))
    data[missing] = np.nan
    names = [f"gyro_{axis}" for axis in "xyzuvw"[:axes]]
    write_log(Log(np.arange(n) / 100.0, 100.0, data, names, unit), path)
    return path


@pytest.fixture
def log(tmp_path):
    return recording(tmp_path / "run.parquet")


@pytest.fixture
def out(tmp_path):
    folder = tmp_path / "out"
    folder.mkdir()
    return folder


@pytest.fixture
def cli(capsys):
    """Run a command; return its code, stdout and stderr."""

    def call(*arguments):
        code = run([str(argument) for argument in arguments])
        return code, *capsys.readouterr()

    return call


def names(folder):
    return sorted(path.name for path in folder.iterdir())


class TestReplay:
    def test_it_writes_a_filtered_log_and_a_figure(self, cli, log, out):
        code, text, errors = cli("replay", log, "-o", out)
        assert (code, errors) == (0, "")
        assert names(out) == ["run-zerorate.parquet", "run-zerorate.png"]
        assert f"wrote {out / 'run-zerorate.parquet'}" in text
        raw, filtered = read_log(log), read_log(out / "run-zerorate.parquet")
        assert (filtered.names, filtered.rate, filtered.unit) == (raw.names, raw.rate, raw.unit)
        alone = DriftFilter(100.0, method="auto", output="compensated", channels=2)
        np.testing.assert_array_equal(filtered.data, alone.process(raw.data))

    def test_options_that_the_chosen_method_does_not_know_are_told(self, cli, log, out):
        options = ("--order", "3,1", "--fading", "0.9", "--startup", "2", "--no-figure")
        code, text, errors = cli("replay", log, "-o", out, *options)
        assert (code, errors) == (0, "")
        assert text.endswith("\n--order, --fading act on the methods beside auto alone\n")

    def test_options_that_no_method_knows_are_refused(self, cli, log, out):
        told = "zerorate: --fading has no effect on --method kf\n"
        assert cli("replay", log, "-o", out, "--method", "kf", "--fading", "0.9") == (2, "", told)
        assert names(out) == []

    @pytest.mark.parametrize("kind", ["parquet", "csv"])
    def test_bias_and_rest_stand_beside_the_compensated_rate(self, cli, log, out, kind):
        code, text, _ = cli("replay", log, "-o", out, "--no-figure", "--format", kind)
        assert code == 0
        assert "Learned by auto" in text
        trace = DriftFilter(100.0, method="auto", channels=2).trace(read_log(log).data)
        columns = ["bias_gyro_x_dps", "bias_sigma_gyro_y_dps", "at_rest_gyro_y"]
        beside = [read_log(out / f"run-zerorate.{kind}", columns=name) for name in columns]
        expected = [trace.bias[:, 0], trace.bias_sigma[:, 1], trace.at_rest[:, 1]]
        for one, values in zip(beside, expected, strict=True):
            np.testing.assert_array_equal(one.data[:, 0], values)

    def test_arrays_beside_the_compensated_rate(self, cli, log, out):
        assert cli("replay", log, "-o", out, "--no-figure", "--format", "npz")[0] == 0
        trace = DriftFilter(100.0, method="auto", channels=2).trace(read_log(log).data)
        with np.load(out / "run-zerorate.npz") as arrays:
            np.testing.assert_array_equal(arrays["bias_gyro_x_dps"], trace.bias[:, 0])
            np.testing.assert_array_equal(arrays["at_rest_gyro_y"], trace.at_rest[:, 1])

    @pytest.mark.parametrize("method", ["auto", "kf"])
    @pytest.mark.parametrize("kind", ["estimate", "compensated"])
    @pytest.mark.parametrize("motion", ["hold", "ignore"])
    def test_output_and_motion(self, cli, log, out, method, kind, motion):
        options = ("--method", method, "--output-kind", kind, "--motion", motion)
        assert cli("replay", log, "-o", out, "--no-figure", *options)[0] == 0
        raw = read_log(log)
        alone = DriftFilter(100.0, method=method, output=kind, motion=motion, channels=2)
        filtered = read_log(out / "run-zerorate.parquet")
        np.testing.assert_array_equal(filtered.data, alone.process(raw.data))

    def test_options_reach_the_filter(self, cli, log, out):
        options = "--order 1,1 --method akf --adapt-for always --forgetting-factor 0.999 "
        options += "--process-noise 0.01 --startup 2 --noise hadamard --no-figure --columns 1"
        assert cli("replay", log, "-o", out, *options.split())[0] == 0
        raw = read_log(log, columns=1)
        expected = DriftFilter(
            100.0,
            order=(1, 1),
            method="akf",
            adapt_for=None,
            forgetting_factor=0.999,
            process_noise=0.01,
            startup=2.0,
            noise="hadamard",
            channels=1,
        ).process(raw.data)
        filtered = read_log(out / "run-zerorate.parquet")
        np.testing.assert_array_equal(filtered.data, expected)

    @pytest.mark.parametrize(("kind", "figure"), [("csv", "svg"), ("npz", "pdf")])
    def test_formats(self, cli, log, out, kind, figure):
        assert cli("replay", log, "-o", out, "--format", kind, "--figure-format", figure)[0] == 0
        assert names(out) == sorted([f"run-zerorate.{kind}", f"run-zerorate.{figure}"])
        assert read_log(out / f"run-zerorate.{kind}").n == 1500

    def test_columns_by_name(self, cli, log, out):
        columns = "gyro_y,gyro_x"
        assert cli("replay", log, "-o", out, "--no-figure", "--columns", columns)[0] == 0
        assert read_log(out / "run-zerorate.parquet").names == ("gyro_y", "gyro_x")

    def test_force_replaces(self, cli, log, out):
        (out / "run-zerorate.png").write_text("old")
        assert cli("replay", log, "-o", out)[0] == 2
        assert names(out) == ["run-zerorate.png"]
        assert cli("replay", log, "-o", out, "--force")[0] == 0
        assert (out / "run-zerorate.png").read_bytes().startswith(b"\x89PNG")

    def test_default_folder_is_the_current_one(self, cli, log, out, monkeypatch):
        monkeypatch.chdir(out)
        assert cli("replay", log, "--no-figure")[0] == 0
        assert names(out) == ["run-zerorate.parquet"]

    @pytest.mark.parametrize("n", [1, 2, 20])
    def test_short_records_are_filtered_as_far_as_it_goes(self, cli, tmp_path, out, n):
        short = recording(tmp_path / "short.npz", n=n)
        code, text, _ = cli("replay", short, "-o", out)
        assert code == 0
        assert f"has {n}: no noise" in " ".join(text.split())

    def test_gaps_are_told(self, cli, tmp_path, out):
        gaps = recording(tmp_path / "gaps.parquet", missing=slice(100, 200))
        code, text, _ = cli("replay", gaps, "-o", out, "--no-figure")
        assert code == 0
        assert "gyro_x 100" in text


DATA_FAULTS = {
    "missing file": ("nothing.csv", None, (), "does not exist"),
    "folder": (".", None, (), "is a folder"),
    "empty": ("a.csv", b"", (), "the file is empty"),
    "binary": ("a.csv", b"\x00\x01\x02" * 50, (), "expected"),
    "damaged parquet": ("a.parquet", b"PAR1" + b"\x00" * 50, (), "truncated or damaged"),
    "unknown suffix": ("a.xyz", b"1,2\n", (), "unknown suffix"),
    "text in a row": ("a.csv", b"time_s,gyro_x\n0,1\n0.1,a\n0.2,2\n", (), "is not a number"),
    "no gyro": ("a.csv", b"time_s,temp\n0,1\n0.1,2\n", (), "choose with --columns"),
    "no rate": ("a.csv", b"gyro_x,gyro_y\n0,1\n1,2\n", (), "give --rate in Hz"),
    "other rate": ("a.csv", b"t,gyro_x\n0,1\n1,2\n2,3\n", ("--rate", "5"), "stated as 5 Hz"),
}

USAGE_FAULTS = {
    "no such option": (("--colour",), "No such option: --colour"),
    "method": (("--method", "median"), "'median' is not one of"),
    "motion": (("--motion", "stop"), "'stop' is not one of"),
    "output kind": (("--output-kind", "bias"), "'bias' is not one of"),
    "noise": (("--noise", "pink"), "'pink' is not one of"),
    "format": (("--format", "xls"), "'xls' is not one of"),
    "figure format": (("--figure-format", "gif"), "'gif' is not one of"),
    "unit": (("--unit", "furlong"), "unknown unit 'furlong'"),
    "rate": (("--rate", "-5"), "rate"),
    "rate no number": (("--rate", "fast"), "--rate"),
    "order": (("--order", "2"), "--order takes two numbers"),
    "order too high": (("--order", "9,1"), "order"),
    "fading": (("--fading", "2"), "fading"),
    "adapt for": (("--adapt-for", "soon"), "--adapt-for takes seconds"),
    "forgetting": (("--forgetting-factor", "0"), "forgetting"),
    "startup": (("--startup", "-1"), "startup"),
    "columns": (("--columns", "gyro_q"), "there is no column 'gyro_q'"),
    "index": (("--columns", "77"), "there is no column 77"),
    "empty column": (("--columns", "a,,b"), "--columns takes names or indices"),
    "twice": (("--columns", "1,1"), "--columns names a column twice"),
    "folder": (("-o", "not-there"), "does not exist"),
}


class TestFaults:
    @pytest.mark.parametrize("name", DATA_FAULTS)
    def test_data(self, cli, tmp_path, out, name):
        file, content, options, match = DATA_FAULTS[name]
        if content is not None:
            (tmp_path / file).write_bytes(content)
        code, text, errors = cli("replay", tmp_path / file, "-o", out, *options)
        assert (code, text) == (1, "")
        self.check_line(errors, match)
        assert names(out) == []

    @pytest.mark.parametrize("name", USAGE_FAULTS)
    def test_usage(self, cli, log, out, name):
        options, match = USAGE_FAULTS[name]
        code, text, errors = cli("replay", log, "-o", out, *options)
        assert (code, text) == (2, "")
        self.check_line(errors, match)
        assert names(out) == []

    def check_line(self, errors, match):
        assert errors.startswith("zerorate: ")
        assert errors.count("\n") == 1
        assert match in errors

    def test_all_missing(self, cli, tmp_path, out):
        empty = recording(tmp_path / "empty.npz", missing=slice(None))
        code, _, errors = cli("replay", empty, "-o", out)
        assert code == 1
        self.check_line(errors, "no axis holds a sample")
        assert names(out) == []

    def test_existing_output_is_refused_before_any_work(self, cli, tmp_path, out):
        (out / "nothing-zerorate.parquet").write_text("old")
        code, _, errors = cli("replay", tmp_path / "nothing.csv", "-o", out)
        assert code == 2
        self.check_line(errors, "exists already; pass --force to replace it")

    def test_folder_that_is_a_file(self, cli, log):
        code, _, errors = cli("replay", log, "-o", log)
        assert code == 2
        self.check_line(errors, "is not a folder")

    def test_folder_not_writable(self, cli, log, out, monkeypatch):
        # Not by chmod: root may write anywhere.
        monkeypatch.setattr(os, "access", lambda _, mode: not mode & os.W_OK)
        code, _, errors = cli("replay", log, "-o", out)
        assert code == 2
        self.check_line(errors, "is not writable")

    @pytest.mark.parametrize("arguments", [("fly",), ("replay",), ("simulate",), ("demo", "x")])
    def test_wrong_commands(self, cli, arguments):
        code, _, errors = cli(*arguments)
        assert code == 2
        self.check_line(errors, "")

    def test_full_disk(self, cli, log, out, monkeypatch):
        def fail(*_, **__):
            raise OSError(28, "No space left on device")

        monkeypatch.setattr("zerorate.cli.replay.write_log", fail)
        code, _, errors = cli("replay", log, "-o", out)
        assert code == 1
        self.check_line(errors, "No space left on device")
        assert names(out) == []

    @pytest.mark.parametrize(("module", "extra"), [("matplotlib", "plot"), ("pyarrow", "io")])
    def test_missing_extras(self, cli, log, out, monkeypatch, module, extra):
        monkeypatch.setattr("zerorate.cli.errors.find_spec", lambda name: None)
        options = () if module == "pyarrow" else ("--format", "csv")
        code, _, errors = cli("replay", log, "-o", out, *options)
        assert code == 2
        self.check_line(errors, f"this needs {module}: pip install 'zerorate[{extra}]'")

    def test_missing_typer(self, cli, monkeypatch):
        monkeypatch.setitem(sys.modules, "typer", None)
        code, _, errors = cli("--version")
        assert code == 2
        self.check_line(errors, "this needs typer: pip install 'zerorate[cli]'")


class TestSimulate:
    @pytest.mark.parametrize("kind", ["csv", "tsv", "npz", "parquet"])
    def test_log_and_truth(self, cli, out, kind):
        file = out / f"sim.{kind}"
        assert cli("simulate", "mpu6050", "-o", file, "--duration", "20")[0] == 0
        log, truth = read_log(file), read_log(out / f"sim-truth.{kind}")
        assert log.names == ("gyro_x_radps", "gyro_y_radps", "gyro_z_radps")
        assert truth.names == ("drift_x_radps", "drift_y_radps", "drift_z_radps")
        assert (log.n, log.rate, log.unit) == (2000, 100.0, "rad/s")
        assert (log.data - truth.data).std() < 0.1

    def test_seed(self, cli, out):
        for name, seed in (("a", 1), ("b", 1), ("c", 2)):
            options = ("--duration", "2", "--seed", seed, "--axes", "1")
            assert cli("simulate", "MTi-100", "-o", out / f"{name}.npz", *options)[0] == 0
        a, b, c = (read_log(out / f"{name}.npz").data for name in "abc")
        np.testing.assert_array_equal(a, b)
        assert not np.array_equal(a, c)

    def test_list(self, cli):
        code, text, _ = cli("simulate", "--list")
        assert code == 0
        assert all(name in text for name in DEVICES)
        assert "data sheet" in text
        assert max(map(len, text.split("\n"))) <= 100

    @pytest.mark.parametrize(
        "arguments",
        [
            ("gizmo", "-o", "a.csv"),
            ("mpu6050", "-o", "a.xyz"),
            ("mpu6050", "-o", "nowhere/a.csv"),
            ("mpu6050", "-o", "a.csv", "--duration", "-1"),
            ("mpu6050", "-o", "a.csv", "--axes", "0"),
            ("mpu6050",),
        ],
    )
    def test_usage(self, cli, out, monkeypatch, arguments):
        monkeypatch.chdir(out)
        code, _, errors = cli("simulate", *arguments)
        assert code == 2
        assert errors.startswith("zerorate: ")
        assert names(out) == []

    def test_existing_truth_is_kept(self, cli, out):
        (out / "sim-truth.csv").write_text("old")
        assert cli("simulate", "mpu6050", "-o", out / "sim.csv", "--duration", "1")[0] == 2
        assert names(out) == ["sim-truth.csv"]


class TestDemo:
    def test_it_compares_with_the_truth(self, cli, out):
        code, text, errors = cli("demo", "-o", out, "--duration", "20")
        assert (code, errors) == (0, "")
        assert "true error" in text
        assert "Learned by auto" in text
        assert names(out) == ["demo-zerorate.parquet", "demo-zerorate.png"]
        assert cli("demo", "-o", out, "--duration", "20")[0] == 2
        assert cli("demo", "-o", out, "--duration", "20", "--force")[0] == 0

    def test_its_folder_is_made(self, cli, out):
        assert cli("demo", "-o", out / "new", "--duration", "5", "--device", "mti-100")[0] == 0
        assert cli("demo", "-o", out / "no" / "new", "--duration", "5")[0] == 2

    def test_unknown_device(self, cli, out):
        code, _, errors = cli("demo", "-o", out, "--device", "gizmo")
        assert code == 2
        assert "unknown device 'gizmo'" in errors


def test_an_interrupt_that_an_import_has_wrapped(monkeypatch, capsys):
    def interrupted(arguments):
        raise RuntimeError("Error calling __set_name__") from KeyboardInterrupt()

    monkeypatch.setattr("zerorate.cli.app.invoke", interrupted)
    assert run(["replay", "run.csv"]) == 130
    assert capsys.readouterr().err == "zerorate: interrupted\n"


def test_no_arguments_ask_for_help(cli):
    code, text, errors = cli()
    assert (code, errors) == (0, "")
    assert "replay" in text


def test_version_and_help(cli):
    assert cli("--version") == (0, f"zerorate {__version__}\n", "")
    code, text, _ = cli("replay", "--help")
    assert code == 0
    assert "--forgetting-factor" in text


@pytest.mark.parametrize("program", [("-m", "zerorate"), ("-m", "zerorate.cli")])
def test_as_a_program(program, log, out):
    if program[1] == "zerorate.cli":
        program = ("-c", "from zerorate.cli import main; main()")
    done = subprocess.run(
        [sys.executable, *program, "replay", log, "-o", out, "--no-figure"],
        capture_output=True,
        text=True,
    )
    assert (done.returncode, done.stderr) == (0, "")
    assert "wrote " in done.stdout


def test_faults_of_a_program(tmp_path):
    done = subprocess.run(
        [sys.executable, "-m", "zerorate", "replay", tmp_path / "nothing.csv"],
        capture_output=True,
        text=True,
    )
    assert (done.returncode, done.stdout) == (1, "")
    assert done.stderr == f"zerorate: {tmp_path / 'nothing.csv'} does not exist\n"
