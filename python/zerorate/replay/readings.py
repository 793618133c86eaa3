"""What a filter said of the drift at every sample, besides the drift itself."""

from dataclasses import dataclass
from typing import Final

import numpy as np
import numpy.typing as npt

from zerorate._native import DriftFilter

__all__ = ["Reader", "Readings"]

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
        before = max(round(_ONSET * rate), _FEWEST)
        begins = np.argwhere(self.at_rest[:-1] & ~self.at_rest[1:])
        for i, axis in begins:
            rest[max(0, i + 1 - before) : i + 1, axis] = False
        return rest


class Reader:
    """Follows a filter with a copy of it, and collects its readings.

    What it does beside the filter is not part of the filter's time.
    """

    def __init__(self, data: Floats, filter_: DriftFilter) -> None:
        self._data = data
        self._filter = filter_.copy()
        self._readings = Readings(np.empty_like(data), np.empty(data.shape, dtype=np.bool_))

    def take(self, filter_: DriftFilter) -> None:
        """Read all samples up to where the filter is."""
        block = slice(self._filter.samples_seen, filter_.samples_seen)
        trace = self._filter.trace(self._data[block])
        self._readings.bias_sigma[block] = trace.bias_sigma
        self._readings.at_rest[block] = trace.at_rest

    def readings(self) -> Readings:
        """Return what was read."""
        return self._readings
