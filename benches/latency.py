"""Time of an answer by call, by line, and through a pipe: ``python benches/latency.py``.

Prints the median and the 99.9 % quantile of successive round trips, each timed alone. `cat` and an
empty call show the machine's own time: two switches between processes, and other processes.
"""

import subprocess
import sys
import tempfile
from pathlib import Path
from time import perf_counter_ns

import numpy as np

import zerorate as zr
from zerorate.tasks.live import LineStream, Settings

RATE = 1000.0
CALLS = 200_000
LINES = 50_000
WARM = 5000
STREAM = (sys.executable, "-m", "zerorate", "stream", "--rate", f"{RATE:g}")


def samples(n, channels):
    z = 0.5 + 0.1 * np.random.default_rng(1).standard_normal((n, channels))
    return z[:, 0].tolist() if channels == 1 else list(z)


def lines(n, channels):
    return [",".join(map(repr, np.atleast_1d(z).tolist())) for z in samples(n, channels)]


def timed(answer, inputs):
    """Return the time of each answer after the warm-up, us."""
    times = []
    for one in inputs:
        begin = perf_counter_ns()
        answer(one)
        times.append(perf_counter_ns() - begin)
    return np.array(times[WARM:]) / 1e3


def by_call(channels):
    width = None if channels == 1 else channels
    drift = zr.DriftFilter(RATE, method="auto", output="compensated", channels=width)
    return timed(drift.update, samples(CALLS, channels))


def by_line(channels):
    return timed(LineStream(Settings(RATE)).take, lines(CALLS, channels))


def through_pipe(channels, *command):
    pipe = subprocess.PIPE
    with subprocess.Popen(command, stdin=pipe, stdout=pipe) as process:

        def ask(line):
            process.stdin.write(line)
            process.stdin.flush()
            process.stdout.readline()

        return timed(ask, [f"{line}\n".encode() for line in lines(LINES, channels)])


def show(name, times):
    middle, late = np.quantile(times, [0.5, 0.999])
    print(f"{name:36}{middle:10.2f}{late:12.2f}", flush=True)


def main():
    print(f"{'microseconds':36}{'median':>10}{'99.9 %':>12}")
    show("empty call", timed(abs, samples(CALLS, 1)))
    show("pipe, cat", through_pipe(3, "cat"))
    for channels, axes in ((1, "1 axis"), (3, "3 axes")):
        show(f"update(), {axes}", by_call(channels))
        show(f"line in Python, {axes}", by_line(channels))
        show(f"pipe, {axes}", through_pipe(channels, *STREAM))
        with tempfile.TemporaryDirectory() as folder:
            saved = ("--checkpoint", str(Path(folder) / "state"))
            show(f"pipe with checkpoints, {axes}", through_pipe(channels, *STREAM, *saved))


if __name__ == "__main__":
    main()
