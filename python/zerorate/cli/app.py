"""Commands of the program, with their help and calls."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from importlib import import_module
from shutil import get_terminal_size
from typing import Final

from zerorate._native import __version__
from zerorate.cli import help
from zerorate.cli.errors import UsageFault, faults
from zerorate.cli.parameters import Hint, Option, Taker, parse, unknown
from zerorate.faults import use_argument_names
from zerorate.texts import WIDTH, use_line_width


@dataclass(frozen=True)
class Command:
    """A command of the program.

    Parameters
    ----------
    about : str
        Description for the list of commands.
    examples : sequence of str
        Examples to type.
    usual : str
        Options in the short help, separated by blanks; empty for all.
    renamed : mapping of str to str
        Arguments of the package with another name as options.
    """

    about: str
    examples: Sequence[str]
    usual: str = ""
    renamed: Mapping[str, str] = field(default_factory=dict)


COMMANDS: Final = {
    "demo": Command(
        "Try it without a sensor: simulate a gyro, remove its bias, draw a figure.",
        ("zerorate demo --device MPU-6050 -o demo",),
    ),
    "report": Command(
        "Report on an IMU: a page of findings, with numbers and limits.",
        (
            "zerorate report flight.ulg -o out",
            "zerorate report before.csv after.csv --unit deg/s,g",
        ),
        usual="-o --gnss --columns --unit --rate --device --range --start --stop --force",
    ),
    "replay": Command(
        "Remove the bias from one log: table, filtered log and figure.",
        (
            "zerorate replay imu.csv --unit deg/s -o out",
            "zerorate replay counts.csv --device MPU-6050 --range 250",
            "zerorate replay imu.csv --methods all",
        ),
        usual="-o --unit --columns --rate --device --range --calibration --methods --no-figure "
        "--force",
        renamed={"data_scale": "--scale"},
    ),
    "allan": Command(
        "Measure the noise of gyros and accelerometers from a log at rest.",
        (
            "zerorate allan static.csv --unit deg/s,g --export kalibr -o out",
            "zerorate allan first.csv second.csv --unit deg/s --deviation mdev",
        ),
        usual="-o --unit --columns --rate --start --stop --deviation --export --no-figure --force",
    ),
    "stream": Command(
        "Remove the bias live: answer each line of samples with the compensated rate.",
        (
            "cat /dev/ttyUSB0 | zerorate stream --rate 200 --unit deg/s",
            "cat lines.csv | zerorate stream --rate 200 --attitude --unit deg/s,g",
            "zerorate stream --rate 100 --from serial:/dev/ttyUSB0@115200 --form xsens",
        ),
        usual="--unit --columns --rate --device --range --with --attitude --sequence --from "
        "--form --checkpoint",
        renamed={
            "extra": "--with",
            "data_scale": "--scale",
            "gyro_scale": "--scale",
            "accel_scale": "--scale",
            "gyro_unit": "--unit",
            "accel_unit": "--unit",
            "mag": "--no-mag",
        },
    ),
    "batch": Command(
        "Remove the bias from many logs, or find their noise; a summary names the outliers.",
        (
            "zerorate batch logs -o out",
            "zerorate batch 'logs/**/*.parquet' --command allan -o noise",
        ),
        usual="-o --command --unit --columns --rate --calibration --method --workers --force",
    ),
    "compare": Command(
        "Compare filters on your logs by the errors of their angles.",
        (
            "zerorate compare imu.csv --unit deg/s --methods auto,kf,ema",
            "zerorate compare --simulated --methods auto,kf,mine=my.py:bias",
        ),
        usual="-o --unit --columns --rate --methods --reference --quaternion --simulated "
        "--per-axis --force",
    ),
    "identify": Command(
        "Find ARMA models of the drift from a log at rest, and test them.",
        ("zerorate identify static.csv --unit deg/s -o out",),
        usual="-o --unit --columns --rate --start --stop --order --criterion --no-figure --force",
    ),
    "calibrate": Command(
        "Calibrate an IMU from rotations by hand: scale, misalignment, bias, with errors.",
        (
            "zerorate calibrate turns.csv --unit deg/s,g --export kalibr -o out",
            "zerorate calibrate imu.csv --apply turns-zerorate-calibration.json -o out",
        ),
        usual="-o --unit --columns --rate --accel-columns --apply --compare --temperature "
        "--export --force",
    ),
    "attitude": Command(
        "Estimate the orientation of a body from gyro, accelerometer and magnetometer.",
        (
            "zerorate attitude imu.csv --unit deg/s,g --frame ned -o out",
            "zerorate attitude imu.csv --unit deg/s,g --reference truth.tum",
        ),
        usual="-o --unit --rate --frame --offline --no-mag --calibration --reference "
        "--no-figure --force",
    ),
    "navigate": Command(
        "Find the track of a vehicle from its gyro, accelerometer and satellite receiver.",
        (
            "zerorate navigate imu.parquet gnss.parquet --outages 10,30 --smooth -o out",
            "zerorate navigate imu.csv fixes.csv --vehicle wheeled --wheel-speed speed",
        ),
        usual="-o --smooth --outages --heading --vehicle --wheel-speed --mount --antenna "
        "--reference --force",
        renamed={"span": "--rest", "seconds": "--outages", "fixes": "their file after the log"},
    ),
    "walk": Command(
        "Find the track of a sensor on a foot, and its strides; no receiver is needed.",
        (
            "zerorate walk foot.csv --unit deg/s,g --floor level -o out",
            "zerorate walk foot.csv --smooth --at 48.137,11.575 --heading 90",
        ),
        usual="-o --unit --columns --rate --floor --smooth --at --heading --calibration "
        "--no-figure --force",
    ),
    "mcp": Command(
        "Let an assistant measure the logs in a folder (Model Context Protocol).",
        ("zerorate mcp logs",),
    ),
    "formats": Command(
        "List the formats that are read and written, or explain how a file is read.",
        ("zerorate formats imu.csv",),
    ),
    "simulate": Command(
        "Write a log of a simulated gyro and its true drift, or of an IMU to calibrate.",
        (
            "zerorate simulate MPU-6050 -o gyro.csv --duration 600",
            "zerorate simulate --poses 12 -o turns.csv",
            "zerorate simulate --list",
        ),
    ),
}
"""Commands, in the order in which a new user needs them."""

_ABOUT: Final = (
    "Removes the bias of MEMS gyros, live or from a log, measures their noise, calibrates them; "
    "finds attitudes and tracks."
)
_EPILOG: Final = (
    "Begin with: zerorate demo. Options of a command: zerorate replay --help, or --help-all."
)
_VERSION: Final = Option("Print the version and end.", name="version", kind=bool, default=False)

_ALWAYS_RENAMED: Final[Mapping[str, str]] = {"destination": "-o"}
"""Arguments with another name in every command."""


def taker_of(name: str) -> Taker:
    """Return the parser and function of a command; its module is imported now."""
    return Taker(getattr(import_module(f"zerorate.cli.{name}"), name))


def invoke(arguments: list[str]) -> int:
    """Run a command and return its exit code; its errors are raised."""
    with use_line_width(columns()):
        name, *words = arguments
        if name not in COMMANDS:
            return _without_command(arguments)
        # Only the command's own modules are imported; all modules would take longer than many logs.
        taker, command = taker_of(name), COMMANDS[name]
        if help.is_wanted(words):
            everything = help.ALL in words
            print(help.of_command(name, taker, command.examples, command.usual, everything))
            return 0
        options = [*taker.options()]
        flags = {one.name: one.flag for one in options if one.all_flags}
        flags |= {flag[2:].replace("-", "_"): flag for flag in flags.values()}
        with use_argument_names({**flags, **command.renamed, **_ALWAYS_RENAMED}), faults():
            taker.value(parse(options, words, _hint(name)))
        return 0


def _without_command(arguments: Sequence[str]) -> int:
    """Print the version or the overview; raise a usage fault for anything else."""
    called = next((word for word in arguments if not word.startswith("-")), "")
    if called == arguments[0]:
        raise UsageFault(unknown("command", called, [*COMMANDS], _hint("")))
    options = arguments[: arguments.index(called)] if called else arguments
    if help.is_wanted(options) or not parse([_VERSION], options, _hint(called)):
        about = {name: command.about for name, command in COMMANDS.items()}
        print(help.overview(about, _ABOUT, _EPILOG))
    else:
        print(f"zerorate {__version__}")
    return 0


def columns() -> int:
    """Return the width of the terminal; without a terminal, the default width of tables."""
    return get_terminal_size((WIDTH, 24)).columns


def _hint(name: str) -> Hint:
    """Return the hint after an error: help and an example, for a command or the program."""
    if name not in COMMANDS:
        return Hint("zerorate --help", COMMANDS["demo"].examples[0])
    return Hint(f"zerorate {name} --help", COMMANDS[name].examples[0])
