"""Logs that hold each sample of a slower sensor until the next."""

from dataclasses import dataclass

import numpy as np

from zerorate.types import Floats, Integers


@dataclass(frozen=True, eq=False)
class Held:
    """Rows of a log at their times, s, samples of the sensor, and which of them each row holds."""

    time: Floats
    rows: Floats
    samples: Floats
    which: Integers


def held(rng, samples, rate, log_rate, late=0.0):
    """Return the rows at `log_rate`, Hz, of samples (n, k) made at `rate`.

    ``late`` is the standard deviation of the time at which a row is read, in periods of the log.
    """
    n = int(len(samples) * log_rate / rate) - 1
    read = np.arange(n) + 0.37 + late * rng.standard_normal(n)
    which = np.clip((read * rate / log_rate).astype(np.int64), 0, len(samples) - 1)
    which = np.maximum.accumulate(which)
    return Held(np.arange(n) / log_rate, samples[which], samples, which)


def quantised(rng, n, axes=3, sigma=10.0, step=1 / 131):
    """Return noise of so many steps of a sensor's resolution."""
    return step * np.rint(sigma * rng.standard_normal((n, axes)))
