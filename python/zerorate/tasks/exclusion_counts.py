"""Counts of present samples that a filter left out, per axis, and sentences on them."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Self

import numpy as np

from zerorate._native import DriftFilter
from zerorate.types import Integers


@dataclass(frozen=True, eq=False)
class ExclusionCounts:
    """Counts for each of k axes, shape (k,).

    Parameters
    ----------
    saturated_count : ndarray of int64
        Samples at the end of the sensor's range, treated as missing.
    outlier_count : ndarray of int64
        Outliers: samples too far from their neighbours.
    stuck_count : ndarray of int64
        Samples of a stuck sensor, which repeats the same value.
    """

    saturated_count: Integers
    outlier_count: Integers
    stuck_count: Integers

    @classmethod
    def of(cls, filter_: DriftFilter) -> Self:
        """Return the counts of a filter to date."""
        counts = (filter_.saturated_count, filter_.outlier_count, filter_.stuck_count)
        return cls(*(np.atleast_1d(np.asarray(count, np.int64)) for count in counts))

    def sentences(self, names: Sequence[str], samples: int, limit: float | None) -> Iterator[str]:
        """Yield a sentence on each count above zero, given the number of samples per axis."""
        beyond = "" if limit is None else f", at or beyond the limit of {limit:g}"
        kinds = (
            (f"saturated{beyond}, so missing", self.saturated_count),
            ("left out as outliers", self.outlier_count),
            ("left out because the sensor was stuck at one value", self.stuck_count),
        )
        for label, counts in kinds:
            if counts.any():
                pairs = zip(names, counts.tolist(), strict=True)
                listed = ", ".join(f"{name} {count}" for name, count in pairs if count)
                yield f"{label}: {listed} of {samples} samples"
