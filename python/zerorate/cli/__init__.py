"""The command line: exit 0, 1 for data, 2 for usage, 130 when interrupted."""

import sys
from collections.abc import Sequence

__all__ = ["main", "run"]


def main() -> None:
    """Run the command line and end the process."""
    sys.exit(run(sys.argv[1:]))


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
    from zerorate.cli.faults import Fault

    try:
        code = invoke(list(arguments) or ["--help"])
        _flush()
    except Fault as fault:
        return _fail(str(fault), fault.code)
    except (KeyboardInterrupt, typer.Abort):
        return _fail("interrupted", 130)
    except OSError as error:
        return _unprinted(error)
    except MemoryError:
        return _fail("there is not enough memory for this much data", 1)
    except Exception as error:
        # The base class of usage errors has no public name that is the same in every typer.
        if not hasattr(error, "format_message"):
            raise
        return _fail(error.format_message(), 2)
    # Some versions of typer turn an interrupt into this code by themselves.
    return _fail("interrupted", 130) if code == 130 else code


def _flush() -> None:
    # None is what a closed descriptor becomes.
    if sys.stdout is not None:
        sys.stdout.flush()


def _unprinted(error: OSError) -> int:
    """Return the exit code if stdout failed: files have names, and faults of their own."""
    from zerorate.cli.stdout import BROKEN_PIPE, drop_stdout

    if error.filename is not None:
        raise error
    drop_stdout()
    if isinstance(error, BrokenPipeError):
        return BROKEN_PIPE
    return _fail(f"the results cannot be printed: {error}", 1)


def _fail(message: str, code: int) -> int:
    print(f"zerorate: {' '.join(message.split())}", file=sys.stderr)
    return code
