"""``zerorate report``: a page and JSON in a folder, a paragraph, and one line for a fault."""

import json
from functools import partial

import numpy as np
import pytest

from support.commands import names, one_line
from support.logs import write_table

STEM = "run-zerorate-report"


@pytest.fixture
def cli(call):
    """Run ``zerorate report``; return its code, stdout and stderr."""
    return partial(call, "report")


def log(folder, kind="gyro"):
    t = np.arange(2000) / 100.0
    z = np.random.default_rng(1).normal(size=(2000, 3))
    columns = {f"{kind}_{axis}": z[:, i] for i, axis in enumerate("xyz")}
    return write_table(folder / "run.csv", {"time_s": t, **columns})


def test_a_page_and_its_numbers_are_written(cli, tmp_path):
    code, out, err = cli(log(tmp_path), "--unit", "deg/s", "-o", tmp_path / "out")
    assert (code, err) == (0, "")
    assert names(tmp_path / "out") == [f"{STEM}.html", f"{STEM}.json"]
    assert "run.csv: All within limits: " in out
    content = json.loads((tmp_path / "out" / f"{STEM}.json").read_text())
    assert content["findings"][0]["kind"] == "sensor"


def test_an_unknown_unit_is_worth_a_look_and_says_what_to_type(cli, tmp_path):
    code, out, _ = cli(log(tmp_path), "-o", tmp_path / "out")
    assert code == 0
    assert "look: gyro: its unit is not known" in out


def test_a_log_without_an_imu_is_one_line(cli, tmp_path):
    code, out, err = cli(log(tmp_path, "mag"), "-o", tmp_path / "out")
    assert (code, out) == (1, "")
    assert "a report needs a gyro or an accelerometer of three axes" in one_line(err)
    assert not (tmp_path / "out").exists()


def test_two_logs_go_on_one_page(cli, tmp_path):
    first = log(tmp_path)
    second = first.rename(tmp_path / "later.csv")
    code, out, err = cli(log(tmp_path), second, "--unit", "deg/s", "-o", tmp_path / "out")
    assert (code, err) == (0, "")
    assert names(tmp_path / "out") == [f"run-later-{STEM[4:]}.html", f"run-later-{STEM[4:]}.json"]
    assert "run.csv and later.csv: " in out
    assert " unchanged." in out
    code, _, err = cli(second, second, "--gnss", second, "-o", tmp_path / "other")
    assert code == 2
    assert "--gnss goes with one log, got two" in one_line(err)


@pytest.mark.parametrize(("level", "code"), [("none", 0), ("act", 1), ("look", 1)])
def test_fail_on_ends_with_1_and_a_line_a_finding(cli, level, code, tmp_path):
    t = np.arange(3000) / 100.0
    z = np.random.default_rng(2).normal(size=(3000, 3))
    z[::8] = np.nan
    path = write_table(
        tmp_path / "lost.csv",
        {"time_s": t, **{f"gyro_{axis}": z[:, i] for i, axis in enumerate("xyz")}},
    )
    ended, out, err = cli(path, "--unit", "deg/s", "--fail-on", level, "-o", tmp_path / "out")
    assert ended == code
    assert (".json\n\nact: gyro" in out) == bool(code)
    assert (f"--fail-on {level}" in err) == bool(code)
    # The page is written all the same.
    assert (tmp_path / "out" / "lost-zerorate-report.html").exists()
