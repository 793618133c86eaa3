"""Common parts of docstrings of functions that export to a text or read it."""

import inspect
import re
from collections.abc import Callable
from typing import Any, Final, TypeVar

_Documented = TypeVar("_Documented", bound=Callable[..., Any])

_SECTIONS: Final = ("Parameters", "Returns", "Raises", "Notes", "Examples")
_SECTION_HEAD: Final = re.compile(rf"\n\n({'|'.join(_SECTIONS)})\n-+\n")
_PATH_DOC: Final = """path : str or path, optional
    Path of a file to which the text is written{}. Default: no file."""
_FORCE_DOC: Final = """force : bool
    Replace an existing file; default False."""
_FAULT_DOC: Final = """OSError
    If the file exists and `force` is False, or if the file cannot be written. No incomplete file
    remains."""
_SOURCE_DOC: Final = """source : str or path
    The text, beginning with ``{``, or the path of a file."""
_RAISES_DOC: Final = """ValueError
    If the text is not from ``to_json``, or has an unknown version.
OSError
    If the file cannot be read."""


def document_export(
    suffix: str = "", *, returned: str = "", faults: str = "", options: str = ""
) -> Callable[[_Documented], _Documented]:
    """Return a decorator that adds sentences on ``path`` and ``force`` to a docstring.

    Parameters
    ----------
    suffix : str
        Usual suffix of these files, if any.
    returned, faults : str
        Common sentences on the returned text and on errors; they end these sections.
    options : str
        Common entries of options, placed before ``force``.
    """
    path = _PATH_DOC.format(f", usually ``{suffix}``" if suffix else "")

    def documented(function: _Documented) -> _Documented:
        parts = _split_sections(function)
        parts["Parameters"] = _lines(path, parts.get("Parameters"), options, _FORCE_DOC)
        parts["Returns"] = _lines(parts.get("Returns"), returned)
        parts["Raises"] = _lines(parts.get("Raises"), faults, _FAULT_DOC)
        return _join_sections(function, parts)

    return documented


def document_restore(function: _Documented) -> _Documented:
    """Add the common sentences on reading a text from ``to_json`` to a docstring."""
    return _join_sections(
        function, {**_split_sections(function), "Parameters": _SOURCE_DOC, "Raises": _RAISES_DOC}
    )


def _split_sections(function: Callable[..., Any]) -> dict[str, str]:
    """Return the sections of a docstring by heading, with the text before them."""
    first, *rest = _SECTION_HEAD.split(inspect.cleandoc(function.__doc__ or ""))
    return {"": first, **dict(zip(rest[::2], rest[1::2], strict=True))}


def _join_sections(function: _Documented, parts: dict[str, str]) -> _Documented:
    present = (name for name in _SECTIONS if parts.get(name))
    texts = (f"{name}\n{'-' * len(name)}\n{parts[name]}" for name in present)
    function.__doc__ = "\n\n".join((parts[""], *texts)) + "\n"
    return function


def _lines(*parts: str | None) -> str:
    return "\n".join(filter(None, parts))
