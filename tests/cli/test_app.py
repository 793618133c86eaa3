"""The program: help, version, wrong commands, interrupts, and its exit codes as a process."""

import re
import signal
import subprocess
import sys

import pytest

from support.commands import check_line
from support.logs import write_gyros
from zerorate import __version__
from zerorate.cli import app, run
from zerorate.cli.errors import UsageFault
from zerorate.cli.parameters import Hint, parse
from zerorate.texts import describe_missing_extra

MISTYPED = {
    "fly": "there is no command 'fly'; zerorate --help lists all",
    "replai": "there is no command 'replai'; did you mean replay?",
    "--foo": "there is no option --foo; zerorate --help lists all",
    "replay": "missing: logs; for example: zerorate replay imu.csv --unit deg/s -o out",
    "batch x": "missing: -o; for example: zerorate batch logs -o out",
    "demo x": "unexpected: x; for example: zerorate demo --device MPU-6050 -o demo",
    "demo --sed 1": "there is no option --sed; did you mean --seed?",
    "identify x --method css": "there is no option --method; zerorate identify --help lists all",
    "replay x --method ekf": "--method takes kf, akf, fading, robust or auto, got 'ekf'",
    "replay x --rate fast": "--rate takes a number",
    "demo --seed 1.5": "--seed takes a whole number",
    "stream --fields 0": "--fields must be greater than or equal to 1",
    "demo --duration 0 -o nowhere": "--duration must be positive and finite, got 0.0",
    "simulate": "simulate needs a gyro and a file, such as simulate MPU-6050 -o gyro.csv; "
    "simulate --list shows the gyros",
}


@pytest.mark.parametrize("typed", MISTYPED)
def test_what_was_mistyped_is_told_in_plain_words(call, tmp_path, monkeypatch, typed):
    monkeypatch.chdir(tmp_path)
    assert call(*typed.split()) == (2, "", f"zerorate: {MISTYPED[typed]}\n")


@pytest.mark.parametrize(
    ("typed", "wrong"),
    [
        ("x.csv --foo", "--foo"),
        ("x.csv --foo=3 --bar", "--foo"),
        ("x.csv --unit --foo", None),
        ("x.csv --unit=--foo --no-figure", None),
        ("--no-figure --foo", "--foo"),
        ("x.csv -- --foo", None),
        ("-o --foo", None),
    ],
)
def test_a_wrong_option_is_no_value_of_another(typed, wrong):
    options = [*app.taker_of("replay").options()]
    try:
        parse(options, typed.split(), Hint("help", "example"))
    except UsageFault as fault:
        found = str(fault)
    else:
        found = ""
    assert ("there is no option" in found) == (wrong is not None)
    assert (wrong or "") in found


@pytest.mark.parametrize("name", app.COMMANDS)
def test_help_is_a_screen_with_an_example_that_is_right(call, name):
    """The list has a line a command; a short help has ten options, a long one has all."""
    about, (example, *more) = app.COMMANDS[name].about, app.COMMANDS[name].examples
    assert about in " ".join(call("--help")[1].split())
    short, whole = call(name, "--help")[1], call(name, "--help-all")[1]
    lines = short.splitlines()
    assert lines[lines.index("Begin with") + 1] == f"  {example}"
    assert len(lines) <= 40
    for text in (short, whole):
        assert max(map(len, text.splitlines())) <= 100
        assert not any(word in text for word in ("<", "TEXT", "BOOL", "…", "e.g.\n\n"))
    options = re.findall(r"(?<![\w-])--?[a-z][\w-]*", " ".join((example, *more)))
    assert all(f" {one} " in f"{whole} ".replace(",", " ") for one in options)


def test_options_of_the_filter_stand_by_the_methods_that_use_them(call):
    text = call("replay", "--help-all")[1].splitlines()
    for panel in ("Output", "Filter", "Only for auto", "Only for kf, akf, fading, robust"):
        assert panel in text


def test_a_command_without_rich_draws_no_bar(call, monkeypatch, tmp_path):
    monkeypatch.setattr("sys.stderr.isatty", lambda: True, raising=False)
    monkeypatch.setattr("zerorate.cli.outputs.find_spec", lambda name: None)
    monkeypatch.setitem(sys.modules, "rich", None)
    log = write_gyros(tmp_path / "run.csv")
    assert call("replay", log, "-o", tmp_path, "--no-figure")[0] == 0


def test_missing_rich(call, monkeypatch):
    monkeypatch.setattr("zerorate.cli.errors.find_spec", lambda name: None)
    code, _, errors = call("stream", "--rate", "100", "--show")
    assert code == 2
    check_line(errors, describe_missing_extra("rich", "cli"))


def test_an_interrupt_that_an_import_has_wrapped(monkeypatch, capsys):
    def interrupted(arguments):
        raise RuntimeError("Error calling __set_name__") from KeyboardInterrupt()

    monkeypatch.setattr("zerorate.cli.app.invoke", interrupted)
    assert run(["replay", "run.csv"]) == 130
    assert capsys.readouterr().err == "zerorate: interrupted\n"


def test_no_arguments_ask_for_help(call):
    code, text, errors = call()
    assert (code, errors) == (0, "")
    assert "replay" in text


def test_version_and_help(call):
    assert call("--version") == (0, f"zerorate {__version__}\n", "")
    code, text, _ = call("replay", "--help-all")
    assert code == 0
    assert "--forgetting-factor" in text


@pytest.mark.parametrize("program", [("-m", "zerorate"), ("-m", "zerorate.cli")])
def test_as_a_program(program, tmp_path, out):
    log = write_gyros(tmp_path / "run.parquet")
    if program[1] == "zerorate.cli":
        program = ("-c", "from zerorate.cli import main; main()")
    done = subprocess.run(
        [sys.executable, *program, "replay", log, "-o", out, "--no-figure"],
        capture_output=True,
        text=True,
    )
    assert (done.returncode, done.stderr) == (0, "")
    assert "wrote " in done.stdout


def test_faults_of_a_program(tmp_path):
    done = subprocess.run(
        [sys.executable, "-m", "zerorate", "replay", tmp_path / "nothing.csv"],
        capture_output=True,
        text=True,
        cwd=tmp_path,  # where it would write
    )
    assert (done.returncode, done.stdout) == (1, "")
    assert done.stderr == f"zerorate: {tmp_path / 'nothing.csv'} does not exist\n"


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT])
def test_a_signal_ends_a_command_with_its_code(monkeypatch, capsys, number):
    monkeypatch.setattr("zerorate.cli.app.invoke", lambda _: signal.raise_signal(number))
    before = signal.getsignal(number)
    assert run(["replay", "run.csv"]) == 128 + number
    told = {signal.SIGTERM: "terminated", signal.SIGINT: "interrupted"}[number]
    assert capsys.readouterr().err == f"zerorate: {told}\n"
    assert signal.getsignal(number) is before


class Panic(BaseException):
    """As a panic of native code is raised."""


@pytest.mark.parametrize("kind", [RuntimeError, KeyError, RecursionError, AssertionError, Panic])
def test_a_fault_of_its_own_is_a_sentence(call, monkeypatch, kind):
    def broken(_):
        raise kind("some\nthing" + "." * 1000)

    monkeypatch.setattr("zerorate.cli.app.invoke", broken)
    monkeypatch.delenv("ZERORATE_TRACEBACK", raising=False)
    code, _, errors = call("replay", "run.csv")
    assert code == 70
    check_line(errors, "please report it with what ZERORATE_TRACEBACK=1 adds to it")
    assert errors.startswith(f"zerorate: {kind.__name__}: ")
    assert len(errors) < 500
    monkeypatch.setenv("ZERORATE_TRACEBACK", "1")
    code, _, errors = call("replay", "run.csv")
    assert (code, errors.startswith("Traceback")) == (70, True)
    assert "in broken" in errors


def test_a_file_that_fails_names_itself(call, monkeypatch):
    def broken(_):
        raise OSError(28, "No space left on device", "some.csv")

    monkeypatch.setattr("zerorate.cli.app.invoke", broken)
    assert call("replay", "run.csv") == (1, "", "zerorate: some.csv: No space left on device\n")
