"""The command line: exit 0, 1 for data, 2 for usage, 70 for its own fault, 128 + n by signal n.

A fault is one line on stderr; the variable ZERORATE_TRACEBACK adds where it was raised.
"""

import os
import sys
import traceback
from collections.abc import Sequence
from typing import Final

from zerorate.cli.standard import BROKEN_PIPE, drop_stdout, prepare, tell
from zerorate.texts import extra_needed

__all__ = ["main", "run"]

_BY_SIGNAL: Final = 128
_OWN_FAULT: Final = 70
_TRACEBACK: Final = "ZERORATE_TRACEBACK"
_SHOWN: Final = 300


def main() -> None:
    """Run the command line and end the process."""
    prepare()
    code = run(sys.argv[1:])
    try:
        _flush()
    except OSError:
        # It was told already; the interpreter's end would try again.
        drop_stdout()
    if code > _BY_SIGNAL:
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
        has it 128 plus the number of the signal that ended the command. A fault is told in one
        line on stderr.
    """
    try:
        import typer  # noqa: F401
    except ImportError:
        return _fail(extra_needed("typer", "cli"), 2)
    from zerorate.cli.app import invoke
    from zerorate.tasks.interrupts import INTERRUPT, Ending

    with Ending() as ending:
        try:
            code = invoke(list(arguments) or ["--help"])
            _flush()
        # A panic of the native code is no Exception.
        except BaseException as error:
            if _is_interrupt(error):
                return _interrupted(ending.number)
            return _told(error)
        # Some versions of typer turn an interrupt into this code by themselves.
        return _interrupted(ending.number) if code == _BY_SIGNAL + INTERRUPT else code


def _is_interrupt(error: BaseException) -> bool:
    from typer import Abort

    # Python 3.11 wraps an interrupt while a class is made, as of an import.
    return isinstance(error, KeyboardInterrupt | Abort) or isinstance(
        error.__cause__, KeyboardInterrupt
    )


def _told(error: BaseException) -> int:
    """Tell what ended a command, and return its exit code."""
    from zerorate.cli.errors import Fault

    if isinstance(error, SystemExit):
        # What typer makes of a reader that is gone.
        if not isinstance(error.__context__, BrokenPipeError):
            raise error
        return _of_the_system(error.__context__)
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

    told = "interrupted" if number == INTERRUPT else "terminated"
    return _fail(told, _BY_SIGNAL + number)


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
    text = str(error)[:_SHOWN]
    return _fail(
        f"{type(error).__name__}: {text}; this is a fault of zerorate, please report it {hint}",
        _OWN_FAULT,
    )


def _fail(message: str, code: int) -> int:
    tell(message)
    return code
