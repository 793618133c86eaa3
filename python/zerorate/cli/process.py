"""The process of a command: standard streams that lose nothing that is printed, its memory."""

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
"""Exit code of a program that SIGPIPE ended, as a shell shows it."""

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
"""A block that may come from the heap, glibc's own limit."""


def prepare() -> None:
    """Make the standard streams of this process safe to write on, and figures safe to draw.

    A descriptor that is closed would be given to the next file that is opened, and what is printed
    would go there.
    """
    # Figures go to files alone; what a notebook sets for itself may not even be installed here.
    os.environ.pop("MPLBACKEND", None)
    home = os.path.expanduser("~")
    if not os.path.isdir(home) or not os.access(home, os.W_OK):
        # Matplotlib keeps its fonts elsewhere then, which says nothing of a result.
        import logging

        logging.getLogger("matplotlib").setLevel(logging.ERROR)
    # A box in the place of a letter says as much.
    warnings.filterwarnings("ignore", r"Glyph \d+ .*missing from font")
    _reserve(0, os.O_RDONLY)
    # Not writable, so that what somebody prints there is a fault and not lost.
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
    """Print a line on stderr; if nobody can read it there, nowhere."""
    # Where there is no stderr, print would take stdout instead.
    if sys.stderr is not None:
        with suppress(OSError, ValueError):
            line = escape_line(" ".join(sentence.split()))
            print(f"zerorate: {line}", file=sys.stderr, flush=True)


def keep_freed() -> None:
    """Keep freed memory for the next blocks of a record, where glibc takes the setting.

    By itself it hands blocks of a megabyte back, and the kernel clears as much again: of a day's
    replay that takes a quarter of the processor's time. At most 128 MB are kept.
    """
    try:
        mallopt = ctypes.CDLL(None).mallopt
    except (AttributeError, OSError, TypeError):
        return  # another C library
    mallopt(_M_MMAP_THRESHOLD, _MAX_HEAP_BLOCK_BYTES)
    mallopt(_M_TRIM_THRESHOLD, _MAX_KEPT_BYTES)


def drop_stdout() -> None:
    """Let output that nobody reads vanish, or the interpreter complains of it at its end."""
    nowhere = os.open(os.devnull, os.O_WRONLY)
    os.dup2(nowhere, sys.stdout.fileno())
    os.close(nowhere)


def _reserve(descriptor: int, mode: int) -> None:
    try:
        os.fstat(descriptor)
    except OSError:
        # The lowest that is free is this one: those under it are taken by now.
        os.open(os.devnull, mode)


def _let_substitute(stream: TextIO) -> None:
    reconfigure = getattr(stream, "reconfigure", None)
    if reconfigure is not None:
        reconfigure(errors=_SUBSTITUTES)


def _substituted(error: UnicodeError) -> tuple[str | bytes, int]:
    """Return the substitute of a character that an encoding lacks, and where to go on."""
    if not isinstance(error, UnicodeEncodeError):
        raise error
    root = _ROOT.match(error.object, error.start)
    if root is not None and root[1]:
        return f"sqrt({root[1]})", root.end()
    letter = error.object[error.start]
    return _PLAIN.get(letter) or _escaped(letter), error.start + 1


def _escaped(letter: str) -> str:
    return make_printable(letter).encode("ascii", "backslashreplace").decode("ascii")
