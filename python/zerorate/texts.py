"""Texts that come from outside, such as names of files, and what to say of an absent package."""

__all__ = ["extra_needed", "one_line", "printable"]


def printable(text: str) -> str:
    r"""Return a text that UTF-8 can hold: a byte of a name that is no UTF-8 becomes ``\xe9``.

    Python keeps such bytes as lone surrogates, which no file, figure or table takes.
    """
    try:
        raw = text.encode("utf-8", "surrogateescape")
    except UnicodeEncodeError:
        raw = text.encode("utf-8", "backslashreplace")
    return raw.decode("utf-8", "backslashreplace")


def one_line(text: str) -> str:
    """Return a text with all that cannot be printed, or breaks a line, as Python escapes it."""
    text = printable(text)
    return "".join(c if c.isprintable() else c.encode("unicode_escape").decode() for c in text)


def extra_needed(module: str, extra: str, what: str = "this") -> str:
    """Return a sentence on a package that is not installed, and how to install it.

    No index has zerorate, so the extra is installed where zerorate itself was: in its checkout.
    """
    return f"{what} needs {module}: run pip install '.[{extra}]' in the checkout of zerorate"
