"""What all functions say that return a text, and write it to a file as well if one is given."""

import inspect
from collections.abc import Callable
from typing import Any, Final, TypeVar

__all__ = ["exports"]

_Export = TypeVar("_Export", bound=Callable[..., Any])

_PATH: Final = """path : str or path, optional
    A file to write as well{}. Default: none.
"""
_FORCE: Final = """force : bool
    Whether to replace an existing file; default no.
"""
_FAULT: Final = """OSError
    If the file exists (without `force`) or cannot be written. Nothing is left half-written.
"""


def exports(suffix: str = "") -> Callable[[_Export], _Export]:
    """Return a decorator that adds to a docstring what it says of ``path`` and ``force``.

    Parameters
    ----------
    suffix : str
        The one that files of this kind have by custom, if any.
    """

    def documented(function: _Export) -> _Export:
        path = _PATH.format(f", ``{suffix}`` by custom" if suffix else "")
        begin, _, end = inspect.cleandoc(function.__doc__ or "").partition("\n\nReturns\n")
        summary, _, parameters = begin.partition("\n\n" + _head("Parameters"))
        own = f"{parameters}\n" if parameters else ""
        given = f"{summary}\n\n{_head('Parameters')}{path}{own}{_FORCE}"
        function.__doc__ = f"{given}\nReturns\n{_with_fault(end)}"
        return function

    return documented


def _with_fault(text: str) -> str:
    """Return the end of a docstring, from what is returned on, with the fault of a file."""
    returned, head, raised = text.partition("\n\n" + _head("Raises"))
    if not head:
        returned, blank, rest = text.partition("\n\nNotes\n")
        if not blank:
            returned, blank, rest = text.partition("\n\nExamples\n")
        return f"{returned}\n\n{_head('Raises')}{_FAULT}{blank.removeprefix(chr(10))}{rest}"
    faults, blank, rest = raised.partition("\n\n")
    return f"{returned}{head}{faults}\n{_FAULT}{blank.removeprefix(chr(10))}{rest}"


def _head(section: str) -> str:
    return f"{section}\n{'-' * len(section)}\n"
