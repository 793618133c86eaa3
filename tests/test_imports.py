"""What is imported before it is needed: nothing that takes long, for every start would pay it."""

import subprocess
import sys

import pytest

ASKED = "import sys; {}; print(*sorted({{name.split('.')[0] for name in sys.modules}}))"
COMMAND = "from zerorate.cli import run; code = run({}); assert code == {}, code"

FOR_FILES = {"matplotlib", "pyarrow", "scipy", "h5py", "rosbags", "pyulog", "distributed", "pandas"}
FOR_PROCESSES = {"multiprocessing", "ssl"}


def imported(statement):
    """The packages that a new interpreter has imported after a statement."""
    told = subprocess.run(
        [sys.executable, "-c", ASKED.format(statement)], capture_output=True, text=True, check=True
    )
    return set(told.stdout.splitlines()[-1].split())


def test_the_package_by_itself():
    """All but the core is imported with the first name asked for, NumPy with the first array."""
    unneeded = {"numpy", "typer", "rich", "dataclasses"} | FOR_FILES | FOR_PROCESSES
    assert imported("import zerorate") & unneeded == set()


def test_a_filter_needs_numpy_alone():
    found = imported("import zerorate; zerorate.DriftFilter(rate=100.0).process([0.0])")
    assert "numpy" in found
    assert found & ({"typer", "rich"} | FOR_FILES | FOR_PROCESSES) == set()


@pytest.mark.parametrize("arguments", [["--version"], ["--nope"], ["nope"]])
def test_what_is_answered_at_once(arguments):
    code = 0 if arguments == ["--version"] else 2
    found = imported(COMMAND.format(arguments, code))
    assert found & ({"numpy", "rich"} | FOR_FILES | FOR_PROCESSES) == set()


def test_help_needs_what_draws_it():
    found = imported(COMMAND.format(["--help"], 0))
    assert found & ({"numpy"} | FOR_FILES | FOR_PROCESSES) == set()


@pytest.mark.parametrize("command", ["replay", "allan", "attitude", "navigate", "identify"])
def test_a_wrong_option_needs_what_knows_the_right_ones(command):
    found = imported(COMMAND.format([command, "--nope"], 2))
    assert found & (FOR_FILES | FOR_PROCESSES | {"rich"}) == set()
