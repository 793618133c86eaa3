"""``zerorate demo``: a simulated gyro through the filters."""

from pathlib import Path
from typing import Annotated

import numpy as np
import typer

from zerorate.cli.errors import as_usage
from zerorate.cli.options import FigureFormat, Force, LogFormat, OutputFolder
from zerorate.cli.outputs import progress_bar
from zerorate.cli.replay import Outputs, in_memory, print_result
from zerorate.cli.simulate import AXES, Duration, Seed, SimulatedRate, simulated
from zerorate.io import Log
from zerorate.simulate.devices import device as find_device
from zerorate.units import convert

__all__ = ["demo"]


def demo(
    device: Annotated[str, typer.Option(help="Gyro of the table: see simulate --list.")] = (
        "MPU-6050"
    ),
    duration: Duration = 600.0,
    rate: SimulatedRate = 100.0,
    seed: Seed = 1,
    output: OutputFolder = Path("demo"),
    force: Force = False,
) -> None:
    """Simulate a three-axis gyro at rest, filter it, and compare with its true drift."""
    with as_usage():
        gyro = find_device(device)
        output.mkdir(exist_ok=True)
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
        result = in_memory(log, progress, truth=truth)
        outputs.write(result, progress)
    print(f"{gyro.name}, simulated: {duration:g} s at {rate:g} Hz, seed {seed}\n")
    print_result(result, outputs)
