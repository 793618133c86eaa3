"""What no method can do that does not know how large the drift is, if there is any."""

import math
from dataclasses import dataclass
from typing import Final

import numpy as np
import numpy.typing as npt

from zerorate.compare.simulated.span import span
from zerorate.compare.simulated.walks import Walks, watched

__all__ = ["Bound", "walk_bound"]

Floats = npt.NDArray[np.float64]

_ROUNDS: Final = 60
_INSTANTS: Final = 40
_TINY: Final = 1e-300
# Of the records that choose the weights and of those that then judge them.
_SEARCH, _JUDGE = 1, 2


@dataclass(frozen=True, eq=False)
class Bound:
    """Least worst regret that any method can have over a set of drift sizes.

    Attributes
    ----------
    sizes : ndarray, shape (m,)
        The random walks, deg/s/sqrt(s); the first is no drift.
    weights : ndarray, shape (m,)
        The hardest prior that was found: share of each size in the mean of squared regrets.
    lower : float
        No method has a smaller worst regret.
    sigma : float
        Standard deviation of `lower`, from the number of records.
    regret : ndarray, shape (m,)
        Regret at each size of the method that is best under these weights. Its largest is what
        one method reaches that knows the set, so the least possible lies between the two.
    """

    sizes: Floats
    weights: Floats
    lower: float
    sigma: float
    regret: Floats


def walk_bound(
    sizes: npt.ArrayLike,
    *,
    angle_random_walk: float = 0.01,
    duration: float = 1800.0,
    score_from: float = 120.0,
    rate: float = 0.5,
    records: int = 200,
) -> Bound:
    """Return the worst regret that no method can undercut, over none and walks of these sizes.

    Parameters
    ----------
    sizes : array_like, shape (m - 1,)
        Random walks that the method must be ready for, deg/s/sqrt(s). No drift is always one more.
    angle_random_walk : float
        White noise, deg/s/sqrt(Hz), known to the method; default 0.1 deg/s at 100 Hz.
    duration, score_from : float
        Length of a record and time from which errors count, s.
    rate : float
        Samples per second of the model, Hz. Only walks whose optimum averages over many samples
        need no more than the default.
    records : int
        Drawn for each size, once to choose the weights and once more for the answer.

    Returns
    -------
    Bound
        Also what the best method against the hardest prior reaches at each size.

    Raises
    ------
    ValueError
        If a size is not positive, there is none, fewer than two records, or no sample that counts.

    Notes
    -----
    Let V_m be the mean squared error of the optimum at size m, E_m(d) that of a method d. For any
    weights w of sum 1 the worst of E_m(d)/V_m is at least sum w_m E_m(d)/V_m. This sum is a
    Bayes risk, with a prior in proportion to w_m/V_m, so no d has less than the posterior mean d*:

        max_m E_m(d)/V_m >= sum_m w_m E_m(d*)/V_m.

    It holds for every method that moves with a constant added to the record, as all here do, and
    for any larger set of drifts. E_m(d*) = V_m + E_m |d* - x_m|^2 with x_m the optimum's estimate,
    so only the excess is averaged over records. The right side is concave in w, and its slope is
    the ratio at each m: the weights grow where that is large, on records other than those that
    give the answer.

    Examples
    --------
    >>> found = walk_bound([3e-5], records=20, duration=600.0)
    >>> round(found.lower, 2), found.sizes.tolist()
    (1.0, [0.0, 3e-05])
    """
    walks = _with_none(sizes, records)
    first, n = span(duration, score_from, rate)
    ratios = (walks / (rate * angle_random_walk)) ** 2
    times = np.unique(np.linspace(first, n - 1, _INSTANTS).astype(np.intp))
    weights = _hardest(watched(ratios, times, records, _SEARCH))
    excess = _excess(watched(ratios, times, records, _JUDGE), weights)
    squared = 1.0 + excess.mean(axis=1)
    lower = math.sqrt(weights @ squared)
    variance = weights**2 @ excess.var(axis=1, ddof=1) / records
    return Bound(walks, weights, lower, math.sqrt(variance) / (2.0 * lower), np.sqrt(squared))


def _with_none(sizes: npt.ArrayLike, records: int) -> Floats:
    walks = np.atleast_1d(np.asarray(sizes, dtype=np.float64))
    if walks.ndim > 1 or walks.size == 0 or not np.all(np.isfinite(walks) & (walks > 0.0)):
        raise ValueError(f"sizes must be a list of positive random walks, got {sizes!r}")
    if records < 2:
        raise ValueError(f"records must be at least 2 for each size, got {records}")
    return np.concatenate([[0.0], walks])


def _hardest(walks: Walks) -> Floats:
    """Return weights that nearly maximise the Bayes risk."""
    sizes = walks.optimum.size
    weights = np.full(sizes, 1.0 / sizes)
    for _ in range(_ROUNDS):
        # At the maximum the excess is the same wherever there is weight; sizes that no filter can
        # tell apart have none at all.
        weights *= _excess(walks, weights).mean(axis=1) + _TINY
        weights /= weights.sum()
    return weights


def _excess(walks: Walks, weights: Floats) -> Floats:
    """Return the squared regret of the posterior mean less 1, shape (sizes, records)."""
    with np.errstate(divide="ignore"):
        prior = np.log(weights / walks.optimum)
    scores = walks.likelihood + prior[:, np.newaxis, np.newaxis]
    posterior = np.exp(scores - scores.max(axis=1, keepdims=True))
    posterior /= posterior.sum(axis=1, keepdims=True)
    mean = (posterior * walks.estimates).sum(axis=1)
    own = np.einsum("tmmk->tmk", walks.estimates)
    squares: Floats = ((mean - own) ** 2).mean(axis=0)
    return squares / walks.optimum[:, np.newaxis]
