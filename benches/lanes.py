"""Time of several channels, all in one run: ``python benches/lanes.py``.

Each number is the minimum of several rounds. Every round times every row once.
"""

import sys
import time
from concurrent.futures import ThreadPoolExecutor

import numpy as np

import peers
import zerorate as zr

ROWS = 100_000
ROUNDS = 9
LANES = (4, 8)
OUT = 0
"""Replaces a number of threads: one thread that writes into an existing array."""
CHANNELS = (1, 2, 3, 4, 6, 8, 16, 64)
KINDS = {
    "kf": {"method": "kf"},
    "akf": {"method": "akf"},
    "fading": {"method": "fading"},
    "fading, always learning": {"method": "fading", "adapt_for": None},
    "auto": {"method": "auto"},
}


def c_jobs(rows):
    """Return name, channels, threads and job of the chain in C, for each number of lanes."""
    native = ("-O3", "-march=native", "-Wno-psabi")
    for k in (1, *LANES):
        run = peers.c_batch(*native, *([f"-DLANES={k}"] if k > 1 else []))
        z = np.ascontiguousarray(rows[:, :k] if k > 1 else rows[:, 0])
        yield "C, always learning, no guard", k, 1, lambda run=run, z=z: run(z)
        yield "C, always learning, no guard", k, 2, lambda run=run, z=z: at_once(run, z)


def at_once(run, z):
    """Process each half of the rows in its own thread, to show the gain of a second thread."""
    with ThreadPoolExecutor(2) as executor:
        list(executor.map(run, np.array_split(z, 2)))


def zerorate_jobs(rows):
    """Return name, channels, threads and job for the filters of this package."""
    for name, options in KINDS.items():
        for k in CHANNELS:
            z = np.ascontiguousarray(rows[:, :k])
            for threads in (1, 2) if k > 1 else (1,):

                def job(z=z, k=k, threads=threads, options=options):
                    zr.DriftFilter(rate=100.0, channels=k, output="estimate", **options).process(
                        z, threads=threads
                    )

                yield name, k, threads, job

            result = np.empty_like(z)

            def reused(z=z, k=k, out=result, options=options):
                zr.DriftFilter(rate=100.0, channels=k, output="estimate", **options).process(
                    z, out=out
                )

            yield name, k, OUT, reused


def least_seconds(jobs, rounds):
    """Return the minimum time of each job over the rounds, s."""
    best = {(name, k, threads): np.inf for name, k, threads, _ in jobs}
    for _ in range(rounds):
        for name, k, threads, job in jobs:
            start = time.perf_counter()
            job()
            best[name, k, threads] = min(best[name, k, threads], time.perf_counter() - start)
    return best


def print_table(best, n):
    titles = f"{'':30}{'channels':>9}{'row':>8}{'to one':>8}{'sample':>8}{'out=':>8}"
    print(f"{titles}{'2 threads':>11}{'gain':>7}")
    for (name, k, threads), seconds in best.items():
        if threads != 1:
            continue
        one, two = best[name, 1, 1], best.get((name, k, 2))
        row = f"{name:30}{k:9}{seconds / n * 1e9:8.1f}{seconds / one:8.2f}"
        row += f"{seconds / (n * k) * 1e9:8.2f}"
        out = best.get((name, k, OUT))
        row += " " * 8 if out is None else f"{out / (n * k) * 1e9:8.2f}"
        if two is not None:
            row += f"{two / (n * k) * 1e9:11.2f}{seconds / two:7.2f}"
        print(row)


def main(n=ROWS, rounds=ROUNDS):
    rows = np.random.default_rng(1).standard_normal((n, max(CHANNELS)))
    print_table(least_seconds([*c_jobs(rows), *zerorate_jobs(rows)], rounds), n)


if __name__ == "__main__":
    main(*map(int, sys.argv[1:]))
