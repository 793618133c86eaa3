"""The commands of the program."""

from collections.abc import Callable, Mapping
from importlib import import_module
from shutil import get_terminal_size
from typing import Annotated, Final

import typer

from zerorate._native import __version__
from zerorate.cli import help
from zerorate.cli.errors import UsageFault, faults
from zerorate.cli.flags import FLAGS, wrong_option
from zerorate.cli.typed import Hint, flags_of, in_plain_words, unknown
from zerorate.faults import naming
from zerorate.texts import WIDTH, within

_COMMANDS: Final = {
    "demo": (
        "Try it without a sensor: simulate a gyro, remove its bias, draw a figure.",
        "zerorate demo --device MPU-6050 -o demo",
    ),
    "report": (
        "Tell what is the matter with an IMU: a page of findings, with numbers and limits.",
        "zerorate report flight.ulg -o out",
    ),
    "replay": (
        "Remove the bias from one log: table, filtered log and figure.",
        "zerorate replay imu.csv --unit deg/s -o out",
    ),
    "allan": (
        "Measure the noise of gyros and accelerometers from a log at rest.",
        "zerorate allan static.csv --unit deg/s,g --export kalibr -o out",
    ),
    "stream": (
        "Remove the bias live: a line of samples in, the compensated rate out.",
        "cat /dev/ttyUSB0 | zerorate stream --rate 200 --unit deg/s",
    ),
    "batch": (
        "Remove the bias from many logs, or find their noise; a summary tells which stand out.",
        "zerorate batch logs -o out",
    ),
    "compare": (
        "Compare filters on your logs, by what their errors cost.",
        "zerorate compare imu.csv --unit deg/s --methods auto,kf,ema",
    ),
    "identify": (
        "Find ARMA models of the drift from a log at rest, and test them.",
        "zerorate identify static.csv --unit deg/s -o out",
    ),
    "calibrate": (
        "Calibrate an IMU from a log of hand turns: scale, misalignment, bias, with errors.",
        "zerorate calibrate turns.csv --unit deg/s,g --export kalibr -o out",
    ),
    "attitude": (
        "Find which way a body points, from gyro, accelerometer and magnetometer.",
        "zerorate attitude imu.csv --unit deg/s,g --frame ned -o out",
    ),
    "navigate": (
        "Find the track of a vehicle from its gyro, accelerometer and satellite receiver.",
        "zerorate navigate imu.parquet gnss.parquet --outages 10,30 --smooth -o out",
    ),
    "walk": (
        "Find where a sensor on a foot went, and its strides; no receiver is needed.",
        "zerorate walk foot.csv --unit deg/s,g --floor level -o out",
    ),
    "formats": (
        "List the formats that are read and written, or tell how a file is understood.",
        "zerorate formats imu.csv",
    ),
    "simulate": (
        "Write a log of a simulated gyro and its true drift, or of an IMU to calibrate.",
        "zerorate simulate MPU-6050 -o gyro.csv --duration 600",
    ),
}
"""What help says of each command, and an example of it; first comes what a newcomer needs."""

_ABOUT: Final = (
    "Removes the bias of MEMS gyros, live or from a log, measures their noise, calibrates them; "
    "finds attitudes and tracks."
)
_EPILOG: Final = (
    "Begin with: zerorate demo. Options of a command: zerorate replay --help, or --help-all."
)


def _print_version(wanted: bool) -> None:
    if wanted:
        print(f"zerorate {__version__}")
        raise typer.Exit


def _root(
    version: Annotated[
        bool,
        typer.Option(
            "--version", callback=_print_version, is_eager=True, help="Print the version and end."
        ),
    ] = False,
) -> None:
    """Only for what comes before a command."""


def program(called: str | None = None) -> typer.Typer:
    """Return the program with the command that is called; None: with all of them."""
    app = typer.Typer(
        name="zerorate",
        help=_ABOUT,
        epilog=_EPILOG,
        add_completion=False,
        pretty_exceptions_enable=False,
    )
    app.callback()(_root)
    # Each command imports what it works with: all of them take longer than many a log.
    names = [called] if called is not None and called in _COMMANDS else [*_COMMANDS]
    for name in names:
        about, example = _COMMANDS[name]
        command = function_of(name) if called in (name, None) else _not_called
        app.command(name, short_help=about, epilog=f"Example: {example}")(command)
    return app


def function_of(name: str) -> Callable[..., None]:
    """Return what a command runs, which is imported for it."""
    command: Callable[..., None] = getattr(import_module(f"zerorate.cli.{name}"), name)
    return command


def _not_called() -> None:
    """Only for the list in help."""


_OTHERWISE: Final[Mapping[str, Mapping[str, str]]] = {
    "attitude": {"mag": "--no-mag"},
    "replay": {"data_scale": "--scale"},
    "navigate": {
        "span": "--rest",
        "seconds": "--outages",
        "fixes": "their file after the log",
    },
    "stream": {
        "beside": "--with",
        "data_scale": "--scale",
        "gyro_scale": "--scale",
        "accel_scale": "--scale",
        "gyro_unit": "--unit",
        "accel_unit": "--unit",
        "mag": "--no-mag",
    },
}
"""Arguments of the package that a command has under another name."""


_ALWAYS: Final[Mapping[str, str]] = {"destination": "-o"}
"""Arguments that have another name in every command."""


def _hint(called: str) -> Hint:
    """Return what helps on with a command, or with the program."""
    if called not in _COMMANDS:
        return Hint("zerorate --help", _COMMANDS["demo"][1])
    return Hint(f"zerorate {called} --help", _COMMANDS[called][1])


def invoke(arguments: list[str]) -> int:
    """Run a command and return its exit code; faults are raised."""
    with within(columns()):
        return _invoked(arguments)


def columns() -> int:
    """Return how wide the terminal is; where there is none, as wide as tables are by themselves."""
    return get_terminal_size((WIDTH, 24)).columns


def _invoked(arguments: list[str]) -> int:
    # What stands before a command takes no values.
    called = next((word for word in arguments if not word.startswith("-")), "")
    if not called and help.asked(arguments):
        about = {name: what for name, (what, _) in _COMMANDS.items()}
        print(help.overview(about, _ABOUT, _EPILOG))
        return 0
    if called in FLAGS and arguments[0] == called and not help.asked(arguments[1:]):
        wrong = wrong_option(called, arguments[1:])
        if wrong is not None:
            known = " ".join(FLAGS[called]).split()
            raise UsageFault(unknown("option", wrong, known, _hint(called)))
    group = typer.main.get_group(program(called))
    if called in _COMMANDS and arguments[0] == called:
        # At once: for options of its own the program would import what checks values.
        command, name, words = group.commands[called], f"zerorate {called}", arguments[1:]
        if help.asked(words):
            example, everything = _COMMANDS[called][1], help.ALL in words
            print(help.of_command(command, function_of(called), called, example, everything))
            return 0
        taken, flags = function_of(called), flags_of(command, _OTHERWISE.get(called, {}))
    elif arguments[0] == called:
        raise UsageFault(unknown("command", called, [*_COMMANDS], _hint("")))
    else:
        command, name, words, taken, flags = group, "zerorate", arguments, None, {}
    try:
        with naming({**flags, **_ALWAYS}), faults():
            return int(command.main(args=words, prog_name=name, standalone_mode=False) or 0)
    except Exception as error:
        # The base class of usage errors has no public name that is the same in every typer.
        if hasattr(error, "format_message"):
            told = in_plain_words(error, taken, words, _hint(called))
            raise UsageFault(told) from None
        raise
