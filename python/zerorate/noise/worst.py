"""One model for several axes."""

import math
from collections.abc import Callable, Iterable
from typing import TypeVar

from zerorate.noise.coefficient import Coefficient
from zerorate.noise.correlated import Markov, Sinusoid
from zerorate.noise.model import NoiseModel
from zerorate.noise.quantities import TERMS

__all__ = ["worst_axis"]

T = TypeVar("T")


def worst_axis(models: Iterable[NoiseModel]) -> NoiseModel:
    """Return the model whose every coefficient is the largest among the axes.

    What an estimator takes that has one number for all axes.

    Parameters
    ----------
    models : iterable of NoiseModel
        One for each axis, at least one, all of one quantity.

    Returns
    -------
    NoiseModel
        Each coefficient as it is in the axis where it is largest, with its standard error; one
        that is not identifiable counts by its upper bound, a ramp by its size. Markov terms and
        sinusoids are those of the axis where they have the largest variance together.

    Raises
    ------
    ValueError
        If there is no model, or they differ in quantity.

    Examples
    --------
    >>> x = NoiseModel(angle_random_walk=1e-4, rate_random_walk=3e-6)
    >>> y = NoiseModel(angle_random_walk=2e-4, rate_random_walk=1e-6)
    >>> worst = worst_axis([x, y])
    >>> worst.angle_random_walk, worst.rate_random_walk
    (Coefficient(0.0002), Coefficient(3e-06))
    """
    axes = list(models)
    quantities = {model.quantity for model in axes}
    if len(quantities) != 1:
        listed = ", ".join(sorted(quantities)) or "none"
        raise ValueError(f"the axes must be models of one quantity, got {listed}")
    quantity = quantities.pop()
    largest = {
        term.field: max((getattr(axis, term.field) for axis in axes), key=_size)
        for term in TERMS[quantity]
    }
    return NoiseModel(
        **largest,
        markov=_largest((axis.markov for axis in axes), _markov_deviation),
        sinusoid=_largest((axis.sinusoid for axis in axes), _sinusoid_deviation),
        quantity=quantity,
    )


def _size(coefficient: Coefficient) -> float:
    return abs(coefficient.conservative)


def _largest(choices: Iterable[tuple[T, ...]], deviation: Callable[[T], float]) -> tuple[T, ...]:
    return max(choices, key=lambda terms: math.hypot(*map(deviation, terms)))


def _markov_deviation(term: Markov) -> float:
    return term.amplitude.conservative * math.sqrt(term.time / 2.0)


def _sinusoid_deviation(term: Sinusoid) -> float:
    return term.amplitude.conservative / math.sqrt(2.0)
