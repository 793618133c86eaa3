"""Disks without room, folders that go away, files that are cut: one line, and nothing by halves."""

import os
import subprocess
import sys
import threading
import time

import pytest

from support.batch_work import make_logs
from support.streams import lines_of, streamed
from zerorate import read_log
from zerorate.cli import run
from zerorate.tasks.batch import batch
from zerorate.tasks.saving import Outputs
from zerorate.views import FigureError

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="limits and /dev/full are Linux's")

N = 3000
LINES = lines_of(range(300))
STREAM = ("stream", "--rate", "100", "--checkpoint", "gyro.state", "--every", "0.5")
WRITING = {
    "replay": ("replay", "{log}"),
    "allan": ("allan", "{log}"),
    "identify": ("identify", "{log}"),
    "simulate": ("simulate", "MPU-6050", "-o", "gyro.parquet", "--duration", "60"),
    "compare": ("compare", "{log}", "--json", "found.json"),
}
BY_COMMAND = pytest.mark.parametrize("command", WRITING)

# A limit on the size of a file stands in for a full disk, which takes rights to make. It would hold
# for compiled modules as well.
LIMITED = (
    "import resource, runpy, signal, sys; sys.dont_write_bytecode = True; "
    "signal.signal(signal.SIGXFSZ, signal.SIG_IGN); "
    "resource.setrlimit(resource.RLIMIT_FSIZE, (1000, 1000)); "
    "sys.argv[0] = 'zerorate'; runpy.run_module('zerorate', run_name='__main__')"
)


@pytest.fixture(scope="module")
def log(tmp_path_factory):
    return make_logs(tmp_path_factory.mktemp("logs"), 1, N)[0]


def arguments(command, log):
    return [word.format(log=log) for word in WRITING[command]]


def called(*arguments, limited=False, **options):
    how = ["-c", LIMITED] if limited else ["-m", "zerorate"]
    command = [sys.executable, *how, *map(str, arguments)]
    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, **options}
    return subprocess.run(command, text=True, check=False, **pipes)


def names(folder):
    return sorted(path.name for path in folder.rglob("*"))


class TestFullDisks:
    @pytest.mark.every(4)
    @BY_COMMAND
    def test_no_room_for_the_results(self, command, log, tmp_path):
        done = called(*arguments(command, log), limited=True, cwd=tmp_path)
        assert done.returncode == 1
        assert done.stderr.startswith(f"zerorate: {tmp_path}: ")
        assert done.stderr.endswith("File too large\n")
        assert len(done.stderr.splitlines()) == 1
        assert names(tmp_path) == []

    def test_no_room_for_a_checkpoint_keeps_the_one_before(self, tmp_path):
        code, first, _ = streamed(
            LINES[:100], *STREAM[1:3], "--checkpoint", tmp_path / "gyro.state"
        )
        before = (tmp_path / "gyro.state").read_bytes()
        more = "".join(f"{line}\n" for line in LINES[100:])
        done = called(*STREAM, limited=True, cwd=tmp_path, input=more)
        message = "zerorate: the checkpoint cannot be written: "
        assert (code, done.returncode) == (0, 1)
        # At the end, and before if the disk has answered before the next save.
        assert {line[: len(message)] for line in done.stderr.splitlines()} == {message}
        assert len(first) + len(done.stdout.splitlines()) == len(LINES)
        assert names(tmp_path) == ["gyro.state"]
        assert (tmp_path / "gyro.state").read_bytes() == before

    @pytest.mark.every(4)
    @BY_COMMAND
    def test_no_room_for_what_is_printed(self, command, log, tmp_path):
        with open("/dev/full", "w") as full:
            done = called(*arguments(command, log), stdout=full, cwd=tmp_path)
        assert done.returncode == 1
        assert done.stderr.startswith("zerorate: the results cannot be printed: ")
        assert len(done.stderr.splitlines()) == 1
        assert not any(name.startswith(".") for name in names(tmp_path))

    def test_no_room_for_answers(self, tmp_path):
        lines = "".join(f"{line}\n" for line in LINES)
        with open("/dev/full", "w") as full:
            done = called(*STREAM, stdout=full, cwd=tmp_path, input=lines)
        assert done.returncode == 1
        assert "could not be read or answered" in done.stderr
        assert len(done.stderr.splitlines()) == 1
        # What was not answered is not saved.
        assert names(tmp_path) == []


class TestFoldersThatGoAway:
    def test_during_a_replay(self, log, tmp_path):
        out, gone = tmp_path / "out", tmp_path / "gone"
        out.mkdir()
        command = [sys.executable, "-m", "zerorate", "replay", log, "-o", out]
        pipe = subprocess.PIPE
        with subprocess.Popen(command, stdout=pipe, stderr=pipe, text=True) as process:
            while not names(out) and process.poll() is None:
                time.sleep(0.01)
            out.rename(gone)
            _, errors = process.communicate()
        assert process.returncode == 1
        assert str(out) in errors
        assert len(errors.splitlines()) == 1
        assert not out.exists()
        # The log gets its name before the figure is drawn: whole, or not at all.
        finished = [name for name in names(gone) if not name.startswith(".")]
        assert finished in ([], ["run00-zerorate.parquet"])
        assert [read_log(gone / name).n for name in finished] in ([], [3000])

    def test_no_folder_is_made_again(self, tmp_path):
        out, gone = tmp_path / "out", tmp_path / "gone"
        moved = threading.Event()

        def write(path):
            out.rename(gone)
            moved.set()

        def draw(path):
            moved.wait(10.0)

        figures = (out / "a.png", out / "b.png")
        outputs = Outputs(out / "a.csv", figures, force=False)
        with pytest.raises((OSError, FigureError)):
            outputs.write([write], [draw, draw], lambda *_: None)
        assert not out.exists()


class TestFilesThatAreCut:
    PARTS = range(8)

    @pytest.fixture
    def cut(self, log, tmp_path):
        """A Parquet file cut at every eighth of its length, the first time at once."""
        whole = log.read_bytes()
        folder = tmp_path / "cut"
        folder.mkdir()
        paths = [folder / f"{part}.parquet" for part in self.PARTS]
        for part, path in zip(self.PARTS, paths, strict=True):
            path.write_bytes(whole[: len(whole) * part // len(self.PARTS)])
        return paths

    def test_in_a_replay(self, cut, tmp_path, capsys):
        out = tmp_path / "out"
        out.mkdir()
        for path in cut:
            assert run(["replay", str(path), "-o", str(out)]) == 1
            text, errors = capsys.readouterr()
            assert str(path) in errors
            assert (text, len(errors.splitlines())) == ("", 1)
        assert names(out) == []

    def test_beside_a_whole_one_in_a_batch(self, cut, log, tmp_path):
        (tmp_path / "cut" / "whole.parquet").write_bytes(log.read_bytes())
        result = batch(f"{tmp_path}/cut/*", tmp_path / "out", workers=2)
        assert result.counts == {"done": 1, "failed": len(cut)}
        for one in result.failed:
            # The log is named beside the reason, once.
            assert one.error
            assert one.name not in one.error
            assert "\n" not in one.error
        written = ["summary.parquet", "whole-zerorate.json", "whole-zerorate.parquet"]
        assert names(tmp_path / "out") == written
        assert read_log(tmp_path / "out" / "whole-zerorate.parquet").n == N


class TestFoldersWithoutPermission:
    @pytest.fixture(autouse=True)
    def locked(self, tmp_path, monkeypatch):
        monkeypatch.chdir(tmp_path)
        # Not by chmod: root may write anywhere.
        monkeypatch.setattr(os, "access", lambda _, mode: not mode & os.W_OK)

    @pytest.mark.parametrize("command", [*WRITING, "stream"])
    def test_are_told_before_any_work(self, command, log, tmp_path, capsys):
        asked = STREAM if command == "stream" else arguments(command, log)
        assert run(list(asked)) == 2
        text, errors = capsys.readouterr()
        assert text == ""
        assert errors.startswith("zerorate: cannot write ")
        assert errors.endswith(" is not writable\n")
        assert names(tmp_path) == []

    def test_are_told_before_any_log_of_a_batch(self, log, tmp_path, capsys):
        assert run(["batch", str(log), "-o", str(tmp_path / "out")]) == 1
        assert capsys.readouterr().err.endswith(" is not writable\n")
        assert names(tmp_path) == ["out"]
