"""The commands of the program."""

from collections.abc import Callable
from importlib import import_module
from typing import Annotated, Final

import typer

from zerorate._native import __version__
from zerorate.cli.errors import Hint

__all__ = ["hint", "invoke", "program"]

_COMMANDS: Final = {
    "demo": (
        "Try it without a sensor: simulate a gyro, remove its bias, draw a figure.",
        "zerorate demo --device MPU-6050 -o demo",
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
_EPILOG: Final = "Begin with: zerorate demo. Options of a command: zerorate replay --help."


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
    """Return the program, of whose commands only the one that is called can be run; None: all."""
    app = typer.Typer(
        name="zerorate",
        help=_ABOUT,
        epilog=_EPILOG,
        add_completion=False,
        pretty_exceptions_enable=False,
    )
    app.callback()(_root)
    # Each command imports what it works with: all of them take longer than many a log.
    for name, (about, example) in _COMMANDS.items():
        command = _command(name) if called in (name, None) else _not_called
        app.command(name, short_help=about, epilog=f"Example: {example}")(command)
    return app


def _command(name: str) -> Callable[..., None]:
    command: Callable[..., None] = getattr(import_module(f"zerorate.cli.{name}"), name)
    return command


def _not_called() -> None:
    """Only for the list in help."""


def hint(called: str | None) -> Hint:
    """Return what helps on with a command, or with the program."""
    command = (called or "").removeprefix("zerorate ")
    if command not in _COMMANDS:
        return Hint("zerorate --help", _COMMANDS["demo"][1])
    return Hint(f"zerorate {command} --help", _COMMANDS[command][1])


def invoke(arguments: list[str]) -> int:
    """Run a command and return its exit code; faults are raised."""
    # What stands before a command takes no values.
    called = next((word for word in arguments if not word.startswith("-")), "")
    group = typer.main.get_group(program(called))
    if called in _COMMANDS and arguments[0] == called:
        # At once: for options of its own the program would import what checks values.
        command, name = group.commands[called], f"zerorate {called}"
        code = command.main(args=arguments[1:], prog_name=name, standalone_mode=False)
    else:
        code = group.main(args=arguments, prog_name="zerorate", standalone_mode=False)
    return int(code or 0)
