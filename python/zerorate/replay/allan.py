"""Allan deviations before and after the filter."""

from collections.abc import Iterator
from concurrent.futures import Executor, Future
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from zerorate._native import overlapping_allan_deviation

__all__ = ["AllanCurves", "AllanJob"]

Floats = npt.NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class AllanCurves:
    """Overlapping Allan deviations of k axes at m averaging times, one octave apart.

    Parameters
    ----------
    taus : ndarray, shape (m,)
        Averaging times up to a quarter of the record, s.
    raw, filtered : ndarray, shape (k, m)
        In the unit of the data; NaN where no two neighbouring clusters are whole.
    """

    taus: Floats
    raw: Floats
    filtered: Floats


class AllanJob:
    """Curves being computed by other threads, of axes given as contiguous rows (k, n)."""

    def __init__(self, executor: Executor, raw: Floats, filtered: Floats, rate: float) -> None:
        self._shape = (2, len(raw), -1)
        self._clusters = _octaves(raw.shape[1])
        self._taus = np.array(self._clusters) / rate
        self._jobs: list[Future[Floats]] = [
            executor.submit(overlapping_allan_deviation, row, self._clusters)
            for row in (*raw, *filtered)
        ]

    def __iter__(self) -> Iterator[float]:
        """Wait for one curve after the other, and yield the fraction that is there."""
        for i, job in enumerate(self._jobs, start=1):
            job.result()
            yield i / len(self._jobs)

    def curves(self) -> AllanCurves:
        """Wait for all, and return the curves."""
        raw, filtered = np.array([job.result() for job in self._jobs]).reshape(self._shape)
        return AllanCurves(self._taus, raw, filtered)


def _octaves(n: int) -> list[int]:
    return [1 << i for i in range(max(1, (n // 4).bit_length()))]
