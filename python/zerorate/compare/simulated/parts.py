"""What a simulated gyro's output is made of: each part as a series and as states."""

import cmath
import math
from dataclasses import dataclass
from typing import NamedTuple, Protocol

import numpy as np
import numpy.typing as npt

from zerorate.compare.simulated.checks import check_not_negative, check_positive
from zerorate.noise import series

__all__ = ["Block", "GaussMarkov", "Part", "Resonance", "WarmUp", "flicker"]

Floats = npt.NDArray[np.float64]

# Shares of a resonance that its start still has after so many decay times: e^-40 is rounding.
_LEAD = 40.0


class Block(NamedTuple):
    """States of a part: x+ = F x + w with covariance Q of w, H x in the output, P of the first."""

    F: Floats
    Q: Floats
    P: Floats
    H: Floats


class Part(Protocol):
    """Anything that can be drawn and that a Kalman filter can know."""

    def block(self, rate: float) -> Block:
        """Return the states of this part at a sampling rate in Hz."""

    def series(self, n: int, rate: float, random: np.random.Generator) -> Floats:
        """Return n samples, deg/s."""


@dataclass(frozen=True)
class GaussMarkov:
    """Exponentially correlated noise, stationary: its deviation in deg/s and time in s."""

    deviation: float
    time: float

    def __post_init__(self) -> None:
        """Check the numbers."""
        check_not_negative(self, "deviation")
        check_positive(self, "time")

    def block(self, rate: float) -> Block:
        """Return its one state, exact at the samples."""
        variance, step = self.deviation**2, 1.0 / (rate * self.time)
        return _scalar(math.exp(-step), -variance * math.expm1(-2.0 * step), variance)

    def series(self, n: int, rate: float, random: np.random.Generator) -> Floats:
        """Return n samples, deg/s."""
        white = random.standard_normal(n)
        return self.deviation * series.markov(white, 1.0 / (rate * self.time))


@dataclass(frozen=True)
class WarmUp:
    """A rate that starts at plus or minus `amplitude`, deg/s, and decays with `time`, s.

    The sign is drawn. It leaves the mean zero and the variance that of the prior, all that the
    error variance of a linear filter depends on.
    """

    amplitude: float
    time: float

    def __post_init__(self) -> None:
        """Check the numbers."""
        check_not_negative(self, "amplitude")
        check_positive(self, "time")

    def block(self, rate: float) -> Block:
        """Return its one state, which no noise drives."""
        return _scalar(math.exp(-1.0 / (rate * self.time)), 0.0, self.amplitude**2)

    def series(self, n: int, rate: float, random: np.random.Generator) -> Floats:
        """Return n samples, deg/s."""
        sign = float(random.choice([-1.0, 1.0]))
        decay: Floats = np.exp(-np.arange(n) / (rate * self.time))
        return sign * self.amplitude * decay


@dataclass(frozen=True)
class Resonance:
    """A hump in the spectrum: AR(2) noise of a deviation in deg/s.

    Its poles ring at `frequency`, Hz, and decay with `time`, s.
    """

    deviation: float
    frequency: float
    time: float

    def __post_init__(self) -> None:
        """Check the numbers."""
        check_not_negative(self, "deviation")
        check_positive(self, "frequency", "time")

    def block(self, rate: float) -> Block:
        """Return this sample and the one before as states."""
        first, second = self._coefficients(rate)
        correlation = first / (1.0 - second)
        P = self.deviation**2 * np.array([[1.0, correlation], [correlation, 1.0]])
        F = np.array([[first, second], [1.0, 0.0]])
        Q = np.diag([self._innovation(rate) ** 2, 0.0])
        return Block(F, Q, P, np.array([1.0, 0.0]))

    def series(self, n: int, rate: float, random: np.random.Generator) -> Floats:
        """Return n samples, deg/s.

        The response Im(p^(k+1))/Im(p) of the pole p is that of a complex AR(1), solved by doubling
        as in `zerorate.noise.series.markov`.
        """
        lead, pole = math.ceil(_LEAD * rate * self.time), self._pole(rate)
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
        """Return the deviation that drives it: Box and Jenkins, equation 3.2.28."""
        first, second = self._coefficients(rate)
        share = (1.0 + second) * ((1.0 - second) ** 2 - first**2) / (1.0 - second)
        return self.deviation * math.sqrt(share)


def flicker(bias_instability: float) -> tuple[GaussMarkov, ...]:
    """Return Gauss-Markov processes whose sum has the density B^2/(2 pi f), B in deg/s.

    Thirteen times from 0.05 s to 20 000 s stand D = 1.07 apart in their logarithms. Processes of
    variance B^2 D/pi at all such times sum to the density with a ripple of 4e-4; without those
    beyond both ends it is exact to 2 % from 0.0003 Hz to 0.1 Hz. So truth and optimum have
    finitely many states.
    """
    times = np.geomspace(0.05, 20_000.0, 13)
    spacing = math.log(times[1] / times[0])
    deviation = bias_instability * math.sqrt(spacing / math.pi)
    return tuple(GaussMarkov(deviation, float(time)) for time in times)


def _scalar(F: float, Q: float, P: float) -> Block:
    return Block(np.array([[F]]), np.array([[Q]]), np.array([[P]]), np.ones(1))
