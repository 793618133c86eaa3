"""``zerorate identify``: tables, page and numbers, and for every fault one line and a code."""

import json
import re
from functools import partial
from html.parser import HTMLParser

import numpy as np
import pytest

import zerorate as zr
from support.commands import names, one_line
from support.logs import write_table
from support.recordings import RECORDINGS, needs_recordings
from zerorate import NoiseModel
from zerorate.identification import ArmaModel, identify
from zerorate.show.tables import WIDTH

RATE = 100.0
STEM = "run-zerorate-identify"


def signal(n=4000, axes=3):
    model = NoiseModel(angle_random_walk=1e-4, bias_instability=2e-5)
    return zr.simulate(model, RATE, n / RATE, seed=1, axes=axes)[0]


@pytest.fixture
def log(tmp_path):
    z = signal()
    return write_table(
        tmp_path / "run.csv", {f"gyro_{x}_radps": z[:, i] for i, x in enumerate("xyz")}
    )


@pytest.fixture
def cli(call):
    """Run ``zerorate identify``; return its code, stdout and stderr."""
    return partial(call, "identify")


class Page(HTMLParser):
    """The tags that are open, which must nest, and every address in the document."""

    VOID = ("meta", "img", "link", "br")

    def __init__(self, text):
        super().__init__()
        self.open, self.addresses, self.tags = [], [], []
        self.feed(text)
        self.close()

    def handle_starttag(self, tag, attrs):
        self.tags.append(tag)
        self.addresses += [value for name, value in attrs if name in ("src", "href")]
        if tag not in self.VOID:
            self.open.append(tag)

    def handle_endtag(self, tag):
        assert self.open.pop() == tag


class TestText:
    def test_every_axis_has_its_tables_and_verdict(self, cli, log, out):
        code, text, errors = cli(log, "-o", out)
        assert (code, errors) == (0, "")
        assert names(out) == [f"{STEM}.html", f"{STEM}.json"]
        for axis in "xyz":
            assert f"\ngyro_{axis}_radps [rad/s]\n" in f"\n{text}"
        for part in (
            "Record",
            "Tests",
            "Orders of AR models",
            "Orders of ARMA",
            "Coefficients",
            "Verdict",
        ):
            assert len(re.findall(f"^{part}", text, re.MULTILINE)) == 3
        assert f"wrote {out / STEM}.html" in text
        assert max(map(len, text.replace(str(out), "").split("\n"))) <= WIDTH

    def test_the_values_are_those_of_the_library(self, cli, log, out):
        cli(log, "-o", out, "--no-figure", "--columns", "gyro_y_radps")
        content = json.loads((out / f"{STEM}.json").read_text(), parse_constant=pytest.fail)
        z = zr.read_log(log).data[:, 1]
        assert list(content["axes"]) == ["gyro_y_radps"]
        found = identify(z, RATE, name="gyro_y_radps", unit="rad/s")
        assert content["axes"]["gyro_y_radps"] == found.to_dict()
        assert content["source"] == "run.csv"

    @pytest.mark.parametrize(
        ("options", "expected"),
        [
            (("--order", "2,1"), "ARMA(2, 1) was requested"),
            (("--criterion", "bic"), "BIC chooses"),
            (("--max-order", "4"), "Orders of AR models"),
            (("--segments", "20"), "20 segments"),
            (("--smooth", "5"), "Smoothed over 5 samples"),
            (("--outliers", "hampel"), "outlier"),
            (("--outliers", "moving-average"), "outlier"),
            (("--trend", "linear"), "straight line was taken off"),
            (("--decimate", "4"), "one sample of 4 kept"),
            (("--estimator", "exact", "--order", "1,1"), "exact"),
        ],
    )
    def test_every_option_tells(self, cli, log, out, options, expected):
        # An option that changes nothing would leave the plain text.
        chosen = ("--columns", "gyro_x_radps", "--no-figure", "--force")
        plain = cli(log, "-o", out, *chosen)[1]
        code, text, errors = cli(log, "-o", out, *chosen, *options)
        assert (code, errors) == (0, "")
        assert expected in one_line(text)
        assert text != plain

    def test_long_names_and_numbers_fit(self, cli, tmp_path, out):
        z = 1e7 + 1e-3 * signal(2000, 1)
        name = "a_very_long_prefix_of_a_message_" * 3 + "gyro_x_dps"
        code, text, _ = cli(write_table(tmp_path / "run.csv", {name: z}), "-o", out, "--no-figure")
        assert code == 0
        assert max(map(len, text.replace(str(out), "").split("\n"))) <= WIDTH

    def test_gaps_are_counted(self, cli, tmp_path, out):
        z = signal(4000, 1).ravel()
        z[500:520] = np.nan
        path = write_table(tmp_path / "run.csv", {"gyro_x_radps": z})
        _, text, _ = cli(path, "-o", out, "--no-figure")
        assert "20, which leaves 2 stretches" in text


class TestFiles:
    def test_the_page_stands_alone(self, cli, log, out):
        cli(log, "-o", out)
        text = (out / f"{STEM}.html").read_text(encoding="utf-8")
        page = Page(text)
        assert page.open == []
        assert page.tags.count("section") == page.tags.count("img") == 3
        assert "script" not in page.tags
        assert all(
            address.startswith(("#", "data:image/svg+xml;base64,")) for address in page.addresses
        )
        assert "@import" not in text
        # A figure is some 200 kB whatever the record's length.
        assert len(text) < 3 * 500_000

    def test_names_are_escaped(self, cli, tmp_path, out):
        path = write_table(tmp_path / "run.csv", {"gyro_x<b>_dps": signal(2000, 1).ravel()})
        code, _, errors = cli(path, "-o", out, "--no-figure", "--columns", "1")
        assert (code, errors) == (0, "")
        text = (out / f"{STEM}.html").read_text(encoding="utf-8")
        assert "gyro_x&lt;b&gt;_dps" in text
        assert "<b>" not in text

    def test_without_figures(self, cli, log, out):
        cli(log, "-o", out, "--no-figure")
        assert "img" not in Page((out / f"{STEM}.html").read_text(encoding="utf-8")).tags

    def test_models_are_read_back(self, cli, log, out):
        cli(log, "-o", out, "--no-figure", "--order", "2,1")
        axes = json.loads((out / f"{STEM}.json").read_text())["axes"]
        for axis in axes.values():
            model = ArmaModel.from_json(json.dumps(axis["models"]["arma"]))
            assert model.order == (2, 1)
            assert model.sigma2 > 0.0

    def test_the_same_log_gives_the_same_files(self, cli, log, out):
        options = (log, "-o", out, "--columns", "gyro_x_radps")
        cli(*options)
        first = [path.read_bytes() for path in sorted(out.iterdir())]
        cli(*options, "--force")
        assert [path.read_bytes() for path in sorted(out.iterdir())] == first

    def test_all_or_none(self, cli, log, out):
        (out / f"{STEM}.json").write_text("old")
        code, _, errors = cli(log, "-o", out, "--no-figure")
        assert code == 2
        assert "pass --force" in errors
        assert names(out) == [f"{STEM}.json"]
        assert cli(log, "-o", out, "--no-figure", "--force")[0] == 0
        assert len(names(out)) == 2

    def test_a_full_disk_leaves_nothing(self, cli, log, out, monkeypatch):
        def fail(*_):
            raise OSError(28, "No space left on device")

        monkeypatch.setattr("zerorate.record.atomic._flush", fail)
        code, _, errors = cli(log, "-o", out, "--no-figure")
        assert (code, names(out)) == (1, [])
        assert errors == f"zerorate: {out}: No space left on device\n"

    def test_an_interrupt_leaves_nothing(self, cli, log, out, monkeypatch):
        def interrupted(*_):
            raise KeyboardInterrupt

        monkeypatch.setattr("concurrent.futures.Future.result", interrupted)
        code, text, errors = cli(log, "-o", out, "--no-figure")
        assert (code, text, errors) == (130, "", "zerorate: interrupted\n")
        assert names(out) == []


USAGE = {
    "order": (("--order", "two"), "--order takes two numbers p,q such as 2,1"),
    "order beyond": (("--order", "200,1"), "p"),
    "criterion": (("--criterion", "dic"), "got 'dic'"),
    "max order": (("--max-order", "-1"), "--max-order must be 0 to"),
    "max order beyond": (("--max-order", "9999"), "--max-order must be 0 to"),
    "segments": (("--segments", "1"), "segments"),
    "smooth": (("--smooth", "0"), "smooth"),
    "outliers": (("--outliers", "all"), "got 'all'"),
    "trend": (("--trend", "cubic"), "got 'cubic'"),
    "decimate": (("--decimate", "0"), "decimate"),
    "decimate beyond": (("--decimate", "100"), "decimation"),
    "method": (("--estimator", "guess"), "got 'guess'"),
    "unit": (("--unit", "furlong"), "unknown unit 'furlong'"),
    "rate": (("--rate", "-5"), "rate"),
    "columns": (("--columns", "gyro_q"), "there is no column 'gyro_q'"),
    "folder": (("-o", f"{__file__}/out"), "is not a folder"),
}

DATA = {
    "too short": (np.arange(199.0), "column 'gyro_x_dps': identification needs at least 200"),
    "no sample": (np.full(300, np.nan), "column 'gyro_x_dps': z holds no finite sample"),
    "constant": (np.full(300, 2.5), "needs samples that differ, all 300 are 2.5"),
}


BROKEN = {
    "constant": (np.full(3000, 2.5), "needs samples that differ, all 3000 are 2.5"),
    "missing": (np.full(3000, np.nan), "z holds no finite sample"),
    "sparse": (np.where(np.arange(3000) % 10, np.nan, np.arange(3000) % 7), "segments"),
    "a ramp": (0.5 * np.arange(3000), "without any noise to estimate"),
    "a spike": (np.where(np.arange(3000) == 9, 1.0, 0.0), "without any noise to estimate"),
}


class TestAxes:
    @pytest.mark.every(6)
    @pytest.mark.parametrize("name", BROKEN)
    @pytest.mark.parametrize("place", [0, 1])
    def test_what_cannot_be_modelled_is_left_out_and_named(self, cli, tmp_path, out, name, place):
        z, reason = BROKEN[name]
        good = np.random.default_rng(1).standard_normal(3000)
        both = [("gyro_x_dps", good), ("gyro_y_dps", good)]
        both[place] = (both[place][0], z)
        code, text, errors = cli(write_table(tmp_path / "run.csv", dict(both)), "-o", out)
        assert (code, errors) == (0, "")
        assert f"{both[place][0]} is left out: " in one_line(text)
        assert reason in one_line(text)
        content = json.loads((out / "run-zerorate-identify.json").read_text())
        assert list(content["axes"]) == [both[1 - place][0]]
        assert any(reason in note for note in content["notes"])
        assert reason in (out / "run-zerorate-identify.html").read_text(encoding="utf-8")

    def test_a_sensor_that_stuck_after_a_gap_is_drawn(self, cli, tmp_path, out):
        z = np.random.default_rng(1).standard_normal(5000)
        z[2000], z[2001:] = np.nan, 0.3
        code, text, errors = cli(write_table(tmp_path / "run.csv", {"gyro_x_dps": z}), "-o", out)
        assert (code, errors) == (0, "")
        assert "gyro_x_dps" in text
        assert "<figure>" in (out / "run-zerorate-identify.html").read_text(encoding="utf-8")


class TestFaults:
    @pytest.mark.parametrize("name", USAGE)
    def test_usage(self, cli, log, out, name):
        options, match = USAGE[name]
        code, text, errors = cli(log, "-o", out, *options)
        assert (code, text, names(out)) == (2, "", [])
        assert errors.startswith("zerorate: ")
        assert errors.count("\n") == 1
        assert match in errors

    @pytest.mark.parametrize("name", DATA)
    def test_data(self, cli, tmp_path, out, name):
        z, match = DATA[name]
        path = write_table(tmp_path / "run.csv", {"gyro_x_dps": z})
        code, text, errors = cli(path, "-o", out)
        assert (code, text, names(out)) == (1, "", [])
        assert errors.count("\n") == 1
        assert match in errors
        assert "others are chosen with --columns" in errors

    def test_every_column_has_its_reason(self, cli, tmp_path, out):
        spiked = np.random.default_rng(1).standard_normal(3000)
        spiked[33] = 3.4e38
        columns = {"gyro_x": spiked, "gyro_y": np.full(3000, 1.5)}
        code, text, errors = cli(write_table(tmp_path / "run.csv", columns), "-o", out)
        assert (code, errors.count("\n")) == (1, 1)
        assert text.endswith(
            "gyro_y: 1.5 in every sample while the other axes change: a dead axis\n\n"
        )
        assert "'gyro_x': identification needs samples of similar size: sample 33" in errors
        assert "--outliers can replace it" in errors
        assert "'gyro_y': identification needs samples that differ" in errors

    def test_a_missing_file(self, cli, tmp_path, out):
        code, _, errors = cli(tmp_path / "none.csv", "-o", out)
        assert (code, errors.count("\n")) == (1, 1)
        assert "none.csv" in errors


@needs_recordings
def test_a_recording(cli, out):
    path = RECORDINGS / "mpu6050_static_100hz.parquet"
    code, text, errors = cli(path, "-o", out, "--rate", RATE, "--no-figure")
    assert (code, errors) == (0, "")
    assert one_line(text).count("Fit for modelling") == 3
