"""What every command prints is as wide as the terminal, without colours, and answers first."""

import os
import pty
import struct
import subprocess
import sys
from fcntl import ioctl
from termios import TIOCSWINSZ

import numpy as np
import pytest

import zerorate as zr
from support.calibrations import write_imu
from support.logs import write_gyros

WIDTHS = (60, 80, 200)
# What each command answers: how its text begins.
FIRST = {
    "demo": "MPU-6050, simulated at rest",
    "replay": "Bias at the end, by auto",
    "allan": "gyro: overlapping Allan deviation",
    "stream": "gyro_x,",
    "batch": "2 logs done",
    "compare": "At rest",
    "identify": "gyro_x [deg/s]",
    "calibrate": "Calibration: ",
    "attitude": "Attitude of ",
    "navigate": "Track of ",
    "walk": "Walk of walk.csv, smoothed: ",
    "report": "hand.csv: All within limits: ",
    "formats": "hand.csv is read as text",
    "simulate": "Gyros that can be simulated",
}


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("logs")
    for name in ("run", "other"):
        write_gyros(folder / f"{name}.parquet", n=2500)
    write_imu(folder / "hand.csv", zr.simulate_motion("hand", duration=12.0, seed=3).recording())
    turns = zr.simulation.simulate_session(12, seed=3, rate=50.0, rest=4.0)
    write_imu(folder / "turns.csv", turns.recording)
    write_imu(folder / "walk.csv", zr.simulate_walk(100.0, strides=5).recording())
    drive = zr.simulate_drive(50.0, 110.0, seed=2, antenna=(0.5, 0.0, -1.0))
    imu = {f"gyro_{axis}_radps": drive.gyro[:, i] for i, axis in enumerate("xyz")}
    imu |= {f"accel_{axis}_mps2": drive.accel[:, i] for i, axis in enumerate("xyz")}
    table(folder / "imu.csv", {"time_s": drive.time, **imu})
    places = zip(("latitude_deg", "longitude_deg", "height_m"), drive.fixes.position.T, strict=True)
    ways = ("velocity_north_mps", "velocity_east_mps", "velocity_down_mps")
    speeds = zip(ways, drive.fixes.velocity.T, strict=True)
    table(folder / "fixes.csv", {"time_s": drive.fixes.time, **dict(places), **dict(speeds)})
    (folder / "lines.csv").write_text("gyro_x,gyro_y\n0.1,0.2\n0.1,0.3\n")
    return folder


def table(path, columns):
    rows = np.column_stack(list(columns.values()))
    np.savetxt(path, rows, delimiter=",", header=",".join(columns), comments="")


TYPED = {
    "demo": "--duration 30 --rate 20",
    "replay": "{}/run.parquet --no-figure --methods kf",
    "allan": "{}/run.parquet --no-figure",
    "stream": "{}/lines.csv --rate 100",
    "batch": "{}/run.parquet {}/other.parquet --workers 1",
    "compare": "{}/run.parquet --methods auto,kf --attitude none",
    "identify": "{}/run.parquet --no-figure --max-order 2 --columns gyro_x",
    "calibrate": "{}/turns.csv --no-figure",
    "attitude": "{}/hand.csv --no-figure --no-mag",
    "navigate": "{}/imu.csv {}/fixes.csv --no-figure --antenna 0.5,0,-1",
    "walk": "{}/walk.csv --no-figure --smooth",
    "report": "{}/hand.csv",
    "formats": "{}/hand.csv",
    "simulate": "--list",
}
NO_FILES = ("formats", "stream", "simulate", "compare")


@pytest.mark.every(3)
@pytest.mark.parametrize("width", WIDTHS)
@pytest.mark.parametrize("name", TYPED)
def test_lines_fit_and_the_answer_comes_first(call, folder, tmp_path, monkeypatch, name, width):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("COLUMNS", str(width))
    typed = TYPED[name].replace("{}", str(folder)).split()
    files = () if name in NO_FILES else ("-o", "out", "--force")
    _, text, errors = call(name, *typed, *files)
    assert text.startswith(FIRST[name]), errors
    # A path is never broken, and may be longer than any line.
    lines = [
        line for line in text.splitlines() if not line.lstrip("- ").startswith(("wrote ", "/"))
    ]
    assert max(map(len, lines)) <= width, max(lines, key=len)
    for told in (text, call(name, "--help")[1], call(name, "--help-all")[1]):
        assert "\x1b" not in told
    assert max(map(len, call(name, "--help-all")[1].splitlines())) <= max(width, 100)


def test_in_a_terminal_of_80_columns_without_colours(folder, tmp_path):
    master, slave = pty.openpty()
    ioctl(slave, TIOCSWINSZ, struct.pack("HHHH", 24, 80, 0, 0))
    environment = {name: value for name, value in os.environ.items() if name != "COLUMNS"}
    command = [sys.executable, "-m", "zerorate", "replay", str(folder / "run.parquet")]
    done = subprocess.run(
        [*command, "--no-figure", "-o", str(tmp_path)],
        stdout=slave,
        stderr=subprocess.PIPE,
        env={**environment, "NO_COLOR": "1"},
        check=True,
    )
    os.close(slave)
    text = os.read(master, 1 << 16).decode()
    assert (done.stderr, "\x1b" in text) == (b"", False)
    assert "bias, deg/s" in text
    assert "K, deg/h" not in text
    assert np.max([len(line) for line in text.splitlines() if "wrote" not in line]) <= 80
