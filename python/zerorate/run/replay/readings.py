"""What a filter said of the drift at every sample, besides the drift itself."""

from dataclasses import dataclass
from typing import Final

import numpy as np
import numpy.typing as npt

__all__ = ["Readings", "onset"]

Floats = npt.NDArray[np.float64]
Flags = npt.NDArray[np.bool_]

_ONSET: Final = 0.5
_FEWEST: Final = 8


@dataclass(frozen=True, eq=False)
class Readings:
    """How well the drift of k axes was known at each of n samples, by what had come until then.

    Parameters
    ----------
    bias_sigma : ndarray, shape (n, k)
        Standard deviation of the drift, in the unit of the data.
    at_rest : ndarray of bool, shape (n, k)
        Whether the filter learned.
    """

    bias_sigma: Floats
    at_rest: Flags

    def certain_rest(self, rate: float) -> Flags:
        """Return `at_rest` without the samples in which a motion began unseen, shape (n, k).

        Rest is judged by ticks of a quarter of a second, four samples at least; a motion is seen
        at the end of the tick in which it began, or of the next.
        """
        rest = self.at_rest.copy()
        before = onset(rate)
        begins = np.argwhere(self.at_rest[:-1] & ~self.at_rest[1:])
        for i, axis in begins:
            rest[max(0, i + 1 - before) : i + 1, axis] = False
        return rest


def onset(rate: float) -> int:
    """Return the samples before a motion is seen in which it may have begun."""
    return max(round(_ONSET * rate), _FEWEST)
