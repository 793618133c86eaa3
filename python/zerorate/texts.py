"""Texts from outside, such as names of files; absent packages; how wide a line of text may be."""

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
"""Most letters in a line, unless `use_line_width` says otherwise."""

_MIN_WIDTH: Final = 60
_WIDTH: ContextVar[int] = ContextVar("width", default=WIDTH)


def width() -> int:
    """Return the largest width of a table's line, in letters."""
    return _WIDTH.get()


@contextmanager
def use_line_width(letters: int) -> Iterator[None]:
    """Let lines of tables have so many letters, 60 at least."""
    token = _WIDTH.set(max(letters, _MIN_WIDTH))
    try:
        yield
    finally:
        _WIDTH.reset(token)


def make_printable(text: str) -> str:
    r"""Return a text that UTF-8 can hold: a byte of a name that is no UTF-8 becomes ``\xe9``.

    Python keeps such bytes as lone surrogates, which no file, figure or table takes.
    """
    try:
        raw = text.encode("utf-8", "surrogateescape")
    except UnicodeEncodeError:
        raw = text.encode("utf-8", "backslashreplace")
    return raw.decode("utf-8", "backslashreplace")


def escape_line(text: str) -> str:
    """Return a text with all that cannot be printed, or breaks a line, as Python escapes it."""
    text = make_printable(text)
    return "".join(c if c.isprintable() else c.encode("unicode_escape").decode() for c in text)


def describe_missing_extra(module: str, extra: str, what: str = "this") -> str:
    """Return a sentence on a package that is not installed, and how to install it.

    No index has zerorate, so the extra is installed where zerorate itself was: in its checkout.
    """
    return f"{what} needs {module}: run pip install '.[{extra}]' in the checkout of zerorate"
