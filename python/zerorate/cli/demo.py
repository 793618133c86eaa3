"""``zerorate demo``: a simulated gyro through the filters."""

from pathlib import Path
from typing import Annotated

import numpy as np
import typer

from zerorate.cli.chosen import Chosen
from zerorate.cli.faults import as_usage
from zerorate.cli.options import FigureFormat, LogFormat, Method
from zerorate.cli.outputs import Outputs
from zerorate.cli.progress import progress_bar
from zerorate.cli.replay import compared, print_result
from zerorate.cli.simulate import AXES, made_folder, simulated
from zerorate.io import Log
from zerorate.run.replay import FilterOptions
from zerorate.simulate.devices import device as find_device
from zerorate.units import convert

__all__ = ["demo"]


def demo(
    device: Annotated[str, typer.Option(help="Gyro of the table: see simulate --list.")] = (
        "MPU-6050"
    ),
    duration: Annotated[float, typer.Option(help="Length, s.")] = 600.0,
    rate: Annotated[float, typer.Option(help="Samples per second, Hz.")] = 100.0,
    seed: Annotated[int, typer.Option(help="The same seed gives the same signal.")] = 1,
    output: Annotated[
        Path, typer.Option("-o", "--output", metavar="FOLDER", help="Folder of the files.")
    ] = Path("demo"),
    force: Annotated[bool, typer.Option("--force", help="Replace existing files.")] = False,
) -> None:
    """Simulate a three-axis gyro at rest, filter it, and compare with its true drift."""
    with as_usage():
        gyro = find_device(device)
    made_folder(output)
    outputs = Outputs.of(output, "demo", LogFormat.parquet, FigureFormat.png, force)
    with progress_bar() as progress:
        progress("simulating", 0.0)
        signal, truth = (
            convert(values, "rad/s", "deg/s")
            for values in simulated(gyro, rate, duration, seed, len(AXES))
        )
        names = tuple(f"gyro_{axis}_dps" for axis in AXES)
        meta = {"source": f"simulated {gyro.name}", "sensor": f"simulated {gyro.name}"}
        log = Log(np.arange(len(signal)) / rate, rate, signal, names, "deg/s", meta)
        chosen = Chosen(compared(Method.auto), None, FilterOptions())
        result = chosen.in_memory(log, progress, truth)
        outputs.write(result, progress)
    print(f"{gyro.name}, simulated: {duration:g} s at {rate:g} Hz, seed {seed}\n")
    print_result(result, outputs)
