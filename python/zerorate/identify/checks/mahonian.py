"""How many reversals a sequence without trend has, exactly."""

from functools import lru_cache
from typing import Final

import numpy as np
import numpy.typing as npt

__all__ = ["LARGEST", "critical_values", "two_sided"]

Floats = npt.NDArray[np.float64]

LARGEST: Final = 100
"""Values up to which the exact distribution is used; the published table ends there, too."""

_TAIL: Final = 0.025


@lru_cache(maxsize=LARGEST)
def _below(m: int) -> Floats:
    """Return P(A <= a) for a = 0, ..., in the lower half of the distribution of m values.

    The k-th value comes before 0 to k - 1 of the lesser ones, each equally likely, so the
    distribution is a convolution of uniform ones (Mahonian numbers over m!). In its lower half
    all terms rise, so the differences of sums keep their precision far into the tail.
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
    """Return lower and upper: 5 % at most of sequences of m values are not in lower < A <= upper.

    J. S. Bendat, A. G. Piersol, Random Data, section 4.5.2 and table A.6.
    """
    lower = int(np.searchsorted(_below(m), _TAIL, side="right")) - 1
    return lower, m * (m - 1) // 2 - lower - 1


def two_sided(m: int, reversals: float) -> float:
    """Return the probability of as few reversals, or as many, or of more extreme numbers."""
    # Ties count half; a half is taken towards the middle.
    rank = int(np.ceil(min(reversals, m * (m - 1) / 2 - reversals)))
    below = _below(m)
    return min(2.0 * float(below[min(rank, below.size - 1)]), 1.0)
