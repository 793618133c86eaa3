"""Errors that end a command with one line on stderr and an exit code."""

import os
import re
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from difflib import get_close_matches
from importlib.util import find_spec
from typing import Final

from zerorate.texts import extra_needed

__all__ = [
    "DataFault",
    "Fault",
    "Hint",
    "UsageFault",
    "as_usage",
    "in_options",
    "in_plain_words",
    "of_a_file",
    "read_faults",
    "require",
    "writing",
]

_ALIKE: Final = 0.8

_OF_TYPER: "Final[tuple[tuple[str, Callable[[re.Match[str], Hint], str]], ...]]" = (
    (
        r"Invalid value for '(?P<name>[^']+)': (?:Value error, )?(?P<got>'.*') is not one of "
        r"(?P<known>.+?)\.?",
        lambda found, hint: f"{found['name']} takes {_either(found['known'])}, got {found['got']}",
    ),
    (
        r"Invalid value for '(?P<name>[^']+)': .*\bvalid (?:number|float)\b.*",
        lambda found, hint: f"{found['name']} takes a number",
    ),
    (
        r"Invalid value for '(?P<name>[^']+)': .*\bvalid integer\b.*",
        lambda found, hint: f"{found['name']} takes a whole number",
    ),
    (
        r"Invalid value for '(?P<name>[^']+)': Input should be (?P<bound>.+)",
        lambda found, hint: f"{found['name']} must be {found['bound']}",
    ),
    (
        r"No such option: (?P<got>[^\s.]+)\.?(?: (?:\(Possible options: |Did you mean )"
        r"(?P<meant>[^\s,?)]+).*)?",
        lambda found, hint: f"there is no option {found['got']}{_meant(found, hint)}",
    ),
    (
        r"No such command '(?P<got>[^']*)'\.(?: Did you mean '?(?P<meant>[^'?]+).*)?",
        lambda found, hint: f"there is no command '{found['got']}'{_meant(found, hint)}",
    ),
    (
        r"Missing (?:argument '(?P<name>[^']+)'|option '(?P<option>[^']+)').*",
        lambda found, hint: (
            f"missing: {found['option'] or found['name'].lower()}; for example: {hint.example}"
        ),
    ),
    (
        r"Got unexpected extra arguments?(?:\(s\))? \((?P<got>.*)\)",
        lambda found, hint: f"unexpected: {found['got']}; for example: {hint.example}",
    ),
)
"""What typer says of what was typed, and the same in plain words."""

_KEYWORD = re.compile(
    r"\b(rate|columns|unit|time|time_unit|scale|device|range|start|stop|bridge|topic|group_by|outliers"
    r"|rest_limit|motion)="
    r"|^(rate|bridge|confidence|duration|axes|seed|max_order|segments|smooth|decimate)(?= must )"
)
_TIME_UNIT = re.compile(r"time_unit='(\w+)'")
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
    from zerorate.io import LogError

    try:
        yield
    except LogError as error:
        about_columns = columns_asked and _ON_COLUMNS.search(str(error))
        typed = about_columns or _TYPED.search(str(error))
        raise (UsageFault if typed else DataFault)(in_options(error)) from None
    except OSError as error:
        raise DataFault(of_a_file(error)) from None
    except ImportError as error:
        raise UsageFault(str(error)) from None
    except ValueError as error:
        raise UsageFault(in_options(error)) from None


@contextmanager
def as_usage() -> Iterator[None]:
    """Turn errors of arguments, and of the place to write to, into usage faults."""
    from zerorate.io import LogError

    try:
        yield
    except LogError:
        raise
    except FileExistsError as error:
        raise UsageFault(str(error).replace("force=True", "--force")) from None
    except OSError as error:
        raise UsageFault(of_a_file(error)) from None
    except ValueError as error:
        raise UsageFault(in_options(error)) from None


@contextmanager
def writing() -> Iterator[None]:
    """Turn what writing a file raises, a full disk for instance, into a fault."""
    from zerorate.io import LogError

    try:
        yield
    except FileExistsError as error:
        raise UsageFault(str(error).replace("force=True", "--force")) from None
    except OSError as error:
        raise DataFault(of_a_file(error)) from None
    except LogError as error:
        raise DataFault(str(error)) from None


def require(module: str, extra: str) -> None:
    """Raise a usage fault if an optional dependency is not installed."""
    if find_spec(module) is None:
        raise UsageFault(extra_needed(module, extra))


@dataclass(frozen=True)
class Hint:
    """What helps on with a command that was mistyped: a way to its help, and an example."""

    help: str
    example: str


def in_plain_words(text: str, hint: Hint) -> str:
    """Return what typer says of what was typed in plain words; other texts as they are."""
    for pattern, plain in _OF_TYPER:
        found = re.fullmatch(pattern, text, re.DOTALL)
        if found:
            return plain(found, hint)
    return text


def _either(listed: str) -> str:
    """Return the words of a list as a choice: ``'a', 'b'`` becomes ``a or b``."""
    *most, last = re.findall(r"'([^']*)'", listed)
    return f"{', '.join(most)} or {last}" if most else last


def _meant(found: re.Match[str], hint: Hint) -> str:
    # Typer proposes what is far from what was typed, too.
    if found["meant"] and get_close_matches(found["got"], [found["meant"]], cutoff=_ALIKE):
        return f"; did you mean {found['meant']}?"
    return f"; {hint.help} lists all"


def of_a_file(error: OSError) -> str:
    """Return what the system says of a file, without a number that means nothing to its user."""
    if error.strerror is None:
        return str(error)
    return (
        error.strerror
        if error.filename is None
        else f"{os.fsdecode(error.filename)}: {error.strerror}"
    )


def in_options(text: object) -> str:
    """Return a text with options where it names arguments."""
    told = _DEVICE.sub(
        lambda found: f"--device {found[1]} --range {found[2].replace(', ', ',')}", str(text)
    )
    told = _TIME_UNIT.sub(r"--time-unit \1", told).replace("time=False", "--time none")
    return _KEYWORD.sub(lambda found: f"--{(found[1] or found[2]).replace('_', '-')}", told)
