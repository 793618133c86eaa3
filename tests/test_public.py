"""What a user sees of the package at a prompt: names and signatures."""

import inspect
import re
from importlib import import_module
from pathlib import Path

import pytest

import zerorate as zr
from zerorate.lazy import modules_by_name

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
LONGEST = 900  # of a task, which has the options of its command
ROOT = Path(__file__).parents[1]
PAGES = [ROOT / "README.md", *(ROOT / "docs").rglob("*.md")]


def read(page):
    return page.read_text(encoding="utf-8")


@pytest.mark.parametrize("module", MODULES.values(), ids=MODULES)
def test_completion_shows_what_is_public_and_nothing_else(module):
    assert dir(module) == sorted(module.__all__)
    assert [name for name in module.__all__ if not hasattr(module, name)] == []


def test_the_root_has_the_names_of_readme_and_docs():
    """And few others: those of packages stand there."""
    used = set(re.findall(r"\bzr\.(\w+)", "\n".join(map(read, PAGES))))
    assert used <= set(zr.__all__)
    for name in zr.__all__:
        assert getattr(zr, name) is not None


def test_a_name_of_the_root_is_that_of_its_package():
    for name, place in modules_by_name(zr._LAZY_EXPORTS).items():
        package = import_module(f"zerorate.{place.partition('.')[0] or name}")
        if name in getattr(package, "__all__", ()):
            assert getattr(package, name) is getattr(zr, name)


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
    page = read(ROOT / "docs/reference/api.md")
    page = re.sub(" -- .*", "", page)
    missing = [n for n in zr.__all__ if not re.search(rf"zerorate\.{n}(\..*)?\n", page)]
    assert missing == ["__version__"]


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
