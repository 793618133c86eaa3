"""Printable texts, messages on missing packages, and the width of lines."""

from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from typing import Final

__all__ = [
    "WIDTH",
    "describe_missing_extra",
    "escape_line",
    "make_printable",
    "use_line_width",
    "width",
]

WIDTH: Final = 100
"""Default of the largest width of a line, characters."""

_MIN_WIDTH: Final = 60
_WIDTH: ContextVar[int] = ContextVar("width", default=WIDTH)


def width() -> int:
    """Return the largest width of a table's line, in characters."""
    return _WIDTH.get()


@contextmanager
def use_line_width(letters: int) -> Iterator[None]:
    """Set the largest width of lines in tables within ``with``; at least 60 characters."""
    token = _WIDTH.set(max(letters, _MIN_WIDTH))
    try:
        yield
    finally:
        _WIDTH.reset(token)


def make_printable(text: str) -> str:
    r"""Return a text that UTF-8 can encode; other bytes of a file's name become escapes.

    An escape is for example ``\xe9``. Python keeps such bytes as lone surrogates, which files,
    figures and tables cannot contain.
    """
    try:
        raw = text.encode("utf-8", "surrogateescape")
    except UnicodeEncodeError:
        raw = text.encode("utf-8", "backslashreplace")
    return raw.decode("utf-8", "backslashreplace")


def escape_line(text: str) -> str:
    """Return a text with escapes for line breaks and other unprintable characters."""
    text = make_printable(text)
    return "".join(c if c.isprintable() else c.encode("unicode_escape").decode() for c in text)


def describe_missing_extra(module: str, extra: str, what: str = "this") -> str:
    """Return a message on a package that is not installed, with the command that installs it.

    zerorate is in no package index, so the command installs the extra from the checkout.
    """
    return f"{what} needs {module}: run pip install '.[{extra}]' in the checkout of zerorate"
