"""Missing samples of an integrated rate: linear interpolation, and its error."""

from __future__ import annotations

import math
from typing import Final, NamedTuple

import numpy as np

from zerorate.record.runs import runs
from zerorate.types import Booleans, Floats

_MAX_EXACT_LENGTH: Final = 16
"""Gap length in samples up to which each length is tested; longer gaps in steps of a fifth."""
_MIN_EXTRA_WINDOWS: Final = 10
"""Number of windows for an error estimate, in addition to one for each sample of the gap."""


class BridgedRates(NamedTuple):
    """Rates without gaps, shape (n, k), and the variance of the angle added by each gap."""

    rates: Floats
    missing: Booleans
    variances: Floats


def bridge(rates: Floats, dt: float) -> BridgedRates:
    """Return the rates with gaps interpolated linearly.

    At the ends of the record the nearest sample is held.

    The error is measured on the record. Every interval of this length without a gap is interpolated
    in the same way, which gives errors of the angle. If no interval is long enough, the rate in the
    gap may have been any rate of the record.

    Parameters
    ----------
    rates
        Rates, shape (n, k), NaN or infinite where missing; each axis has a sample.
    dt
        Sampling period, s.

    Returns
    -------
    Bridged
        Rates, and variances at the first sample of each gap, zero elsewhere, shape (n, k), in the
        square of the rates' unit times seconds.
    """
    present = np.isfinite(rates)
    filled, variances = rates.copy(), np.zeros(rates.shape)
    index = np.arange(len(rates))
    for axis in np.flatnonzero(~present.all(axis=0)):
        there = present[:, axis]
        filled[~there, axis] = np.interp(index[~there], index[there], rates[there, axis])
        trial = _GapTrial(np.where(there, rates[:, axis], 0.0), there)
        for first, stop in runs(~there):
            inside = first > 0 and stop < len(rates)
            variances[first, axis] = trial.variance(_round_up(stop - first), inside) * dt**2
    return BridgedRates(filled, np.any(~present, axis=1), variances)


def _round_up(length: int) -> int:
    if length <= _MAX_EXACT_LENGTH:
        return int(length)
    return math.ceil(
        _MAX_EXACT_LENGTH
        * 1.2 ** math.ceil(math.log(length / _MAX_EXACT_LENGTH) / math.log(1.2) - 1e-9)
    )


class _GapTrial:
    """Gaps simulated on one axis where it has samples."""

    def __init__(self, rates: Floats, present: Booleans) -> None:
        self._rates = rates
        self._present = present
        self._sums = np.concatenate(([0.0], np.cumsum(rates)))
        self._counts = np.concatenate(([0], np.cumsum(present)))
        self._cache: dict[tuple[int, bool], float] = {}

    def variance(self, length: int, inside: bool) -> float:
        """Return the mean square error of the sum for a gap of a given number of samples."""
        if (length, inside) not in self._cache:
            self._cache[length, inside] = self._measure(length, inside)
        return self._cache[length, inside]

    def _measure(self, length: int, inside: bool) -> float:
        width = length + 1 + inside
        whole = self._counts[width:] - self._counts[:-width] == width
        if np.count_nonzero(whole) < length + _MIN_EXTRA_WINDOWS:
            return self._bound_by_rates(length)
        first = np.flatnonzero(whole)
        total = self._sums[first + length + 1] - self._sums[first + 1]
        if inside:
            bridged_rate = 0.5 * (self._rates[first] + self._rates[first + length + 1])
        else:
            bridged_rate = self._rates[first]
        return float(np.mean((total - length * bridged_rate) ** 2))

    def _bound_by_rates(self, length: int) -> float:
        rates = self._rates[self._present]
        # A single sample has no information on the rate in the gap.
        return length**2 * float(np.var(rates)) if rates.size > 1 else math.inf
