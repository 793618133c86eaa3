"""Small logs of made signals."""

import numpy as np

from zerorate import Log

RATE = 100.0


def make_log(data, rate=RATE, names=None, unit="deg/s", **meta):
    data = np.asarray(data, dtype=np.float64)
    data = data[:, np.newaxis] if data.ndim == 1 else data
    names = names or [f"gyro_{i}" for i in range(data.shape[1])]
    return Log(np.arange(len(data)) / rate, rate, data, names, unit, meta)


def noise(n=6000, axes=2, seed=1):
    return 0.5 + 0.1 * np.random.default_rng(seed).standard_normal((n, axes))
