"""The command line: exit 0, 1 for data, 2 for usage, 130 when interrupted."""

import os
import sys
from collections.abc import Sequence
from typing import Final

__all__ = ["main", "run"]

_INTERRUPTED: Final = 130


def main() -> None:
    """Run the command line and end the process."""
    code = run(sys.argv[1:])
    if code == _INTERRUPTED:
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
        0, 1 for a fault of the data, 2 for one of usage, 130 after an interrupt. A fault is told
        in one line on stderr.
    """
    try:
        import typer
    except ImportError:
        return _fail("this needs typer: pip install 'zerorate[cli]'", 2)
    from zerorate.cli.app import invoke
    from zerorate.cli.errors import Fault

    try:
        code = invoke(list(arguments) or ["--help"])
        _flush()
    except Fault as fault:
        return _fail(str(fault), fault.code)
    except (KeyboardInterrupt, typer.Abort):
        return _fail("interrupted", _INTERRUPTED)
    except OSError as error:
        return _unprinted(error)
    except MemoryError:
        return _fail("there is not enough memory for this much data", 1)
    except Exception as error:
        # What Python 3.11 makes of an interrupt while a class is made, as of an import.
        if isinstance(error.__cause__, KeyboardInterrupt):
            return _fail("interrupted", _INTERRUPTED)
        # The base class of usage errors has no public name that is the same in every typer.
        if not hasattr(error, "format_message"):
            raise
        return _fail(error.format_message(), 2)
    # Some versions of typer turn an interrupt into this code by themselves.
    return _fail("interrupted", code) if code == _INTERRUPTED else code


def _flush() -> None:
    # None is what a closed descriptor becomes.
    if sys.stdout is not None:
        sys.stdout.flush()


def _unprinted(error: OSError) -> int:
    """Return the exit code if stdout failed: files have names, and faults of their own."""
    from zerorate.cli.errors import BROKEN_PIPE, drop_stdout

    if error.filename is not None:
        raise error
    drop_stdout()
    if isinstance(error, BrokenPipeError):
        return BROKEN_PIPE
    return _fail(f"the results cannot be printed: {error}", 1)


def _fail(message: str, code: int) -> int:
    print(f"zerorate: {' '.join(message.split())}", file=sys.stderr)
    return code
