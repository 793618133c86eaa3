"""``zerorate simulate``: a gyro of the table as a log."""

import textwrap
from pathlib import Path
from typing import Annotated, Final, TypeAlias

import numpy as np
import typer

from zerorate.cli.errors import UsageFault, as_usage, require, writing
from zerorate.cli.options import OUTPUT, Force
from zerorate.cli.outputs import check_outputs, progress_bar, together
from zerorate.io import Log, write_log
from zerorate.show import WIDTH
from zerorate.simulate.devices import DEVICES, Device
from zerorate.simulate.devices import device as find_device
from zerorate.simulate.gyro import simulate as run_simulation
from zerorate.types import Floats
from zerorate.units import convert

__all__ = ["AXES", "Duration", "Seed", "SimulatedRate", "simulate", "simulated"]

AXES: Final = ("x", "y", "z")
Duration: TypeAlias = Annotated[float, typer.Option(help="Length in seconds.")]
SimulatedRate: TypeAlias = Annotated[float, typer.Option(help="Samples per second.")]
Seed: TypeAlias = Annotated[
    int, typer.Option(help="Any whole number; the same one gives the same signal.")
]
_SUFFIXES: Final = (".csv", ".tsv", ".npz", ".parquet")


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
    duration: Duration = 600.0,
    rate: SimulatedRate = 100.0,
    seed: Seed = 1,
    axes: Annotated[
        int, typer.Option(help="Number of axes, with a different bias and drift each.")
    ] = 3,
    list_: Annotated[
        bool,
        typer.Option(
            "--list", help="Print the gyros that can be simulated, with their noise, and end."
        ),
    ] = False,
    force: Force = False,
) -> None:
    """Write a log of a simulated gyro at rest, and its true bias to a second file, NAME-truth."""
    if list_:
        print(_listed())
        return
    if device is None or output is None:
        raise UsageFault(
            "simulate needs a gyro and a file, such as simulate MPU-6050 -o gyro.csv; "
            "simulate --list shows the gyros"
        )
    with as_usage():
        gyro = find_device(device)
    paths = _checked_paths(output, force)
    with progress_bar() as progress:
        progress("simulating", 0.0)
        data = simulated(gyro, rate, duration, seed, axes)
        progress("writing", 0.5)
        with writing(), together(paths, force) as temporary:
            for values, stem, path in zip(data, ("gyro", "drift"), temporary, strict=True):
                write_log(_log(values, stem, rate, gyro), path)
    print("\n".join(f"wrote {path}" for path in paths))


def simulated(
    gyro: Device, rate: float, duration: float, seed: int, axes: int
) -> tuple[Floats, Floats]:
    """Return signal and true drift, shape (n, axes), rad/s, or raise a usage fault."""
    with as_usage():
        return run_simulation(gyro, rate, duration, seed, axes=axes)


def _checked_paths(output: Path, force: bool) -> list[Path]:
    if output.suffix.lower() not in _SUFFIXES:
        raise UsageFault(f"cannot write a log as '{output.suffix}'; known: {', '.join(_SUFFIXES)}")
    if output.suffix.lower() == ".parquet":
        require("pyarrow", "io")
    paths = [output, output.with_name(f"{output.stem}-truth{output.suffix}")]
    check_outputs(paths, force)
    return paths


def _log(values: Floats, stem: str, rate: float, gyro: Device) -> Log:
    labels = AXES if values.shape[1] <= len(AXES) else [str(i + 1) for i in range(values.shape[1])]
    names = tuple(f"{stem}_{label}_radps" for label, _ in zip(labels, values.T, strict=False))
    meta = {"sensor": f"simulated {gyro.name}"}
    return Log(np.arange(len(values)) / rate, rate, values, names, "rad/s", meta)


def _listed() -> str:
    head = f"{'device':12}{'noise density':>17}{'bias instability':>18}"
    head += f"{'turn-on bias':>15}{'resolution':>13}"
    units = f"{'':12}{'deg/s/sqrt(Hz)':>17}{'deg/h':>18}{'deg/s':>15}{'deg/s':>13}"
    return "\n".join(
        (head, units, *map(_row, DEVICES.values()), "", *map(_source, DEVICES.values()))
    )


def _row(gyro: Device) -> str:
    noise = convert(gyro.noise.angle_random_walk, "rad/s/sqrt(Hz)", "deg/s/sqrt(Hz)")
    bias = convert(gyro.noise.bias_instability, "rad/s", "deg/h")
    turn_on, step = (convert(v, "rad/s", "deg/s") for v in (gyro.turn_on_bias, gyro.resolution))
    return f"{gyro.name:12}{noise:17.3g}{bias:18.3g}{turn_on:15.3g}{step:13.3g}"


def _source(gyro: Device) -> str:
    return textwrap.fill(f"{gyro.name}: {gyro.source}", WIDTH, subsequent_indent="  ")
