"""The worst regret that no method can undercut that does not know which of several gyros it has.

``python examples/least_regret.py [--records 400]`` searches it between no drift and random walks
of 3e-6 to 3e-4 deg/s/sqrt(s) under white noise of 0.01 deg/s/sqrt(Hz).
"""

import argparse
import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
import numpy.typing as npt

from zerorate.simulation.models import GyroModel, simulate_records
from zerorate.simulation.optimal_filter import Optimum, optimum
from zerorate.tasks.compare.simulated import scored_span
from zerorate.types import Floats

_ROUNDS: Final = 60
_INSTANTS: Final = 40
_TINY: Final = 1e-300


Indices = npt.NDArray[np.intp]


@dataclass(frozen=True, eq=False)
class Bound:
    """Least worst regret that any method can have over a set of models.

    Attributes
    ----------
    models : tuple of GyroModel
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

    models: tuple[GyroModel, ...]
    weights: Floats
    lower: float
    sigma: float
    regret: Floats


@dataclass(frozen=True, eq=False)
class Filtered:
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


def least_regret(
    models: Sequence[GyroModel],
    *,
    duration: float = 1800.0,
    score_from: float = 120.0,
    rate: float = 0.5,
    records: int = 200,
) -> Bound:
    """Return the worst regret that no method can undercut on all of several models.

    Parameters
    ----------
    models : sequence of GyroModel
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
    >>> from zerorate.simulation.models import GyroModel
    >>> drifts = GyroModel("none"), GyroModel("walk", rate_random_walk=1e-4)
    >>> round(least_regret(drifts, records=20, duration=600.0).lower, 1)
    1.0
    """
    gyros = _checked(models, records)
    first, n = scored_span(duration, score_from, rate)
    times = np.unique(np.linspace(first, n - 1, _INSTANTS).astype(np.intp))
    weights = _hardest(filtered_by_all(gyros, rate, times, range(records)))
    others = filtered_by_all(gyros, rate, times, range(records, 2 * records))
    excess = _excess(others, weights)
    squared = 1.0 + excess.mean(axis=1)
    lower = math.sqrt(weights @ squared)
    variance = weights**2 @ excess.var(axis=1, ddof=1) / records
    return Bound(gyros, weights, lower, math.sqrt(variance) / (2.0 * lower), np.sqrt(squared))


def filtered_by_all(
    models: Sequence[GyroModel], rate: float, times: Indices, seeds: Iterable[int]
) -> Filtered:
    """Draw records of every model and filter each with the filters of all.

    Parameters
    ----------
    models : sequence of GyroModel
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
    signals = [simulate_records(model, rate, n, chosen)[0] for model in models]
    pairs = np.array([[_filtered(one, signal, times) for signal in signals] for one in filters])
    estimates, likelihood = np.moveaxis(pairs, (2, 3), (0, 1))
    return Filtered(
        estimates, likelihood, np.array([one.variance[times].mean() for one in filters])
    )


def _filtered(one: Optimum, signal: Floats, times: Indices) -> tuple[Floats, Floats]:
    """Return estimate and log likelihood after each instant, shape (instants, k)."""
    drift, innovation = one.filtered(signal)
    variance = one.innovation_variance[1:, np.newaxis]
    steps = np.zeros_like(innovation)
    # The first sample sets the level, which has no prior: it says nothing of the model.
    steps[1:] = -0.5 * (np.log(variance) + innovation[1:] ** 2 / variance)
    return drift[times], np.cumsum(steps, axis=0)[times]


def _checked(models: Sequence[GyroModel], records: int) -> tuple[GyroModel, ...]:
    if len(models) < 2 or records < 2:
        raise ValueError(
            f"a bound needs two models and two records of each, got {len(models)} and {records}"
        )
    for model in models:
        if model.resolution > 0.0 or model.transient:
            raise ValueError(f"{model.name} rounds or warms up: its likelihood is not Gaussian")
    return tuple(models)


def _hardest(found: Filtered) -> Floats:
    """Return weights that nearly maximise the Bayes risk."""
    count = found.optimum.size
    weights = np.full(count, 1.0 / count)
    for _ in range(_ROUNDS):
        # At the maximum the excess is the same wherever there is weight; models that no filter
        # can tell apart have none at all.
        weights *= _excess(found, weights).mean(axis=1) + _TINY
        weights /= weights.sum()
    return weights


def _excess(found: Filtered, weights: Floats) -> Floats:
    """Return the squared regret of the posterior mean less 1, shape (m, records)."""
    with np.errstate(divide="ignore"):
        prior = np.log(weights / found.optimum)
    scores = found.likelihood + prior[:, np.newaxis, np.newaxis]
    posterior = np.exp(scores - scores.max(axis=1, keepdims=True))
    posterior /= posterior.sum(axis=1, keepdims=True)
    mean = (posterior * found.estimates).sum(axis=1)
    own = np.einsum("tmmk->tmk", found.estimates)
    squares: Floats = ((mean - own) ** 2).mean(axis=0)
    return squares / found.optimum[:, np.newaxis]


def main() -> None:
    """Print the bound, and what each gyro costs the method that reaches nearly as little."""
    parser = argparse.ArgumentParser(description="The regret that no method can undercut.")
    parser.add_argument("--records", type=int, default=400, help="drawn from each gyro, twice")
    walks = np.geomspace(3e-6, 3e-4, 9)
    gyros = [GyroModel("none"), *(GyroModel(f"{w:.0e}", rate_random_walk=float(w)) for w in walks)]
    found = least_regret(gyros, records=parser.parse_args().records)
    print(f"no method has less than {found.lower:.3f} +- {found.sigma:.3f} on the worst of")
    for gyro, weight, regret in zip(found.models, found.weights, found.regret, strict=True):
        print(
            f"{gyro.name:>6}  weight {weight:.3f}  regret {regret:.3f} of a method made for these"
        )


if __name__ == "__main__":
    main()
