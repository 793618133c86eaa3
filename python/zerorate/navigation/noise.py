"""Noise of the sensors, as the navigation filter takes it."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Final

from zerorate.noise import NoiseModel

__all__ = ["densities"]

_CONSUMER: Final = {"gyro": (math.radians(0.05), 1e-5), "accel": (0.02, 5e-4)}
"""White noise and walk of the bias, SI, of sensors of which nothing is known."""

_QUANTITY: Final = {"gyro": "angular rate", "accel": "acceleration"}

_FLAT: Final = 0.664
"""The flat part of an Allan deviation over the bias instability."""

_HORIZON: Final = 100.0
"""Seconds of flicker noise that a walk is to cover."""

Axes = tuple[float, float, float]
Models = NoiseModel | Sequence[NoiseModel]


def densities(sensor: str, model: Models | None) -> tuple[Axes, Axes]:
    """Return white noise and walk of the bias of three axes.

    The walk is the larger of the rate random walk and of the one that grows in 100 s as far as
    the bias instability; that of a consumer sensor where neither is known.

    Parameters
    ----------
    sensor : {"gyro", "accel"}
        Whose noise it is.
    model : NoiseModel or sequence of three, or None
        Of all axes, or of each; None is a consumer sensor.

    Returns
    -------
    white, walk : tuple of three floats
        rad/s/sqrt(Hz) and rad/s/sqrt(s), of an accelerometer m/s^2 instead of rad/s.

    Raises
    ------
    TypeError
        If it is no model.
    ValueError
        If a model is of another quantity, or its white noise is not known.
    """
    if model is None:
        white, walk = _CONSUMER[sensor]
        return (white,) * 3, (walk,) * 3
    models = [model] * 3 if isinstance(model, NoiseModel) else list(model)
    if len(models) != 3 or not all(isinstance(one, NoiseModel) for one in models):
        raise TypeError(f"{sensor} must be a NoiseModel or three of them, one an axis")
    found = [_of_axis(sensor, one) for one in models]
    (x, y, z), (a, b, c) = ([one[i] for one in found] for i in range(2))
    return (x, y, z), (a, b, c)


def _of_axis(sensor: str, model: NoiseModel) -> tuple[float, float]:
    if model.quantity not in (_QUANTITY[sensor], "unknown"):
        raise ValueError(
            f"{sensor} must be a NoiseModel of {_QUANTITY[sensor]}, got one of {model.quantity}"
        )
    if not model.angle_random_walk.known:
        raise ValueError(
            f"{sensor}: the model has no angle_random_walk, the white noise that a filter needs"
        )
    walks = []
    if model.rate_random_walk.known:
        walks.append(float(model.rate_random_walk))
    if model.bias_instability.known:
        walks.append(_FLAT * float(model.bias_instability) * math.sqrt(3.0 / _HORIZON))
    return float(model.angle_random_walk), max(walks, default=_CONSUMER[sensor][1])
