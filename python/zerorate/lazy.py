"""Names of a package whose modules are imported when a name is first asked for."""

from collections.abc import Callable, Iterator, Mapping
from importlib import import_module
from typing import Any

__all__ = ["later"]


def later(
    package: str, places: Mapping[str, tuple[str, ...]]
) -> tuple[Callable[[str], Any], Callable[[], list[str]]]:
    """Return ``__getattr__`` and ``__dir__`` of a package, given the names by module."""
    modules = dict(_by_name(places))

    def get(name: str) -> Any:  # noqa: ANN401
        if name not in modules:
            raise AttributeError(f"module {package!r} has no attribute {name!r}")
        return getattr(import_module(f"{package}.{modules[name]}"), name)

    def names() -> list[str]:
        listed: list[str] = import_module(package).__all__
        return listed

    return get, names


def _by_name(places: Mapping[str, tuple[str, ...]]) -> Iterator[tuple[str, str]]:
    return ((name, module) for module, names in places.items() for name in names)
