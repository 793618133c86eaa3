"""Process of a command: standard streams and memory."""

import codecs
import ctypes
import os
import re
import sys
import warnings
from contextlib import suppress
from typing import Final, TextIO

from zerorate.texts import escape_line, make_printable

BROKEN_PIPE: Final = 128 + 13
"""Exit code of a program ended by SIGPIPE, as in a shell."""

_SUBSTITUTES: Final = "zerorate.substitutes"
_ROOT: Final = re.compile(r"√(\w*)", re.ASCII)
_PLAIN: Final = {
    "±": "+/-",
    "√": "sqrt",
    "°": "deg",
    "º": "deg",
    "µ": "u",
    "μ": "u",
    "σ": "sigma",
    "φ": "phi",
    "θ": "theta",
    "τ": "tau",
    "²": "^2",
    "³": "^3",
    "·": "*",
    "×": "x",
    "†": "*",
    "…": "...",
    "–": "-",
    "—": "-",
    "−": "-",
    "ê": "e",
}

_M_TRIM_THRESHOLD: Final = -1
_M_MMAP_THRESHOLD: Final = -3
_MAX_KEPT_BYTES: Final = 1 << 27
_MAX_HEAP_BLOCK_BYTES: Final = 1 << 25
"""Largest block that glibc takes from the heap, bytes."""


def prepare() -> None:
    """Make the standard streams safe to write to, and figures safe to draw.

    Otherwise the next opened file would get a closed standard descriptor, and printed text would go
    into this file.
    """
    # Figures are drawn into files only; the backend of a notebook may not be installed.
    os.environ.pop("MPLBACKEND", None)
    home = os.path.expanduser("~")
    if not os.path.isdir(home) or not os.access(home, os.W_OK):
        # Hide matplotlib's message on another folder for fonts.
        import logging

        logging.getLogger("matplotlib").setLevel(logging.ERROR)
    # The figure shows a box for a missing letter.
    warnings.filterwarnings("ignore", r"Glyph \d+ .*missing from font")
    _reserve(0, os.O_RDONLY)
    # Read-only, so that printing raises an error.
    _reserve(1, os.O_RDONLY)
    _reserve(2, os.O_WRONLY)
    if sys.stdout is None:
        sys.stdout = os.fdopen(1, "w", encoding="utf-8", closefd=False)
    if sys.stderr is None:
        sys.stderr = os.fdopen(2, "w", encoding="utf-8", closefd=False)
    codecs.register_error(_SUBSTITUTES, _substituted)
    for stream in (sys.stdout, sys.stderr):
        _let_substitute(stream)


def notify(sentence: str) -> None:
    """Print a line on stderr, or nowhere if stderr is closed."""
    # With a closed stderr, print would use stdout.
    if sys.stderr is not None:
        with suppress(OSError, ValueError):
            line = escape_line(" ".join(sentence.split()))
            print(f"zerorate: {line}", file=sys.stderr, flush=True)


def keep_freed() -> None:
    """Keep freed memory for the next blocks of a record, if the C library is glibc.

    By default glibc returns blocks of a megabyte to the kernel, which must clear them again. This
    takes a quarter of the processor time of a one-day replay. At most 128 MB are kept.
    """
    try:
        mallopt = ctypes.CDLL(None).mallopt
    except (AttributeError, OSError, TypeError):
        return  # another C library
    mallopt(_M_MMAP_THRESHOLD, _MAX_HEAP_BLOCK_BYTES)
    mallopt(_M_TRIM_THRESHOLD, _MAX_KEPT_BYTES)


def drop_stdout() -> None:
    """Discard unread output; otherwise the interpreter prints a message at exit."""
    nowhere = os.open(os.devnull, os.O_WRONLY)
    os.dup2(nowhere, sys.stdout.fileno())
    os.close(nowhere)


def _reserve(descriptor: int, mode: int) -> None:
    try:
        os.fstat(descriptor)
    except OSError:
        # open() returns this descriptor because all lower ones are in use.
        os.open(os.devnull, mode)


def _let_substitute(stream: TextIO) -> None:
    reconfigure = getattr(stream, "reconfigure", None)
    if reconfigure is not None:
        reconfigure(errors=_SUBSTITUTES)


def _substituted(error: UnicodeError) -> tuple[str | bytes, int]:
    """Return the substitute for a character that the encoding lacks, and the next position."""
    if not isinstance(error, UnicodeEncodeError):
        raise error
    root = _ROOT.match(error.object, error.start)
    if root is not None and root[1]:
        return f"sqrt({root[1]})", root.end()
    letter = error.object[error.start]
    return _PLAIN.get(letter) or _escaped(letter), error.start + 1


def _escaped(letter: str) -> str:
    return make_printable(letter).encode("ascii", "backslashreplace").decode("ascii")
