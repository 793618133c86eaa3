"""Noise models of sensors at rest: coefficients with uncertainties, curves, exports."""

from zerorate.noise.coefficient import Coefficient
from zerorate.noise.correlated import Markov, Sinusoid
from zerorate.noise.discrete import DiscreteSigmas
from zerorate.noise.model import NoiseModel
from zerorate.noise.quantities import Quantity
from zerorate.noise.terms import FLICKER_FLOOR
from zerorate.noise.worst import worst_axis

__all__ = [
    "FLICKER_FLOOR",
    "Coefficient",
    "DiscreteSigmas",
    "Markov",
    "NoiseModel",
    "Quantity",
    "Sinusoid",
    "worst_axis",
]
