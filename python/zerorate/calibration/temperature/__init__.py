"""The bias of a gyro by temperature: the model, its fit, the thermometer, files."""

from zerorate.calibration.temperature.model import TemperatureBias, TemperatureModel

__all__ = ["TemperatureBias", "TemperatureModel"]
