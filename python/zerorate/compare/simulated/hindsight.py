"""The exponential moving average that proves best once the truth is known."""

from typing import Final

import numpy as np
import numpy.typing as npt

__all__ = ["GAINS", "best_moving_average"]

Floats = npt.NDArray[np.float64]

GAINS: Final[Floats] = np.geomspace(1e-6, 1e-1, 25)
"""Gains that are tried: averages over ten samples to a million."""


def best_moving_average(signal: Floats, truth: Floats, first: int) -> Floats:
    """Return the mean squared error of each record at the one gain that is best for all of them.

    Until a gain is reached each is the plain mean, so that none has to forget its first sample.

    Parameters
    ----------
    signal, truth : ndarray, shape (n, k)
        Output and true drift of k gyros.
    first : int
        First sample whose error counts.
    """
    gains = GAINS[:, np.newaxis]
    x = np.zeros((GAINS.size, signal.shape[1]))
    total = np.zeros_like(x)
    for k, (z, drift) in enumerate(zip(signal, truth, strict=True)):
        x += np.maximum(gains, 1.0 / (k + 1)) * (z - x)
        if k >= first:
            total += (x - drift) ** 2
    best: Floats = total[total.sum(axis=1).argmin()]
    return best / (len(signal) - first)
