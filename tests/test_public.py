"""What a user sees of the package at a prompt: names and signatures."""

import inspect
import re
from importlib import import_module
from pathlib import Path

import pytest

import zerorate as zr

PACKAGES = (
    "array",
    "attitude",
    "calibration",
    "checks",
    "datasets",
    "denoising",
    "findings",
    "geometry",
    "foot",
    "identification",
    "linear",
    "metrics",
    "navigation",
    "noise",
    "record",
    "simulation",
    "tasks.compare",
    "tasks.live",
    "units",
)
MODULES = {"zerorate": zr} | {name: import_module(f"zerorate.{name}") for name in PACKAGES}
ROOT = 40
LONGEST = 620


@pytest.mark.parametrize("module", MODULES.values(), ids=MODULES)
def test_completion_shows_what_is_public_and_nothing_else(module):
    assert dir(module) == sorted(module.__all__)
    assert [name for name in module.__all__ if not hasattr(module, name)] == []


def test_the_root_has_the_names_that_users_need():
    """All others have their home in a package; see `zerorate._PLACES`."""
    assert len(set(zr.__all__) - {"__version__"}) == ROOT == len(zr.__all__) - 1
    assert {"identification", "metrics", "units"} <= set(dir(zr))


def test_what_has_its_home_in_a_package_is_public_there():
    moved = {name: home for name, home in zr._MODULES.items() if name not in zr.__all__}
    assert moved
    for name, home in moved.items():
        package = import_module(f"zerorate.{home}")
        assert name in package.__all__, name
        assert getattr(zr, name) is getattr(package, name)
        assert name not in dir(zr)


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
    page = re.sub(" -- .*", "", page)
    missing = [name for name in zr.__all__ if not re.search(rf"zerorate\.{name}(\.\*)?\n", page)]
    assert missing == ["__version__"]
    moved = (f"zerorate.{home}.{name}" for name, home in zr._MODULES.items() if "." not in home)
    whole = re.findall(r"^(zerorate\.\S+)\.\*$", page, re.MULTILINE)
    listed = (name for name in moved if name.rpartition(".")[0] not in whole)
    assert [name for name in listed if f"{name}\n" not in page and "._native." not in name] == []


@pytest.mark.parametrize("name", MODULES)
def test_every_class_and_function_has_an_example(name):
    """What `pytest --doctest-modules --pyargs zerorate` runs; types of arguments have none."""
    found = {one: getattr(MODULES[name], one) for one in MODULES[name].__all__}
    told = {one: inspect.getdoc(what) or "" for one, what in found.items() if takes_example(what)}
    assert [one for one, text in told.items() if ">>> " not in text] == []


def takes_example(what):
    """Return whether it is a class or a function of the package, and no exception."""
    if inspect.isclass(what):
        return not issubclass(what, Exception)
    return inspect.isroutine(what)
