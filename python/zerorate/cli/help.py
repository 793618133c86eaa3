"""Help on a command: an example, what people use most, and by ``--help-all`` everything in groups.

Made of what the commands take, in letters alone, as wide as the terminal.
"""

import inspect
import textwrap
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from enum import Enum
from pathlib import Path
from typing import Any, Final

from zerorate.cli.typed import annotated
from zerorate.texts import WIDTH, width

HELP: Final = "--help"
ALL: Final = "--help-all"

_READ: Final = ("--unit", "--columns", "--rate")
_FILES: Final = ("--no-figure", "--force")
USUAL: Final[Mapping[str, tuple[str, ...]]] = {
    "replay": ("-o", *_READ, "--device", "--range", "--calibration", "--methods", *_FILES),
    "allan": ("-o", *_READ, "--start", "--stop", "--deviation", "--export", *_FILES),
    "stream": (
        *_READ,
        "--device",
        "--range",
        "--with",
        "--attitude",
        "--sequence",
        "--from",
        "--form",
        "--checkpoint",
    ),
    "batch": ("-o", "--command", *_READ, "--calibration", "--method", "--workers", "--force"),
    "compare": (
        "-o",
        *_READ,
        "--methods",
        "--reference",
        "--quaternion",
        "--simulated",
        "--per-axis",
        "--force",
    ),
    "identify": ("-o", *_READ, "--start", "--stop", "--order", "--criterion", *_FILES),
    "calibrate": (
        "-o",
        *_READ,
        "--accel-columns",
        "--apply",
        "--compare",
        "--temperature",
        "--export",
        "--force",
    ),
    "attitude": (
        "-o",
        "--unit",
        "--rate",
        "--frame",
        "--offline",
        "--no-mag",
        "--calibration",
        "--reference",
        *_FILES,
    ),
    "navigate": (
        "-o",
        "--smooth",
        "--outages",
        "--heading",
        "--vehicle",
        "--wheel-speed",
        "--mount",
        "--antenna",
        "--reference",
        "--force",
    ),
    "walk": ("-o", *_READ, "--floor", "--smooth", "--at", "--heading", "--calibration", *_FILES),
}
"""Options that a short help lists; where a command is not named it lists all."""

_FIRST: Final = 24
"""Letters of the column with the options."""
_GAP: Final = "  "
_KINDS: Final = {float: "NUMBER", int: "N", Path: "FILE"}
_MOST: Final = 30
"""Letters of the choices of an option that stand beside its name."""


MORE: Final[Mapping[str, tuple[str, ...]]] = {
    "replay": (
        "zerorate replay counts.csv --device MPU-6050 --range 250",
        "zerorate replay imu.csv --methods all",
    ),
    "allan": ("zerorate allan first.csv second.csv --unit deg/s --deviation mdev",),
    "stream": (
        "cat lines.csv | zerorate stream --rate 200 --attitude --unit deg/s,g",
        "zerorate stream --rate 100 --from serial:/dev/ttyUSB0@115200 --form xsens",
    ),
    "batch": ("zerorate batch 'logs/**/*.parquet' --command allan -o noise",),
    "compare": ("zerorate compare --simulated --methods auto,kf,mine=my.py:bias",),
    "calibrate": ("zerorate calibrate imu.csv --apply turns-zerorate-calibration.json -o out",),
    "attitude": ("zerorate attitude imu.csv --unit deg/s,g --reference truth.tum",),
    "navigate": ("zerorate navigate imu.csv fixes.csv --vehicle wheeled --wheel-speed speed",),
    "walk": ("zerorate walk foot.csv --smooth --at 48.137,11.575 --heading 90",),
    "simulate": ("zerorate simulate --poses 12 -o turns.csv", "zerorate simulate --list"),
}
"""Further lines to type."""


def asked(words: Sequence[str]) -> bool:
    """Return whether help is asked for among the words of a command."""
    typed = words[: words.index("--")] if "--" in words else words
    return HELP in typed or ALL in typed


def overview(commands: Mapping[str, str], about: str, epilog: str) -> str:
    """Return what the program does, and a line a command."""
    lines = [_filled(f"zerorate: {about}"), "", "Usage: zerorate COMMAND ...", ""]
    for name, what in commands.items():
        lines += _row(name, what, 10)
    lines += ["", *_row("--version", "Print the version and end.", 10), "", _filled(epilog)]
    return "\n".join(lines)


def of_command(
    command: Any,  # noqa: ANN401
    taken: Callable[..., None],
    name: str,
    example: str,
    everything: bool,
) -> str:
    """Return the help on a command.

    Parameters
    ----------
    command : Command
        What typer made of its function.
    taken : callable
        The function, whose annotations say what options take: versions of typer differ in that.
    name : str
        What it is called.
    example : str
        A line to type.
    everything : bool
        Whether all options are listed, with all that is said of them.
    """
    takes = taken_by(command, taken)
    arguments = [one for one in takes if one.is_argument]
    options = [one for one in takes if not one.is_argument]
    what, _, further = (command.help or "").partition("\n\n")
    parts = [
        _filled(f"zerorate {name}: {_joined(what)}"),
        "\n".join(("Examples", *(f"{_GAP}{one}" for one in (example, *MORE.get(name, ()))))),
    ]
    if everything and further:
        parts.append("\n\n".join(_filled(_joined(one)) for one in further.split("\n\n")))
    usage = " ".join((f"zerorate {name}", *(one.typed for one in arguments), "[OPTIONS]"))
    parts.append(_block(f"Usage: {usage}", arguments, everything))
    usual = () if everything else USUAL.get(name, ())
    if usual:
        shown = [one for flag in usual for one in options if flag in one.names]
        parts.append(_block("Options", shown, everything))
        parts.append(_filled(f"{ALL} lists all {len(options)} options, in groups."))
    else:
        groups: dict[str, list[Taken]] = {}
        for one in options:
            groups.setdefault(one.panel, []).append(one)
        parts += [_block(title, many, everything) for title, many in groups.items()]
    return "\n\n".join(parts)


@dataclass(frozen=True)
class Taken:
    """An option or argument, as it is typed, and what is said of it."""

    made: Any
    kind: Any

    @property
    def is_argument(self) -> bool:
        """Whether it has no name that is typed."""
        return bool(self.made.param_type_name == "argument")

    @property
    def names(self) -> Sequence[str]:
        """How the option may be typed."""
        names: Sequence[str] = self.made.opts
        return names

    @property
    def panel(self) -> str:
        """The group that it stands in."""
        usual = "Arguments" if self.is_argument else "Options"
        return getattr(self.made, "rich_help_panel", None) or usual

    @property
    def typed(self) -> str:
        """How it is typed, with what it takes."""
        made = self.made
        if self.is_argument:
            name = str(made.name).upper() + ("..." if made.nargs == -1 else "")
            return name if made.required else f"[{name}]"
        if made.is_flag:
            # What is on by default can be put off.
            return _names(made.secondary_opts if made.default is True else made.opts)
        return f"{_names(made.opts)} {self._takes}"

    @property
    def meaning(self) -> str:
        """What is said of it, with its choices and its default."""
        text = _joined(self.made.help or "")
        if len("|".join(self._choices)) > _MOST:
            text += f" One of {', '.join(self._choices)}."
        default = self._default
        return f"{text} Default: {default}." if default else text

    @property
    def _takes(self) -> str:
        if self.made.metavar:
            return str(self.made.metavar)
        listed = "|".join(self._choices)
        if listed:
            return listed if len(listed) <= _MOST else "WORD"
        return _KINDS.get(self.kind, "NAME")

    @property
    def _choices(self) -> list[str]:
        several = isinstance(self.kind, type) and issubclass(self.kind, Enum)
        return [str(one.value) for one in self.kind] if several else []

    @property
    def _default(self) -> str:
        shown, value = getattr(self.made, "show_default", False), self.made.default
        if isinstance(shown, str):
            return shown
        flag = getattr(self.made, "is_flag", False)
        if not shown or flag or value is None or callable(value) or value in ("", ()):
            return ""
        if value == ".":
            return "this folder"
        text = str(getattr(value, "value", f"{value:g}" if isinstance(value, float) else value))
        return text.replace(",", ", ") if len(text) > _MOST else text


def taken_by(command: Any, function: Callable[..., None]) -> list[Taken]:  # noqa: ANN401
    """Return what a command takes, without what is hidden."""
    own = inspect.signature(function, eval_str=True).parameters
    shown = (one for one in command.params if not getattr(one, "hidden", False))
    return [Taken(one, annotated(own[one.name])[0]) for one in shown if one.name in own]


def _names(opts: Sequence[str]) -> str:
    return ", ".join(sorted(opts, key=len))


def _block(title: str, parameters: Sequence[Taken], everything: bool) -> str:
    lines = [title]
    for one in parameters:
        told = one.meaning if everything else _first_sentence(_joined(one.made.help or ""))
        lines += _row(one.typed, told, _FIRST)
    return "\n".join(lines)


def _row(first: str, text: str, column: int) -> Iterator[str]:
    """Yield the lines of a row: what is too long for the first column has a line of its own."""
    indent = " " * (column + 2 * len(_GAP))
    room = min(width(), WIDTH) - len(indent)
    told = textwrap.wrap(text, room, break_on_hyphens=False, break_long_words=False) or [""]
    if len(first) > column:
        yield f"{_GAP}{first}"
    else:
        yield f"{_GAP}{first.ljust(column)}{_GAP}{told.pop(0)}".rstrip()
    yield from (f"{indent}{line}" for line in told)


def _filled(text: str) -> str:
    return textwrap.fill(text, min(width(), WIDTH), break_on_hyphens=False, break_long_words=False)


def _joined(text: str) -> str:
    return " ".join(text.split())


def _first_sentence(text: str) -> str:
    """Return a text up to its first full stop that ends a sentence."""
    for i, letter in enumerate(text):
        rest = text[i + 1 :]
        ends = not rest or (rest[0] == " " and rest[1:2].isupper())
        if letter == "." and ends and not text[: i + 1].endswith("e.g."):
            return text[: i + 1]
        if letter == ";":
            return f"{text[:i]}."
    return text
