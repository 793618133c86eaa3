"""Time of checks, notes and error paths; run it in two checkouts in turn, compare the minima."""

import tempfile
import time
from pathlib import Path

import numpy as np
from scipy.io import savemat

import zerorate as zr

N = 400_000


def least(f, times=9):
    """Return the minimum time of several runs, s."""
    found = []
    for _ in range(times):
        begin = time.perf_counter()
        f()
        found.append(time.perf_counter() - begin)
    return min(found)


def filters(z):
    """Yield the name and the time of a sample, ns, for filters after their start-up."""
    rows = z[: N // 8 * 8].reshape(-1, 8)
    for method, record, channels in [
        ("kf", z, None),
        ("fading", z, None),
        ("auto", z, None),
        ("fading", rows, 8),
    ]:
        f = zr.DriftFilter(rate=100.0, method=method, channels=channels, output="estimate")
        f.process(record[:200])
        took = least(lambda f=f, record=record: f.process(record))
        yield f"{method}, {channels or 1} channels, ns a sample", 1e9 * took / record.size


def files(z, folder):
    """Yield the name and the reading time, ms, of a text table and of a MAT file."""
    table, mat = folder / "a.csv", folder / "a.mat"
    columns = np.column_stack([np.arange(200_000) / 100, z[:200_000]])
    names = "time_s,gyro_x_dps"
    np.savetxt(table, columns, delimiter=",", header=names, comments="", fmt="%.6f")
    savemat(mat, {"time_s": np.arange(20_000) / 100, "gyro_x_dps": z[:20_000]})
    for name, path in (("text, 200 000 rows, ms", table), ("MAT, 20 000 rows, ms", mat)):
        yield name, 1e3 * least(lambda path=path: zr.read_log(path), 4)


def main():
    z = np.random.default_rng(1).standard_normal(N)
    with tempfile.TemporaryDirectory() as folder:
        told = [*filters(z), *files(z, Path(folder))]
    short = least(
        lambda: zr.DriftFilter(rate=100.0, method="auto", output="estimate").process(z[:6000]), 40
    )
    told.append(("auto, a new filter on 6000 samples, us", 1e6 * short))
    told.append(("allan of 20 000 samples, us", 1e6 * least(lambda: zr.allan(z[:20_000], 100), 30)))
    for name, value in told:
        print(f"{name:<42} {value:8.1f}")


if __name__ == "__main__":
    main()
