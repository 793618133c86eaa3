"""The compiled module knows no module of the package: it is told what it goes by."""

import re
from importlib import import_module
from pathlib import Path

import pytest

from zerorate import _native

SOURCES = sorted((Path(__file__).parents[1] / "rust/py/src").rglob("*.rs"))
# Where a class says that it lives.
HOME = re.compile(r'module = "zerorate(\.\w+)?"')


def code(path):
    """The lines of a file without comments, and without the homes of classes."""
    for line in path.read_text(encoding="utf-8").splitlines():
        if not line.lstrip().startswith("//"):
            yield HOME.sub("", line)


def test_there_are_sources():
    assert len(SOURCES) > 20


@pytest.mark.parametrize("path", SOURCES, ids=lambda path: path.name)
def test_it_names_no_module_of_the_package(path):
    assert not [line for line in code(path) if re.search(r"[\"'.]zerorate[\"'.]", line)]


def test_an_unknown_rule_is_refused():
    with pytest.raises(KeyError, match="no rule 'weather'"):
        _native.register(weather=print)


CLASSES = [getattr(_native, name) for name in _native.__all__ if name[0].isupper()]


@pytest.mark.parametrize("kind", CLASSES, ids=lambda kind: kind.__name__)
def test_a_class_stands_where_it_says(kind):
    assert getattr(import_module(kind.__module__), kind.__name__) is kind
