"""Views of results: the table and the figure of each, found by its class when they are asked for.

What shows results registers itself here; a result knows nothing of how it is shown.
"""

from __future__ import annotations

from collections.abc import Mapping
from importlib import import_module
from typing import TYPE_CHECKING, Any, NamedTuple

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["Result", "View", "figure_of", "register", "shown_by", "table_of"]


class View(NamedTuple):
    """The functions that make a result's table and its figure, ``"module:name"`` each."""

    table: str
    figure: str


_VIEWS: dict[str, View] = {}
_SHOWN_BY: list[str] = []


def shown_by(module: str) -> None:
    """Say which module registers views; it is imported when the first one is asked for."""
    _SHOWN_BY.append(module)


def register(package: str, views: Mapping[str, View]) -> None:
    """Register the views of results, by ``"module.Class"`` within a package.

    Nothing is imported before a view is asked for.
    """
    _VIEWS.update({f"{package}.{name}": view for name, view in views.items()})


def table_of(result: object, *arguments: object) -> str:
    """Return the table of a result as text; TypeError if there is none for its class."""
    return str(_called(_view_of(result).table)(result, *arguments))


def figure_of(result: object, *arguments: object) -> Figure:
    """Return the figure of a result.

    Raises
    ------
    ImportError
        Without matplotlib, of the extra ``plot``.
    TypeError
        If there is none for its class.
    """
    figure: Figure = _called(_view_of(result).figure)(result, *arguments)
    return figure


def _view_of(result: object) -> View:
    while _SHOWN_BY:
        import_module(_SHOWN_BY.pop())
    for one in type(result).__mro__:
        view = _VIEWS.get(f"{one.__module__}.{one.__qualname__}")
        if view is not None:
            return view
    raise TypeError(f"nothing is registered that shows a {type(result).__name__}")


def _called(place: str) -> Any:  # noqa: ANN401
    module, _, name = place.partition(":")
    return getattr(import_module(module), name)


class Result:
    """What a person gets back: `table`, `plot` and `str` are alike for every result."""

    __slots__ = ()

    def table(self) -> str:
        """Return what was found as text, for a terminal or a page."""
        return table_of(self)

    def plot(self) -> Figure:
        """Return the figure; ImportError without matplotlib, of the extra ``plot``."""
        return figure_of(self)

    def __str__(self) -> str:
        """Return the table."""
        return self.table()
