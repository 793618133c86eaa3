"""Commands in any surroundings: encodings, closed outputs, backends, names of any bytes."""

import os
import subprocess
import sys
import tempfile

import numpy as np
import pytest

from support.commands import check_line
from support.inside import called
from support.logs import write_gyros, write_table
from zerorate.cli.process import prepare

posix = pytest.mark.skipif(
    sys.platform == "win32", reason="names are bytes, and shells sh, on POSIX"
)


def zerorate(*arguments, encoding="utf-8", redirected="", **variables):
    """Run a command as a process; return its code, and what it wrote as bytes."""
    command = [sys.executable, "-m", "zerorate", *arguments]
    if redirected:
        command = ["sh", "-c", f'exec "$@" {redirected}', "sh", *command]
    surroundings = {**os.environ, "PYTHONIOENCODING": encoding, "COLUMNS": "100", **variables}
    # Where it may write, though nothing should be written there.
    folder = tempfile.gettempdir()
    done = subprocess.run(command, capture_output=True, env=surroundings, cwd=folder)
    return done.returncode, done.stdout, done.stderr


@pytest.fixture(scope="module")
def log(tmp_path_factory):
    return write_gyros(tmp_path_factory.mktemp("logs") / "run.csv", n=6000)


TEXTS = {
    "replay": (("--no-figure",), "sqrt(h)", "+/-"),
    "allan": (("--no-figure",), "+/-", "%"),
    "compare": (("--methods", "raw,ema"), "ema*", "At rest"),
}


class TestEncodings:
    @pytest.mark.every(2)
    @pytest.mark.parametrize("encoding", ["ascii", "cp1252"])
    @pytest.mark.parametrize("command", TEXTS)
    def test_no_table_is_lost(self, log, tmp_path, command, encoding):
        options, *parts = TEXTS[command]
        output = () if command == "compare" else ("-o", tmp_path, "--force")
        arguments = (command, log, *output, *options)
        code, text, errors = zerorate(*arguments, encoding=encoding)
        assert (code, errors) == (0, b"")
        text = text.decode(encoding)
        if encoding == "ascii":
            assert all(part in text for part in parts)
        _, whole, _ = called(*arguments)
        # Only what the encoding lacks was replaced; the speed differs from run to run.
        assert len(text.splitlines()) == len(whole.splitlines())
        assert text.split()[:3] == whole.split()[:3]

    @pytest.mark.parametrize(
        ("text", "substitute"),
        [
            ("0.1 ± 0.2 deg/√h", "0.1 +/- 0.2 deg/sqrt(h)"),
            ("√", "sqrt"),
            ("√√s", "sqrtsqrt(s)"),
            ("±√h°", "+/-sqrt(h)deg"),
            ("φ1 θ1 2σ", "phi1 theta1 2sigma"),
            ("µg m/s²", "ug m/s^2"),
            ("Thêo1 †…", "Theo1 *..."),
            ("\udce9\ud800\u65e5", r"\xe9\ud800\u65e5"),
        ],
    )
    def test_substitutes(self, text, substitute):
        prepare()
        assert text.encode("ascii", "zerorate.substitutes").decode() == substitute

    def test_help(self):
        code, text, errors = zerorate("replay", "--help-all", encoding="ascii")
        assert (code, errors) == (0, b"")
        assert b"--figure-format" in text

    def test_what_has_no_substitute_is_escaped(self, tmp_path):
        code, _, errors = zerorate("allan", tmp_path / "日.csv", encoding="ascii")
        assert code == 1
        check_line(errors.decode(), "\\u65e5.csv does not exist")


@posix
class TestNames:
    """Names of files and columns that are no UTF-8."""

    NAME = os.fsdecode(b"r\xe9sum\xe9")

    @pytest.mark.every(4)
    @pytest.mark.parametrize("command", ["replay", "allan", "identify", "compare"])
    def test_of_a_log(self, log, tmp_path, command):
        path = tmp_path / f"{self.NAME}.csv"
        path.write_bytes(log.read_bytes())
        output = () if command == "compare" else ("-o", tmp_path)
        code, text, errors = zerorate(command, path, *output)
        assert (code, errors) == (0, b"")
        made = sorted(os.listdir(os.fsencode(tmp_path)))
        assert len(made) == (1 if command == "compare" else 3)
        assert all(name.startswith(b"r\xe9sum\xe9") for name in made)
        if output:
            assert rb"r\xe9sum\xe9-zerorate" in text

    @pytest.mark.every(4)
    @pytest.mark.parametrize("command", ["replay", "allan", "identify", "compare"])
    def test_of_a_column(self, tmp_path, command):
        z = 0.5 + 0.1 * np.random.default_rng(1).standard_normal(6000)
        path = tmp_path / "run.csv"
        rows = "".join(f"{value!r}\n" for value in z.tolist())
        path.write_bytes(b"gyro_\xe9_dps\n" + rows.encode())
        output = () if command == "compare" else ("-o", tmp_path)
        code, _, errors = zerorate(command, path, *output, "--rate", "100")
        # To refuse such a name is the reader's right.
        assert code in (0, 1)
        assert len(errors.splitlines()) == code
        assert b"Traceback" not in errors

    def test_of_a_column_that_was_asked_for(self, log):
        code, _, errors = zerorate("allan", log, "--columns", self.NAME)
        assert code == 2
        check_line(errors.decode(), r"there is no column 'r\xe9sum\xe9'")


@pytest.mark.parametrize(("command", "backend"), [("replay", "module://nope"), ("allan", "nope")])
def test_figures_need_no_backend(log, tmp_path, command, backend):
    code, _, errors = zerorate(command, log, "-o", tmp_path, MPLBACKEND=backend)
    assert (code, errors) == (0, b"")
    assert len(list(tmp_path.iterdir())) == 2


@posix
def test_a_user_without_a_home_is_told_nothing_of_it(log, tmp_path):
    nowhere = {"HOME": "/dev/null", "XDG_CONFIG_HOME": "", "XDG_CACHE_HOME": ""}
    code, _, errors = zerorate("allan", log, "-o", tmp_path, **nowhere)
    assert (code, errors) == (0, b"")


@pytest.mark.every(3)
@pytest.mark.parametrize("command", ["replay", "allan", "identify"])
def test_letters_that_no_font_has_are_no_warning(tmp_path, command):
    z = 0.5 + 0.1 * np.random.default_rng(1).standard_normal(6000)
    path = write_table(tmp_path / "角速度$_{.csv", {"gyro_x角$^_dps": z})
    code, _, errors = zerorate(command, path, "-o", tmp_path, "--rate", "100")
    assert (code, errors) == (0, b"")


@posix
class TestOutputs:
    @pytest.mark.every(2)
    @pytest.mark.parametrize("command", ["simulate", "replay"])
    def test_nobody_reads(self, log, tmp_path, command):
        arguments = {"replay": (log, "-o", tmp_path, "--no-figure"), "simulate": ("--list",)}
        command = [sys.executable, "-m", "zerorate", command, *arguments[command]]
        reader, writer = os.pipe()
        os.close(reader)
        with os.fdopen(writer, "wb") as answers:
            done = subprocess.run(command, stdout=answers, stderr=subprocess.PIPE)
        # As the shell shows a process that SIGPIPE ended.
        assert (done.returncode, done.stderr) == (141, b"")

    @pytest.mark.every(2)
    @pytest.mark.parametrize("command", ["replay", "simulate"])
    def test_a_full_device(self, log, tmp_path, command):
        arguments = {"replay": (log, "-o", tmp_path, "--no-figure"), "simulate": ("--list",)}
        code, text, errors = zerorate(command, *arguments[command], redirected=">/dev/full")
        assert (code, text) == (1, b"")
        check_line(errors.decode(), "the results cannot be printed: ")

    @pytest.mark.every(2)
    @pytest.mark.parametrize("closed", ["<&- 2>&-", "2>&-"])
    def test_closed_descriptors_change_no_result(self, log, tmp_path, closed):
        arguments = ("allan", log, "-o", tmp_path, "--force", "--no-figure")
        _, whole, _ = called(*arguments)
        assert zerorate(*arguments, redirected=closed) == (0, whole.encode(), b"")

    def test_results_that_go_nowhere_are_a_fault(self, log, tmp_path):
        arguments = ("allan", log, "-o", tmp_path, "--no-figure")
        code, _, errors = zerorate(*arguments, redirected=">&-")
        assert code == 1
        check_line(errors.decode(), "the results cannot be printed: ")

    def test_a_fault_with_stderr_closed_is_not_printed_among_results(self, tmp_path):
        arguments = ("allan", tmp_path / "none.csv", "-o", tmp_path)
        assert zerorate(*arguments, redirected="2>&-") == (1, b"", b"")
