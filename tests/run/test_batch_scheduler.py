"""A scheduler of somebody else's that dies during a batch."""

import json
import subprocess
import sys
import time
from contextlib import ExitStack, contextmanager

import pytest

from support.batch_work import make_logs
from zerorate.run.batch import run_batch

COUNT = 12
# Generous, since it only ends a test that would hang for ever.
HANGS = 120.0


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


def finished(out):
    return {path: path.stat().st_ino for path in out.rglob("*-zerorate.json")}


def test_what_is_finished_stays_and_one_line_says_what_happened(scheduler, tmp_path):
    process, address = scheduler
    make_logs(tmp_path / "logs", COUNT, 30_000)
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
        errors == f"zerorate: the scheduler at '{address}' is gone: a later run goes on from here\n"
    )
    counts = run_batch(pattern, out, workers=1).counts
    assert counts["skipped"] >= len(kept) > 0
    assert counts["done"] + counts["skipped"] == COUNT
    assert kept.items() <= finished(out).items()
    assert [path for path in out.rglob(".*") if path.is_file()] == []
