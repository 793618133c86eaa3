"""Simulated gyros whose true drift is known, and how near to the optimum methods come."""

from zerorate.compare.simulated.bounds import Bound, least_regret
from zerorate.compare.simulated.format import format_regret
from zerorate.compare.simulated.methods import Estimate, Method
from zerorate.compare.simulated.models import MODELS, DeviceModel
from zerorate.compare.simulated.optimal import Optimum, optimum
from zerorate.compare.simulated.parts import GaussMarkov, Resonance, WarmUp, flicker
from zerorate.compare.simulated.records import record
from zerorate.compare.simulated.regret import run
from zerorate.compare.simulated.result import Regret

__all__ = [
    "MODELS",
    "Bound",
    "DeviceModel",
    "Estimate",
    "GaussMarkov",
    "Method",
    "Optimum",
    "Regret",
    "Resonance",
    "WarmUp",
    "flicker",
    "format_regret",
    "least_regret",
    "optimum",
    "record",
    "run",
]
