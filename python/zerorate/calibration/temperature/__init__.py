"""Bias of a gyro by temperature: the model, its fit, the thermometer, and files."""

from zerorate.calibration.temperature.model import TemperatureBias, TemperatureModel

__all__ = ["TemperatureBias", "TemperatureModel"]
