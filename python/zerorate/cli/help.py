"""Help on a command: examples and usual options, or all options with ``--help-all``.

Plain text from the commands' options, as wide as the terminal.
"""

import inspect
import textwrap
from collections.abc import Iterator, Mapping, Sequence
from typing import Final

from zerorate.cli.parameters import Argument, Option, Taker
from zerorate.texts import WIDTH, width

HELP: Final = "--help"
ALL: Final = "--help-all"

_FIRST_COLUMN: Final = 24
"""Width of the column of options, characters."""
_GAP: Final = "  "


def is_wanted(words: Sequence[str]) -> bool:
    """Return True if the words of a command request help."""
    typed = words[: words.index("--")] if "--" in words else words
    return HELP in typed or ALL in typed


def overview(commands: Mapping[str, str], about: str, epilog: str) -> str:
    """Return the description of the program, with one line for each command."""
    lines = [_filled(f"zerorate: {about}"), "", "Usage: zerorate COMMAND ...", ""]
    for name, what in commands.items():
        lines += _row(name, what, 10)
    lines += ["", *_row("--version", "Print the version and end.", 10), "", _filled(epilog)]
    return "\n".join(lines)


def of_command(
    name: str, taker: Taker, examples: Sequence[str], usual: str, everything: bool
) -> str:
    """Return the help on a command.

    Parameters
    ----------
    name : str
        Name of the command.
    taker : Taker
        Parser and function of the command.
    examples : sequence of str
        Examples to type; the first is for beginners.
    usual : str
        Options in the short help, separated by blanks; empty for all.
    everything : bool
        List all options with their complete texts.
    """
    taken = [*taker.options()]
    arguments = [one for one in taken if isinstance(one, Argument)]
    options = [one for one in taken if one not in arguments]
    about, _, further = (inspect.getdoc(taker.takes) or "").partition("\n\n")
    first, *more = (f"{_GAP}{one}" for one in examples)
    parts = [_filled(f"zerorate {name}: {_joined(about)}"), f"Begin with\n{first}"]
    if more:
        parts.append("\n".join(("More examples", *more)))
    if everything and further:
        parts.append("\n\n".join(_filled(_joined(one)) for one in further.split("\n\n")))
    usage = " ".join((f"zerorate {name}", *(one.typed for one in arguments), "[OPTIONS]"))
    parts.append(_block(f"Usage: {usage}", arguments, everything))
    if usual and not everything:
        shown = [one for flag in usual.split() for one in options if flag in one.all_flags]
        parts.append(_block("Options", shown, everything))
        parts.append(_filled(f"{ALL} lists all {len(options)} options, in groups."))
    else:
        panels: dict[str, list[Option]] = {}
        for one in options:
            panels.setdefault(one.panel or "Options", []).append(one)
        parts += [_block(title, many, everything) for title, many in panels.items()]
    return "\n\n".join(parts)


def _block(title: str, options: Sequence[Option], everything: bool) -> str:
    lines = [title]
    for one in options:
        text = one.meaning if everything else _first_sentence(one.help)
        lines += _row(one.typed, text, _FIRST_COLUMN)
    return "\n".join(lines)


def _row(first: str, text: str, column: int) -> Iterator[str]:
    """Yield the lines of a row; a long first text gets a separate line."""
    indent = " " * (column + 2 * len(_GAP))
    room = min(width(), WIDTH) - len(indent)
    wrapped = textwrap.wrap(text, room, break_on_hyphens=False, break_long_words=False) or [""]
    if len(first) > column:
        yield f"{_GAP}{first}"
    else:
        yield f"{_GAP}{first.ljust(column)}{_GAP}{wrapped.pop(0)}".rstrip()
    yield from (f"{indent}{line}" for line in wrapped)


def _filled(text: str) -> str:
    return textwrap.fill(text, min(width(), WIDTH), break_on_hyphens=False, break_long_words=False)


def _joined(text: str) -> str:
    return " ".join(text.split())


def _first_sentence(text: str) -> str:
    """Return the first sentence of a text."""
    for i, letter in enumerate(text):
        rest = text[i + 1 :]
        ends = not rest or (rest[0] == " " and rest[1:2].isupper())
        if letter == "." and ends and not text[: i + 1].endswith("e.g."):
            return text[: i + 1]
        if letter == ";":
            return f"{text[:i]}."
    return text
