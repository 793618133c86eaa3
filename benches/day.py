"""A day of six axes at 100 Hz through ``zerorate replay``: time, memory, and time of each stage.

    python benches/day.py [--rows 8640000] [--rounds 3]

Time and memory are for the whole command, including the start of the program. The table has the
minimum time and the maximum memory of the rounds. Each stage is timed in one thread.
"""

import argparse
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from zerorate.io import open_log
from zerorate.io.readers.parquet import RowGroupWriter
from zerorate.tasks.replay.filters import Filters
from zerorate.tasks.replay.measures import Measures
from zerorate.tasks.replay.run import BLOCK_ROWS
from zerorate.tasks.workers import limit_threads, thread_pool

RATE = 100.0
PART = 1 << 18
AXES = tuple(f"{sensor}_{axis}" for sensor in ("gyro", "acc") for axis in "xyz")
OTHERS = "--methods kf,akf,fading"
CASES = ("--method fading --no-figure", "--no-figure", f"{OTHERS} --no-figure", OTHERS)


def make(path, rows):
    """Write a log with white noise on a random walk, as from a gyro at rest.

    The log is made in parts, because the memory of this process would count for the command.
    """
    rng, drift = np.random.default_rng(1), np.zeros(len(AXES))
    schema = pa.schema([(name, pa.float64()) for name in ("time", *AXES)])
    with pq.ParquetWriter(path, schema) as file:
        for first in range(0, rows, PART):
            count = min(PART, rows - first)
            walk = drift + np.cumsum(1e-5 * rng.standard_normal((count, len(AXES))), axis=0)
            drift = walk[-1]
            axes = walk + 0.1 * rng.standard_normal(walk.shape)
            time = np.arange(first, first + count) / RATE
            file.write_table(pa.table([time, *np.asfortranarray(axes).T], schema=schema))


def run(path, folder, options):
    """Return the time, s, the maximum memory, MB, and the size of the output, MB."""
    command = ["-m", "zerorate", "replay", str(path), "-o", str(folder), "--force"]
    arguments = [sys.executable, *command, "--columns", ",".join(AXES), *options.split()]
    begin = time.perf_counter()
    child = subprocess.Popen(arguments, stdout=subprocess.DEVNULL)
    _, status, usage = os.wait4(child.pid, 0)
    seconds = time.perf_counter() - begin
    # The process is reaped here, so its object must not reap it again.
    child.returncode = os.waitstatus_to_exitcode(status)
    if child.returncode:
        raise SystemExit(f"zerorate replay {options} ended with {child.returncode}")
    written = sum(file.stat().st_size for file in folder.glob("*.parquet"))
    return seconds, usage.ru_maxrss / 1e3, written / 1e6


class Stopwatch:
    """Processor time of this process for each stage, s."""

    def __init__(self):
        self.seconds = {}

    @contextmanager
    def __call__(self, stage):
        begin = time.process_time()
        yield
        passed = time.process_time() - begin
        self.seconds[stage] = self.seconds.get(stage, 0.0) + passed

    def each(self, stage, items):
        """Yield items, and time their production."""
        items, end = iter(items), object()
        while True:
            with self(stage):
                item = next(items, end)
            if item is end:
                return
            yield item


def stages(path, target, method) -> dict[str, float]:
    watch = Stopwatch()
    with watch("clock"):
        recording = open_log(path, columns=list(AXES))
    header = recording.header
    filters = Filters(header, [method], "estimate", {})
    measures = Measures(header, [method], (10.0, 60.0), filters.holds)
    with (
        limit_threads(1),
        thread_pool() as executor,
        RowGroupWriter(target, ["time", *AXES], {}) as file,
    ):
        raws = watch.each("read", recording.blocks(BLOCK_ROWS))
        for block in watch.each("read and filter", filters.process_blocks(raws, executor)):
            with watch("measure"):
                measures.take(block)
            with watch("write"):
                file.write([recording.time(block.first, block.end), *block.bias[method]])
    watch.seconds["filter"] = watch.seconds.pop("read and filter") - watch.seconds["read"]
    return watch.seconds


def table(path, folder, rounds) -> Iterator[str]:
    yield "| options | s | MB in memory | MB written |\n| --- | ---: | ---: | ---: |"
    for options in CASES:
        found = [run(path, folder, options) for _ in range(rounds)]
        seconds, memory = min(f[0] for f in found), max(f[1] for f in found)
        yield f"| `{options}` | {seconds:.2f} | {memory:.0f} | {found[0][2]:.0f} |"


def main(arguments: Sequence[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--rows", type=int, default=8_640_000)
    parser.add_argument("--rounds", type=int, default=3)
    asked = parser.parse_args(arguments)
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        make(folder / "day.parquet", asked.rows)
        (folder / "out").mkdir()
        for line in table(folder / "day.parquet", folder / "out", asked.rounds):
            print(line, flush=True)
        print("\n| processor's seconds | fading | auto |\n| --- | ---: | ---: |")
        each = [stages(folder / "day.parquet", folder / "x.parquet", m) for m in ("fading", "auto")]
        for stage in ("clock", "read", "filter", "measure", "write"):
            print(f"| {stage} | " + " | ".join(f"{found[stage]:.2f}" for found in each) + " |")


if __name__ == "__main__":
    main()
