"""Smallest worst-case regret of any method that does not know which of several gyros it has.

``python examples/least_regret.py [--records 400]`` computes it for gyros without drift and with
random walks of 3e-6 to 3e-4 deg/s/sqrt(s). The white noise is 0.01 deg/s/sqrt(Hz).
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
    """Smallest worst-case regret that any method can have over a set of models.

    Attributes
    ----------
    models : tuple of GyroModel
        Models of the m gyros.
    weights : ndarray, shape (m,)
        Weight of each model in the mean of squared regrets, chosen to make this mean hard to
        reduce.
    lower : float
        Lower bound: no method has a smaller worst-case regret.
    sigma : float
        Standard error of `lower`, from the number of records.
    regret : ndarray, shape (m,)
        Regret on each model of the best method for these weights. A method that knows the set
        reaches the largest of these values. The smallest possible regret is therefore between
        `lower` and this value.
    """

    models: tuple[GyroModel, ...]
    weights: Floats
    lower: float
    sigma: float
    regret: Floats


@dataclass(frozen=True, eq=False)
class Filtered:
    """Results of m filters for k records of each of m models, at some instants.

    Attributes
    ----------
    estimates : ndarray, shape (instants, m, m, k)
        Drift by the filter of the first model, on records of the second model, deg/s.
    likelihood : ndarray, of the same shape
        Log likelihood of the record until each instant under the filter's model, without common
        terms.
    optimum : ndarray, shape (m,)
        Error variance of each model's own filter, as mean over the instants.
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
    """Return the smallest worst-case regret that any method can have on several models.

    Parameters
    ----------
    models : sequence of GyroModel
        Two or more gyros with Gaussian noise, without rounding or warm-up. The method may know all
        models, but not which model it has.
    duration, score_from : float
        Length of a record, s, and time from which errors count, s.
    rate : float
        Sampling rate, Hz. The default is sufficient if the drift changes little in 2 s. A sample of
        white noise is then equivalent to the mean of many samples.
    records : int
        Number of records of each model for the weights, and again for the result.

    Returns
    -------
    Bound
        Bound, with the regret of the best method for the hardest weights on each model.

    Raises
    ------
    ValueError
        If there are fewer than two models or records. Also if a model has rounding or a warm-up, or
        no sample counts.

    Notes
    -----
    Let V_m be the mean squared error of the optimum on model m, and E_m(d) the error of a method d.
    For any weights w with sum 1, the maximum of E_m(d)/V_m is at least sum w_m E_m(d)/V_m. This sum
    is a Bayes risk with a prior proportional to w_m/V_m. Its minimum is reached by the posterior
    mean d*:

        max_m E_m(d)/V_m >= sum_m w_m E_m(d*)/V_m.

    This is valid for every method that follows a constant added to the record, and for any larger
    set of models. With the optimum's estimate x_m, E_m(d*) = V_m + E_m |d* - x_m|^2, so only the
    second term is averaged over records. The right side is concave in w, and its slope is the ratio
    for each m. The weights therefore increase where the ratio is large. The result comes from other
    records than the weights.

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
    """Draw records of every model, and filter each with the filters of all models.

    Parameters
    ----------
    models : sequence of GyroModel
        Models of the m gyros.
    rate : float
        Sampling rate, Hz.
    times : ndarray of int, shape (instants,)
        Sample counts after which the filters are read, in rising order.
    seeds : iterable of int
        Seeds, one for each record of a model.
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
    """Return estimate and log likelihood at each instant, shape (instants, k)."""
    drift, innovation = one.filtered(signal)
    variance = one.innovation_variance[1:, np.newaxis]
    steps = np.zeros_like(innovation)
    # The first sample sets the level, which has no prior, so it does not rate the model.
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
        # At the maximum all models with weight have the same excess. Models that no filter can
        # distinguish have zero weight.
        weights *= _excess(found, weights).mean(axis=1) + _TINY
        weights /= weights.sum()
    return weights


def _excess(found: Filtered, weights: Floats) -> Floats:
    """Return the squared regret of the posterior mean minus 1, shape (m, records)."""
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
    """Print the bound, and the regret on each gyro of a method that nearly reaches it."""
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
