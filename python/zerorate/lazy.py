"""Import of a package's modules at the first access to one of their names."""

from collections.abc import Callable, Mapping
from importlib import import_module
from typing import Any

__all__ = ["lazy_exports", "modules_by_name"]


def lazy_exports(
    package: str, exports: Mapping[str, str]
) -> tuple[Callable[[str], Any], Callable[[], list[str]]]:
    """Return the functions ``__getattr__`` and ``__dir__`` of a package with lazy imports.

    `exports` maps each module to its names, separated by blanks; the key "" lists names of modules.
    Hide ``__getattr__`` from type checkers, because they would accept any name.
    """
    modules = modules_by_name(exports)

    def get(name: str) -> Any:  # noqa: ANN401
        if name not in modules:
            raise AttributeError(f"module {package!r} has no attribute {name!r}")
        attribute = import_module(f"{package}.{modules[name] or name}")
        if modules[name]:
            attribute = getattr(attribute, name)
        setattr(import_module(package), name, attribute)
        return attribute

    def names() -> list[str]:
        listed: list[str] = import_module(package).__all__
        return listed

    return get, names


def modules_by_name(exports: Mapping[str, str]) -> dict[str, str]:
    """Return the module of each public name."""
    return {name: module for module, names in exports.items() for name in names.split()}
