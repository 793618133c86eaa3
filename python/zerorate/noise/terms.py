"""Allan and Hadamard deviation of each noise term, and terms with a time scale."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import reduce
from typing import TYPE_CHECKING, Final

import numpy as np
import numpy.typing as npt

from zerorate.noise.coefficient import CoefficientField
from zerorate.types import Floats

if TYPE_CHECKING:
    from zerorate.noise.model import NoiseModel

FLICKER_FLOOR: Final = math.sqrt(2.0 * math.log(2.0) / math.pi)
"""Allan deviation of flicker noise divided by its bias instability B: 0.664."""

_FLICKER_RATIO: Final = math.log(256.0 / 27.0) / (4.0 * math.log(2.0))
_SERIES_BELOW: Final = 0.25
_SERIES_ORDER: Final = 18


@dataclass(frozen=True)
class Markov:
    """Exponentially correlated (first-order Markov) noise, IEEE Std 952-1997, C.1.5.

    Parameters
    ----------
    amplitude : float
        q_c in rad/s^2/sqrt(Hz), the density of the driving white noise. The variance of the Markov
        noise is q_c^2 T_c / 2.
    time : float
        Correlation time T_c in s, positive. Well below T_c the noise is a random walk with K = q_c;
        well above T_c it is white with N = q_c T_c.

    Raises
    ------
    ValueError
        If a number is not finite. If the amplitude is negative or the time is not positive.

    Examples
    --------
    >>> import zerorate as zr
    >>> model = zr.NoiseModel(markov=(zr.noise.Markov(amplitude=1e-5, time=100.0),))
    >>> int(model.allan_deviation([1.0, 189.0, 1e5]).argmax())  # the peak is at 1.89 T_c
    1
    """

    amplitude: CoefficientField = CoefficientField(required=True)
    time: CoefficientField = CoefficientField(positive=True, required=True)


@dataclass(frozen=True)
class Sinusoid:
    """A sine of unknown phase in the rate, IEEE Std 952-1997, C.1.6.

    Parameters
    ----------
    amplitude : float
        Omega_0 in rad/s, from zero to peak.
    frequency : float
        f_0 in Hz, positive.

    Raises
    ------
    ValueError
        If a number is not finite. If the amplitude is negative or the frequency is not positive.

    Examples
    --------
    >>> import zerorate as zr
    >>> model = zr.NoiseModel(sinusoid=(zr.noise.Sinusoid(amplitude=1e-3, frequency=0.1),))
    >>> bool(model.allan_deviation([10.0])[0] < 1e-9)  # over a whole period
    True
    """

    amplitude: CoefficientField = CoefficientField(required=True)
    frequency: CoefficientField = CoefficientField(positive=True, required=True)


@dataclass(frozen=True)
class Statistic:
    """Weights of the terms in a squared deviation at tau = 1 s.

    The deviation uses differences of the angle, of order 2 (Allan) or 3 (Hadamard), at steps of
    tau.
    """

    order: int
    quantization: float
    flicker: float
    walk: float
    ramp: float
    sinusoid: float
    squares: tuple[float, ...]
    """Weights of the mean square change of the angle over 1, 2, ... steps."""


ALLAN: Final = Statistic(
    order=2,
    quantization=math.sqrt(3.0),
    flicker=FLICKER_FLOOR,
    walk=math.sqrt(1.0 / 3.0),
    ramp=math.sqrt(1.0 / 2.0),
    sinusoid=1.0,
    squares=(2.0, -1.0 / 2.0),
)
HADAMARD: Final = Statistic(
    order=3,
    quantization=math.sqrt(10.0 / 3.0),
    flicker=FLICKER_FLOOR * math.sqrt(_FLICKER_RATIO),
    walk=math.sqrt(1.0 / 6.0),
    ramp=0.0,
    sinusoid=2.0 / math.sqrt(3.0),
    squares=(15.0 / 6.0, -1.0, 1.0 / 6.0),
)


def deviation(model: NoiseModel, taus: npt.ArrayLike, statistic: Statistic) -> Floats:
    """Return a model's deviation curve, in the shape of `taus`; ValueError if one is not > 0."""
    tau = np.asarray(taus, dtype=np.float64)
    if not np.all(np.isfinite(tau) & (tau > 0.0)):
        raise ValueError("averaging times must be positive and finite")
    terms = (
        statistic.quantization * model.quantization / tau,
        model.angle_random_walk / np.sqrt(tau),
        np.full_like(tau, statistic.flicker * model.bias_instability),
        statistic.walk * model.rate_random_walk * np.sqrt(tau),
        statistic.ramp * abs(model.rate_ramp) * tau,
        *(_markov_deviation(term, tau, statistic) for term in model.markov),
        *(_sinusoid_deviation(term, tau, statistic) for term in model.sinusoid),
    )
    # hypot does not overflow, unlike the root of a sum of squares.
    return reduce(np.hypot, terms)


def _sinusoid_deviation(term: Sinusoid, tau: Floats, statistic: Statistic) -> Floats:
    phase = math.pi * term.frequency * tau
    size: Floats = np.abs(np.sin(phase)) ** statistic.order / phase
    return statistic.sinusoid * term.amplitude * size


def _markov_deviation(term: Markov, tau: Floats, statistic: Statistic) -> Floats:
    """Return q_c T_c / sqrt(tau) times the root of `_growth` at x = tau / T_c.

    In a time t the mean square change of the angle is q_c^2 T_c^3 (u - 1 + exp(-u)), u = t / T_c.
    This is twice the integral of the autocovariance. Its weighted sum is the variance.
    """
    x = tau / term.time
    return term.amplitude * term.time / np.sqrt(tau) * np.sqrt(_growth(x, statistic.squares) / x)


def _growth(x: Floats, weights: tuple[float, ...]) -> Floats:
    """Return sum_k w_k (k x - 1 + exp(-k x)), as a series for small x."""
    steps = np.arange(1, len(weights) + 1)
    powers = np.arange(3, _SERIES_ORDER)
    factors = [
        (-1.0) ** j / math.factorial(j) * float(np.dot(weights, steps.astype(float) ** j))
        for j in powers
    ]
    small = np.minimum(x, _SERIES_BELOW)
    series = small**3 * np.polynomial.polynomial.polyval(small, factors)
    direct = sum(w * (k * x + np.expm1(-k * x)) for k, w in enumerate(weights, start=1))
    return np.where(x < _SERIES_BELOW, series, direct)
