"""The reverse-arrangements test of a trend."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache
from typing import Any, Final, Literal, NamedTuple, get_args

import numpy as np
import numpy.typing as npt

from zerorate import _native
from zerorate.faults import ArgumentError
from zerorate.identification.preparation import segments as cut
from zerorate.identification.verdict import TWO_SIDED_95, Verdict
from zerorate.noise.records import as_record, size_of
from zerorate.types import Booleans, Floats, Integers

SegmentStatistic = Literal["mean", "variance"]

_MIN_SEGMENTS: Final = 10


@dataclass(frozen=True, kw_only=True)
class ReverseArrangements(Verdict):
    """Result of the reverse-arrangements test; its statistic is the number of reversals.

    Attributes
    ----------
    reversal_count : int
        A: number of pairs with the greater value first.
    tie_count : int
        Number of pairs with equal values. `reversal_count` does not include them.
    segment_count : int
        M: number of values.
    left_out_count : int
        Number of segments that lack half of their samples or more; they give no value.
    of : {"mean", "variance", "sample"}
        Kind of the values.
    z_score : float
        lambda = (A' + 1/2 - E) / sd. A' is the number of pairs with the greater value last. E and
        sd are the mean and standard deviation of A' without a trend. Positive if the record rises.
        Between -2 and 2 if the test accepts at 5 %.
    where : str
        Position with the largest difference between the values before and after it.

    Examples
    --------
    >>> import numpy as np
    >>> from zerorate.identification import reverse_arrangements
    >>> found = reverse_arrangements(np.random.default_rng(1).standard_normal(15_000))
    >>> found.segment_count, found.of, found.accepted
    (100, 'mean', True)
    """

    reversal_count: int
    tie_count: int
    segment_count: int
    left_out_count: int
    of: str
    z_score: float
    where: str


def reverse_arrangements(
    z: npt.ArrayLike, segments: int | None = 100, of: SegmentStatistic = "mean"
) -> ReverseArrangements:
    """Test a record for a trend, by the order of its segments' means or variances.

    Parameters
    ----------
    z : array_like, shape (n,)
        Samples in any unit; values that are not finite count as missing. A segment that lacks half
        of its samples or more is left out.
    segments : int or None, default 100
        Number of segments, 10 to n, with at least 2 samples each for variances. None: each sample
        is a segment. Segments longer than the noise's correlation time separate slow drift from
        noise.
    of : {"mean", "variance"}
        Property to compare; ignored if each sample is a segment.

    Returns
    -------
    ReverseArrangements
        Result. The acceptance interval is exact for up to 100 values, and a normal approximation
        for more. Each pair of equal values lowers the mean of A by 1/2, and the interval is lowered
        by the same amount.

    Raises
    ------
    TypeError
        If `z` does not hold real numbers.
    ValueError
        If `z` is not one axis, or has too few or only equal samples. If an argument is not as
        described.

    Notes
    -----
    J. S. Bendat, A. G. Piersol, Random Data, section 4.5.2: E = M (M - 1)/4, with variance M (2 M +
    5)(M - 1)/72. E and the variance are reduced for ties (M. G. Kendall, Rank Correlation Methods).
    Bao and Yuan use lambda with N = 15 000 samples and M = 100.

    Examples
    --------
    >>> noise = np.random.default_rng(1).standard_normal(15_000)
    >>> reverse_arrangements(noise).accepted
    True
    >>> drifting = reverse_arrangements(noise + np.linspace(0.0, 0.5, 15_000))
    >>> drifting.accepted, drifting.z_score > 2.0
    (False, True)
    """
    if of not in get_args(SegmentStatistic):
        names = ", ".join(repr(name) for name in get_args(SegmentStatistic))
        raise ArgumentError("of", f"must be one of {names}, got {of!r}")
    record = as_record(z, _MIN_SEGMENTS, "the reverse-arrangements test")
    unit = size_of(record[np.isfinite(record)])
    values, numbers, n = _segment_values(record / unit, segments, of)
    if values.size < _MIN_SEGMENTS:
        raise ValueError(
            f"the reverse-arrangements test needs at least {_MIN_SEGMENTS} segments with "
            "more than half "
            f"of their samples, got {values.size}"
        )
    what = "sample" if segments is None else of
    return ReverseArrangements(
        **_test_values(values),
        n=n,
        left_out_count=(segments or values.size) - values.size,
        of=what,
        where=_describe_split(values, numbers, what, unit * unit if what == "variance" else unit),
    )


def _test_values(values: Floats) -> dict[str, Any]:
    """Return the fields of the test's result for ordered values, as a dictionary."""
    count, ties, tie_weight = _native.reversals(values)
    m = values.size
    null = _null_distribution(m, ties, tie_weight)
    lower, upper = null.interval(m, ties)
    later = m * (m - 1) // 2 - ties - count
    return dict(
        name="reverse arrangements",
        hypothesis="no trend",
        statistic=float(count),
        p_value=null.p_value(m, count + ties / 2),
        lower=lower,
        upper=upper,
        accepted=lower < count <= upper,
        reversal_count=count,
        tie_count=ties,
        segment_count=m,
        z_score=(later + 0.5 - null.mean) / null.sigma if null.sigma else 0.0,
    )


class _NullDistribution(NamedTuple):
    """Mean and standard deviation of A without a trend."""

    mean: float
    sigma: float

    def interval(self, m: int, ties: int) -> tuple[float, float]:
        if m <= MAX_EXACT_VALUES:
            lower, upper = critical_values(m)
            return lower - ties / 2, upper - ties / 2
        return self.mean - TWO_SIDED_95 * self.sigma, self.mean + TWO_SIDED_95 * self.sigma

    def p_value(self, m: int, reversals: float) -> float:
        if m <= MAX_EXACT_VALUES:
            return two_sided_probability(m, reversals)
        distance = abs(reversals - m * (m - 1) / 4)
        return math.erfc(distance / self.sigma / math.sqrt(2.0)) if self.sigma else 1.0


def _null_distribution(m: int, ties: int, tie_weight: float) -> _NullDistribution:
    variance = (m * (m - 1) * (2 * m + 5) - tie_weight) / 72
    return _NullDistribution((m * (m - 1) / 2 - ties) / 2, math.sqrt(max(variance, 0.0)))


def _segment_values(record: Floats, segments: int | None, of: str) -> tuple[Floats, Integers, int]:
    """Return the compared values, their segment numbers from 1, and the number of samples."""
    if segments is None:
        indices = np.flatnonzero(np.isfinite(record))
        return record[indices], indices + 1, indices.size
    rows = cut(record, segments)
    there = np.isfinite(rows)
    counts = there.sum(axis=1)
    if of == "variance" and rows.shape[1] < 2:
        raise ValueError(f"variances need segments of 2 samples, got {segments} of 1")
    used = 2 * counts > rows.shape[1]
    origin = record[int(np.argmax(np.isfinite(record)))]
    values = _segment_moments(
        np.where(there, rows - origin, 0.0)[used], there[used], counts[used], of
    )
    # The level affects only `where`.
    return values, np.flatnonzero(used) + 1, int(counts[used].sum())


def _segment_moments(rows: Floats, there: Booleans, counts: Integers, of: str) -> Floats:
    means = rows.sum(axis=1) / counts
    if of == "mean":
        return np.asarray(means)
    distance = np.where(there, rows - means[:, None], 0.0)
    return np.asarray(np.einsum("ij,ij->i", distance, distance) / counts)


def _describe_split(values: Floats, numbers: Integers, of: str, unit: float) -> str:
    """Describe the split with the most significant difference between its sides."""
    m = values.size
    before = np.arange(1, m)
    level = values - values.mean()
    sums = np.cumsum(level)[:-1]
    split = int(np.argmax(np.abs(sums) / np.sqrt(before * (m - before))))
    difference = float(sums[split] * m / (before[split] * (m - before[split])))
    side = "above" if difference > 0.0 else "below"
    noun = "samples" if of == "sample" else f"{of}s of segments"
    first, last = f"{numbers[0]} to {numbers[split]}", f"{numbers[split + 1]} to {numbers[-1]}"
    return f"{noun} {first} lie {abs(difference) * unit:.3g} {side} {last} in the mean"


MAX_EXACT_VALUES: Final = 100
"""Largest number of values for the exact distribution; the published table ends at this number."""

_TAIL_PROBABILITY: Final = 0.025


@lru_cache(maxsize=MAX_EXACT_VALUES)
def _cumulative_probability(m: int) -> Floats:
    """Return P(A <= a) for a = 0, ..., in the lower half of the distribution of m values.

    The k-th value precedes 0 to k - 1 of the smaller values with equal probability. The
    distribution is therefore a convolution of uniform distributions (Mahonian numbers over m!).
    Terms rise throughout its lower half, so differences of sums stay precise far into the tail.
    """
    size = m * (m - 1) // 4 + 1
    probability = np.zeros(size)
    probability[0] = 1.0
    for k in range(2, m + 1):
        sums = np.cumsum(probability)
        probability = sums / k
        probability[k:] -= sums[:-k] / k
    return np.cumsum(probability)


def critical_values(m: int) -> tuple[int, int]:
    """Return the lower and upper limit of A for m values at 5 %.

    At most 5 % of random sequences are outside lower < A <= upper. J. S. Bendat, A. G. Piersol,
    Random Data, section 4.5.2 and table A.6.
    """
    lower = int(np.searchsorted(_cumulative_probability(m), _TAIL_PROBABILITY, side="right")) - 1
    return lower, m * (m - 1) // 2 - lower - 1


def two_sided_probability(m: int, reversals: float) -> float:
    """Return the two-sided probability of a given or more extreme number of reversals."""
    # A tie counts as half a reversal. A remaining half is rounded towards the middle.
    rank = int(np.ceil(min(reversals, m * (m - 1) / 2 - reversals)))
    below = _cumulative_probability(m)
    return min(2.0 * float(below[min(rank, below.size - 1)]), 1.0)
