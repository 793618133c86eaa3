"""Command line. Exit codes: 0; 1 data, 2 usage, 70 fault of zerorate; 128 + n signal n.

An error is one line on stderr. The variable ZERORATE_TRACEBACK adds the traceback.
"""

import os
import sys
import traceback
from collections.abc import Sequence
from typing import Final

from zerorate.cli.process import BROKEN_PIPE, drop_stdout, notify, prepare

__all__ = ["main", "run"]

_SIGNAL_CODE: Final = 128
_OWN_FAULT: Final = 70
_TRACEBACK: Final = "ZERORATE_TRACEBACK"
_MAX_SHOWN_LETTERS: Final = 300


def main() -> None:
    """Run the command line and end the process."""
    prepare()
    code = run(sys.argv[1:])
    try:
        _flush()
    except OSError:
        # The error was already reported; the interpreter would report it again at exit.
        drop_stdout()
    if code > _SIGNAL_CODE:
        # Exit at once: the interpreter's own exit fails if a library's thread is in native code.
        # All files are complete or removed.
        os._exit(code)
    sys.exit(code)


def run(arguments: Sequence[str]) -> int:
    """Run one command and return its exit code.

    Parameters
    ----------
    arguments : sequence of str
        Words after ``zerorate``.

    Returns
    -------
    int
        Exit code. An error is also printed as one line on stderr.

        - 0: success
        - 1: error in the data
        - 2: wrong usage
        - 70: error in zerorate
        - 128 + n: signal n ended the command
    """
    from zerorate.cli.app import invoke
    from zerorate.tasks.interrupts import TerminationHandler
    from zerorate.views import collect_figure_faults

    with TerminationHandler() as ending, collect_figure_faults() as faults:
        try:
            code = invoke(list(arguments) or ["--help"])
            _flush()
        except SystemExit as ended:
            return ended.code if isinstance(ended.code, int) else _OWN_FAULT
        # A panic of the native code is no Exception.
        except BaseException as error:
            # Python 3.11 wraps an interrupt during the creation of a class, as in an import.
            if isinstance(error, KeyboardInterrupt) or isinstance(
                error.__cause__, KeyboardInterrupt
            ):
                return _interrupted(ending.number)
            return _exit_code(error)
        for fault in faults:
            notify(str(fault))
        return code or (1 if faults else 0)


def _exit_code(error: BaseException) -> int:
    """Print the reason for a command's end, and return its exit code."""
    from zerorate.cli.errors import Fault

    if isinstance(error, Fault):
        if os.environ.get(_TRACEBACK):
            traceback.print_exception(error)
        return _fail(str(error), error.code)
    if isinstance(error, OSError):
        return _of_the_system(error)
    if isinstance(error, MemoryError):
        return _fail("there is not enough memory for this much data", 1)
    return _own_fault(error)


def _flush() -> None:
    # A closed stream is None.
    if sys.stdout is not None:
        sys.stdout.flush()


def _interrupted(number: int) -> int:
    from zerorate.tasks.interrupts import INTERRUPT

    word = "interrupted" if number == INTERRUPT else "terminated"
    return _fail(word, _SIGNAL_CODE + number)


def _of_the_system(error: OSError) -> int:
    """Return the exit code for a failed file; a file without a name is stdout."""
    if error.filename is not None:
        from zerorate.cli.errors import of_a_file

        return _fail(of_a_file(error), 1)
    drop_stdout()
    if isinstance(error, BrokenPipeError):
        return BROKEN_PIPE
    return _fail(f"the results cannot be printed: {error}", 1)


def _own_fault(error: BaseException) -> int:
    if os.environ.get(_TRACEBACK):
        traceback.print_exception(error)
        hint = "with the lines above"
    else:
        hint = f"with what {_TRACEBACK}=1 adds to it"
    text = str(error)[:_MAX_SHOWN_LETTERS]
    return _fail(
        f"{type(error).__name__}: {text}; this is a fault of zerorate, please report it {hint}",
        _OWN_FAULT,
    )


def _fail(message: str, code: int) -> int:
    notify(message)
    return code
