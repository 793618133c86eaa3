"""Speed of the filter relative to peers, all in one run: ``python benches/ratios.py``.

Each row is the minimum of several rounds. Every round times every row once, so that a disturbance
of the machine affects all rows equally.
"""

import sys
import time
from pathlib import Path

import numpy as np

import peers
import zerorate as zr
from versions import print_versions

sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))

N = 1_000_000
ROUNDS = 9
C = ("-O3", "-march=native")
LEARNS = "-DLEARNED=12000"
START = 100
"""Number of samples before the first block of the self-tuning filter."""


def _filter(method="fading", output="estimate", **options):
    return lambda z: zr.DriftFilter(100.0, method=method, output=output, **options).process(z)


def _calls(make, n):
    def run(z):
        update = make()
        samples = z[:n].tolist()
        start = time.perf_counter()
        for sample in samples:
            update(sample)
        return (time.perf_counter() - start) / n

    return run


def _learned_update():
    drift = zr.DriftFilter(rate=100.0, method="fading", output="estimate")
    drift.process(np.random.default_rng(2).standard_normal(20_000))
    return drift.update


def _self_tuned():
    drift = zr.DriftFilter(rate=100.0, method="auto", output="estimate")
    drift.process(np.random.default_rng(2).standard_normal(20_000))
    return drift


def _at_the_end_of(period):
    """Return the minimum time of the sample that ends a tick or a block, s, over many calls."""

    def run(z):
        drift = _self_tuned()
        least = np.inf
        for _ in range(20):
            into = (drift.samples_seen - START) % period
            drift.process(z[: period - into - 1])
            start = time.perf_counter()
            drift.update(0.5)
            least = min(least, time.perf_counter() - start)
        return least

    return run


def _oracle(z):
    from oracle.drift import DriftFilter

    reference = DriftFilter(rate=100.0, adapt_for=None)
    for sample in z:
        reference.update(sample)


def batch_rows():
    """Return name, function of an array, and number of samples for each row."""
    learning = {"adapt_for": None}
    return [
        ("C, native, no guard", peers.c_batch(*C), N),
        ("C, generic x86-64, no guard", peers.c_batch("-O3"), N),
        ("C, native, the same guard", peers.c_batch(*C, "-DGUARD"), N),
        ("C, native, the same guard, learns 120 s", peers.c_batch(*C, "-DGUARD", LEARNS), N),
        ("numba, no guard", peers.numba_batch(), N),
        ("zerorate fading, default (learns 120 s)", _filter(), N),
        ("zerorate fading, always learning", _filter(**learning), N),
        ("zerorate akf, default", _filter(method="akf"), N),
        ("zerorate kf, default", _filter(method="kf"), N),
        ("zerorate auto", _filter(method="auto"), N),
        ("zerorate auto, output='compensated'", _filter(method="auto", output="compensated"), N),
        ("zerorate fading, default, motion='hold'", _filter(motion="hold"), N),
        ("zerorate RestDetector", lambda z: zr.RestDetector(rate=100.0).process(z), N),
        ("zerorate fading, small G0, default", _filter(process_noise=1e-4), N),
        ("zerorate fading, order (1, 1)", _filter(order=(1, 1)), N),
        ("zerorate fading, order (3, 3)", _filter(order=(3, 3)), N),
        ("filterpy 1, Kalman alone", peers.filterpy_batch(1), 5_000),
        ("filterpy 2, Kalman alone", peers.filterpy_batch(2), 5_000),
        ("NumPy oracle", _oracle, 2_000),
    ]


def seconds_per_sample(run, z):
    repeats = max(1, 20_000 // len(z)) if len(z) <= 1_000 else 1
    start = time.perf_counter()
    for _ in range(repeats):
        run(z)
    return (time.perf_counter() - start) / (repeats * len(z))


def least(rows):
    """Return the minimum time of a sample for each row over all rounds, s."""
    best = [np.inf] * len(rows)
    for _ in range(ROUNDS):
        for i, row in enumerate(rows):
            best[i] = min(best[i], row())
    return best


def print_table(title, names, values):
    print(f"\n{title}\n{'':44}{'ns':>9}{'ratio':>9}")
    for name, value in zip(names, values, strict=True):
        print(f"{name:44}{value * 1e9:9.1f}{value / values[0]:9.2f}")


def main():
    print_versions("cc", "numba", "filterpy", "filterpy 2")
    z = np.random.default_rng(1).standard_normal(N)
    rows = batch_rows()
    for _, run, _ in rows:
        run(z[:1000])  # compile and warm up
    timed = [lambda run=run, n=n: seconds_per_sample(run, z[:n]) for _, run, n in rows]
    print_table("A sample of a batch", [name for name, *_ in rows], least(timed))

    calls = [
        ("C extension, update(float), no guard", _calls(peers.c_extension, 100_000)),
        ("zerorate DriftFilter.update", _calls(_learned_update, 100_000)),
        ("zerorate DriftFilter.update, auto", _calls(lambda: _self_tuned().update, 100_000)),
        ("the same, the sample that ends a tick", _at_the_end_of(25)),
        ("the same, the sample that ends a block", _at_the_end_of(200)),
        ("zerorate AllanNoise.update", _calls(lambda: zr.noise.AllanNoise().update, 100_000)),
        ("math.fabs, an empty call", _calls(lambda: __import__("math").fabs, 100_000)),
    ]
    timed = [lambda run=run: run(z) for _, run in calls]
    print_table("A call from Python, loop included", [name for name, _ in calls], least(timed))

    lengths = [10**k for k in range(3, 9)]
    z = np.random.default_rng(1).standard_normal(lengths[-1])
    timed = [
        lambda n=n: seconds_per_sample(_filter(startup=0.1, adapt_for=None), z[:n]) for n in lengths
    ]
    print_table(
        "A sample of a batch of n, always learning", [f"n = {n:,}" for n in lengths], least(timed)
    )


if __name__ == "__main__":
    main()
