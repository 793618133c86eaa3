"""``zerorate walk``: a table, a log, a figure, maps where the start is told."""

import json
from functools import partial

import numpy as np
import pytest

import zerorate as zr
from support.calibrations import write_imu
from support.commands import names, one_line

STEM = "foot-zerorate-walk"


@pytest.fixture
def cli(call):
    """Run ``zerorate walk``; return its code, stdout and stderr."""
    return partial(call, "walk")


@pytest.fixture(scope="module")
def foot(tmp_path_factory):
    path = tmp_path_factory.mktemp("logs") / "foot.csv"
    write_imu(path, zr.simulate_walk(100.0, strides=8, seed=1, gyro_range=6.5).recording())
    return path


def test_all_that_is_written(cli, foot, out):
    typed = ("--floor", "level", "--smooth", "--at", "48.1,11.6", "--heading", "90")
    code, message, errors = cli(foot, *typed, "-o", out)
    assert (code, errors) == (0, "")
    assert names(out) == [f"{STEM}.{end}" for end in ("geojson", "gpx", "parquet", "png")]
    assert message.startswith("Walk of foot.csv, smoothed: 10.")
    assert "gyro y is clipped at 372 deg/s" in " ".join(message.split())
    line = json.loads((out / f"{STEM}.geojson").read_text())["features"][0]["geometry"]
    east, north = np.ptp(np.array(line["coordinates"])[:, :2], axis=0)
    assert east > 10.0 * north
    assert zr.read_log(out / f"{STEM}.parquet", columns=["x_m", "y_m", "z_m"]).n == len(
        line["coordinates"]
    )


def test_without_a_start_there_are_no_maps(cli, foot, out):
    code, message, _ = cli(foot, "--no-figure", "--clipped", "leave", "-o", out)
    assert (code, names(out)) == (0, [f"{STEM}.parquet"])
    assert "clipped" not in message


def test_a_machine_is_refused_in_a_line(cli, tmp_path, out):
    walk = zr.simulate_walk(100.0, strides=5)
    slow = {"gyro_x_radps": walk.gyro[:, 0], "time_s": walk.time}
    for i, axis in enumerate("xyz"):
        slow[f"gyro_{axis}_radps"] = 0.1 * walk.gyro[:, i]
        slow[f"accel_{axis}_mps2"] = walk.accel[:, i]
    rows = np.column_stack(list(slow.values()))
    path = tmp_path / "cart.csv"
    np.savetxt(path, rows, delimiter=",", header=",".join(slow), comments="")
    code, _, errors = cli(path, "-o", out)
    assert (code, names(out)) == (1, [])
    assert "--assume-foot navigates it in spite of this" in one_line(errors)
    assert "this sensor is not on a foot" in one_line(errors)


def test_attitude_restores_what_is_certainly_clipped_and_says_so(call, foot, tmp_path):
    def told(*typed):
        code, text, errors = call("attitude", foot, "--no-figure", "--no-mag", *typed)
        assert (code, errors) == (0, "")
        return text.splitlines()

    where = f"{foot.name}: gyro y is clipped at 372 deg/s in "
    options = ("-o", tmp_path, "--force")
    first = told(*options)[0]
    assert where in first
    assert first.endswith(", and restored from its flanks: --clipped leave leaves it")
    assert "clipped" not in "".join(told("--clipped", "leave", *options))
