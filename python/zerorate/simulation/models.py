"""Gyros as linear systems: drift and noise with a known optimal filter."""

import cmath
import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import Final, NamedTuple, Protocol

import numpy as np

from zerorate.faults import ArgumentError
from zerorate.simulation import sequences
from zerorate.simulation.gyro import check_not_negative
from zerorate.types import Floats

# Length of a resonance's transient in decay times: exp(-40) is below rounding.
_LEAD_DECAYS = 40.0


def _check_not_negative(instance: object, *names: str) -> None:
    """Raise ValueError if an attribute is not finite or negative."""
    for name in names:
        check_not_negative(name, getattr(instance, name))


def _check_positive(instance: object, *names: str) -> None:
    """Raise ValueError if an attribute is not finite or not positive."""
    for name in names:
        value = getattr(instance, name)
        if not 0.0 < value < math.inf:
            raise ArgumentError(name, f"must be finite and positive, got {value}")


class Block(NamedTuple):
    """States of a part: x+ = F x + w, covariance Q of w, output H x, start covariance P."""

    F: Floats
    Q: Floats
    P: Floats
    H: Floats


class Part(Protocol):
    """Part of a model that can be simulated and that a Kalman filter can include as states."""

    def block(self, rate: float) -> Block:
        """Return the states of this part at a sampling rate, Hz."""

    def series(self, n: int, rate: float, random: np.random.Generator) -> Floats:
        """Return n samples, deg/s."""


@dataclass(frozen=True)
class GaussMarkov:
    """Stationary, exponentially correlated noise: standard deviation, deg/s, and time, s."""

    deviation: float
    time: float

    def __post_init__(self) -> None:
        """Check the numbers."""
        _check_not_negative(self, "deviation")
        _check_positive(self, "time")

    def block(self, rate: float) -> Block:
        """Return the block with one state; it is exact at the samples."""
        variance, step = self.deviation**2, 1.0 / (rate * self.time)
        return _scalar_block(math.exp(-step), -variance * math.expm1(-2.0 * step), variance)

    def series(self, n: int, rate: float, random: np.random.Generator) -> Floats:
        """Return n samples, deg/s."""
        white = random.standard_normal(n)
        return self.deviation * sequences.markov(white, 1.0 / (rate * self.time))


@dataclass(frozen=True)
class WarmUp:
    """Rate that starts at plus or minus `amplitude`, deg/s, and decays with `time`, s.

    The sign is random. The mean is therefore zero and the variance equals the prior's variance. The
    error variance of a linear filter depends only on these two.
    """

    amplitude: float
    time: float

    def __post_init__(self) -> None:
        """Check the numbers."""
        _check_not_negative(self, "amplitude")
        _check_positive(self, "time")

    def block(self, rate: float) -> Block:
        """Return the block with one state, without driving noise."""
        return _scalar_block(math.exp(-1.0 / (rate * self.time)), 0.0, self.amplitude**2)

    def series(self, n: int, rate: float, random: np.random.Generator) -> Floats:
        """Return n samples, deg/s."""
        sign = float(random.choice([-1.0, 1.0]))
        decay: Floats = np.exp(-np.arange(n) / (rate * self.time))
        return sign * self.amplitude * decay


@dataclass(frozen=True)
class Resonance:
    """Resonance in the spectrum: AR(2) noise with a standard deviation in deg/s.

    Its poles oscillate at `frequency`, Hz, and decay with `time`, s.
    """

    deviation: float
    frequency: float
    time: float

    def __post_init__(self) -> None:
        """Check the numbers."""
        _check_not_negative(self, "deviation")
        _check_positive(self, "frequency", "time")

    def block(self, rate: float) -> Block:
        """Return the block with this sample and the previous sample as states."""
        first, second = self._coefficients(rate)
        correlation = first / (1.0 - second)
        P = self.deviation**2 * np.array([[1.0, correlation], [correlation, 1.0]])
        F = np.array([[first, second], [1.0, 0.0]])
        Q = np.diag([self._innovation(rate) ** 2, 0.0])
        return Block(F, Q, P, np.array([1.0, 0.0]))

    def series(self, n: int, rate: float, random: np.random.Generator) -> Floats:
        """Return n samples, deg/s.

        For the pole p the response is Im(p^(k+1))/Im(p). It comes from a complex AR(1) process,
        solved by doubling as in `zerorate.simulation.sequences.markov`.
        """
        lead, pole = math.ceil(_LEAD_DECAYS * rate * self.time), self._pole(rate)
        x = random.standard_normal(lead + n).astype(np.complex128)
        lag, decay = 1, pole
        while lag < x.size and abs(decay) > 1e-17:
            x[lag:] += decay * x[:-lag]
            lag, decay = 2 * lag, decay * decay
        ringing: Floats = (pole * x[lead:]).imag / pole.imag
        return self._innovation(rate) * ringing

    def _pole(self, rate: float) -> complex:
        if not 2.0 * self.frequency < rate:
            raise ValueError(f"a resonance at {self.frequency} Hz needs twice that, got {rate} Hz")
        return cmath.exp(complex(-1.0 / self.time, 2.0 * math.pi * self.frequency) / rate)

    def _coefficients(self, rate: float) -> tuple[float, float]:
        pole = self._pole(rate)
        return 2.0 * pole.real, -(abs(pole) ** 2)

    def _innovation(self, rate: float) -> float:
        """Return the standard deviation of the driving noise (Box and Jenkins, equation 3.2.28)."""
        first, second = self._coefficients(rate)
        share = (1.0 + second) * ((1.0 - second) ** 2 - first**2) / (1.0 - second)
        return self.deviation * math.sqrt(share)


def flicker(bias_instability: float) -> tuple[GaussMarkov, ...]:
    """Return Gauss-Markov processes with a total density B^2/(2 pi f), B in deg/s.

    There are thirteen correlation times from 0.05 s to 20 000 s, at a distance of D = 1.07 in their
    logarithms. Each process has the variance B^2 D/pi. An infinite series of such processes would
    have this density with a ripple of 4e-4. The thirteen processes have it within 2 % from 0.0003
    Hz to 0.1 Hz. With a finite number of states, the optimal filter can be computed.
    """
    times = np.geomspace(0.05, 20_000.0, 13)
    spacing = math.log(times[1] / times[0])
    deviation = bias_instability * math.sqrt(spacing / math.pi)
    return tuple(GaussMarkov(deviation, float(time)) for time in times)


def _scalar_block(F: float, Q: float, P: float) -> Block:
    return Block(np.array([[F]]), np.array([[Q]]), np.array([[P]]), np.ones(1))


@dataclass(frozen=True)
class GyroModel:
    """A gyro at rest with constant bias, drift, noise that is not drift, and rounding.

    Parameters
    ----------
    name : str
        Unique name. The random numbers of a seed depend on it.
    angle_random_walk : float
        White noise, deg/s/sqrt(Hz). The default has a standard deviation of 0.1 deg/s at 100 Hz.
    rate_random_walk : float
        Random walk of the drift, deg/s/sqrt(s).
    drift : tuple of Part
        Other parts of the drift that a filter has to estimate.
    disturbances : tuple of Part
        Coloured noise that is not drift.
    resolution : float
        Step of the output, deg/s. 0 means no rounding.
    turn_on_bias : float
        Standard deviation of the constant bias, deg/s. Filters do not know the bias.
    transient : bool
        True if the drift decays. Results for such a model are reported separately.

    Raises
    ------
    ValueError
        If a number is negative or not finite.

    Examples
    --------
    >>> MODELS[2].name, MODELS[2].rate_random_walk
    ('walk', 0.0003)
    """

    name: str
    angle_random_walk: float = 0.01
    rate_random_walk: float = 0.0
    drift: tuple[Part, ...] = ()
    disturbances: tuple[Part, ...] = ()
    resolution: float = 0.0
    turn_on_bias: float = 0.5
    transient: bool = False

    def __post_init__(self) -> None:
        """Check the numbers."""
        _check_not_negative(
            self, "angle_random_walk", "rate_random_walk", "resolution", "turn_on_bias"
        )


def _hump(deviation: float) -> tuple[Resonance]:
    """Return a resonance at 18 Hz with poles of radius 0.97 at 100 Hz."""
    return (Resonance(deviation, 18.0, 0.3283),)


MODELS: Final = (
    GyroModel("none"),
    GyroModel("faint slow", drift=(GaussMarkov(0.0015, 600.0),)),
    GyroModel("walk", rate_random_walk=3e-4),
    GyroModel("strong walk", rate_random_walk=3e-3),
    GyroModel("Markov 100 s", drift=(GaussMarkov(0.01, 100.0),)),
    GyroModel("Markov 10 s", drift=(GaussMarkov(0.02, 10.0),)),
    GyroModel("two Markov", drift=(GaussMarkov(0.01, 8.0), GaussMarkov(0.01, 300.0))),
    GyroModel("flicker", drift=flicker(0.002)),
    GyroModel("flicker + walk", rate_random_walk=2e-4, drift=flicker(0.001)),
    GyroModel("tactical", angle_random_walk=0.0005, drift=flicker(0.0005)),
    GyroModel(
        "rounded",
        angle_random_walk=0.005,
        rate_random_walk=3e-4,
        drift=(GaussMarkov(0.004, 60.0),),
        resolution=0.05,
    ),
    GyroModel(
        "hump",
        angle_random_walk=0.005,
        drift=(GaussMarkov(0.006, 150.0),),
        disturbances=_hump(0.2),
    ),
    GyroModel(
        "strong hump",
        angle_random_walk=0.005,
        drift=(GaussMarkov(0.006, 150.0),),
        disturbances=_hump(0.6),
    ),
    GyroModel("coloured", rate_random_walk=3e-4, disturbances=(GaussMarkov(0.05, 0.1),)),
    GyroModel("warm-up", rate_random_walk=2e-4, drift=(WarmUp(0.1, 300.0),), transient=True),
)
"""Gyro models from no drift to a warm-up; the transient models are last."""


def simulate_records(
    model: GyroModel, rate: float, n: int, seeds: Iterable[int]
) -> tuple[Floats, Floats]:
    """Return output and true drift of several gyros of one model, shape (n, seeds), deg/s."""
    pairs = [simulate_record(model, rate, n, seed) for seed in seeds]
    signals, truths = zip(*pairs, strict=True)
    return np.column_stack(signals), np.column_stack(truths)


def simulate_record(model: GyroModel, rate: float, n: int, seed: int) -> tuple[Floats, Floats]:
    """Simulate one gyro at rest, and return its output and its true drift.

    Parameters
    ----------
    model : GyroModel
        Model of the gyro.
    rate : float
        Sampling rate, Hz.
    n : int
        Number of samples.
    seed : int
        Seed, at least 0. Each model, seed and part of a model has its own random stream.

    Returns
    -------
    signal, truth : ndarray, shape (n,)
        Output, and true drift including the turn-on bias, deg/s.

    Raises
    ------
    ValueError
        If the model has a resonance above half the rate.

    Examples
    --------
    >>> from zerorate.simulation.models import MODELS
    >>> signal, truth = simulate_record(MODELS[0], 100.0, 6000, seed=1)
    >>> round(float((signal - truth).std()), 2), float(np.ptp(truth))
    (0.1, 0.0)
    """
    streams = _streams(model, seed)
    truth = np.full(n, model.turn_on_bias * next(streams).standard_normal())
    white = next(streams).standard_normal(n)
    step = model.rate_random_walk / np.sqrt(rate)
    truth += step * sequences.walk(next(streams).standard_normal(n))
    for part in model.drift:
        truth += part.series(n, rate, next(streams))
    signal = truth + model.angle_random_walk * np.sqrt(rate) * white
    for part in model.disturbances:
        signal += part.series(n, rate, next(streams))
    return _quantise(signal, model.resolution), truth


def _streams(model: GyroModel, seed: int) -> Iterator[np.random.Generator]:
    name = int.from_bytes(model.name.encode())
    count = 3 + len(model.drift) + len(model.disturbances)
    return map(np.random.default_rng, np.random.SeedSequence([seed, name]).spawn(count))


def _quantise(signal: Floats, step: float) -> Floats:
    return np.round(signal / step) * step if step > 0.0 else signal
