"""What no method can do that does not know which of several gyros it has."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
import numpy.typing as npt

from zerorate.compare.simulated.models import DeviceModel
from zerorate.compare.simulated.span import span
from zerorate.compare.simulated.views import Views, viewed

__all__ = ["Bound", "least_regret"]

Floats = npt.NDArray[np.float64]

_ROUNDS: Final = 60
_INSTANTS: Final = 40
_TINY: Final = 1e-300


@dataclass(frozen=True, eq=False)
class Bound:
    """Least worst regret that any method can have over a set of models.

    Attributes
    ----------
    models : tuple of DeviceModel
        The m gyros.
    weights : ndarray, shape (m,)
        Share of each in the mean of squared regrets that was found hardest to keep low.
    lower : float
        No method has a smaller worst regret.
    sigma : float
        Standard error of `lower`, from the number of records.
    regret : ndarray, shape (m,)
        Regret on each model of the method that is best under these weights. Its largest is what
        a method reaches that knows the set, so the least possible lies between the two.
    """

    models: tuple[DeviceModel, ...]
    weights: Floats
    lower: float
    sigma: float
    regret: Floats


def least_regret(
    models: Sequence[DeviceModel],
    *,
    duration: float = 1800.0,
    score_from: float = 120.0,
    rate: float = 0.5,
    records: int = 200,
) -> Bound:
    """Return the worst regret that no method can undercut on all of several models.

    Parameters
    ----------
    models : sequence of DeviceModel
        Two or more gyros of Gaussian noise: none that rounds or warms up. The method may know
        them all, but not which one it has.
    duration, score_from : float
        Length of a record and time from which errors count, s.
    rate : float
        Samples per second, Hz. The default serves drift that changes little in 2 s and white
        noise, of which the samples then hold as much as the means of many.
    records : int
        Drawn from each model, once to choose the weights and once more for the answer.

    Returns
    -------
    Bound
        Also what the best method under the hardest weights reaches on each model.

    Raises
    ------
    ValueError
        If there are fewer than two models or records, one rounds or warms up, or no sample counts.

    Notes
    -----
    Let V_m be the mean squared error of the optimum on model m, E_m(d) that of a method d. For any
    weights w of sum 1 the worst of E_m(d)/V_m is at least sum w_m E_m(d)/V_m. This sum is a
    Bayes risk, with a prior in proportion to w_m/V_m, so no d has less than the posterior mean d*:

        max_m E_m(d)/V_m >= sum_m w_m E_m(d*)/V_m.

    It holds for every method that moves with a constant added to the record, as all here do, and
    for any larger set of models. E_m(d*) = V_m + E_m |d* - x_m|^2 with x_m the optimum's estimate,
    so only the excess is averaged over records. The right side is concave in w, and its slope is
    the ratio at each m: the weights grow where that is large, on records other than those that
    give the answer.

    Examples
    --------
    >>> drifts = DeviceModel("none"), DeviceModel("walk", rate_random_walk=1e-4)
    >>> round(least_regret(drifts, records=20, duration=600.0).lower, 1)
    1.0
    """
    gyros = _checked(models, records)
    first, n = span(duration, score_from, rate)
    times = np.unique(np.linspace(first, n - 1, _INSTANTS).astype(np.intp))
    weights = _hardest(viewed(gyros, rate, times, range(records)))
    others = viewed(gyros, rate, times, range(records, 2 * records))
    excess = _excess(others, weights)
    squared = 1.0 + excess.mean(axis=1)
    lower = math.sqrt(weights @ squared)
    variance = weights**2 @ excess.var(axis=1, ddof=1) / records
    return Bound(gyros, weights, lower, math.sqrt(variance) / (2.0 * lower), np.sqrt(squared))


def _checked(models: Sequence[DeviceModel], records: int) -> tuple[DeviceModel, ...]:
    if len(models) < 2 or records < 2:
        raise ValueError(
            f"a bound needs two models and two records of each, got {len(models)} and {records}"
        )
    for model in models:
        if model.resolution > 0.0 or model.transient:
            raise ValueError(f"{model.name} rounds or warms up: its likelihood is not Gaussian")
    return tuple(models)


def _hardest(views: Views) -> Floats:
    """Return weights that nearly maximise the Bayes risk."""
    count = views.optimum.size
    weights = np.full(count, 1.0 / count)
    for _ in range(_ROUNDS):
        # At the maximum the excess is the same wherever there is weight; models that no filter
        # can tell apart have none at all.
        weights *= _excess(views, weights).mean(axis=1) + _TINY
        weights /= weights.sum()
    return weights


def _excess(views: Views, weights: Floats) -> Floats:
    """Return the squared regret of the posterior mean less 1, shape (m, records)."""
    with np.errstate(divide="ignore"):
        prior = np.log(weights / views.optimum)
    scores = views.likelihood + prior[:, np.newaxis, np.newaxis]
    posterior = np.exp(scores - scores.max(axis=1, keepdims=True))
    posterior /= posterior.sum(axis=1, keepdims=True)
    mean = (posterior * views.estimates).sum(axis=1)
    own = np.einsum("tmmk->tmk", views.estimates)
    squares: Floats = ((mean - own) ** 2).mean(axis=0)
    return squares / views.optimum[:, np.newaxis]
