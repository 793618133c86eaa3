"""Generalised autocovariances (Greenhall and Riley 2003) and strengths of the noise processes.

The phase x (the sum of the rate) of a random walk has no autocovariance, but its differences have
autocovariances. All follow from one even function s(k). Take two sums of phases with weights that
add up to zero: their covariance is the sum of products of weights times s. Differences remove
polynomials in k² up to a degree, which may be left out of s. The sample is the unit of time.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from zerorate.faults import ArgumentError
from zerorate.noise.kinds import Kind
from zerorate.types import Floats

_SERIES_TERMS: Final = 20
_ZETA_3: Final = 1.2020569031595942


@dataclass(frozen=True)
class Process:
    """Noise of unit strength.

    Parameters
    ----------
    phase : callable
        s(k) of the phase.
    summed : callable
        s(k) of the running sum of the phase; its negative second difference is `phase`.
    is_point : bool
        True if s(k) of the phase is zero for all k except zero.
    """

    phase: Callable[[Floats], Floats]
    summed: Callable[[Floats], Floats]
    is_point: bool = False


def _power_log(k: Floats, power: int) -> Floats:
    """Return k^power ln|k|, which is 0 at 0."""
    size = np.abs(k)
    return size**power * np.log(np.where(size > 0.0, size, 1.0))


def _flicker_summed(k: Floats) -> Floats:
    """Return the even function with k² ln|k| / (2 pi) as negative second difference.

    It uses the Euler-Maclaurin series, accurate to 1e-4 for |k| >= 1. The value at 0 is the value
    at 1.
    """
    size = np.maximum(np.abs(k), 1.0)
    smooth = (10.0 * size**2 * (size**2 - 1.0) + 1.0) * np.log(size) / 120.0 - 7.0 * size**4 / 144.0
    return -(smooth + _ZETA_3 / (4.0 * math.pi**2) * size) / (2.0 * math.pi)


QUANTISATION: Final = Process(
    phase=lambda k: np.where(k == 0.0, 1.0, 0.0),
    summed=lambda k: -np.abs(k) / 2.0,
    is_point=True,
)
"""White phase of variance 1."""

WHITE: Final = Process(
    phase=lambda k: -np.abs(k) / 2.0,
    summed=lambda k: np.abs(k) * (k * k - 1.0) / 12.0,
)
"""White rate of variance 1."""

FLICKER: Final = Process(
    phase=lambda k: _power_log(k, 2) / (2.0 * math.pi),
    summed=_flicker_summed,
)
"""Flicker of rate, density 1 / (2 pi f)."""

WALK: Final = Process(
    phase=lambda k: np.abs(k) * (k * k - 1.0) / 12.0,
    summed=lambda k: -np.abs(k) * (k * k - 1.0) * (k * k - 4.0) / 240.0,
)
"""Random walk of rate with steps of variance 1."""


def _flicker_phase(k: Floats) -> Floats:
    """Return the negative second difference of k² ln|k|, by its limit for large k."""
    near = 2.0 * _power_log(k, 2) - _power_log(k - 1.0, 2) - _power_log(k + 1.0, 2)
    return np.where(np.abs(k) < 1e3, near, -2.0 * np.log(np.maximum(np.abs(k), 1.0)) - 3.0)


BY_EXPONENT: Final[dict[int, Process]] = {
    2: QUANTISATION,
    1: Process(phase=_flicker_phase, summed=lambda k: _power_log(k, 2)),
    0: WHITE,
    -1: FLICKER,
    -2: WALK,
    -3: Process(phase=lambda k: -_power_log(k, 4), summed=lambda k: _power_log(k, 6) / 30.0),
    -4: Process(phase=lambda k: -(np.abs(k) ** 5), summed=lambda k: np.abs(k) ** 7 / 42.0),
}
"""Noises of any strength by the exponent of the density of their rate."""


def markov(time: float) -> Process:
    """Return a first-order Gauss-Markov rate of variance 1 and correlation time `time` samples."""
    return Process(
        phase=lambda k: -(time**2) * _exponential_tail(np.abs(k) / time, 3),
        summed=lambda k: _markov_summed(np.abs(k), time),
    )


def _markov_summed(k: Floats, time: float) -> Floats:
    """Return the double integral, scaled from second derivative to second difference."""
    integral = time**4 * _exponential_tail(k / time, 5)
    return integral - time**2 * _exponential_tail(k / time, 3) / 12.0 - k / (180.0 * time)


def _exponential_tail(r: Floats, first: int) -> Floats:
    """Return the terms of exp(-r) from (-r)^first / first! on.

    Even terms of lower order may be left out; odd terms belong to the process. For small r they
    would cancel in a difference, so the series is summed.
    """
    small = np.minimum(r, 1.0)
    series = np.zeros_like(r)
    for j in range(first + _SERIES_TERMS, first - 1, -1):
        series = series * -small / (j + 1) + 1.0
    series *= (-small) ** first / math.factorial(first)
    direct = np.exp(-r) - sum((-r) ** j / math.factorial(j) for j in range(first))
    return np.where(r < 1.0, series, direct)


COLOURED: Final[dict[str, Process]] = {
    "quantization": QUANTISATION,
    "angle_random_walk": WHITE,
    "bias_instability": FLICKER,
    "rate_random_walk": WALK,
}
"""Coloured noises by the coefficients of `NoiseModel`."""

TERMS: Final = (*COLOURED, "rate_ramp")
"""Coefficients in a fit by default."""

_RATE_POWER: Final = {
    "quantization": 2.0,
    "angle_random_walk": 1.0,
    "bias_instability": 0.0,
    "rate_random_walk": -1.0,
    "rate_ramp": -2.0,
}


def strength(term: str, rate: float) -> float:
    """Return the variance of a term with coefficient 1; the unit of time is one sample."""
    return math.pow(rate, _RATE_POWER[term])


def check_terms(terms: Sequence[str]) -> tuple[str, ...]:
    """Return the terms in their order; ValueError for an unknown, repeated or missing term."""
    names = (terms,) if isinstance(terms, str) else tuple(terms)
    for term in names:
        if term not in TERMS:
            raise ValueError(f"unknown term {term!r}; known: {', '.join(TERMS)}")
    if not names:
        raise ValueError(f"terms is empty; name at least one of {', '.join(TERMS)}")
    return tuple(term for term in TERMS if term in names)


def check_times(markov: Sequence[float] | int) -> tuple[float, ...] | int:
    """Return a number of Markov terms, or their times; ValueError if they are not valid."""
    if isinstance(markov, int | np.integer):
        if markov < 0:
            raise ArgumentError("markov", f"must not be a negative number of terms, got {markov}")
        return int(markov)
    times = tuple(float(time) for time in markov)
    if not all(math.isfinite(time) and time > 0.0 for time in times):
        raise ArgumentError("markov", f"must be positive correlation times in s, got {times}")
    return times


def check_frequencies(sinusoid: Sequence[float], rate: float) -> tuple[float, ...]:
    """Return the frequencies; ValueError if one is not between zero and half the rate."""
    frequencies = tuple(float(frequency) for frequency in sinusoid)
    if not all(0.0 < frequency < rate / 2.0 for frequency in frequencies):
        raise ArgumentError(
            "sinusoid",
            f"must be frequencies above 0 and below {rate / 2.0:g} Hz, got {frequencies}",
        )
    return frequencies


def ramp_variance(kind: Kind, m: Floats) -> Floats:
    """Return the squared deviation of a rate that grows by 1 per sample."""
    return m**2 / 2.0 if kind.order == 2 else np.zeros_like(m)


def sinusoid_variance(kind: Kind, m: Floats, frequency: float) -> Floats:
    """Return the squared deviation of a sine of amplitude 1, for its cycles per sample."""
    half = math.pi * frequency
    response = np.abs(2.0 * np.sin(half * m)) ** kind.order / (m * 2.0 * math.sin(half))
    if kind.modified:
        response *= np.sin(half * m) / (m * math.sin(half))
    return response**2 / (2.0 * math.factorial(kind.order))
