"""Noise of sensors at rest: deviation curves, fitted models, and their exports."""

from zerorate._native import AllanNoise, MotionDetector
from zerorate.noise.allan import allan
from zerorate.noise.coefficient import Coefficient
from zerorate.noise.dynamic import DynamicAllan, dynamic_allan
from zerorate.noise.fit import FittedModel
from zerorate.noise.low_pass import LowPass
from zerorate.noise.model import DiscreteSigmas, NoiseModel, worst_axis
from zerorate.noise.quantities import Quantity
from zerorate.noise.result import AllanResult
from zerorate.noise.spectrum import whittle
from zerorate.noise.terms import FLICKER_FLOOR, Markov, Sinusoid

__all__ = [
    "FLICKER_FLOOR",
    "AllanNoise",
    "AllanResult",
    "Coefficient",
    "DiscreteSigmas",
    "DynamicAllan",
    "FittedModel",
    "LowPass",
    "Markov",
    "MotionDetector",
    "NoiseModel",
    "Quantity",
    "Sinusoid",
    "allan",
    "dynamic_allan",
    "whittle",
    "worst_axis",
]


def __dir__() -> list[str]:
    """Return the public names."""
    return __all__
