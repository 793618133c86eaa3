"""Allan deviations before and after the filter."""

from dataclasses import dataclass

import numpy as np

from zerorate._native import allan_deviations
from zerorate.tasks.workers import thread_pool
from zerorate.types import Floats


@dataclass(frozen=True, eq=False)
class AllanCurves:
    """Overlapping Allan deviations of k axes at m averaging times, one octave apart.

    Parameters
    ----------
    taus : ndarray, shape (m,)
        Averaging times up to a quarter of the record, s.
    raw, filtered : ndarray, shape (k, m)
        Deviations in the unit of the data; NaN if there are no two consecutive clusters with all
        samples.
    """

    taus: Floats
    raw: Floats
    filtered: Floats


def allan_curves(raw: Floats, filtered: Floats, rate: float) -> AllanCurves:
    """Return the curves of two records, shape (n, k), from samples present in both."""
    # Predictions in a gap are no measurements.
    present = np.isfinite(raw)
    present_filtered = filtered if present.all() else np.where(present, filtered, np.nan)
    factors = _octaves(len(raw))
    with thread_pool() as executor:
        jobs = [executor.submit(_deviations, record, factors) for record in (raw, present_filtered)]
        return AllanCurves(np.array(factors) / rate, *(job.result() for job in jobs))


def _deviations(record: Floats, factors: list[int]) -> Floats:
    # The executor already uses all cores.
    deviations, _, _ = allan_deviations(record, factors, threads=1)
    return deviations.T


def _octaves(n: int) -> list[int]:
    return [1 << i for i in range(max(1, (n // 4).bit_length()))]
