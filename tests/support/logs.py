"""Small logs of made signals."""

import numpy as np

from zerorate import Log, write_log

RATE = 100.0


def make_log(data, rate=RATE, names=None, unit="deg/s", **meta):
    data = np.asarray(data, dtype=np.float64)
    data = data[:, np.newaxis] if data.ndim == 1 else data
    names = names or [f"gyro_{i}" for i in range(data.shape[1])]
    return Log(np.arange(len(data)) / rate, rate, data, names, unit, meta)


def write_table(path, columns, rate=RATE):
    """Write columns after the seconds of a clock, as CSV."""
    names, values = zip(*columns.items(), strict=True)
    rows = np.column_stack([np.arange(len(values[0])) / rate, *values])
    np.savetxt(path, rows, delimiter=",", header="time_s," + ",".join(names), comments="")
    return path


def noise(n=6000, axes=2, seed=1):
    return 0.5 + 0.1 * np.random.default_rng(seed).standard_normal((n, axes))


def write_gyros(path, n=1500, axes=2, missing=slice(0, 0), unit="deg/s"):
    """Write gyros at rest in the format of the file's suffix."""
    data = 0.5 + 0.1 * np.random.default_rng(1).standard_normal((n, axes))
    data[missing] = np.nan
    names = [f"gyro_{axis}" for axis in "xyzuvw"[:axes]]
    write_log(Log(np.arange(n) / 100.0, 100.0, data, names, unit), path)
    return path
