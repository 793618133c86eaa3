"""``zerorate simulate``: a gyro at rest, an IMU to calibrate, or an IMU in motion."""

from functools import partial
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
from zerorate.tasks.simulate_motion import MOTIONS, simulated_motion, write_motion

Duration: TypeAlias = Annotated[float, Option("Length in seconds.")]
SimulatedRate: TypeAlias = Annotated[float, Option("Samples per second.")]
Seed: TypeAlias = Annotated[int, Option("Seed, a whole number; equal seeds give equal signals.")]


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


def _parse_numbers(flag: str, text: str, example: str) -> tuple[float, ...]:
    try:
        numbers = tuple(map(float, text.split(",")))
    except ValueError:
        numbers = ()
    if len(numbers) != example.count(",") + 1:
        raise UsageFault(f"{flag} takes numbers such as {example}, got {text!r}")
    return numbers


def simulate(
    device: Annotated[
        str | None,
        Argument(
            "Gyro at rest, e.g. MPU-6050 (--list shows all), or motion of an IMU: hand (with "
            "magnetometer and true orientation), drive (with fixes) or walk."
        ),
    ] = None,
    output: Annotated[
        Path | None,
        Option(
            "File: csv, tsv, npz or parquet, by its suffix.",
            "-o --output",
            metavar="FILE",
            panel=OUTPUT,
        ),
    ] = None,
    duration: Annotated[
        float | None,
        Option(
            f"Length in seconds; if not given {DURATION_S:g} of a gyro at rest, "
            f"{', '.join(f'{seconds:g} of a {kind}' for kind, seconds in MOTIONS.items())}."
        ),
    ] = None,
    rate: SimulatedRate = 100.0,
    seed: Seed = 1,
    axes: Annotated[
        int | None, Option("Number of axes. Default: 3. Each has its own bias and drift.")
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
            "Number of poses of a simulated IMU to calibrate. It is at rest in each pose and "
            "rotated by hand between them; its gyro is an MPU-6050 unless stated."
        ),
    ] = None,
    temperature: Annotated[
        tuple[float, float] | None,
        Option(
            "Temperatures at start and end, degC; with --poses.",
            metavar="FIRST,LAST",
            parse=_parse_temperatures,
        ),
    ] = None,
    magnet: Annotated[
        tuple[float, ...] | None,
        Option(
            "Start and end of a magnet's presence, s; with hand.",
            metavar="FROM,TO",
            parse=partial(_parse_numbers, example="30,40"),
        ),
    ] = None,
    iron: Annotated[
        tuple[float, ...] | None,
        Option(
            "Hard iron on the magnetometer, uT; with hand.",
            metavar="X,Y,Z",
            parse=partial(_parse_numbers, example="12,-9,20"),
        ),
    ] = None,
    list_: Annotated[bool, Option("Print the gyros that can be simulated, and end.")] = False,
    force: Force = False,
) -> None:
    """Write a simulated log of a motion, of a gyro at rest, or of an IMU to calibrate.

    Also writes the fixes of a drive's receiver (NAME-fixes.csv), the true bias of a gyro at rest
    (NAME-truth), or with --poses the true parameters (NAME-truth.json).
    """
    if list_:
        print(format_devices())
        return
    if device in MOTIONS:
        unused = {"axes": axes, "low_pass": low_pass, "poses": poses, "temperature": temperature}
        _check_unused(f"has no meaning with {device}", **unused)
        if output is None:
            raise UsageFault(f"simulate {device} needs a file, such as -o {device}.csv")
        further = ["-fixes.csv"] if device == "drive" else []
        paths = _checked_paths(output, force, SESSION_FORMATS, *further)
        with progress_bar() as progress:
            progress("simulating", 0.0)
            recording, fixes = simulated_motion(
                device, rate, duration, seed, magnet=magnet or (), iron=iron or ()
            )
            progress("writing", 0.5)
            with atomic_paths(paths, force) as temporary:
                write_motion(recording, fixes, *temporary)
        print("\n".join(f"wrote {path}" for path in paths))
        return
    _check_unused("needs the motion hand", magnet=magnet, iron=iron)
    if poses is not None:
        _check_unused(
            "has no meaning with --poses", duration=duration, axes=axes, low_pass=low_pass
        )
        if output is None:
            raise UsageFault("simulate --poses needs a file, such as -o session.csv")
        paths = _checked_paths(output, force, SESSION_FORMATS, "-truth.json")
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
        paths = _checked_paths(output, force, GYRO_FORMATS, f"-truth{output.suffix}")
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


def _checked_paths(output: Path, force: bool, known: tuple[str, ...], *further: str) -> list[Path]:
    """Return the paths of the log and of further files (by ending), checked to be writable."""
    if output.suffix.lower() not in known:
        raise UsageFault(f"cannot write a log as '{output.suffix}'; known: {', '.join(known)}")
    if output.suffix.lower() == ".parquet":
        require("pyarrow", "io")
    paths = [output, *(output.with_name(f"{output.stem}{ending}") for ending in further)]
    check_outputs(paths, force)
    return paths
