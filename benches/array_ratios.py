"""Time of an array compared with its filters alone: ``python benches/array_ratios.py``.

Eight gyros with three axes rest and move in turn. Each row is the minimum of several rounds. Every
round times every row once, so that a disturbance of the machine affects all rows equally.
"""

import time

import numpy as np

import zerorate as zr
from ratios import least, print_table
from versions import print_versions

N = 50_000
CALLS = 5_000
SENSORS = 8
RATE = 100.0


def samples():
    """Return samples (n, sensors, 3): ten seconds of rest, then ten seconds of motion."""
    rng = np.random.default_rng(1)
    t = np.arange(N) / RATE
    waves = 30.0 * np.sin(2.0 * np.pi * t[:, np.newaxis] * [0.7, 0.43, 0.9])
    true = np.where((t % 20.0 > 10.0)[:, np.newaxis], waves, 0.0)
    scale = 1.0 + 0.01 * rng.standard_normal((SENSORS, 3))
    noise = 0.1 * rng.standard_normal((N, SENSORS, 3))
    return true[:, np.newaxis] * scale + rng.standard_normal((SENSORS, 3)) + noise


def filters(z):
    zr.DriftFilter(RATE, channels=3 * SENSORS).process(z.reshape(len(z), -1), threads=1)


def voted(z):
    zr.GyroArray(RATE, SENSORS).process(z)


def turned(z):
    zr.GyroArray(RATE, rotations=[np.eye(3)] * SENSORS).process(z)


def median(z):
    np.median(z, axis=1)


def calls(z):
    array = zr.GyroArray(RATE, SENSORS)
    for row in z[:CALLS]:
        array.update(row)


def rows():
    """Return name, function, and number of sample rows for each row of the table."""
    yield "24 filters alone", filters, N
    yield "GyroArray.process, 8 x 3", voted, N
    yield "the same with rotations", turned, N
    yield "NumPy: the median alone", median, N
    yield "GyroArray.update, a call", calls, CALLS


def seconds(run, z, count):
    """Return the time of a sample row of all sensors, s."""
    start = time.perf_counter()
    run(z)
    return (time.perf_counter() - start) / count


def main():
    print_versions()
    z, todo = samples(), list(rows())
    found = least([lambda run=run, n=n: seconds(run, z, n) for _, run, n in todo])
    print_table("A row of eight gyros of three axes", [name for name, *_ in todo], found)


if __name__ == "__main__":
    main()
