"""The model that a filter would have learned online from the same record."""

from dataclasses import dataclass
from typing import Final

import numpy as np
import numpy.typing as npt

from zerorate._native import RecursiveLeastSquares
from zerorate.identify.models.model import ArmaModel

__all__ = ["Online", "learned_online"]

Floats = npt.NDArray[np.float64]

_STARTUP: Final = 100
_MOMENTS: Final = 200
_LARGEST: Final = 3
"""Order up to which the recursion is built."""


@dataclass(frozen=True, eq=False)
class Online:
    """Recursive extended least squares over a record.

    Attributes
    ----------
    samples : ndarray of int64, shape (m,)
        How many had been given at each moment, evenly spaced in their logarithm.
    coefficients : ndarray, shape (m, p + q + 1)
        [phi, theta, c] at these moments, c in the unit of the record.
    distance : ndarray, shape (p + q,)
        How far the last phi and theta are from the offline ones, in their standard errors.
    """

    samples: npt.NDArray[np.int64]
    coefficients: Floats
    distance: Floats

    @property
    def last(self) -> Floats:
        """[phi, theta, c] at the end of the record."""
        return np.asarray(self.coefficients[-1])


def learned_online(record: Floats, offline: ArmaModel) -> Online | None:
    """Return what recursive least squares of the offline model's order makes of a record.

    Parameters
    ----------
    record : ndarray, shape (n,)
        NaN where missing.
    offline : ArmaModel
        Of the same record.

    Returns
    -------
    Online or None
        None for an order without an autoregressive part, or beyond 3, and for a record no longer
        than the start-up of 100 samples.
    """
    p, q = offline.order
    if not 1 <= p <= _LARGEST or q > _LARGEST or record.size <= _STARTUP:
        return None
    samples = np.unique(np.geomspace(_STARTUP, record.size, _MOMENTS).astype(np.int64))
    filter_ = RecursiveLeastSquares((p, q), startup=_STARTUP)
    history = []
    for start, end in zip((0, *samples[:-1]), samples, strict=True):
        filter_.process(record[start:end])
        history.append(filter_.coefficients if filter_.ready else np.full(p + q + 1, np.nan))
    coefficients = np.stack(history)
    return Online(samples, coefficients, _distance(coefficients[-1], offline))


def _distance(last: Floats, offline: ArmaModel) -> Floats:
    known = np.concatenate((offline.phi, offline.theta))
    errors = offline.standard_errors[: known.size]
    there = errors > 0.0
    distance = np.full(known.size, np.nan)
    distance[there] = (last[: known.size] - known)[there] / errors[there]
    return distance
