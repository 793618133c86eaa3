"""Errors that end a command with one line on stderr and an exit code."""

import os
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from importlib.util import find_spec
from typing import TYPE_CHECKING

from zerorate.faults import render_text, sentence_of
from zerorate.texts import describe_missing_extra

if TYPE_CHECKING:
    from zerorate.record import LogError


class Fault(Exception):
    """A fault with its exit code."""

    code = 1


class DataFault(Fault):
    """Fault of the data or the disk."""


class UsageFault(Fault):
    """Fault in the command line."""

    code = 2


def sentence(error: BaseException) -> str:
    """Return the message of an error, with the command's options as names of arguments."""
    return render_text(sentence_of(error))


@contextmanager
def faults() -> Iterator[None]:
    """Turn errors of a task into faults of the data or of the command line.

    Contradictions in the recording are printed first, because they may be the cause.
    """
    try:
        yield
    except _log_errors() as error:
        print_alarms(getattr(error, "__notes__", ()))
        raise (DataFault if error.argument is None else UsageFault)(sentence(error)) from error
    except FileExistsError as error:
        raise UsageFault(of_a_file(error)) from error
    except OSError as error:
        # An OSError without a file name is from stdout.
        if error.filename is None and error.errno is not None:
            raise
        raise DataFault(of_a_file(error)) from error
    except (ImportError, ValueError) as error:
        raise UsageFault(sentence(error)) from error


def _log_errors() -> "tuple[type[LogError], ...]":
    """Return the class of errors of logs; empty if its module has not been imported."""
    module = sys.modules.get("zerorate.record.log")
    return () if module is None else (module.LogError,)


def print_alarms(alarms: Sequence[str]) -> None:
    """Print the contradictions in a recording and an empty line, if there are any."""
    if alarms:
        print("\n".join(map(render_text, alarms)), end="\n\n")


@contextmanager
def as_usage() -> Iterator[None]:
    """Turn errors of arguments and of destinations into usage faults."""
    from zerorate.record import LogError

    try:
        yield
    except LogError:
        raise
    except OSError as error:
        raise UsageFault(of_a_file(error)) from None
    except ValueError as error:
        raise UsageFault(sentence(error)) from None


def require(module: str, extra: str) -> None:
    """Raise a usage fault if an optional package is not installed."""
    if find_spec(module) is None:
        raise UsageFault(describe_missing_extra(module, extra))


def of_a_file(error: OSError) -> str:
    """Return the system's message on a file, without the error number."""
    if error.strerror is None:
        return sentence(error)
    return (
        error.strerror
        if error.filename is None
        else f"{os.fsdecode(error.filename)}: {error.strerror}"
    )
