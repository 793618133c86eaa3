"""``zerorate demo``: a simulated gyro through the filters."""

from typing import Annotated

import numpy as np
import typer

from zerorate.cli.errors import as_usage
from zerorate.cli.options import Force, Output
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
    output: Output = "demo",
    force: Force = False,
) -> None:
    """Simulate a three-axis gyro at rest, filter it, and compare with its true drift."""
    with as_usage():
        gyro = find_device(device)
    place = Outputs.place(output, "demo", figure=True)
    outputs = Outputs.of(place, None, None, draws=True, force=force)
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
