"""Options of several commands: of the filter, of reading a log, and texts that become arguments."""

import inspect
import re
from collections.abc import Callable, Mapping, Sequence
from copy import copy
from dataclasses import dataclass, fields
from enum import Enum, StrEnum
from pathlib import Path
from typing import Annotated, Any, Final, TypeAlias, TypeVar, get_args, get_type_hints

import typer

from zerorate._native import DriftFilter
from zerorate.cli.errors import UsageFault, as_usage
from zerorate.faults import naming
from zerorate.io import raw_counts
from zerorate.io.counts import Scale
from zerorate.options import FILTER_OPTIONS, LIMITS, METHODS, Option, check_used, used_by

_Choice = TypeVar("_Choice", bound=StrEnum)
_Command: TypeAlias = Callable[..., None]

_WORDS: Final = {"adapt_for": "always", "rest_limit": "none", "bias_limit": "none"}
"""What None is called on the command line, where a number is the default."""

_TAKEN: Final = {"order": "two numbers p,q: p from 1 to 3, q from 0 to 3"}
"""What a kind of option takes, where that is typed otherwise than in Python."""

_DEFAULTS: Final = {"order": "2,1; robust: 1,0"}
"""Defaults that depend on the method, as help shows them."""

_FLAGGED: Final = {"on": True, "off": False}
"""How True and False are typed beside a word."""

_FLAGS: Final = {
    # Where files are written, that is what --output means.
    "output": "--output-kind",
    # Where logs are read, --scale multiplies their values.
    "scale": "--noise-scale",
}
"""Options of the filter that are called otherwise than in Python."""

_REQUIRED: Final = inspect.Parameter.empty
RECORDING: Final = (
    "Recording: csv, tsv, txt, npy, npz, parquet, arrow, feather, h5, mat, bag, mcap, ulg, "
    "bin, log, tlog, mp4, bbl, or the folder of a ROS 2 bag."
)


OUTPUT: Final = "Output"
PANEL: Final = "Reading the log"
"""Panels of help."""


class LogFormat(StrEnum):
    """File formats of a log."""

    parquet = "parquet"
    csv = "csv"
    npz = "npz"
    mcap = "mcap"
    gcsv = "gcsv"


class FigureFormat(StrEnum):
    """File formats of a figure."""

    png = "png"
    svg = "svg"
    pdf = "pdf"


class FigurePanels(StrEnum):
    """How much of a result its figure shows."""

    usual = "usual"
    all = "all"


class FrameName(StrEnum):
    """Axes of the earth."""

    enu = "enu"
    ned = "ned"
    nwu = "nwu"


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
PanelsOption: TypeAlias = Annotated[
    FigurePanels,
    typer.Option(
        "--figure",
        help="Panels of the figure: the usual ones, six at most, or all.",
        rich_help_panel=OUTPUT,
    ),
]
GyroName: TypeAlias = Annotated[
    str | None,
    typer.Option(
        "--gyro",
        metavar="NAME",
        help="Which gyro, where the log has several: gyro, gyro_1 and so on, in the order of the "
        "file.",
        rich_help_panel=PANEL,
    ),
]
AccelName: TypeAlias = Annotated[
    str | None,
    typer.Option(
        "--accel",
        metavar="NAME",
        help="Which accelerometer; by default the one of the gyro.",
        rich_help_panel=PANEL,
    ),
]
NoAccel: TypeAlias = Annotated[
    bool,
    typer.Option(
        "--no-accel",
        help="Leave an accelerometer alone that the log has beside its gyro; else no rate is taken "
        "for a bias while it shows motion.",
        rich_help_panel=PANEL,
    ),
]
CalibrationOption: TypeAlias = Annotated[
    Path | None,
    typer.Option(
        "--calibration",
        metavar="CAL",
        help="Correct gyro and accelerometer by this calibration first (JSON of zerorate "
        "calibrate).",
        rich_help_panel=PANEL,
    ),
]
Fix: TypeAlias = Annotated[
    bool,
    typer.Option(
        "--fix",
        help="Put right a unit or axes of the gyro that the motion contradicts, where it is sure "
        "which are right; a note says what was done.",
        rich_help_panel=PANEL,
    ),
]
Force: TypeAlias = Annotated[
    bool, typer.Option("--force", help="Replace existing files.", rich_help_panel=OUTPUT)
]
ForceExports: TypeAlias = Annotated[
    bool,
    typer.Option(
        "--force",
        help="Replace existing files; and export numbers that the log does not bear out, with a "
        "warning in the file.",
        rich_help_panel=OUTPUT,
    ),
]


def with_filter_options(command: _Command) -> _Command:
    """Give a command the options of the drift filter, from their table.

    The command takes them as `options`, a mapping by the names of `zerorate.DriftFilter`: the
    method, and those that were given.
    """
    return with_options(FILTER_OPTIONS, "options", flag, always=("method",))(command)


def with_options(
    options: Mapping[str, Option],
    place: str,
    flag_of: Callable[[str], str] | None = None,
    *,
    panel: str = "Filter",
    always: Sequence[str] = (),
) -> Callable[[_Command], _Command]:
    """Return a decorator that gives a command the options in a table.

    Parameters
    ----------
    options : mapping of str to Option
        The table.
    place : str
        The command's argument that takes those that were given, a mapping by name.
    flag_of : callable, optional
        What an option is called on the command line; by default as in Python.
    panel : str
        The panel of help with what every method uses.
    always : sequence of str
        Options whose default is passed on as well.
    """
    called = flag_of or _own_flag
    names = {name: called(name).removeprefix("--").replace("-", "_") for name in options}

    def gathered(context: typer.Context, values: Mapping[str, Any]) -> dict[str, object]:
        return {
            name: _parsed(option, values[names[name]])
            for name, option in options.items()
            if name in always or _was_given(context, names[name])
        }

    parameters = [
        _parameter(one, called(one.name), names[one.name], panel) for one in options.values()
    ]
    return lambda command: _with_parameters(command, place, parameters, gathered)


def with_group(
    group: type[Any], place: str, panel: str | None = None
) -> Callable[[_Command], _Command]:
    """Return a decorator that gives a command the options that are the fields of a dataclass.

    The command takes them as one object, in the argument `place`. Those that name no panel of help
    stand in `panel`; what is off by default has one flag, its name.
    """
    hints = get_type_hints(group, include_extras=True)
    own = [(one.name, one.default) for one in fields(group)]
    listed = [
        _keyword(name, _in_panel(hints[name], name, usual, panel), usual) for name, usual in own
    ]
    return lambda command: _with_parameters(command, place, listed, lambda _, given: group(**given))


def _in_panel(hint: Any, name: str, usual: object, panel: str | None) -> Any:  # noqa: ANN401
    kind, about = get_args(hint)
    about = copy(about)
    about.rich_help_panel = about.rich_help_panel or panel
    # Where a type is annotated, typer takes the first flag for the default.
    if usual is False and about.default is ...:
        about.default = _own_flag(name)
    return Annotated[kind, about]


def _with_parameters(
    command: _Command,
    place: str,
    parameters: Sequence[inspect.Parameter],
    gathered: Callable[[typer.Context, Mapping[str, Any]], object],
) -> _Command:
    """Return a command with further parameters in the place of one, which is gathered of them."""

    def entry(**arguments: Any) -> None:  # noqa: ANN401
        context: typer.Context = arguments["context"]
        given = {one.name: arguments.pop(one.name) for one in parameters}
        if "context" not in own:
            del arguments["context"]
        command(**arguments, **{place: gathered(context, given)})

    own = inspect.signature(command, eval_str=True).parameters
    listed = [_keyword("context", typer.Context)]
    for one in own.values():
        if one.name == place:
            listed += parameters
        elif one.name != "context":
            listed.append(_keyword(one.name, one.annotation, one.default))
    entry.__name__, entry.__doc__ = command.__name__, command.__doc__
    entry.__annotations__ = {one.name: one.annotation for one in listed}
    entry.__signature__ = inspect.Signature(listed)  # type: ignore[attr-defined]
    return entry


@dataclass(frozen=True)
class Reading:
    """What is read of a log, and how, as the options of a command say it.

    Attributes
    ----------
    arguments : mapping
        Those of `zerorate.read_log` and of the other readers.
    group_by : str or int or None
        Column that tells several logs in a file apart.
    """

    arguments: Mapping[str, Any]
    group_by: str | int | None = None


_READING: Final[Mapping[str, tuple[type, str | None, str]]] = {
    "columns": (
        str,
        "NAMES",
        "Names, or positions counted from 0 over all columns, e.g. gx,gy,gz. Default: the three "
        "axes of one gyro, by their names.",
    ),
    "accel_columns": (str, "NAMES", "The same of the accelerometer."),
    "mag_columns": (str, "NAMES", "The same of the magnetometer."),
    "unit": (
        str,
        "UNIT",
        "Unit of the gyro columns if their names do not say: rad/s, deg/s or deg/h. Values are "
        "not converted.",
    ),
    "rate": (
        float,
        "HZ",
        "Samples per second. Needed where the log has no timestamps.",
    ),
    "time": (
        str,
        "NAME",
        "Column of the timestamps, by name or position; none reads the log without, by --rate.",
    ),
    "time_unit": (
        str,
        "UNIT",
        "Unit of timestamps that do not say it: s, ms, us, ns, 100us, min, h, days, or samples of "
        "--rate.",
    ),
    "scale": (
        str,
        "FACTOR",
        "What the values are multiplied by, e.g. 1/131 for raw counts; --unit says what they are "
        "then.",
    ),
    "device": (
        str,
        "NAME",
        "Sensor whose raw counts become deg/s by the numbers of its data sheet, e.g. MPU-6050; "
        "with --range.",
    ),
    "range": (
        str,
        "DEG/S",
        "Range that the gyro of --device was set to, e.g. 250.",
    ),
    "sensor": (
        str,
        "NAME",
        "Which sensor of several in one table: words of its columns' names, e.g. imu2, left_ankle, "
        "raw; or all.",
    ),
    "start": (float, "S", "Begin so many seconds after the first sample."),
    "stop": (float, "S", "End so many seconds after the first sample."),
    "topic": (
        str,
        "TOPIC",
        "Topic of a ROS recording or a PX4 log, where several hold an IMU.",
    ),
    "group_by": (
        str,
        "COLUMN",
        "Column that tells several sensors or recordings apart: each is a log.",
    ),
}
"""Type, metavar and help of the options of reading a log."""

_OF_OTHERS: Final = {"accel_columns": "accel", "mag_columns": "mag"}
"""Options with columns of another sensor than the gyro, and its kind."""

OF_IMU: Final = {
    "unit": "Unit of the gyro columns if their names do not say: rad/s, deg/s or deg/h; with a "
    "comma between that of the accelerometer, g or m/s^2: deg/s,g.",
    "scale": "What the values of the gyro are multiplied by, e.g. 1/131 for raw counts, and with a "
    "comma between those of the accelerometer: 1/131,1/16384. --unit says what they are then.",
    "device": "Sensor whose raw counts become deg/s and g by the numbers of its data sheet, e.g. "
    "MPU-6050; with --range.",
    "range": "Range that the gyro of --device was set to, deg/s, and that of the accelerometer, g, "
    "e.g. 250,2.",
}
"""Help of those that say more where a command reads gyro and accelerometer."""

READING: Final = tuple(_READING)
"""Names of those options."""


def with_reading_options(
    *, without: Sequence[str] = (), help: Mapping[str, str] | None = None, imu: bool = False
) -> Callable[[_Command], _Command]:
    """Return a decorator that gives a command the options of reading a log.

    The command takes them as `reading`, a `Reading`.

    Parameters
    ----------
    without : sequence of str
        Options that mean nothing to the command.
    help : mapping of str to str, optional
        Texts for some options instead of the common ones.
    imu : bool
        Whether the command reads all sensors of a recording, whose columns may be named.
    """
    texts = {**(OF_IMU if imu else {}), **(help or {})}
    left_out = without if imu else (*without, *_OF_OTHERS)
    rows = {name: row for name, row in _READING.items() if name not in left_out}

    def parameter(name: str, kind: Any, metavar: str | None, text: str) -> inspect.Parameter:  # noqa: ANN401
        about = typer.Option(
            metavar=metavar,
            help=texts.get(name, text),
            rich_help_panel=PANEL,
            show_default=False,
        )
        return _keyword(name, Annotated[kind | None, about], None)

    def gathered(_: typer.Context, given: Mapping[str, Any]) -> Reading:
        return _reading(given)

    parameters = [parameter(name, *row) for name, row in rows.items()]
    return lambda command: _with_parameters(command, "reading", parameters, gathered)


def _reading(given: Mapping[str, Any]) -> Reading:
    arguments = dict(given)
    columns = parse_columns(arguments["columns"])
    arguments["columns"] = None if columns is None else tuple(columns)
    others = {kind: parse_columns(arguments.pop(name, None)) for name, kind in _OF_OTHERS.items()}
    if any(others.values()):
        arguments["columns"] = {"gyro": arguments["columns"], **others}
    device, ends = arguments.pop("device"), arguments.pop("range")
    arguments["scale"] = _parse_scale(arguments["scale"], device, ends)
    if "time" in arguments:
        arguments["time"] = _time_column(arguments["time"])
    group_by = parse_columns(arguments.pop("group_by", None))
    return Reading(arguments, None if group_by is None else group_by[0])


def _time_column(typed: str | None) -> str | int | None:
    """Return the column of the timestamps that was typed, False for none of them."""
    found = parse_columns(typed)
    return None if found is None else False if found[0] == "none" else found[0]


def _parse_scale(scale: str | None, device: str | None, ends: str | None) -> Scale:
    """Return the factor of raw counts, given as it is or by a device and its ranges."""
    if (device is None) != (ends is None):
        missing, there = ("--device", "--range") if device is None else ("--range", "--device")
        raise UsageFault(f"{there} needs {missing}, as in --device MPU-6050 --range 250")
    if device is not None and ends is not None:
        if scale is not None:
            raise UsageFault("give either --scale or --device with --range, not both")
        return raw_counts(device, *_parse_numbers("--range", ends, "250 or 250,2"))
    if scale is None:
        return None
    first, *more = _parse_numbers("--scale", scale, "0.0076, 1/131 or 1/131,1/16384")
    return {"gyro": first, "accel": more[0]} if more else first


def _parse_numbers(option: str, text: str, example: str) -> list[float]:
    """Return the one or two numbers of an option, each maybe a fraction."""
    try:
        found = [_parse_fraction(word) for word in text.split(",")]
    except (ValueError, ZeroDivisionError):
        found = []
    if len(found) not in (1, 2):
        raise UsageFault(f"{option} takes a number such as {example}, got '{text}'")
    return found


def _parse_fraction(text: str) -> float:
    number, _, divisor = text.partition("/")
    return float(number) / float(divisor) if divisor else float(number)


def check_filter_options(options: Mapping[str, Any], methods: Sequence[str]) -> None:
    """Raise a usage fault for an option that no method uses, or a value that is refused."""
    with naming({name: flag(name) for name in FILTER_OPTIONS}), as_usage():
        check_used(options, methods)
        for method in methods:
            # Of the rate no refusal depends.
            DriftFilter(1.0, **{**used_by(method, options), "method": method})


def flag(name: str) -> str:
    """Return how an option of the filter is called on the command line."""
    return _FLAGS.get(name, _own_flag(name))


def _own_flag(name: str) -> str:
    return f"--{name.replace('_', '-')}"


def _keyword(name: str, annotation: Any, default: Any = _REQUIRED) -> inspect.Parameter:  # noqa: ANN401
    kind = inspect.Parameter.KEYWORD_ONLY
    return inspect.Parameter(name, kind, default=default, annotation=annotation)


def _parameter(option: Option, flag: str, argument: str, panel: str) -> inspect.Parameter:
    """Return an option of a filter as a parameter of a command."""
    value: Any = float
    default: Any = option.default
    metavar = None
    if option.kind in ("choice", "word or flag"):
        value = _members(option)
        default = default and value(default)
    elif option.kind == "order":
        value, metavar = str, "P,Q"
        default = ",".join(map(str, default))
    elif option.kind == "pair or word":
        value, metavar = str, "X,Y"
        default = ",".join(f"{number:g}" for number in default)
    elif option.name in _WORDS:
        value, metavar = str, "NUMBER"
        default = _WORDS[option.name] if default is None else f"{default:g}"
    limit = LIMITS.get(option.name)
    shown: bool | str = _DEFAULTS.get(option.name, True)
    if limit is not None:
        shown = f"{limit:g} deg/s, where the unit is known"
    about = typer.Option(
        flag,
        metavar=metavar,
        help=_help(option),
        show_default=shown,
        rich_help_panel=_panel(option, panel),
    )
    annotation: Any = Annotated[value | None if default is None else value, about]
    return _keyword(argument, annotation, default)


def _panel(option: Option, common: str) -> str:
    """Return the panel of help that an option stands in, by the methods that use it."""
    return common if option.methods in (METHODS, ()) else f"Only for {', '.join(option.methods)}"


def _members(option: Option) -> Any:  # noqa: ANN401
    """Return the choices as a class that typer lists in help, and refuses all others by."""
    named: Any = StrEnum
    words = (*option.choices, *(_FLAGGED if option.kind == "word or flag" else ()))
    return named(option.name, [(word, word) for word in words])


def _help(option: Option) -> str:
    """Return what an option means and takes: a choice shows that by itself."""
    meaning = f"{option.meaning[0].upper()}{option.meaning[1:]}."
    if option.kind in ("choice", "word or flag"):
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
    typed = value.value if isinstance(value, Enum) else value
    return _FLAGGED.get(typed, typed) if option.kind == "word or flag" else typed


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
    p, _, q = (word.strip() for word in text.partition(","))
    if not (p + q).isdecimal() or not (p and q):
        raise UsageFault(f"--order takes two numbers p,q such as 2,1, got '{text}'")
    return int(p), int(q)


def parse_columns(text: str | None, option: str = "--columns") -> list[str | int] | None:
    """Return the names and indices of a list with commas."""
    if text is None:
        return None
    words = parse_words(option, text, "names or indices")
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
