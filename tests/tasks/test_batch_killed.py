"""Batches of real processes that are killed, interrupted, out of room, or without a scheduler."""

import json
import os
import signal
import subprocess
import sys
import time
from contextlib import ExitStack, contextmanager

import psutil
import pyarrow.parquet as pq
import pytest

import zerorate as zr
from support.batch_work import make_logs
from zerorate import read_log

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="signals are those of POSIX")

COUNT = 12
N = 30_000
# Generous, since it only ends a test that would hang for ever.
HANGS = 120.0


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("logs")
    make_logs(folder, COUNT, N)
    return folder


def start(folder, out, *options):
    command = [sys.executable, "-m", "zerorate", "batch", f"{folder}/**/*.parquet", "-o", out]
    return subprocess.Popen(
        [*map(str, command), *options],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    )


def workers_of(process):
    found = psutil.Process(process.pid).children(recursive=True)
    return [child for child in found if "--multiprocessing-fork" in child.cmdline()]


def finished(out):
    """Return the records that are there, by path: a file that is written again is another one."""
    return {path: path.stat().st_ino for path in out.rglob("*-zerorate.json")}


def wait_until(process, out, count):
    """Wait until so many logs are finished, or all that the run will do."""
    while len(finished(out)) < count and process.poll() is None:
        time.sleep(0.01)


def check_whole(out, expected):
    """Every log must be there and whole, and nothing else."""
    logs = sorted(out.rglob("*-zerorate.parquet"))
    assert len(logs) == expected
    for log in logs:
        assert read_log(log).n == N
    hidden = [path for path in out.rglob(".*") if path.is_file()]
    assert hidden == []


@pytest.mark.every(2)
@pytest.mark.parametrize("engine", [("--workers", "2"), ("--local-cluster", "2")])
def test_killed_workers_lose_nothing(folder, tmp_path, engine):
    process = start(folder, tmp_path / "out", *engine)
    kept = {}
    for count in (2, 6):
        wait_until(process, tmp_path / "out", count)
        kept |= finished(tmp_path / "out")
        for worker in workers_of(process)[:1]:
            worker.send_signal(signal.SIGKILL)
    text, errors = process.communicate(timeout=120)
    assert (process.returncode, errors) == (0, "")
    assert f"{COUNT} logs done" in text
    check_whole(tmp_path / "out", COUNT)
    assert kept.items() <= finished(tmp_path / "out").items()
    assert pq.read_table(tmp_path / "out" / "summary.parquet").num_rows == COUNT


@pytest.mark.every(3)
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGKILL])
def test_a_stopped_run_is_resumed(folder, tmp_path, number):
    process = start(folder, tmp_path / "out", "--workers", "2")
    wait_until(process, tmp_path / "out", 1)
    # Looked up early: that takes as long as several logs, which must not all be done by then.
    workers = workers_of(process)
    wait_until(process, tmp_path / "out", 3)
    if number != signal.SIGKILL:
        os.killpg(process.pid, number)  # as a terminal does, and a supervisor
    else:
        process.kill()
    _, errors = process.communicate(timeout=30)
    psutil.wait_procs(workers, timeout=30)
    kept = finished(tmp_path / "out")
    assert 3 <= len(kept) < COUNT
    if number != signal.SIGKILL:
        told = {signal.SIGINT: "interrupted", signal.SIGTERM: "terminated"}[number]
        assert (process.returncode, errors) == (128 + number, f"zerorate: {told}\n")
        assert [path for path in (tmp_path / "out").rglob(".*") if path.is_file()] == []
    again = start(folder, tmp_path / "out", "--workers", "2")
    text, _ = again.communicate(timeout=120)
    assert f"{COUNT - len(kept)} logs done" in text
    assert f"{len(kept)} skipped, 0 failed" in text
    check_whole(tmp_path / "out", COUNT)
    assert kept.items() <= finished(tmp_path / "out").items()


def test_a_log_without_room_fails_and_leaves_nothing(tmp_path):
    small, large = make_logs(tmp_path / "logs", 2, 2000)
    make_logs(tmp_path / "more", 1, N)[0].replace(large)
    # A limit on the size of a file stands in for a full disk, which takes rights to make.
    limited = (
        "import resource, runpy, signal, sys; sys.dont_write_bytecode = True; "
        "signal.signal(signal.SIGXFSZ, signal.SIG_IGN); "
        "resource.setrlimit(resource.RLIMIT_FSIZE, (200_000, 200_000)); "
        "sys.argv[0] = 'zerorate'; runpy.run_module('zerorate', run_name='__main__')"
    )
    pattern, out = str(tmp_path / "logs" / "*" / "*"), tmp_path / "out"
    done = subprocess.run(
        [sys.executable, "-c", limited, "batch", pattern, "-o", str(out), "--workers", "1"],
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 1
    assert done.stderr == "zerorate: 1 of 2 logs failed\n"
    assert f"failed: unit1/{large.name}:" in done.stdout
    assert "too large" in " ".join(done.stdout.lower().split())
    names = sorted(path.name for path in out.rglob("*") if path.is_file())
    finished_one = [f"{small.stem}-zerorate.{suffix}" for suffix in ("json", "parquet")]
    assert names == [*finished_one, "summary.parquet"]


# A scheduler of somebody else's that dies during a batch.


@contextmanager
def running(module, *options):
    command = [sys.executable, "-m", module, *map(str, options)]
    quiet = subprocess.DEVNULL
    with subprocess.Popen(command, stdout=quiet, stderr=quiet) as process:
        try:
            yield process
        finally:
            process.kill()


@pytest.fixture
def scheduler(tmp_path):
    """A scheduler with one worker, and its address."""
    file = tmp_path / "scheduler.json"
    options = ("--scheduler-file", file, "--no-dashboard")
    with ExitStack() as stack:
        place = ("--host", "127.0.0.1", "--port", "0")
        process = stack.enter_context(running("distributed.cli.dask_scheduler", *options, *place))
        stack.enter_context(
            running("distributed.cli.dask_worker", *options, "--nthreads", "1", "--no-nanny")
        )
        yield process, address_in(file)


def address_in(file):
    limit = time.monotonic() + HANGS
    while time.monotonic() < limit:
        try:
            return json.loads(file.read_text())["address"]
        except (FileNotFoundError, json.JSONDecodeError):
            time.sleep(0.05)
    raise TimeoutError("the scheduler does not start")


def test_what_is_finished_stays_and_one_line_says_what_happened(scheduler, tmp_path):
    process, address = scheduler
    make_logs(tmp_path / "logs", COUNT, N)
    pattern, out = f"{tmp_path}/logs/**/*.parquet", tmp_path / "out"
    command = [sys.executable, "-m", "zerorate", "batch", pattern, "-o", out]
    with subprocess.Popen(
        [*command, "--scheduler", address],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    ) as batch:
        while not finished(out) and batch.poll() is None:
            time.sleep(0.01)
        kept = finished(out)
        process.kill()
        text, errors = batch.communicate(timeout=HANGS)
    assert (batch.returncode, text) == (1, "")
    assert (
        errors
        == f"zerorate: the scheduler at '{address}' is gone: the next run continues from here\n"
    )
    counts = zr.batch(pattern, out, workers=1).counts
    assert counts["skipped"] >= len(kept) > 0
    assert counts["done"] + counts["skipped"] == COUNT
    assert kept.items() <= finished(out).items()
    assert [path for path in out.rglob(".*") if path.is_file()] == []
