"""What a record holds, before anything is done to it."""

from dataclasses import dataclass
from typing import Final

import numpy as np
import numpy.typing as npt

__all__ = ["Survey", "surveyed"]

Floats = npt.NDArray[np.float64]

_GLANCE: Final = 10_000
_COARSE: Final = 4
"""Samples for each distinct value from which on a record counts as quantised."""


@dataclass(frozen=True)
class Survey:
    """Size and shape of the record of one axis.

    Attributes
    ----------
    samples : int
        Missing ones included.
    missing : int
        Of these.
    stretches : int
        Parts between gaps.
    rate : float
        Samples per second, Hz.
    mean, deviation : float
        Of what is there, in the unit of the record.
    step : float
        Of the quantisation, in the unit of the record; 0 where the values look continuous.
    """

    samples: int
    missing: int
    stretches: int
    rate: float
    mean: float
    deviation: float
    step: float

    @property
    def duration(self) -> float:
        """Length, s: each sample stands for one period."""
        return self.samples / self.rate


def surveyed(record: Floats, rate: float) -> Survey:
    """Return what a record of shape (n,) holds; at least one sample must be there."""
    present = np.isfinite(record)
    there = record if present.all() else record[present]
    starts = int(present[0]) + np.count_nonzero(present[1:] & ~present[:-1])
    # Centred, as an offset may be many times the noise.
    first = there[0]
    rest = there - first
    return Survey(
        samples=record.size,
        missing=record.size - there.size,
        stretches=int(starts),
        rate=rate,
        mean=float(first + rest.mean()),
        deviation=float(rest.std()),
        step=_step(there[:_GLANCE]),
    )


def _step(values: Floats) -> float:
    """Return the usual distance between neighbouring values where these are few."""
    distinct = np.unique(values)
    if distinct.size < 2 or distinct.size * _COARSE > values.size:
        return 0.0
    return float(np.median(np.diff(distinct)))
