"""The example with which the help of each command begins runs on files of these names."""

import shlex

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

import zerorate as zr
from support.inside import called
from support.logs import write_gyros, write_table
from support.ulogs import flight, write_ulog
from zerorate.cli import app
from zerorate.units import convert

RATE = 25.0


def write_sensors(path, gyro, accel, rate):
    """Write rates, rad/s, and forces, m/s^2, in deg/s and g, whose units the names lack."""
    deg, g = convert(1.0, "rad/s", "deg/s"), convert(1.0, "m/s^2", "g")
    columns = {f"gyro_{axis}": deg * gyro[:, i] for i, axis in enumerate("xyz")}
    columns |= {f"accel_{axis}": g * accel[:, i] for i, axis in enumerate("xyz")}
    write_table(path, columns, rate)


def write_drive(folder):
    drive = zr.simulate_drive(RATE, 160.0, seed=2)
    imu = {"time_s": drive.time}
    for name, values in (("gyro_{}_radps", drive.gyro), ("accel_{}_mps2", drive.accel)):
        imu |= {name.format(axis): values[:, i] for i, axis in enumerate("xyz")}
    fixes = drive.fixes
    gnss = {"time_s": fixes.time}
    gnss |= dict(zip(("latitude_deg", "longitude_deg", "height_m"), fixes.position.T, strict=True))
    ways = ("north", "east", "down")
    gnss |= {f"velocity_{way}_mps": v for way, v in zip(ways, fixes.velocity.T, strict=True)}
    for name, columns in (("imu", imu), ("gnss", gnss)):
        pq.write_table(pa.table(columns), folder / f"{name}.parquet")


def write_motion(path, rate=50.0):
    motion = zr.simulate_motion("hand", rate, 30.0, seed=1)
    write_sensors(path, motion.gyro, motion.accel, rate)


def write_session(path):
    session = zr.simulation.simulate_session(12, rate=50.0)
    gyro, accel = session.recording.gyro, session.recording.accel
    columns = {f"gyro_{axis}": gyro.data[:, i] for i, axis in enumerate("xyz")}
    columns |= {f"accel_{axis}": accel.data[:, i] for i, axis in enumerate("xyz")}
    write_table(path, columns, 50.0)


def write_foot(path):
    walk = zr.simulate_walk(100.0, strides=8, seed=1)
    write_sensors(path, walk.gyro, walk.accel, 100.0)


def write_static(path):
    rest = zr.simulate_drive(RATE, 400.0, seed=3, kind="rest")
    write_sensors(path, rest.gyro, rest.accel, RATE)


def write_logs(folder):
    (folder / "logs").mkdir()
    for name in ("a", "b"):
        write_gyros(folder / "logs" / f"{name}.parquet")


FILES = {
    "report": lambda folder: write_ulog(folder / "flight.ulg", flight(4000)),
    "replay": lambda folder: write_gyros(folder / "imu.csv"),
    "allan": lambda folder: write_static(folder / "static.csv"),
    "batch": write_logs,
    "compare": lambda folder: write_gyros(folder / "imu.csv", n=6000),
    "identify": lambda folder: write_gyros(folder / "static.csv", n=3000),
    "calibrate": lambda folder: write_session(folder / "turns.csv"),
    "attitude": lambda folder: write_motion(folder / "imu.csv"),
    "navigate": write_drive,
    "walk": lambda folder: write_foot(folder / "foot.csv"),
    "formats": lambda folder: write_gyros(folder / "imu.csv"),
}
"""What writes the files that an example names, by its command; others read none.

``mcp`` speaks a protocol: a client calls it in tests/tasks/test_assistant.py.
"""


@pytest.mark.parametrize("name", [name for name in app.COMMANDS if name != "mcp"])
def test_the_example_to_begin_with_runs(tmp_path, monkeypatch, name):
    monkeypatch.chdir(tmp_path)
    if name in FILES:
        FILES[name](tmp_path)
    # A stream is read of stdin, into which the example copies a device.
    typed = shlex.split(app.COMMANDS[name].examples[0].rpartition("| ")[2])
    lines = "".join(f"{value:.3f},0.1,0.2\n" for value in np.sin(np.arange(400.0)))
    code, out, errors = called(*typed[1:], given=lines)
    assert (code, bool(out)) == (0, True), errors
