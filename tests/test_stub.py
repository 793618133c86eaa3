"""The stub of the native module, which editors read."""

import ast
import inspect
import sys
from pathlib import Path

import zerorate
from zerorate import _native

ROOT = Path(__file__).parents[1]
sys.path.append(str(ROOT / ".ci"))

from stub import with_docstrings  # noqa: E402

BARE = ROOT / "python" / "zerorate" / "_native.pyi"


def test_that_of_a_wheel_tells_what_the_module_tells():
    stub = ast.parse(with_docstrings(BARE.read_text(encoding="utf-8"), _native))
    owners = {one.name: one for one in stub.body if isinstance(one, ast.ClassDef)}
    shared = {one.name: one for one in owners["_Stream"].body if hasattr(one, "name")}
    for name in (one for one in owners if not one.startswith("_")):
        kind, owner = getattr(_native, name), owners[name]
        assert ast.get_docstring(owner) == (kind.__doc__ and inspect.getdoc(kind)), name
        own = {one.name: one for one in owner.body if isinstance(one, ast.FunctionDef)}
        streams = any(isinstance(base, ast.Name) and base.id == "_Stream" for base in owner.bases)
        told = {**(shared if streams else {}), **own}
        for member in (one for one in vars(kind) if not one.startswith("_")):
            assert ast.get_docstring(told[member]) == inspect.getdoc(getattr(kind, member)), member


def test_the_one_that_is_installed_is_one_of_both():
    bare = BARE.read_text(encoding="utf-8")
    installed = Path(zerorate.__file__).with_name("_native.pyi")
    expected = bare if installed.samefile(BARE) else with_docstrings(bare, _native)
    assert installed.read_text(encoding="utf-8") == expected
