"""Simulated gyros whose true drift is known, and how near to the optimum methods come."""

from zerorate.compare.simulated.models import MODELS, DeviceModel

__all__ = ["MODELS", "DeviceModel"]
