"""Processor time to build a figure and to render it as PNG.

``python benches/figures.py`` prints a row per figure, with the minimum of ROUNDS. All data are
simulated.
"""

import time
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

import zerorate as zr
from zerorate.show import plot_calibration, plot_replay, plot_track, save_figure
from zerorate.tasks.replay.run import run_filters

ROUNDS = 5
SAMPLES, RATE = 1_000_000, 100.0


def seconds(work):
    """Return the minimum processor time of some rounds, s."""
    taken = []
    for _ in range(ROUNDS):
        begun = time.process_time()
        work()
        taken.append(time.process_time() - begun)
    return min(taken)


def drawn(make, path):
    """Return the processor time to build and render a figure, s."""
    return seconds(lambda: save_figure(make(), path))


def results():
    """Yield the names of figures, and functions that draw them."""
    rng = np.random.default_rng(1)
    log = zr.Log(
        np.arange(SAMPLES) / RATE, RATE, rng.standard_normal((SAMPLES, 3)), list("xyz"), "deg/s"
    )
    alone = seconds(lambda: run_filters(log, methods=("auto",)))
    yield "the filter of a replay, for comparison", alone, None
    replayed = run_filters(log, methods=("auto",))
    yield "replay", None, lambda: plot_replay(replayed)
    yield "replay, all panels", None, lambda: plot_replay(replayed, everything=True)
    attitude = zr.estimate_attitude(zr.simulate_motion("hand", 200.0, 200.0, seed=1).recording())
    yield "attitude", None, attitude.plot
    session = zr.simulation.simulate_session(20, seed=4).recording
    found = zr.calibrate(session, gravity=9.80665)
    yield "calibrate", None, lambda: plot_calibration(found, session)
    drive = zr.simulate_drive(50.0, 900.0, seed=3)
    start = zr.align(drive.recording(), latitude=48.0, heading="course", span=(0.0, 20.0))
    track = zr.NavigationFilter(start).process(drive.recording(), drive.fixes)
    yield "navigate", None, lambda: plot_track(track)


def main():
    """Print the table."""
    with TemporaryDirectory() as folder:
        for name, taken, make in results():
            shown = drawn(make, Path(folder, "figure.png")) if taken is None else taken
            print(f"{name:40}{shown:7.2f} s")


if __name__ == "__main__":
    main()
