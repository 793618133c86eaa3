"""Pipes, devices, folders and endless files wherever a command takes a file: refused at once."""

import os
import signal
import sys

import pytest

from zerorate.cli import run

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="pipes with names are of POSIX")

LOG = "imu.csv"
TAKEN = {
    "log": ["replay", "{}"],
    "allan": ["allan", "{}"],
    "report": ["report", "{}"],
    "batch": ["batch", "{}", "-o", "out"],
    "formats": ["formats", "{}"],
    "calibration": ["replay", LOG, "--calibration", "{}"],
    "calibration of attitude": ["attitude", LOG, "--calibration", "{}"],
    "applied": ["calibrate", LOG, "--apply", "{}"],
    "poses": ["attitude", LOG, "--reference", "{}"],
    "fixes": ["navigate", LOG, "{}"],
    "track": ["navigate", LOG, LOG, "--reference", "{}"],
    "gyro noise": ["navigate", LOG, LOG, "--gyro-noise", "{}"],
    "accelerometer noise": ["navigate", LOG, LOG, "--accel-noise", "{}"],
    "checkpoint": ["stream", "--rate", "100", "--checkpoint", "{}"],
    "second report": ["report", LOG, "{}"],
    "receiver": ["report", LOG, "--gnss", "{}"],
    "rotations": ["replay", LOG, "--array", "--rotations", "{}"],
    "compare": ["compare", "{}"],
    "identify": ["identify", "{}"],
    "walk": ["walk", "{}"],
}
"""Where commands take a file."""


@pytest.fixture
def place(tmp_path, monkeypatch):
    rows = "".join(f"{i / 100},0.1,0.2,{i % 3},0,0,{1 + i % 2 / 100}\n" for i in range(800))
    (tmp_path / LOG).write_text("time_s,gx_dps,gy_dps,gz_dps,ax_g,ay_g,az_g\n" + rows)
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.mark.parametrize("kind", ["pipe", "zeros", "terminal", "folder"])
@pytest.mark.parametrize("taken", TAKEN)
def test_what_is_no_file_is_refused_at_once(place, taken, kind, capsys):
    if kind == "pipe":
        os.mkfifo(place / "given")
    elif kind == "folder":
        (place / "given").mkdir()
    else:
        (place / "given").symlink_to({"zeros": "/dev/zero", "terminal": "/dev/tty"}[kind])
    begun = signal.signal(signal.SIGALRM, lambda *_: (_ for _ in ()).throw(TimeoutError("waits")))
    signal.alarm(20)
    try:
        code = run([word.format("given") for word in TAKEN[taken]])
    finally:
        signal.alarm(0)
        signal.signal(signal.SIGALRM, begun)
    printed, told = capsys.readouterr()
    assert code in (1, 2), told
    assert told.count("\n") == 1
    told += printed if taken == "batch" else ""
    assert "unknown option" not in told.lower()
    said = [
        "pipe, a socket or a device",
        "older",
        "directory",
        "No such device",
        "denied",
        "no log",
        "is no file",
        "no column",
        "no regular file",
    ]
    assert any(words in told for words in said), told
