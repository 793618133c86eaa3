"""Samples that a filter left out although they were there, by axis, and how to say it."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Self

import numpy as np

from zerorate._native import DriftFilter
from zerorate.types import Integers


@dataclass(frozen=True, eq=False)
class ExclusionCounts:
    """Counts of each of k axes, shape (k,).

    Parameters
    ----------
    saturated_count : ndarray of int64
        Samples at the end of the sensor's range, which are missing.
    outlier_count : ndarray of int64
        Samples too far from their neighbours to be believed.
    stuck_count : ndarray of int64
        Samples of a sensor that gave the same again and again.
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
        """Yield a sentence on each kind of which there are any, of so many samples an axis."""
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
