"""Faults: their exit codes and options come of what errors carry, not of their words."""

import ast
import copy
from pathlib import Path

import pytest

import zerorate.cli
from support.commands import check_line
from support.logs import write_gyros
from zerorate.cli.errors import DataFault, UsageFault, as_usage, faults, sentence
from zerorate.faults import ArgumentError, keyword_argument, make_sentence, use_argument_names
from zerorate.record import LogError

SOURCES = sorted(Path(zerorate.cli.__file__).parent.glob("*.py"))


def _names(node):
    """Return the names in an expression, without those of which only an attribute is taken."""
    parts = {one.value for one in ast.walk(node) if isinstance(one, ast.Attribute)}
    names = (one for one in ast.walk(node) if isinstance(one, ast.Name) and one not in parts)
    return {one.id for one in names}


def _texts_of_errors(function):
    """Return the names that errors and their texts have in a function."""
    found = set()
    for node in ast.walk(function):
        if isinstance(node, ast.ExceptHandler) and node.name:
            found.add(node.name)
        if isinstance(node, ast.arg) and node.annotation is not None:
            kind = ast.unparse(node.annotation)
            found |= {node.arg} if "Error" in kind or "Exception" in kind else set()
    for node in ast.walk(function):
        if isinstance(node, ast.Assign) and _names(node.value) & found:
            found |= {one.id for one in node.targets if isinstance(one, ast.Name)}
    return found


_READERS = {"sub", "search", "match", "fullmatch", "split", "findall", "finditer", "replace"}


@pytest.mark.parametrize("source", SOURCES, ids=lambda path: path.stem)
def test_no_command_reads_the_sentence_of_an_error(source):
    """No regular expression, and no search for words, looks at an error or at its text."""
    tree = ast.parse(source.read_text(encoding="utf-8"))
    for function in (one for one in ast.walk(tree) if isinstance(one, ast.FunctionDef)):
        texts = _texts_of_errors(function)
        for node in ast.walk(function):
            reads = isinstance(node, ast.Call) and getattr(node.func, "attr", "") in _READERS
            looks = isinstance(node, ast.Compare) and any(isinstance(op, ast.In) for op in node.ops)
            if reads or looks:
                assert not _names(node) & texts, f"{source.name}: {ast.unparse(node)}"
    if source.stem in ("errors", "parameters"):
        imports = (one for one in ast.walk(tree) if isinstance(one, ast.Import))
        assert "re" not in {name.name for one in imports for name in one.names}


CODES = [
    (LogError("any words"), DataFault, 1),
    (LogError("any words", "columns"), UsageFault, 2),
    (LogError("there is no topic, columns= and start= say so"), DataFault, 1),
    (FileNotFoundError(2, "any words", "log.csv"), DataFault, 1),
    (ValueError("any words"), UsageFault, 2),
    (ArgumentError("rate", "any words"), UsageFault, 2),
    (ImportError("any words"), UsageFault, 2),
]


@pytest.mark.parametrize(("error", "fault", "code"), CODES)
@pytest.mark.parametrize("word", ["any words", "other ones", "rate= must be"])
def test_the_exit_code_does_not_hang_on_words(error, fault, code, word):
    """A message that is worded anew has the same code."""
    anew = copy.copy(error)
    anew.args = tuple(word if "any words" in str(one) else one for one in error.args)
    with pytest.raises(fault) as caught, faults():
        raise anew
    assert caught.value.code == code


def test_an_option_is_named_as_the_command_has_it():
    error = ArgumentError("span", "must be long")
    with use_argument_names({"span": "--rest", "force": "--force"}):
        assert sentence(error) == "--rest must be long"
        exists = FileExistsError(
            make_sentence("pass ", keyword_argument("force", "", "force=True"))
        )
        with pytest.raises(UsageFault, match="pass --force"), as_usage():
            raise exists
    assert sentence(error) == "span must be long"


REFUSED = {
    "replay {log} --rate -1": "--rate must be",
    "replay {log} --columns nothing": "there is no column 'nothing'",
    "replay {log} --start -1": "--start is seconds",
    "replay {log} --stop 1e9": "--stop is at",
    "replay {log} --topic /imu": "--topic chooses",
    "replay {log} --time-unit year": "--time-unit must be",
    "replay {log} --scale 0": "--scale must be",
    "replay {log} --unit furlong": "furlong",
    "replay {log} --device gizmo --range 250": "--device is 'gizmo'",
    "replay {log} --device MPU-6050 --range 3": "--range is 3 deg/s",
    "replay {log} --method kf --order 9,9": "--order must be",
    "replay {log} --method kf --bias-limit 3": "--bias-limit has no effect",
    "replay {log} --limit -2": "--limit must be",
    "batch {log} -o out --rate -1": "--rate must be",
    "batch {log} -o out --workers 0": "--workers must be",
    "allan {log} --rate -1": "--rate must be",
    "allan {log} --confidence 2": "--confidence must",
    "allan {log} --bridge -1": "--bridge must not be negative",
    "allan {log} --markov -1": "--markov must not be negative",
    "identify {log} --max-order -1": "--max-order must be",
    "compare {log} --rate -1": "--rate must be",
    "calibrate {log} --rate -1": "--rate must be",
    "attitude {log} --rate -1": "--rate must be",
    "attitude {log} --stop -1": "--stop is seconds",
    "attitude {log} --kp 1": "--kp has no effect on method 'auto', only on 'mahony'",
    "navigate {log} --rate -1": "--rate must be",
    "navigate {log} --wheel-sigma 1": "--wheel-sigma needs --vehicle wheeled",
    "navigate {log} --kind lever": "--kind takes rate or increment, got 'lever'",
    "navigate {log} --heading up": "--heading takes",
    "navigate {log} --time-offset nan": "--time-offset takes",
    "walk {log} --heading 90": "--heading needs --at",
    "walk {log} --at here": "--at takes latitude and longitude, deg,",
    "walk {log} --at 90,0": "--at takes deg, latitude within 89.5 first",
    "walk {log} --at 0,0 --heading 1e9": "--heading takes an angle within 360 deg",
    "stream --rate -1": "--rate must be",
    "stream --rate 100 --rest-limit -1": "--rest-limit must be",
    "simulate MPU-6050 -o sim.csv --rate -1": "--rate must be",
    "simulate MPU-6050 -o sim.csv --duration 0": "--duration must be",
    "simulate MPU-6050 -o sim.csv --axes 0": "--axes must be",
    "demo --seed -1 -o sim": "--seed must be",
}


@pytest.mark.parametrize("typed", REFUSED)
def test_a_refusal_names_the_option(call, tmp_path, monkeypatch, typed):
    monkeypatch.chdir(tmp_path)
    log = write_gyros(tmp_path / "run.csv")
    code, _, errors = call(*typed.format(log=log).split())
    assert code == 2
    check_line(errors, REFUSED[typed])
