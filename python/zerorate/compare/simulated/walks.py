"""White noise plus random walks of several sizes, each seen by the optimal filter of each."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

__all__ = ["Walks", "watched"]

Floats = npt.NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Walks:
    """What the filters of all sizes say of records of all sizes, at some instants.

    Attributes
    ----------
    estimates : ndarray, shape (instants, sizes, sizes, k)
        Drift by the filter of the first size, on record k of the second.
    likelihood : ndarray, of the same shape
        Log likelihood of the record so far under that filter's size, less what all sizes share.
    optimum : ndarray, shape (sizes,)
        Error variance of each size's own filter, mean over the instants.
    """

    estimates: Floats
    likelihood: Floats
    optimum: Floats


def watched(ratios: Floats, times: npt.NDArray[np.intp], k: int, seed: int) -> Walks:
    """Draw k records of each size and filter all of them with the filters of all sizes.

    Parameters
    ----------
    ratios : ndarray, shape (sizes,)
        Variance of a step of the walk over that of the white noise, which is 1.
    times : ndarray of int, shape (instants,)
        Samples after which the filters are read, ascending from 0.
    k : int
        Records of each size.
    seed : int
        Of all draws.

    Notes
    -----
    The level has no prior: the first sample sets it, and says nothing of the size.
    """
    samples = _samples(ratios, k, np.random.default_rng(seed))
    bank = _Bank(ratios, next(samples))
    read = []
    for now in range(int(times[-1]) + 1):
        if now > 0:
            bank.update(next(samples))
        if now in times:
            read.append((bank.x.copy(), bank.likelihood.copy(), bank.P.copy()))
    estimates, likelihood, variance = (np.array(part) for part in zip(*read, strict=True))
    return Walks(estimates, likelihood, variance.mean(axis=0))


def _samples(ratios: Floats, k: int, random: np.random.Generator) -> Iterator[Floats]:
    """Yield one sample after the other of k records of each size, shape (sizes, k)."""
    steps = np.sqrt(ratios)[:, np.newaxis]
    drift = np.zeros((ratios.size, k))
    while True:
        yield drift + random.standard_normal(drift.shape)
        drift += steps * random.standard_normal(drift.shape)


class _Bank:
    """Filters of all sizes on the same records: states of shape (sizes, sizes, k)."""

    def __init__(self, ratios: Floats, first: Floats) -> None:
        self._ratios = ratios
        self.x = np.tile(first, (ratios.size, 1, 1))
        self.likelihood = np.zeros_like(self.x)
        self.P = np.ones(ratios.size)

    def update(self, z: Floats) -> None:
        """Take a sample of every record, shape (sizes, k)."""
        P = self.P + self._ratios
        variance = _each(P + 1.0)
        innovation = z - self.x
        self.likelihood -= 0.5 * (np.log(variance) + innovation**2 / variance)
        # With R = 1 the gain is also the variance after the sample.
        self.P = P / (P + 1.0)
        self.x += _each(self.P) * innovation


def _each(of_filter: Floats) -> Floats:
    return of_filter[:, np.newaxis, np.newaxis]
