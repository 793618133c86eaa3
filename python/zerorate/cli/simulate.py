"""``zerorate simulate``: a gyro of the table as a log at rest, or an IMU that is calibrated."""

from pathlib import Path
from typing import Annotated, TypeAlias

from zerorate.cli.errors import UsageFault, require
from zerorate.cli.options import OUTPUT, Force
from zerorate.cli.outputs import check_outputs, progress_bar
from zerorate.cli.parameters import Argument, Option
from zerorate.io import write_log
from zerorate.noise import LowPass
from zerorate.show.devices_table import format_devices
from zerorate.simulation.devices import device as find_device
from zerorate.tasks.saving import atomic_paths
from zerorate.tasks.simulate import (
    DURATION_S,
    GYRO_FORMATS,
    SESSION_FORMATS,
    simulated_gyro,
    simulated_session,
    write_session,
)

Duration: TypeAlias = Annotated[float, Option("Length in seconds.")]
SimulatedRate: TypeAlias = Annotated[float, Option("Samples per second.")]
Seed: TypeAlias = Annotated[int, Option("Any whole number; the same one gives the same signal.")]


def _parse_temperatures(flag: str, text: str) -> tuple[float, float]:
    try:
        first, last = map(float, text.split(","))
    except ValueError:
        raise UsageFault(f"{flag} takes two numbers, such as 20,35, got {text!r}") from None
    return first, last


def _parse_low_pass(flag: str, text: str) -> LowPass:
    corner, _, order = text.partition(",")
    try:
        return LowPass(float(corner), float(order or 2))
    except ValueError:
        raise UsageFault(
            f"{flag} takes a corner in Hz and, after a comma, an order, such as 20,1, got {text!r}"
        ) from None


def simulate(
    device: Annotated[
        str | None, Argument("Gyro to simulate, such as MPU-6050; --list shows all.")
    ] = None,
    output: Annotated[
        Path | None,
        Option(
            "File to write; its suffix says the format: csv, tsv, npz or parquet.",
            "-o --output",
            metavar="FILE",
            panel=OUTPUT,
        ),
    ] = None,
    duration: Annotated[
        float | None, Option(f"Length in seconds; {DURATION_S:g} if not given.")
    ] = None,
    rate: SimulatedRate = 100.0,
    seed: Seed = 1,
    axes: Annotated[
        int | None, Option("Number of axes, with a different bias and drift each; 3 if not given.")
    ] = None,
    low_pass: Annotated[
        LowPass | None,
        Option(
            "Filter the samples: corner in Hz and order, such as 20,1; inf is a moving average, 2 "
            "if not given.",
            metavar="CORNER[,ORDER]",
            parse=_parse_low_pass,
        ),
    ] = None,
    poses: Annotated[
        int | None,
        Option(
            "Simulate an IMU instead, held still in so many poses and turned by hand between "
            "them, for zerorate calibrate; its gyro is an MPU-6050 if none is named."
        ),
    ] = None,
    temperature: Annotated[
        tuple[float, float] | None,
        Option(
            "With --poses: temperatures in degC at the start and the end.",
            metavar="FIRST,LAST",
            parse=_parse_temperatures,
        ),
    ] = None,
    list_: Annotated[
        bool, Option("Print the gyros that can be simulated, with their noise, and end.")
    ] = False,
    force: Force = False,
) -> None:
    """Write a log of a simulated gyro at rest, and its true bias to a second file, NAME-truth.

    With --poses: a log of an IMU, and its true parameters in NAME-truth.json.
    """
    if list_:
        print(format_devices())
        return
    if poses is not None:
        unused = {"duration": duration, "axes": axes, "low_pass": low_pass}
        _check_unused("has no meaning with --poses", **unused)
        if output is None:
            raise UsageFault("simulate --poses needs a file, such as -o session.csv")
        paths = _checked_paths(output, force, SESSION_FORMATS, ".json")
        with progress_bar() as progress:
            progress("simulating", 0.0)
            session = simulated_session(device, poses, rate, seed, temperature)
            progress("writing", 0.5)
            with atomic_paths(paths, force) as temporary:
                write_session(session, *temporary)
    else:
        _check_unused("needs --poses", temperature=temperature)
        if device is None or output is None:
            raise UsageFault(
                "simulate needs a gyro and a file, such as simulate MPU-6050 -o gyro.csv; "
                "simulate --list shows the gyros"
            )
        gyro = find_device(device)
        paths = _checked_paths(output, force, GYRO_FORMATS, output.suffix)
        with progress_bar() as progress:
            progress("simulating", 0.0)
            logs = simulated_gyro(gyro, rate, duration, seed, axes, low_pass)
            progress("writing", 0.5)
            with atomic_paths(paths, force) as temporary:
                for log, path in zip(logs, temporary, strict=True):
                    write_log(log, path)
    print("\n".join(f"wrote {path}" for path in paths))


def _check_unused(why: str, **options: object) -> None:
    given = [name for name, value in options.items() if value is not None]
    if given:
        raise UsageFault(f"--{given[0].replace('_', '-')} {why}")


def _checked_paths(output: Path, force: bool, known: tuple[str, ...], of_truth: str) -> list[Path]:
    """Return the files of the log and of the truth, after checking that they can be written."""
    if output.suffix.lower() not in known:
        raise UsageFault(f"cannot write a log as '{output.suffix}'; known: {', '.join(known)}")
    if output.suffix.lower() == ".parquet":
        require("pyarrow", "io")
    paths = [output, output.with_name(f"{output.stem}-truth{of_truth}")]
    check_outputs(paths, force)
    return paths
