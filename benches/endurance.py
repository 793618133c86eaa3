"""Long runs to check that covariances stay definite: ``python benches/endurance.py [FOLDER]``.

The input is 1e8 samples of white noise. The recordings at rest in FOLDER are repeated to the same
length. The eigenvalues of P and G are checked every 1e4 samples. The exit code is 1 if an
eigenvalue is negative.
"""

import sys
from pathlib import Path

import numpy as np

import zerorate as zr

CHUNK = 10_000
SAMPLES = 100_000_000
RECORDINGS = ("adis16405_static_100hz_run1", "mpu6050_static_100hz")


def white_noise():
    rng = np.random.default_rng(1)
    for _ in range(SAMPLES // CHUNK):
        yield rng.standard_normal(CHUNK)


def repeated(signal):
    rows = np.resize(signal, max(CHUNK, signal.size // CHUNK * CHUNK)).reshape(-1, CHUNK)
    for k in range(SAMPLES // CHUNK):
        yield rows[k % len(rows)]


def lowest_eigenvalues(chunks, **options):
    """Return the smallest eigenvalues of P and G over all checks, relative to R."""
    drift = zr.DriftFilter(100.0, method="fading", output="estimate", **options)
    lowest = np.full(2, np.inf)
    for chunk in chunks:
        drift.process(chunk)
        matrices = np.stack([drift.covariance, drift.process_noise]) / drift.measurement_noise
        lowest = np.minimum(lowest, np.linalg.eigvalsh(matrices)[:, 0])
    return lowest, drift.guard_count


def signals(folder):
    yield "white noise", white_noise, {}
    yield "white noise, always learning", white_noise, {"adapt_for": None}
    yield "white noise, G0 1e-4", white_noise, {"process_noise": 1e-4}
    for name in RECORDINGS if folder else ():
        log = zr.read_log(folder / f"{name}.parquet", rate=100.0)
        for axis, signal in zip(log.names, log.data.T, strict=True):
            yield f"{name[:9]} {axis}", lambda signal=signal: repeated(signal), {}


def main():
    folder = Path(sys.argv[1]) if len(sys.argv) > 1 else None
    worst = np.inf
    print(f"{'signal':32}{'lowest of P/R':>16}{'lowest of G/R':>16}{'guarded':>12}")
    for name, chunks, options in signals(folder):
        (p, g), guards = lowest_eigenvalues(chunks(), **options)
        print(f"{name:32}{p:16.2e}{g:16.2e}{guards:12,}", flush=True)
        worst = min(worst, p, g)
    sys.exit(int(worst < 0))


if __name__ == "__main__":
    main()
