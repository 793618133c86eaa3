"""A replay that is stopped at any moment leaves no file, or a whole one."""

import signal
import subprocess
import sys
import time

import numpy as np
import pytest

from zerorate import Log, read_log, write_log

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="signals are those of POSIX")

N = 200_000
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


@pytest.mark.parametrize("share", [0.5, 0.7, 0.85, 0.95])
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGKILL])
def test_stopped_at_any_moment(recording, usual_time, tmp_path, number, share):
    process = start(recording, tmp_path)
    time.sleep(share * usual_time)
    process.send_signal(number)
    _, errors = process.communicate(timeout=30)
    check_outputs(tmp_path)
    assert set(visible(tmp_path)) <= set(OUTPUTS)
    if number == signal.SIGINT:
        assert process.returncode in (0, 130, -signal.SIGINT)
        assert sorted(path.name for path in tmp_path.iterdir()) == sorted(visible(tmp_path))
        assert process.returncode != 130 or errors.strip() == "zerorate: interrupted"


def test_a_later_run_succeeds(recording, usual_time, tmp_path):
    process = start(recording, tmp_path)
    time.sleep(0.8 * usual_time)
    process.kill()
    process.communicate()
    again = start(recording, tmp_path, "--force")
    again.communicate()
    assert again.returncode == 0
    assert sorted(visible(tmp_path)) == sorted(OUTPUTS)
    check_outputs(tmp_path)


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGKILL])
def test_an_old_output_stays_until_the_new_one_is_whole(recording, usual_time, tmp_path, number):
    for name in OUTPUTS:
        (tmp_path / name).write_bytes(b"old")
    process = start(recording, tmp_path, "--force")
    time.sleep(0.7 * usual_time)
    process.send_signal(number)
    process.communicate()
    for name in OUTPUTS:
        content = (tmp_path / name).read_bytes()
        assert content == b"old" or len(content) > 10_000
