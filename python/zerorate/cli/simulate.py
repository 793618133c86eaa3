"""``zerorate simulate``: a gyro of the table as a log at rest, or an IMU that is calibrated."""

from dataclasses import replace
from pathlib import Path
from typing import Annotated, Final, TypeAlias

import numpy as np
import typer

from zerorate.cli.errors import UsageFault, require
from zerorate.cli.options import OUTPUT, Force
from zerorate.cli.outputs import check_outputs, progress_bar
from zerorate.io import write_log
from zerorate.record import Log
from zerorate.show.tables import Table, as_text, prose
from zerorate.simulation.devices import DEVICES, Device
from zerorate.simulation.devices import device as find_device
from zerorate.simulation.gyro import simulate as run_simulation
from zerorate.tasks.saving import together
from zerorate.types import Floats
from zerorate.units import convert

AXES: Final = ("x", "y", "z")
Duration: TypeAlias = Annotated[float, typer.Option(help="Length in seconds.")]
SimulatedRate: TypeAlias = Annotated[float, typer.Option(help="Samples per second.")]
Seed: TypeAlias = Annotated[
    int, typer.Option(help="Any whole number; the same one gives the same signal.")
]
_SUFFIXES: Final = (".csv", ".tsv", ".npz", ".parquet")
_DURATION: Final = 600.0
_OF_SESSIONS: Final = (".csv", ".tsv", ".parquet")
"""Formats that hold a gyro with other sensors beside it."""
_BY_TEMPERATURE: Final = ((0.2, -0.1, 0.15), (0.02, 0.01, -0.01))
"""Bias of each axis in deg/s by 10 K from 25 degC and by their square."""


def simulate(
    device: Annotated[
        str | None, typer.Argument(help="Gyro to simulate, such as MPU-6050; --list shows all.")
    ] = None,
    output: Annotated[
        Path | None,
        typer.Option(
            "-o",
            "--output",
            metavar="FILE",
            help="File to write; its suffix says the format: csv, tsv, npz or parquet.",
            rich_help_panel=OUTPUT,
        ),
    ] = None,
    duration: Annotated[
        float | None, typer.Option(help=f"Length in seconds; {_DURATION:g} if not given.")
    ] = None,
    rate: SimulatedRate = 100.0,
    seed: Seed = 1,
    axes: Annotated[
        int | None,
        typer.Option(help="Number of axes, with a different bias and drift each; 3 if not given."),
    ] = None,
    poses: Annotated[
        int | None,
        typer.Option(
            help="Simulate an IMU instead, held still in so many poses and turned by hand between "
            "them, for zerorate calibrate; its gyro is an MPU-6050 if none is named.",
        ),
    ] = None,
    temperature: Annotated[
        str | None,
        typer.Option(
            metavar="FIRST,LAST",
            help="With --poses: temperatures in degC at the start and the end.",
        ),
    ] = None,
    list_: Annotated[
        bool,
        typer.Option(
            "--list", help="Print the gyros that can be simulated, with their noise, and end."
        ),
    ] = False,
    force: Force = False,
) -> None:
    """Write a log of a simulated gyro at rest, and its true bias to a second file, NAME-truth.

    With --poses: a log of an IMU, and its true parameters in NAME-truth.json.
    """
    if list_:
        print(_listed())
        return
    if poses is not None:
        _check_unused("has no meaning with --poses", duration=duration, axes=axes)
        _simulate_session(device or "MPU-6050", output, poses, rate, seed, temperature, force)
        return
    _check_unused("needs --poses", temperature=temperature)
    if device is None or output is None:
        raise UsageFault(
            "simulate needs a gyro and a file, such as simulate MPU-6050 -o gyro.csv; "
            "simulate --list shows the gyros"
        )
    gyro = find_device(device)
    paths = _checked_paths(output, force)
    with progress_bar() as progress:
        progress("simulating", 0.0)
        length = _DURATION if duration is None else duration
        data = simulated(gyro, rate, length, seed, len(AXES) if axes is None else axes)
        progress("writing", 0.5)
        with together(paths, force) as temporary:
            for values, stem, path in zip(data, ("gyro", "drift"), temporary, strict=True):
                write_log(_log(values, stem, rate, gyro), path)
    print("\n".join(f"wrote {path}" for path in paths))


def _check_unused(why: str, **options: object) -> None:
    given = [name for name, value in options.items() if value is not None]
    if given:
        raise UsageFault(f"--{given[0]} {why}")


def _simulate_session(
    device: str,
    output: Path | None,
    poses: int,
    rate: float,
    seed: int,
    temperature: str | None,
    force: bool,
) -> None:
    from zerorate.simulation.session import GyroErrors, simulate_session

    if output is None:
        raise UsageFault("simulate --poses needs a file, such as -o session.csv")
    course = None if temperature is None else _two_numbers("--temperature", temperature)
    paths = _checked_paths(output, force, _OF_SESSIONS, ".json")
    with progress_bar() as progress:
        progress("simulating", 0.0)
        by_temperature = () if course is None else np.radians(_BY_TEMPERATURE)
        errors = GyroErrors(noise=find_device(device), temperature=by_temperature)
        session = simulate_session(poses, seed=seed, rate=rate, gyro=errors, temperature=course)
        progress("writing", 0.5)
        with together(paths, force) as (log_path, truth_path):
            gyro, *others = session.recording.values()
            extra = {n: x for log in others for n, x in zip(log.names, log.data.T, strict=True)}
            write_log(replace(gyro, extra=extra), log_path)
            truth_path.write_text(session.truth.to_json() + "\n", encoding="utf-8")
    print("\n".join(f"wrote {path}" for path in paths))


def simulated(
    gyro: Device, rate: float, duration: float, seed: int, axes: int
) -> tuple[Floats, Floats]:
    """Return signal and true drift, shape (n, axes), rad/s, or raise a usage fault."""
    return run_simulation(gyro, rate, duration, seed, axes=axes)


def _two_numbers(option: str, text: str) -> tuple[float, float]:
    try:
        first, last = map(float, text.split(","))
    except ValueError:
        raise UsageFault(f"{option} takes two numbers, such as 20,35, got {text!r}") from None
    return first, last


def _checked_paths(
    output: Path, force: bool, known: tuple[str, ...] = _SUFFIXES, of_truth: str | None = None
) -> list[Path]:
    if output.suffix.lower() not in known:
        raise UsageFault(f"cannot write a log as '{output.suffix}'; known: {', '.join(known)}")
    if output.suffix.lower() == ".parquet":
        require("pyarrow", "io")
    paths = [output, output.with_name(f"{output.stem}-truth{of_truth or output.suffix}")]
    check_outputs(paths, force)
    return paths


def _log(values: Floats, stem: str, rate: float, gyro: Device) -> Log:
    labels = AXES if values.shape[1] <= len(AXES) else [str(i + 1) for i in range(values.shape[1])]
    names = tuple(f"{stem}_{label}_radps" for label, _ in zip(labels, values.T, strict=False))
    meta = {"sensor": f"simulated {gyro.name}"}
    return Log(np.arange(len(values)) / rate, rate, values, names, "rad/s", meta)


def _listed() -> str:
    head = ("device", "N, deg/s/√Hz", "B, deg/h", "turn-on, deg/s", "step, deg/s")
    note = "N: noise density; B: bias instability; step: resolution."
    rows = tuple(map(_row, DEVICES.values()))
    table = as_text(Table("Gyros that can be simulated", head, rows, note=note))
    return "\n".join((table, "", *map(_source, DEVICES.values())))


def _row(gyro: Device) -> tuple[str, ...]:
    noise = convert(gyro.noise.angle_random_walk, "rad/s/sqrt(Hz)", "deg/s/sqrt(Hz)")
    bias = convert(gyro.noise.bias_instability, "rad/s", "deg/h")
    turn_on, step = (convert(v, "rad/s", "deg/s") for v in (gyro.turn_on_bias, gyro.resolution))
    return (gyro.name, *(f"{value:.3g}" for value in (noise, bias, turn_on, step)))


def _source(gyro: Device) -> str:
    return prose(f"{gyro.name}: {gyro.source}", hang="  ")
