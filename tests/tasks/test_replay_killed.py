"""A replay that is stopped at any moment leaves no file, or a whole one, and nothing for ever."""

import os
import signal
import subprocess
import sys
import time

import numpy as np
import pytest

from support.killed import left_by_a_kill, temporary_of
from zerorate import Log, read_log, write_log
from zerorate.cli import run

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="signals are those of POSIX")

N = 60_000
OUTPUTS = ("run-zerorate.parquet", "run-zerorate.png")


@pytest.fixture(scope="module")
def recording(tmp_path_factory):
    path = tmp_path_factory.mktemp("log") / "run.parquet"
    data = np.random.default_rng(1).standard_normal((N, 3))
    write_log(Log(np.arange(N) / 100.0, 100.0, data, ["gyro_x", "gyro_y", "gyro_z"], "deg/s"), path)
    return path


def start(recording, folder, *options):
    return subprocess.Popen(
        [sys.executable, "-m", "zerorate", "replay", recording, "-o", folder, *options],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )


@pytest.fixture(scope="module")
def usual_time(recording, tmp_path_factory):
    begin = time.monotonic()
    process = start(recording, tmp_path_factory.mktemp("whole"))
    process.communicate()
    assert process.returncode == 0
    return time.monotonic() - begin


def check_outputs(folder):
    """Every file under a final name must be whole."""
    log, figure = (folder / name for name in OUTPUTS)
    if log.exists():
        filtered = read_log(log)
        assert filtered.data.shape == (N, 3)
        assert np.isfinite(filtered.data).all()
    if figure.exists():
        assert figure.read_bytes().startswith(b"\x89PNG")
        assert figure.read_bytes().endswith(b"IEND\xaeB`\x82")


def visible(folder):
    return [path.name for path in folder.iterdir() if not path.name.startswith(".")]


def hidden(folder):
    return [path.name for path in folder.iterdir() if path.name.startswith(".")]


@pytest.mark.every(3)
@pytest.mark.parametrize(
    "moment",
    [
        (signal.SIGTERM, 0.6, True),
        (signal.SIGKILL, 0.7, False),
        (signal.SIGINT, 0.85, True),
        (signal.SIGKILL, 0.95, True),
        (signal.SIGTERM, 0.9, False),
    ],
)
def test_stopped_at_any_moment(recording, usual_time, tmp_path, moment):
    number, share, old = moment
    for name in OUTPUTS if old else ():
        (tmp_path / name).write_bytes(b"old")
    process = start(recording, tmp_path, *(["--force"] if old else []))
    time.sleep(share * usual_time)
    process.send_signal(number)
    _, errors = process.communicate(timeout=30)
    # An old output stays until the new one is whole.
    if old and any((tmp_path / name).read_bytes() == b"old" for name in OUTPUTS):
        for name in OUTPUTS:
            if (tmp_path / name).read_bytes() == b"old":
                (tmp_path / name).unlink()
    check_outputs(tmp_path)
    assert set(visible(tmp_path)) <= set(OUTPUTS)
    if number != signal.SIGKILL:
        # The interpreter's own start and end are not the command's.
        assert process.returncode in (0, 128 + number, -number)
        assert hidden(tmp_path) == []
        told = {signal.SIGINT: "zerorate: interrupted", signal.SIGTERM: "zerorate: terminated"}
        assert process.returncode != 128 + number or errors.strip() == told[number]


def test_a_later_run_succeeds_and_removes_what_the_kill_left(recording, tmp_path):
    process = start(recording, tmp_path)
    # Before the figure is drawn, and long before both files get their names.
    while not hidden(tmp_path) and process.poll() is None:
        time.sleep(0.002)
    process.kill()
    process.communicate()
    assert hidden(tmp_path) != []
    again = start(recording, tmp_path, "--force")
    again.communicate()
    assert again.returncode == 0
    assert sorted(path.name for path in tmp_path.iterdir()) == sorted(OUTPUTS)
    check_outputs(tmp_path)


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGHUP])
def test_a_signal_while_it_streams_into_a_file_leaves_nothing(recording, tmp_path, number):
    process = start(recording, tmp_path, "--no-figure", "--format", "csv")
    while not hidden(tmp_path) and process.poll() is None:
        time.sleep(0.002)
    process.send_signal(number)
    text, errors = process.communicate(timeout=30)
    assert (process.returncode, text, errors) == (128 + number, "", "zerorate: terminated\n")
    assert list(tmp_path.iterdir()) == []


def test_a_command_under_nohup_survives_a_hang_up(recording, tmp_path):
    command = [sys.executable, "-m", "zerorate", "replay", str(recording), "-o", str(tmp_path)]
    quiet = subprocess.DEVNULL
    with subprocess.Popen(["nohup", *command], stdin=quiet, stdout=quiet, stderr=quiet) as process:
        while not hidden(tmp_path) and process.poll() is None:
            time.sleep(0.002)
        process.send_signal(signal.SIGHUP)
        assert process.wait() == 0
    assert sorted(visible(tmp_path)) == sorted(OUTPUTS)


def test_what_others_are_writing_stays(recording, tmp_path):
    target, other = tmp_path / "run-zerorate.parquet", tmp_path / "other.csv"
    here = temporary_of(target, os.getpid())
    elsewhere = temporary_of(other, 1, machine="00000000")
    foreign = [tmp_path / ".other.0123456789ab.csv", tmp_path / ".zerorate-notes.parquet"]
    for path in (here, elsewhere, *foreign):
        path.write_bytes(b"half")
    left_by_a_kill(target)
    left_by_a_kill(target, machine="00000000")
    left_by_a_kill(other)
    process = start(recording, tmp_path, "--no-figure")
    process.communicate()
    assert process.returncode == 0
    assert sorted(hidden(tmp_path)) == sorted(path.name for path in (here, elsewhere, *foreign))


@pytest.mark.parametrize("name", ["a.npz", "b.csv"])
def test_what_a_kill_left_is_removed_by_the_next_run_into_that_folder(tmp_path, name):
    for target in ("a.npz", "a-truth.npz", "else.parquet"):
        left_by_a_kill(tmp_path / target)
    assert run(["simulate", "mpu6050", "-o", str(tmp_path / name), "--duration", "2"]) == 0
    stem, suffix = name.split(".")
    assert sorted(visible(tmp_path)) == [f"{stem}-truth.{suffix}", name]
    assert hidden(tmp_path) == []
