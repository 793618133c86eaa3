"""The command line: exit 0, 1 for data, 2 for usage, 70 for its own fault, 128 + n by signal n.

A fault is one line on stderr; the variable ZERORATE_TRACEBACK adds where it was raised.
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
        # It was reported already; the interpreter's end would try again.
        drop_stdout()
    if code > _SIGNAL_CODE:
        # At once: a library's thread may be inside native code still, where the interpreter's own
        # end would fail. Files are whole or gone by now.
        os._exit(code)
    sys.exit(code)


def run(arguments: Sequence[str]) -> int:
    """Run one command and return its exit code.

    Parameters
    ----------
    arguments : sequence of str
        What stands after ``zerorate``.

    Returns
    -------
    int
        0, 1 for a fault of the data, 2 for one of usage, 70 for one of zerorate, and as a shell
        has it 128 plus the number of the signal that ended the command. A fault is one
        line on stderr.
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
            # Python 3.11 wraps an interrupt while a class is made, as of an import.
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
    # None is what a closed descriptor becomes.
    if sys.stdout is not None:
        sys.stdout.flush()


def _interrupted(number: int) -> int:
    from zerorate.tasks.interrupts import INTERRUPT

    word = "interrupted" if number == INTERRUPT else "terminated"
    return _fail(word, _SIGNAL_CODE + number)


def _of_the_system(error: OSError) -> int:
    """Return the exit code of a file that fails; one without a name is stdout."""
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
