"""``zerorate demo``: a simulated gyro in the filters."""

from typing import Annotated

import numpy as np

from zerorate.cli.options import Force, Output
from zerorate.cli.outputs import LogAndFigure, check_outputs, print_written, progress_bar
from zerorate.cli.parameters import Option
from zerorate.cli.simulate import Duration, Seed, SimulatedRate
from zerorate.show.tables import wrap_prose
from zerorate.simulation.devices import device as find_device
from zerorate.tasks.replay import Replay
from zerorate.tasks.replay import replay as remove_bias
from zerorate.tasks.saving import Outputs, files_of
from zerorate.tasks.simulate import DURATION_S, simulated_demo


def demo(
    device: Annotated[str, Option("Gyro; zerorate simulate --list shows all.")] = "MPU-6050",
    duration: Duration = DURATION_S,
    rate: SimulatedRate = 100.0,
    seed: Seed = 1,
    output: Output = "demo",
    force: Force = False,
) -> None:
    """Try it without a sensor: simulate a gyro at rest on three axes and remove its bias.

    Prints the errors of each method, and writes the filtered log and a figure.
    """
    gyro = find_device(device)
    written = LogAndFigure(output, force=force)
    outputs = written.at(written.place("demo-zerorate"))
    check_outputs(outputs.paths, force)
    with progress_bar() as progress:
        progress("simulating", 0.0)
        log, truth = simulated_demo(gyro, rate, duration, seed)
        result = remove_bias(log, methods="all", truth=truth, progress=progress)
        outputs.save(files_of(result), progress)
    print(f"{gyro.name}, simulated at rest: {duration:g} s at {rate:g} Hz, seed {seed}\n")
    print(result)
    print_written(outputs.paths)
    print(f"\n{_guide(result, outputs)}")


def _guide(result: Replay, outputs: Outputs) -> str:
    """Return a guide to the written files, for a first run."""
    assert result.error_at_end is not None
    error = float(np.abs(result.error_at_end).max())
    biases = np.abs([score.mean for score in result.scores if score.method == "raw"])
    sentences = (
        f"What you see: the simulated gyro has a bias of up to {max(biases):.2g} deg/s. The method "
        f"{result.method} is off by {error:.2g} deg/s at the end at most (the column 'error at the "
        "end'); 'true error' of the second table is RMS over the log.",
        f"Look at {outputs.figures[0]}: raw samples on top, below them the bias of each axis with "
        f"its uncertainty, and the true bias (dashed).",
        f"{outputs.log} is the filtered log: raw minus bias, and the bias in columns of its own.",
        "Next: zerorate replay LOG does the same with your own log.",
    )
    return "\n".join(map(wrap_prose, sentences))
