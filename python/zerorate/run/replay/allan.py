"""Allan deviations before and after the filter."""

from collections.abc import Iterator
from concurrent.futures import Executor, Future
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from zerorate._native import allan_deviations

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
    """Curves being computed by other threads, of two records of shape (n, k)."""

    def __init__(self, executor: Executor, raw: Floats, filtered: Floats, rate: float) -> None:
        self._factors = _octaves(len(raw))
        self._taus = np.array(self._factors) / rate
        self._jobs: list[Future[Floats]] = [
            executor.submit(self._deviations, record) for record in (raw, filtered)
        ]

    def _deviations(self, record: Floats) -> Floats:
        # The executor's threads are all that the machine has.
        deviations, _, _ = allan_deviations(record, self._factors, threads=1)
        return deviations.T

    def __iter__(self) -> Iterator[float]:
        """Wait for one record after the other, and yield the fraction that is there."""
        for i, job in enumerate(self._jobs, start=1):
            job.result()
            yield i / len(self._jobs)

    def curves(self) -> AllanCurves:
        """Wait for all, and return the curves."""
        raw, filtered = (job.result() for job in self._jobs)
        return AllanCurves(self._taus, raw, filtered)


def _octaves(n: int) -> list[int]:
    return [1 << i for i in range(max(1, (n // 4).bit_length()))]
