"""The terms that a fit may find, each with its unit strength in samples."""

import math
from collections.abc import Sequence
from typing import Final

import numpy as np
import numpy.typing as npt

from zerorate.noise.kinds import Kind
from zerorate.noise.power_laws import FLICKER, QUANTISATION, WALK, WHITE, Process

__all__ = [
    "COLOURED",
    "TERMS",
    "check_frequencies",
    "check_terms",
    "check_times",
    "ramp_variance",
    "sinusoid_variance",
    "strength",
]

Floats = npt.NDArray[np.float64]

COLOURED: Final[dict[str, Process]] = {
    "quantization": QUANTISATION,
    "angle_random_walk": WHITE,
    "bias_instability": FLICKER,
    "rate_random_walk": WALK,
}
"""Noises of the coefficients of `NoiseModel`."""

TERMS: Final = (*COLOURED, "rate_ramp")
"""Coefficients that a fit finds unless told otherwise."""

_RATE_POWER: Final = {
    "quantization": 2.0,
    "angle_random_walk": 1.0,
    "bias_instability": 0.0,
    "rate_random_walk": -1.0,
    "rate_ramp": -2.0,
}


def strength(term: str, rate: float) -> float:
    """Return the variance, with the sample as unit of time, of a term whose coefficient is 1."""
    return math.pow(rate, _RATE_POWER[term])


def check_terms(terms: Sequence[str]) -> tuple[str, ...]:
    """Return the terms in their order; ValueError for an unknown, repeated or missing one."""
    given = (terms,) if isinstance(terms, str) else tuple(terms)
    for term in given:
        if term not in TERMS:
            raise ValueError(f"unknown term {term!r}; known: {', '.join(TERMS)}")
    if not given:
        raise ValueError(f"terms is empty; name at least one of {', '.join(TERMS)}")
    return tuple(term for term in TERMS if term in given)


def check_times(markov: Sequence[float] | int) -> tuple[float, ...] | int:
    """Return a number of Markov terms, or their times; ValueError if one means nothing."""
    if isinstance(markov, int | np.integer):
        if markov < 0:
            raise ValueError(f"markov must not be a negative number of terms, got {markov}")
        return int(markov)
    times = tuple(float(time) for time in markov)
    if not all(math.isfinite(time) and time > 0.0 for time in times):
        raise ValueError(f"markov must be positive correlation times in s, got {times}")
    return times


def check_frequencies(sinusoid: Sequence[float], rate: float) -> tuple[float, ...]:
    """Return the frequencies; ValueError unless they lie between zero and half the rate."""
    frequencies = tuple(float(frequency) for frequency in sinusoid)
    if not all(0.0 < frequency < rate / 2.0 for frequency in frequencies):
        raise ValueError(
            f"sinusoid must be frequencies above 0 and below {rate / 2.0:g} Hz, got {frequencies}"
        )
    return frequencies


def ramp_variance(kind: Kind, m: Floats) -> Floats:
    """Return the squared deviation of a rate that grows by 1 a sample."""
    return m**2 / 2.0 if kind.order == 2 else np.zeros_like(m)


def sinusoid_variance(kind: Kind, m: Floats, frequency: float) -> Floats:
    """Return the squared deviation of a sine of amplitude 1 at so many cycles a sample."""
    half = math.pi * frequency
    response = np.abs(2.0 * np.sin(half * m)) ** kind.order / (m * 2.0 * math.sin(half))
    if kind.modified:
        response *= np.sin(half * m) / (m * math.sin(half))
    return response**2 / (2.0 * math.factorial(kind.order))
