"""Terms of a noise model that have a time scale of their own."""

from dataclasses import dataclass

from zerorate.noise.fields import CoefficientField

__all__ = ["Markov", "Sinusoid"]


@dataclass(frozen=True)
class Markov:
    """Exponentially correlated (first-order Markov) noise, IEEE Std 952-1997, C.1.5.

    Parameters
    ----------
    amplitude : float
        q_c in rad/s^2/sqrt(Hz): the white noise that drives it. Its variance is q_c^2 T_c / 2.
    time : float
        T_c in s, the correlation time, positive. Well within it the noise is a random walk with
        K = q_c, well beyond it white with N = q_c T_c.

    Raises
    ------
    ValueError
        If a number is not finite, the amplitude negative or the time not positive.
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
        If a number is not finite, the amplitude negative or the frequency not positive.
    """

    amplitude: CoefficientField = CoefficientField(required=True)
    frequency: CoefficientField = CoefficientField(positive=True, required=True)
