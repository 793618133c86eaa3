"""Errors that end a command with one line on stderr and an exit code."""

import re
from collections.abc import Iterator
from contextlib import contextmanager
from importlib.util import find_spec

from zerorate.io import LogError

__all__ = [
    "DataFault",
    "Fault",
    "UsageFault",
    "as_usage",
    "in_options",
    "read_faults",
    "require",
    "writing",
]

_KEYWORD = re.compile(
    r"\b(rate|columns|unit|scale|device|range|start|stop|bridge|topic|group_by|outliers"
    r"|rest_limit)="
)
_DEVICE = re.compile(r'scale=zr\.raw_counts\("([^"]+)", ([^)]+)\)')
_TYPED = re.compile(r"there is no topic|topic= chooses|\b(start|stop)= ")
_ON_COLUMNS = re.compile(r"there is no column|columns=|columns are named")


class Fault(Exception):
    """A fault with its exit code."""

    code = 1


class DataFault(Fault):
    """The data or the disk is at fault."""


class UsageFault(Fault):
    """What was typed is at fault."""

    code = 2


@contextmanager
def read_faults(columns_asked: bool) -> Iterator[None]:
    """Turn what reading a log raises into faults that name options, not arguments."""
    try:
        yield
    except LogError as error:
        about_columns = columns_asked and _ON_COLUMNS.search(str(error))
        typed = about_columns or _TYPED.search(str(error))
        raise (UsageFault if typed else DataFault)(in_options(error)) from None
    except OSError as error:
        raise DataFault(str(error)) from None
    except ImportError as error:
        raise UsageFault(str(error)) from None
    except ValueError as error:
        raise UsageFault(in_options(error)) from None


@contextmanager
def as_usage() -> Iterator[None]:
    """Turn errors of arguments, and of the place to write to, into usage faults."""
    try:
        yield
    except LogError:
        raise
    except FileExistsError as error:
        raise UsageFault(str(error).replace("force=True", "--force")) from None
    except (ValueError, OSError) as error:
        raise UsageFault(str(error)) from None


@contextmanager
def writing() -> Iterator[None]:
    """Turn what writing a file raises, a full disk for instance, into a fault."""
    try:
        yield
    except FileExistsError as error:
        raise UsageFault(str(error).replace("force=True", "--force")) from None
    except (OSError, LogError) as error:
        raise DataFault(str(error)) from None


def require(module: str, extra: str) -> None:
    """Raise a usage fault if an optional dependency is not installed."""
    if find_spec(module) is None:
        raise UsageFault(f"this needs {module}: pip install 'zerorate[{extra}]'")


def in_options(text: object) -> str:
    """Return a text with options where it names arguments."""
    told = _DEVICE.sub(
        lambda found: f"--device {found[1]} --range {found[2].replace(', ', ',')}", str(text)
    )
    return _KEYWORD.sub(lambda found: f"--{found[1].replace('_', '-')}", told)
