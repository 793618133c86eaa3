"""The decays and oscillations that an autoregression is made of."""

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

__all__ = ["Mode", "modes"]


class Mode(NamedTuple):
    """One real root of an autoregression, or a pair of complex ones.

    Attributes
    ----------
    root : complex
        Of 1 - phi_1 x - ..., the one with an imaginary part >= 0 of a pair.
    time_constant : float
        Seconds in which it decays by e; infinite or negative where it does not decay.
    frequency : float
        Of its oscillation in Hz: 0 for a positive real root, rate / 2 for a negative one.
    damping : float
        Ratio to the critical damping: 1 for a plain decay, 0 for an undamped oscillation.
    """

    root: complex
    time_constant: float
    frequency: float
    damping: float


def modes(inverse_roots: npt.NDArray[np.complex128], rate: float) -> tuple[Mode, ...]:
    """Return the modes of reciprocal roots that are not zero, slowest decay first."""
    upper = [complex(pole) for pole in inverse_roots if pole.imag >= 0.0 and pole != 0.0]
    return tuple(_mode(pole, rate) for pole in upper)


def _mode(pole: complex, rate: float) -> Mode:
    # The sampled exp(s / rate).
    s = complex(np.log(pole)) * rate
    time = -1.0 / s.real if s.real else np.inf
    damping = -s.real / abs(s) if s else 0.0
    return Mode((1.0 / pole).conjugate(), float(time), abs(s.imag) / (2.0 * np.pi), float(damping))
