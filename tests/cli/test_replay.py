"""``zerorate replay``: files and tables, and for every fault one line and an exit code."""

import math
import os
from functools import partial

import numpy as np
import pytest

from support.commands import check_line, names, one_line
from support.logs import write_gyros, write_table
from zerorate import DriftFilter, read_log
from zerorate.texts import describe_missing_extra

LIMITS = {"rest_limit": 10.0, "bias_limit": 20.0}
"""What the command takes where the data are in deg/s."""


@pytest.fixture
def cli(call):
    """Run ``zerorate replay``; return its code, stdout and stderr."""
    return partial(call, "replay")


@pytest.fixture
def log(tmp_path):
    return write_gyros(tmp_path / "run.parquet")


class TestReplay:
    def test_it_writes_a_filtered_log_and_a_figure(self, cli, log, out):
        code, text, errors = cli(log, "-o", out)
        assert (code, errors) == (0, "")
        assert names(out) == ["run-zerorate.parquet", "run-zerorate.png"]
        assert f"wrote {out / 'run-zerorate.parquet'}" in text
        raw, filtered = read_log(log), read_log(out / "run-zerorate.parquet")
        assert (filtered.names, filtered.rate, filtered.unit) == (raw.names, raw.rate, raw.unit)
        alone = DriftFilter(100.0, method="auto", output="compensated", channels=2, **LIMITS)
        np.testing.assert_array_equal(filtered.data, alone.process(raw.data))

    def test_options_that_act_on_the_baselines_alone_are_told(self, cli, log, out):
        options = ("--order", "3,1", "--fading", "0.9", "--startup", "2", "--no-figure")
        options += ("--methods", "kf,fading")
        code, text, errors = cli(log, "-o", out, *options)
        assert (code, errors) == (0, "")
        told = "--order, --fading have no effect on auto, only on the methods that the table"
        assert text.endswith(f"\n{told} compares it with\n")

    def test_several_logs_have_one_table(self, cli, log, tmp_path, out):
        other = write_gyros(tmp_path / "other.parquet")
        code, text, _ = cli(log, other, "-o", out, "--no-figure")
        assert code == 0
        assert names(out) == ["other-zerorate.parquet", "run-zerorate.parquet"]
        first = [line.split()[0] for line in text.split("\n")[2:6]]
        assert first == ["run.parquet", "gyro_y", "other.parquet", "gyro_y"]
        assert cli(log, other, "-o", out, "--force", "--figure-format", "svg")[0] == 0
        assert "replay-zerorate-overlay.svg" in names(out)
        code, _, errors = cli(log, other, "-o", out, "--figure-format", "svg")
        assert (code, "exists already; pass --force" in errors) == (2, True)
        code, _, errors = cli(log, other, "-o", out / "a.parquet")
        assert (code, "takes a folder for several logs" in errors) == (2, True)
        code, _, errors = cli(log, log, "-o", out)
        assert (code, "two logs have the same name" in errors) == (2, True)

    @pytest.mark.parametrize("typed", ["ekf", "", "kf,,akf"])
    def test_methods_that_there_are_not(self, cli, log, out, typed):
        code, _, errors = cli(log, "-o", out, "--methods", typed)
        assert code == 2
        assert errors.startswith("zerorate: --methods takes ")

    @pytest.mark.parametrize(
        ("options", "told"),
        [
            (
                ("--method", "kf", "--fading", "0.9"),
                "--fading has no effect on method 'kf', only on 'fading'",
            ),
            (
                ("--order", "3,1"),
                "--order has no effect on method 'auto', only on 'kf', 'akf', 'fading' and "
                "'robust'",
            ),
            (
                ("--fading", "0.97"),
                "--fading has no effect on method 'auto', only on 'fading'",
            ),
        ],
    )
    def test_options_that_no_method_uses_are_refused(self, cli, log, out, options, told):
        assert cli(log, "-o", out, *options) == (2, "", f"zerorate: {told}\n")
        assert names(out) == []

    def test_options_of_the_baselines_reach_them_alone(self, cli, log, out):
        asked = (log, "-o", out, "--no-figure", "--methods", "kf,akf,fading")
        text, other = cli(*asked)[1], cli(*asked, "--fading", "0.5", "--force")[1]
        tables = [t.partition("Bias as each")[2].split("\n")[3:8] for t in (text, other)]
        rows = [[line.split()[-6:] for line in table] for table in tables]
        same = [one == another for one, another in zip(*rows, strict=True)]
        assert same == [True, True, True, False, True]

    @pytest.mark.parametrize("kind", ["parquet", "csv"])
    def test_bias_and_rest_stand_beside_the_compensated_rate(self, cli, log, out, kind):
        code, text, _ = cli(log, "-o", out, "--no-figure", "--format", kind)
        assert code == 0
        assert "Bias at the end, by auto" in text
        trace = DriftFilter(100.0, method="auto", channels=2, **LIMITS).trace(read_log(log).data)
        columns = ["bias_gyro_x_dps", "bias_sigma_gyro_y_dps", "at_rest_gyro_y"]
        beside = [read_log(out / f"run-zerorate.{kind}", columns=name) for name in columns]
        expected = [trace.bias[:, 0], trace.bias_sigma[:, 1], trace.at_rest[:, 1]]
        for one, values in zip(beside, expected, strict=True):
            np.testing.assert_array_equal(one.data[:, 0], values)

    def test_arrays_beside_the_compensated_rate(self, cli, log, out):
        assert cli(log, "-o", out, "--no-figure", "--format", "npz")[0] == 0
        trace = DriftFilter(100.0, method="auto", channels=2, **LIMITS).trace(read_log(log).data)
        with np.load(out / "run-zerorate.npz") as arrays:
            np.testing.assert_array_equal(arrays["bias_gyro_x_dps"], trace.bias[:, 0])
            np.testing.assert_array_equal(arrays["at_rest_gyro_y"], trace.at_rest[:, 1])

    @pytest.mark.parametrize("method", ["auto", "kf"])
    @pytest.mark.parametrize("kind", ["estimate", "compensated"])
    @pytest.mark.parametrize("motion", ["hold", "ignore"])
    def test_output_and_motion(self, cli, log, out, method, kind, motion):
        options = ("--method", method, "--output-kind", kind, "--motion", motion)
        assert cli(log, "-o", out, "--no-figure", *options)[0] == 0
        raw = read_log(log)
        limits = LIMITS if (method, motion) == ("auto", "hold") else {}
        alone = DriftFilter(100.0, method=method, output=kind, motion=motion, channels=2, **limits)
        filtered = read_log(out / "run-zerorate.parquet")
        np.testing.assert_array_equal(filtered.data, alone.process(raw.data))

    def test_options_reach_the_filter(self, cli, log, out):
        options = "--order 1,1 --method akf --adapt-for always --forgetting-factor 0.999 "
        options += "--process-noise 0.01 --startup 2 --noise hadamard --no-figure --columns 1"
        assert cli(log, "-o", out, *options.split())[0] == 0
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

    @pytest.mark.parametrize(
        ("given", "limits"),
        [
            ("", LIMITS),
            ("--rest-limit 2 --bias-limit none", {"rest_limit": 2.0}),
            ("--rest-limit none --bias-limit none --limit 200", {"limit": 200.0}),
            ("--rest-limit none --motion ignore", {"motion": "ignore"}),
        ],
    )
    def test_limits_of_rest_and_of_the_range(self, cli, tmp_path, out, given, limits):
        z = 0.5 + 0.1 * np.random.default_rng(4).standard_normal((3000, 1))
        z[:1000] += 60.0
        z[2000:2010] = 200.0
        log = write_table(tmp_path / "run.csv", {"gyro_x_dps": z[:, 0]})
        code, text, errors = cli(log, "-o", out, "--no-figure", *given.split())
        assert (code, errors) == (0, "")
        alone = DriftFilter(100.0, method="auto", output="compensated", channels=1, **limits)
        filtered = read_log(out / "run-zerorate.parquet")
        np.testing.assert_array_equal(filtered.data, alone.process(z))
        saturated = "saturated, at or beyond the limit of 200, so missing: gyro_x_dps 10 of 3000"
        assert (saturated in one_line(text)) == ("limit" in limits)

    def test_limits_are_in_the_unit_of_the_log(self, cli, tmp_path, out):
        log = write_gyros(tmp_path / "run.parquet", unit="rad/s")
        assert cli(log, "-o", out, "--no-figure")[0] == 0
        limits = {name: math.radians(limit) for name, limit in LIMITS.items()}
        alone = DriftFilter(100.0, method="auto", output="compensated", channels=2, **limits)
        filtered = read_log(out / "run-zerorate.parquet")
        np.testing.assert_array_equal(filtered.data, alone.process(read_log(log).data))

    def test_flags_stand_beside_the_compensated_rate(self, cli, tmp_path, out):
        z = 0.5 + 0.1 * np.random.default_rng(4).standard_normal((3000, 1))
        z[1000:1500] = z[1000]
        z[2000:2010] = 250.0
        log = write_table(tmp_path / "run.csv", {"gyro_x_dps": z[:, 0]})
        assert cli(log, "-o", out, "--no-figure", "--limit", 250)[0] == 0
        alone = DriftFilter(100.0, method="auto", limit=250.0, channels=1, **LIMITS)
        trace = alone.trace(z)
        for name, expected in (("stuck", trace.stuck), ("saturated", trace.saturated)):
            found = read_log(out / "run-zerorate.parquet", columns=f"{name}_gyro_x")
            np.testing.assert_array_equal(found.data, expected)
            assert expected.any()

    @pytest.mark.parametrize(("kind", "figure"), [("csv", "svg"), ("npz", "pdf")])
    def test_formats(self, cli, log, out, kind, figure):
        assert cli(log, "-o", out, "--format", kind, "--figure-format", figure)[0] == 0
        assert names(out) == sorted([f"run-zerorate.{kind}", f"run-zerorate.{figure}"])
        assert read_log(out / f"run-zerorate.{kind}").n == 1500

    def test_columns_by_name(self, cli, log, out):
        columns = "gyro_y,gyro_x"
        assert cli(log, "-o", out, "--no-figure", "--columns", columns)[0] == 0
        assert read_log(out / "run-zerorate.parquet").names == ("gyro_y", "gyro_x")

    def test_force_replaces(self, cli, log, out):
        (out / "run-zerorate.png").write_text("old")
        assert cli(log, "-o", out)[0] == 2
        assert names(out) == ["run-zerorate.png"]
        assert cli(log, "-o", out, "--force")[0] == 0
        assert (out / "run-zerorate.png").read_bytes().startswith(b"\x89PNG")

    def test_default_folder_is_the_current_one(self, cli, log, out, monkeypatch):
        monkeypatch.chdir(out)
        assert cli(log, "--no-figure")[0] == 0
        assert names(out) == ["run-zerorate.parquet"]

    @pytest.mark.every(3)
    @pytest.mark.parametrize("n", [1, 2, 20])
    def test_short_records_are_filtered_as_far_as_it_goes(self, cli, tmp_path, out, n):
        short = write_gyros(tmp_path / "short.npz", n=n)
        code, text, _ = cli(short, "-o", out)
        assert code == 0
        assert f"has {n}: no noise" in " ".join(text.split())

    def test_gaps_are_told(self, cli, tmp_path, out):
        gaps = write_gyros(tmp_path / "gaps.parquet", missing=slice(100, 200))
        code, text, _ = cli(gaps, "-o", out, "--no-figure")
        assert code == 0
        assert "gyro_x 100" in text


DATA_FAULTS = {
    "missing file": ("nothing.csv", None, (), "does not exist"),
    "folder": (".", None, (), "is a folder"),
    "empty": ("a.csv", b"", (), "the file is empty"),
    "binary": ("a.csv", b"\x00\x01\x02" * 50, (), "expected"),
    "damaged parquet": ("a.parquet", b"PAR1" + b"\x00" * 50, (), "truncated, damaged"),
    "unknown suffix": ("a.xyz", b"1,2\n", (), "unknown suffix"),
    "text in a row": ("a.csv", b"time_s,gyro_x\n0,1\n0.1,a\n0.2,2\n", (), "is not a number"),
    "no gyro": ("a.csv", b"time_s,temp\n0,1\n0.1,2\n", (), "choose with --columns"),
    "no rate": ("a.csv", b"gyro_x,gyro_y\n0,1\n1,2\n", (), "give --rate in Hz"),
    "other rate": ("a.csv", b"t_s,gyro_x\n0,1\n1,2\n2,3\n", ("--rate", "5"), "stated as 5 Hz"),
}

USAGE_FAULTS = {
    "no such option": (
        ("--colour",),
        "there is no option --colour; zerorate replay --help lists all",
    ),
    "method": (("--method", "median"), "got 'median'"),
    "motion": (("--motion", "stop"), "got 'stop'"),
    "output kind": (("--output-kind", "bias"), "got 'bias'"),
    "noise": (("--noise", "pink"), "got 'pink'"),
    "format": (("--format", "xls"), "got 'xls'"),
    "figure format": (("--figure-format", "gif"), "got 'gif'"),
    "unit": (("--unit", "furlong"), "unknown unit 'furlong'"),
    "rate": (("--rate", "-5"), "rate"),
    "rate no number": (("--rate", "fast"), "--rate"),
    "order": (("--order", "2"), "--order takes two numbers"),
    "order too high": (("--order", "9,1"), "order"),
    "fading": (("--fading", "2"), "fading"),
    "adapt for": (("--adapt-for", "soon"), "--adapt-for takes a number or 'always'"),
    "forgetting": (("--forgetting-factor", "0"), "forgetting"),
    "startup": (("--startup", "-1"), "startup"),
    "rest limit": (("--rest-limit", "-1"), "--rest-limit must be a positive number, got -1"),
    "rest limit no number": (("--rest-limit", "low"), "--rest-limit takes a number or 'none'"),
    "rest limit of kf": (("--method", "kf", "--rest-limit", "3"), "no effect on method 'kf', only"),
    "rest limit of all": (
        ("--rest-limit", "3", "--motion", "ignore"),
        "--rest-limit has no effect on motion 'ignore', only on 'hold'",
    ),
    "bias limit": (("--bias-limit", "0"), "--bias-limit must be a positive number, got 0"),
    "limit": (("--limit", "-250"), "--limit must be a positive number, got -250"),
    "limit no number": (("--limit", "abc"), "--limit takes a number"),
    "outliers": (("--outliers", "drop"), "got 'drop'"),
    "columns": (("--columns", "gyro_q"), "there is no column 'gyro_q'"),
    "index": (("--columns", "77"), "there is no column 77"),
    "empty column": (("--columns", "a,,b"), "--columns takes names or indices"),
    "twice": (("--columns", "1,1"), "--columns names a column twice"),
    "folder": (("-o", f"{__file__}/out"), "is not a folder"),
}


class TestFaults:
    @pytest.mark.parametrize("name", DATA_FAULTS)
    def test_data(self, cli, tmp_path, out, name):
        file, content, options, match = DATA_FAULTS[name]
        if content is not None:
            (tmp_path / file).write_bytes(content)
        code, text, errors = cli(tmp_path / file, "-o", out, *options)
        assert (code, text) == (1, "")
        check_line(errors, match)
        assert names(out) == []

    @pytest.mark.parametrize("name", USAGE_FAULTS)
    def test_usage(self, cli, log, out, name):
        options, match = USAGE_FAULTS[name]
        code, text, errors = cli(log, "-o", out, *options)
        assert (code, text) == (2, "")
        check_line(errors, match)
        assert names(out) == []

    def test_all_missing(self, cli, tmp_path, out):
        empty = write_gyros(tmp_path / "empty.npz", missing=slice(None))
        code, _, errors = cli(empty, "-o", out)
        assert code == 1
        check_line(errors, "no axis has a sample")
        assert names(out) == []

    def test_existing_output_is_refused_before_any_work(self, cli, tmp_path, out):
        (out / "nothing-zerorate.parquet").write_text("old")
        code, _, errors = cli(tmp_path / "nothing.csv", "-o", out)
        assert code == 2
        check_line(errors, "exists already; pass --force to replace it")

    def test_folder_that_is_a_file(self, cli, log):
        code, _, errors = cli(log, "-o", log / "out")
        assert code == 2
        check_line(errors, "is not a folder")

    def test_folder_not_writable(self, cli, log, out, monkeypatch):
        # Not by chmod: root may write anywhere.
        monkeypatch.setattr(os, "access", lambda _, mode: not mode & os.W_OK)
        code, _, errors = cli(log, "-o", out)
        assert code == 2
        check_line(errors, "is not writable")

    def test_full_disk(self, cli, log, out, monkeypatch):
        def fail(*_, **__):
            raise OSError(28, "No space left on device")

        monkeypatch.setattr("zerorate.tasks.replay.task.write_log", fail)
        code, _, errors = cli(log, "-o", out)
        assert code == 1
        check_line(errors, "No space left on device")
        assert names(out) == []

    @pytest.mark.parametrize(("module", "extra"), [("matplotlib", "plot"), ("pyarrow", "io")])
    def test_missing_extras(self, cli, log, out, monkeypatch, module, extra):
        monkeypatch.setattr("zerorate.cli.errors.find_spec", lambda name: None)
        options = () if module == "pyarrow" else ("--format", "csv")
        code, _, errors = cli(log, "-o", out, *options)
        assert code == 2
        check_line(errors, describe_missing_extra(module, extra))


def test_all_panels_of_the_figure(cli, log, out):
    """The usual ones are a column of a page wide, all of them two."""
    widths = []
    for chosen in ("usual", "all"):
        assert cli(log, "-o", out, "--force", "--figure", chosen)[0] == 0
        (figure,) = out.glob("*.png")
        # Where a PNG has its width.
        widths.append(int.from_bytes(figure.read_bytes()[16:20]))
    assert widths[0] == 850
    assert widths[1] > 850
    code, _, errors = cli(log, "-o", out, "--force", "--figure", "all", "--no-figure")
    assert code == 2
    assert "--figure all has no effect with --no-figure" in errors
