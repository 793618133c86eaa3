"""The standard streams: whatever they are connected to, nothing printed is lost or goes astray."""

import codecs
import os
import re
import sys
from contextlib import suppress
from typing import Final, TextIO

__all__ = ["BROKEN_PIPE", "drop_stdout", "prepare", "tell"]

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


def prepare() -> None:
    """Make the standard streams of this process safe to write on.

    A descriptor that is closed would be given to the next file that is opened, and what is printed
    would go there.
    """
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


def tell(sentence: str) -> None:
    """Print a line on stderr; if nobody can read it there, nowhere."""
    # Where there is no stderr, print would take stdout instead.
    if sys.stderr is not None:
        with suppress(OSError, ValueError):
            print(f"zerorate: {' '.join(sentence.split())}", file=sys.stderr, flush=True)


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
    """Return what stands for characters that an encoding lacks, and where to go on."""
    if not isinstance(error, UnicodeEncodeError):
        raise error
    root = _ROOT.match(error.object, error.start)
    if root is not None and root[1]:
        return f"sqrt({root[1]})", root.end()
    letters = error.object[error.start : error.end]
    return "".join(_PLAIN.get(letter) or _escaped(letter) for letter in letters), error.end


def _escaped(letter: str) -> str:
    # A byte of a name that is no UTF-8 is shown as that byte.
    byte = ord(letter) - 0xDC00
    if 0x80 <= byte <= 0xFF:
        return f"\\x{byte:02x}"
    return letter.encode("ascii", "backslashreplace").decode("ascii")
