"""Records of several models, each seen by the optimal filter of every one of them."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from zerorate.compare.simulated.models import DeviceModel
from zerorate.compare.simulated.optimal import Optimum, optimum
from zerorate.compare.simulated.records import records

__all__ = ["Views", "viewed"]

Floats = npt.NDArray[np.float64]
Indices = npt.NDArray[np.intp]


@dataclass(frozen=True, eq=False)
class Views:
    """What m filters say of k records of each of m models, at some instants.

    Attributes
    ----------
    estimates : ndarray, shape (instants, m, m, k)
        Drift by the filter of the first model, on the records of the second, deg/s.
    likelihood : ndarray, of the same shape
        Log likelihood of the record so far under the filter's model, less what all share.
    optimum : ndarray, shape (m,)
        Error variance of each model's own filter, mean over the instants.
    """

    estimates: Floats
    likelihood: Floats
    optimum: Floats


def viewed(
    models: Sequence[DeviceModel], rate: float, times: Indices, seeds: Iterable[int]
) -> Views:
    """Draw records of every model and filter each with the filters of all.

    Parameters
    ----------
    models : sequence of DeviceModel
        The m gyros.
    rate : float
        Samples per second, Hz.
    times : ndarray of int, shape (instants,)
        Samples after which the filters are read, ascending.
    seeds : iterable of int
        One a record of each model.
    """
    n, chosen = int(times[-1]) + 1, list(seeds)
    filters = [optimum(model, rate, n) for model in models]
    signals = [records(model, rate, n, chosen)[0] for model in models]
    pairs = np.array([[_view(one, signal, times) for signal in signals] for one in filters])
    estimates, likelihood = np.moveaxis(pairs, (2, 3), (0, 1))
    return Views(estimates, likelihood, np.array([one.variance[times].mean() for one in filters]))


def _view(one: Optimum, signal: Floats, times: Indices) -> tuple[Floats, Floats]:
    """Return estimate and log likelihood after each instant, shape (instants, k)."""
    drift, innovation = one.filtered(signal)
    variance = one.innovation_variance[1:, np.newaxis]
    steps = np.zeros_like(innovation)
    # The first sample sets the level, which has no prior: it says nothing of the model.
    steps[1:] = -0.5 * (np.log(variance) + innovation[1:] ** 2 / variance)
    return drift[times], np.cumsum(steps, axis=0)[times]
