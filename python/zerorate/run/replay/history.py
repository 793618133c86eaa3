"""What a filter knew over time, at few enough moments to draw."""

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np
import numpy.typing as npt

if TYPE_CHECKING:
    from zerorate._native import DriftFilter

__all__ = ["History", "Recorder", "moments"]

Floats = npt.NDArray[np.float64]
Counts = npt.NDArray[np.int64]

_EVEN: Final = 600
_PER_DECADE: Final = 60


@dataclass(frozen=True, eq=False)
class History:
    """State of a filter of k axes after each of m moments; NaN until the axis is started up.

    Parameters
    ----------
    samples : ndarray of int64, shape (m,)
        Samples that had been given, missing ones included.
    measurement_noise : ndarray, shape (m, k)
        Variance R, unit of the data squared.
    gain : ndarray, shape (m, k, p + 1)
        Kalman gain; its first component weighs the newest sample. The drift is all that "auto"
        has for a state: 1 in place of p + 1, and of p + q + 1 below.
    coefficients : ndarray, shape (m, k, p + q + 1)
        ARMA model [φ…, θ…, c], c in the unit of the data.
    angle_random_walk : ndarray, shape (m, k)
        Density of the white noise as learned, unit of the data times root second.
    rate_random_walk : ndarray, shape (m, k)
        How far the drift walks in a root second as learned by "auto", unit of the data.
    bias, bias_sigma : ndarray, shape (m, k)
        Drift and its standard deviation, in the unit of the data.
    """

    samples: Counts
    measurement_noise: Floats
    gain: Floats
    coefficients: Floats
    angle_random_walk: Floats
    rate_random_walk: Floats
    bias: Floats
    bias_sigma: Floats


def moments(n: int) -> Counts:
    """Return rising sample counts up to n, dense at the start where a filter learns.

    Six hundred in even steps, for a linear time axis, and sixty a decade, for a logarithmic
    one.
    """
    even = np.linspace(n / _EVEN, n, _EVEN)
    decades = int(np.ceil(np.log10(n)))
    rising = np.logspace(0.0, decades, decades * _PER_DECADE + 1)
    both = np.ceil(np.concatenate((even, rising))).astype(np.int64)
    return np.unique(both[both <= n])


class Recorder:
    """Collects a history, one moment after the other."""

    def __init__(self) -> None:
        self._samples: list[int] = []
        self._rows: list[tuple[Floats, ...]] = []

    def take(self, filter_: "DriftFilter") -> None:
        """Note the state of the filter."""
        ready = filter_.ready
        each = ready[:, np.newaxis]
        row = (
            np.where(ready, filter_.measurement_noise, np.nan),
            np.where(each, filter_.gain, np.nan),
            np.where(each, filter_.coefficients, np.nan),
            filter_.angle_random_walk,
            filter_.rate_random_walk,
            np.where(ready, filter_.bias, np.nan),
            np.where(ready, filter_.bias_sigma, np.nan),
        )
        self._samples.append(filter_.samples_seen)
        self._rows.append(row)

    def history(self) -> History:
        """Return what was noted."""
        columns = (np.stack(column) for column in zip(*self._rows, strict=True))
        return History(np.array(self._samples, dtype=np.int64), *columns)
