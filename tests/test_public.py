"""What a user sees of the package at a prompt: names and signatures."""

import inspect
from pathlib import Path

import pytest

import zerorate as zr

MODULES = {"zerorate": zr} | {
    name: getattr(zr, name) for name in ("compare", "identify", "live", "metrics", "units")
}
LONGEST = 620


@pytest.mark.parametrize("module", MODULES.values(), ids=MODULES)
def test_completion_shows_what_is_public_and_nothing_else(module):
    assert dir(module) == sorted(module.__all__)
    assert [name for name in module.__all__ if not hasattr(module, name)] == []


def test_the_large_parts_are_among_it():
    assert {"compare", "identify", "live", "metrics", "units"} <= set(dir(zr))


def callables(module):
    """Every public function, class and method of a module, by name; of an exception none."""
    for name in module.__all__:
        found = getattr(module, name)
        if not callable(found) or (inspect.isclass(found) and issubclass(found, Exception)):
            continue
        yield name, found
        public = (one for one in vars(found) if inspect.isclass(found) and not one.startswith("_"))
        methods = ((one, inspect.getattr_static(found, one)) for one in public)
        yield from ((f"{name}.{one}", method) for one, method in methods if callable(method))


@pytest.mark.parametrize("name", MODULES)
def test_signatures_can_be_read(name):
    """As they are written, not with every type that an array can be made from."""
    texts = {one: str(inspect.signature(call)) for one, call in callables(MODULES[name])}
    assert texts
    assert {one: len(text) for one, text in texts.items() if len(text) > LONGEST} == {}
    assert [one for one, text in texts.items() if "_SupportsArray" in text] == []


def test_the_reference_has_every_name():
    page = (Path(__file__).parents[1] / "docs/reference/api.md").read_text(encoding="utf-8")
    assert [name for name in zr.__all__ if f"zerorate.{name}\n" not in page] == ["__version__"]
