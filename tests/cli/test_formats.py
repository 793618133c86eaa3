"""Every command reads every kind of file, and a topic where a recording has several."""

import sys

import h5py
import numpy as np
import pyarrow.feather as feather
import pytest
from pyarrow import table
from scipy.io import savemat

from support.bags import write_recording
from support.commands import check_line
from support.tables import miscounted
from support.ulogs import flight, write_ulog
from zerorate import read_log
from zerorate.cli import run
from zerorate.texts import describe_missing_extra

N = 4000
TIME = np.arange(N) / 100
GYRO = np.random.default_rng(1).standard_normal(N)
COMMANDS = {
    "replay": ["--no-figure"],
    "allan": ["--no-figure"],
    "identify": ["--no-figure", "--order", "1,0"],
    "compare": ["--methods", "auto"],
}


@pytest.fixture
def cli(capsys, tmp_path, monkeypatch):
    """Run a command in a folder of its own; return its code, stdout and stderr."""
    monkeypatch.chdir(tmp_path)

    def call(*arguments):
        code = run([str(argument) for argument in arguments])
        return code, *capsys.readouterr()

    return call


def written(folder, suffix):
    path = folder / f"run.{suffix}"
    columns = {"time_s": TIME, "gyro_x_dps": GYRO}
    if suffix == "feather":
        feather.write_feather(table(columns), path)
    elif suffix == "mat":
        savemat(path, columns)
    elif suffix == "ulg":
        write_ulog(path, flight(N))
    else:
        with h5py.File(path, "w") as file:
            file.update(columns)
    return path


@pytest.mark.parametrize("suffix", ["feather", "h5", "mat", "ulg"])
def test_a_replay_of_each_format(cli, tmp_path, suffix):
    code, text, errors = cli("replay", written(tmp_path, suffix), "--no-figure")
    assert (code, errors) == (0, "")
    assert "wrote run-zerorate.parquet" in text
    names = read_log(tmp_path / f"run.{suffix}").names
    assert read_log("run-zerorate.parquet").names == names


@pytest.mark.every(2)
@pytest.mark.parametrize("command", COMMANDS)
def test_the_topic_of_a_recording(cli, tmp_path, command):
    log = write_recording(tmp_path, "mcap", ["/left", "/right"], n=N)
    code, _, errors = cli(command, log, *COMMANDS[command], "--topic", "/right")
    assert (code, errors) == (0, "")
    code, _, errors = cli(command, log, *COMMANDS[command], "--force")
    assert (code, errors.count("\n")) == (1, 1)
    assert "2 topics hold sensor_msgs/msg/Imu; choose with --topic from: /left, /right" in errors


def test_faults_of_usage(cli, tmp_path, monkeypatch):
    log = write_recording(tmp_path, "folder", ["/left"])
    code, _, errors = cli("replay", log, "--topic", "/right")
    assert (code, errors.count("\n")) == (2, 1)
    assert "there is no topic '/right'" in errors
    code, _, errors = cli("replay", written(tmp_path, "h5"), "--topic", "/right")
    assert (code, errors.count("\n")) == (2, 1)
    assert "--topic chooses among the topics of a ROS recording" in errors
    monkeypatch.setitem(sys.modules, "rosbags", None)
    code, _, errors = cli("replay", log)
    assert (code, errors) == (
        2,
        f"zerorate: {describe_missing_extra('rosbags', 'ros', 'a ROS recording')}\n",
    )


@pytest.mark.parametrize("rows", [1, 63])
def test_a_miscounted_log_is_damaged_data(cli, tmp_path, rows):
    """What is made of it in pieces is room for so many rows."""
    path = miscounted(tmp_path / "run.parquet", rows)
    code, text, errors = cli("replay", path, "--no-figure")
    assert (code, text) == (1, "")
    check_line(errors, "run.parquet: cannot be read as Parquet: ")
    check_line(errors, f"it says that it has {rows} rows")
    assert [one.name for one in tmp_path.iterdir()] == ["run.parquet"]


def test_a_damaged_recording(cli, tmp_path):
    log = write_recording(tmp_path, "bag", ["/imu"])
    log.write_bytes(log.read_bytes()[:2000])
    code, _, errors = cli("replay", log)
    assert (code, errors.count("\n")) == (1, 1)
    assert "cannot be read as a ROS 1 bag: truncated, damaged or of a foreign kind" in errors
