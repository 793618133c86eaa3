"""Options of several commands, those of the filter among them, and texts that become arguments."""

import inspect
import re
from collections.abc import Callable, Mapping, Sequence
from enum import Enum, StrEnum
from pathlib import Path
from typing import Annotated, Any, Final, TypeAlias, TypeVar, cast

import typer

from zerorate._native import DriftFilter
from zerorate.cli.errors import UsageFault
from zerorate.options import FILTER_OPTIONS, LIMITS, METHODS, Option, check_used, used_by

__all__ = [
    "OUTPUT",
    "RECORDING",
    "Columns",
    "FigureFormat",
    "FigureFormatOption",
    "Force",
    "GroupBy",
    "LogArgument",
    "LogFormat",
    "LogFormatOption",
    "NoFigure",
    "Output",
    "Rate",
    "Topic",
    "Unit",
    "check_filter_options",
    "flag",
    "parse_choices",
    "parse_columns",
    "parse_order",
    "parse_words",
    "with_filter_options",
]

_Choice = TypeVar("_Choice", bound=StrEnum)

_WORDS: Final = {"adapt_for": "always", "rest_limit": "none", "bias_limit": "none"}
"""What None is called on the command line, where a number is the default."""

_TAKEN: Final = {"order": "two numbers p,q: p from 1 to 3, q from 0 to 3"}
"""What a kind of option takes, where that is typed otherwise than in Python."""

_DEFAULTS: Final = {"order": "2,1; robust: 1,0"}
"""Defaults that depend on the method, as help shows them."""

_FLAGS: Final = {
    # Where files are written, that is what --output means.
    "output": "--output-kind",
    # Where logs are read, --scale multiplies their values.
    "scale": "--noise-scale",
}
"""Options of the filter that are called otherwise than in Python."""

_FIRST: Final = re.compile(rf"^({'|'.join(FILTER_OPTIONS)})\b")
"""The option that a refusal begins with."""

_REQUIRED: Final = inspect.Parameter.empty
RECORDING: Final = (
    "Recording: csv, tsv, txt, npy, npz, parquet, arrow, feather, h5, mat, bag, mcap, ulg, "
    "or the folder of a ROS 2 bag."
)


OUTPUT: Final = "Output"
"""The panel of help with what is written, and where."""


class LogFormat(StrEnum):
    """File formats of a log."""

    parquet = "parquet"
    csv = "csv"
    npz = "npz"


class FigureFormat(StrEnum):
    """File formats of a figure."""

    png = "png"
    svg = "svg"
    pdf = "pdf"


LogArgument: TypeAlias = Annotated[Path, typer.Argument(help=RECORDING)]
Output: TypeAlias = Annotated[
    str,
    typer.Option(
        "-o",
        "--output",
        metavar="PATH",
        help="Folder for the files, or the name of one of them; a missing folder is made.",
        rich_help_panel=OUTPUT,
    ),
]
Columns: TypeAlias = Annotated[
    str | None, typer.Option(help="Names or indices with commas between.")
]
GroupBy: TypeAlias = Annotated[
    str | None,
    typer.Option(help="Column that tells several sensors or recordings apart: each is a log."),
]
Topic: TypeAlias = Annotated[
    str | None,
    typer.Option(help="Topic of a ROS recording or a PX4 log, where several hold an IMU."),
]
Rate: TypeAlias = Annotated[float | None, typer.Option(help="Samples per second, Hz.")]
Unit: TypeAlias = Annotated[str | None, typer.Option(help="rad/s, deg/s, deg/h.")]
LogFormatOption: TypeAlias = Annotated[
    LogFormat | None,
    typer.Option(
        help="File format of the filtered log; else the suffix of -o, or parquet.",
        show_default=False,
        rich_help_panel=OUTPUT,
    ),
]
FigureFormatOption: TypeAlias = Annotated[
    FigureFormat | None,
    typer.Option(
        help="File format of the figure; else the suffix of -o, or png.",
        show_default=False,
        rich_help_panel=OUTPUT,
    ),
]
NoFigure: TypeAlias = Annotated[
    bool, typer.Option("--no-figure", help="Draw no figure.", rich_help_panel=OUTPUT)
]
Force: TypeAlias = Annotated[
    bool, typer.Option("--force", help="Replace existing files.", rich_help_panel=OUTPUT)
]


def with_filter_options(
    help: Mapping[str, str] | None = None, **defaults: object
) -> Callable[[Callable[..., None]], Callable[..., None]]:
    """Return a decorator that gives a command the options of the filter, from their table.

    The command takes them as `options`, a mapping by the names of `zerorate.DriftFilter`: those
    that were given, and the command's own `defaults` that are not None.

    Parameters
    ----------
    help : mapping of str to str, optional
        Texts for some options instead of those of the table.
    **defaults
        Defaults of the command instead of those of the table.
    """
    texts = help or {}
    table = {
        name: (option, defaults.get(name, option.default))
        for name, option in FILTER_OPTIONS.items()
    }

    def decorated(command: Callable[..., None]) -> Callable[..., None]:
        def entry(**arguments: Any) -> None:  # noqa: ANN401
            context: typer.Context = arguments.pop("context")
            values = {name: arguments.pop(_argument(name)) for name in table}
            options = {
                name: _parsed(table[name][0], value)
                for name, value in values.items()
                if _was_given(context, _argument(name)) or defaults.get(name) is not None
            }
            command(**arguments, options=options)

        parameters = [_keyword("context", typer.Context)]
        for own in inspect.signature(command, eval_str=True).parameters.values():
            if own.name == "options":
                parameters += [_parameter(*row, texts) for row in table.values()]
            else:
                parameters.append(_keyword(own.name, own.annotation, own.default))
        entry.__name__, entry.__doc__ = command.__name__, command.__doc__
        entry.__annotations__ = {one.name: one.annotation for one in parameters}
        entry.__signature__ = inspect.Signature(parameters)  # type: ignore[attr-defined]
        return entry

    return decorated


def check_filter_options(options: Mapping[str, Any], methods: Sequence[str]) -> None:
    """Raise a usage fault for an option that no method uses, or a value that is refused."""
    try:
        check_used(options, methods)
        for method in methods:
            # Of the rate no refusal depends.
            DriftFilter(1.0, **{**used_by(method, options), "method": method})
    except ValueError as error:
        raise UsageFault(_FIRST.sub(lambda found: flag(found[0]), str(error))) from None


def flag(name: str) -> str:
    """Return how an option of the filter is called on the command line."""
    return _FLAGS.get(name, f"--{name.replace('_', '-')}")


def _argument(name: str) -> str:
    return flag(name).removeprefix("--").replace("-", "_")


def _keyword(name: str, annotation: Any, default: Any = _REQUIRED) -> inspect.Parameter:  # noqa: ANN401
    kind = inspect.Parameter.KEYWORD_ONLY
    return inspect.Parameter(name, kind, default=default, annotation=annotation)


def _parameter(option: Option, default: object, texts: Mapping[str, str]) -> inspect.Parameter:
    """Return an option of the filter as a parameter of a command."""
    value: Any = float
    metavar = None
    if option.kind == "choice":
        value = _members(option)
        default = default and value(default)
    elif option.kind == "order":
        value, metavar = str, "p,q"
        default = ",".join(map(str, cast(tuple[int, int], default)))
    elif option.kind == "pair or word":
        value, metavar = str, "<float,float>"
        default = ",".join(f"{number:g}" for number in cast(tuple[float, float], default))
    elif option.name in _WORDS:
        value, metavar = str, "<float>"
        default = _WORDS[option.name] if default is None else f"{default:g}"
    limit = LIMITS.get(option.name)
    shown: bool | str = _DEFAULTS.get(option.name, True)
    if limit is not None:
        shown = f"{limit:g} deg/s, where the unit is known"
    about = typer.Option(
        flag(option.name),
        metavar=metavar,
        help=texts.get(option.name, _help(option)),
        show_default=shown,
        rich_help_panel=_panel(option),
    )
    annotation: Any = Annotated[value | None if default is None else value, about]
    return _keyword(_argument(option.name), annotation, default)


def _panel(option: Option) -> str:
    """Return the panel of help that an option stands in, by the methods that use it."""
    return "Filter" if option.methods == METHODS else f"Only for {', '.join(option.methods)}"


def _members(option: Option) -> Any:  # noqa: ANN401
    """Return the choices as a class that typer lists in help, and refuses all others by."""
    named: Any = StrEnum
    return named(option.name, [(choice, choice) for choice in option.choices])


def _help(option: Option) -> str:
    """Return what an option means and takes: a choice shows that by itself."""
    meaning = f"{option.meaning[0].upper()}{option.meaning[1:]}."
    if option.kind == "choice":
        return meaning
    taken = _TAKEN.get(option.kind, option.expected)
    word = f", or '{_WORDS[option.name]}'" if option.name in _WORDS else ""
    return f"{meaning} {taken[0].upper()}{taken[1:]}{word}."


def _parsed(option: Option, value: Any) -> object:  # noqa: ANN401
    if option.kind == "order":
        return parse_order(value)
    if option.kind == "pair or word":
        return _parse_pair(option, value)
    if option.name in _WORDS:
        return _parse_number(flag(option.name), value, _WORDS[option.name])
    return value.value if isinstance(value, Enum) else value


def _was_given(context: typer.Context, name: str) -> bool:
    source = context.get_parameter_source(name)
    return source is not None and source.name not in ("DEFAULT", "DEFAULT_MAP")


def _parse_number(option: str, text: str, word: str) -> float | None:
    """Return the number, None for the word."""
    if text == word:
        return None
    try:
        return float(text)
    except ValueError:
        raise UsageFault(f"{option} takes a number or '{word}', got '{text}'") from None


def _parse_pair(option: Option, text: str) -> tuple[float, float] | str:
    """Return the two numbers of ``4,0.75``, or the word that may stand in their place."""
    if text in option.choices:
        return text
    try:
        first, second = map(float, text.split(","))
    except ValueError:
        words = " or ".join(f"'{word}'" for word in option.choices)
        raise UsageFault(
            f"{flag(option.name)} takes two numbers with a comma between or {words}, got '{text}'"
        ) from None
    return first, second


def parse_order(text: str) -> tuple[int, int]:
    """Return the orders of ``2,1``."""
    found = re.fullmatch(r"\s*([0-9]+)\s*,\s*([0-9]+)\s*", text)
    if found is None:
        raise UsageFault(f"--order takes two numbers p,q such as 2,1, got '{text}'")
    return int(found[1]), int(found[2])


def parse_columns(text: str | None) -> list[str | int] | None:
    """Return the names and indices of a list with commas."""
    if text is None:
        return None
    words = parse_words("--columns", text, "names or indices")
    return [int(word) if re.fullmatch("-?[0-9]+", word) else word for word in words]


def parse_words(option: str, text: str, expected: str = "names") -> list[str]:
    """Return the words of a list with commas, none of them empty."""
    words = [word.strip() for word in text.split(",")]
    if not all(words):
        raise UsageFault(f"{option} takes {expected} with commas between, got '{text}'")
    return words


def parse_choices(option: str, text: str | None, choices: type[_Choice]) -> list[_Choice]:
    """Return the members that a list with commas names, each once."""
    words = [] if text is None else [word.strip() for word in text.split(",")]
    for word in words:
        if word not in list(choices):
            raise UsageFault(f"{option} takes some of {', '.join(choices)}, got '{word}'")
    return list(dict.fromkeys(map(choices, words)))
