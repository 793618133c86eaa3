"""Ctrl-C or SIGTERM in any command: one sentence, its exit code, and no file by halves."""

import signal
import subprocess
import sys
import time

import pytest

from support.killed import left_in
from support.logs import write_gyros
from zerorate.tasks.interrupts import TerminationHandler

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="signals are those of POSIX")

COMMANDS = {
    "allan": ("allan", "{log}", "-o", "new/a.csv"),
    "identify": ("identify", "{log}", "-o", "new"),
    "compare": ("compare", "{log}", "--json", "new/a.json"),
    "simulate": ("simulate", "MPU-6050", "-o", "new/a.csv", "--duration", "1000"),
    "demo": ("demo", "-o", "new", "--duration", "600"),
}
TOLD = {signal.SIGINT: "zerorate: interrupted\n", signal.SIGTERM: "zerorate: terminated\n"}


@pytest.fixture(scope="module")
def log(tmp_path_factory):
    return write_gyros(tmp_path_factory.mktemp("logs") / "run.parquet", n=15_000, axes=1)


@pytest.mark.every(5)
@pytest.mark.parametrize("command", COMMANDS)
def test_at_any_moment(command, log, tmp_path):
    words = [word.format(log=log) for word in COMMANDS[command]]

    def started(folder):
        folder.mkdir()
        pipe = subprocess.PIPE
        program = [sys.executable, "-m", "zerorate", *words]
        return subprocess.Popen(program, cwd=folder, stdout=pipe, stderr=pipe, text=True)

    begin = time.monotonic()
    with started(tmp_path / "whole") as process:
        _, errors = process.communicate()
    usual = time.monotonic() - begin
    assert (process.returncode, errors) == (0, "")
    whole = sorted(path.name for path in (tmp_path / "whole" / "new").iterdir())
    for i, (share, number) in enumerate([(0.6, signal.SIGINT), (0.85, signal.SIGTERM)]):
        with started(tmp_path / str(i)) as process:
            time.sleep(share * usual)
            process.send_signal(number)
            _, errors = process.communicate()
        # The interpreter's own start and end are not the command's.
        assert process.returncode in (0, 128 + number, -number)
        if process.returncode == 128 + number:
            assert errors == TOLD[number]
        assert left_in(tmp_path / str(i)) == []
        made = tmp_path / str(i) / "new"
        assert not made.exists() or {path.name for path in made.iterdir()} <= set(whole)


@pytest.mark.parametrize("number", TOLD)
def test_within_the_machinery_of_imports_a_signal_waits(number):
    """What is raised in a callback there is lost, and its lock held for ever."""
    code = compile("frame = sys._getframe()", "<frozen importlib._bootstrap>", "exec")
    found = {"sys": sys}
    exec(code, found)
    begin = time.monotonic()
    with TerminationHandler() as ending:
        ending._end(number, found["frame"])
        with pytest.raises(KeyboardInterrupt):
            time.sleep(10.0)
    assert ending.number == number
    # It wakes who waits.
    assert time.monotonic() - begin < 5.0
