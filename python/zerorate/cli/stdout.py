"""What becomes of answers that nobody can take."""

import os
import sys
from typing import Final

__all__ = ["BROKEN_PIPE", "drop_stdout"]

BROKEN_PIPE: Final = 128 + 13
"""Exit code of a program that SIGPIPE ended, as a shell shows it."""


def drop_stdout() -> None:
    """Let what nobody takes vanish, or the interpreter complains of it at its end."""
    nowhere = os.open(os.devnull, os.O_WRONLY)
    os.dup2(nowhere, sys.stdout.fileno())
    os.close(nowhere)
