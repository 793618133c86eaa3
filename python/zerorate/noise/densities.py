"""Noise densities for the navigation filter from a noise model."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    from zerorate.noise.model import NoiseModel

_QUANTITY: Final = {"gyro": "angular rate", "accel": "acceleration"}

_FLICKER_FLOOR: Final = 0.664
"""Flat part of an Allan deviation over the bias instability."""

_HORIZON_S: Final = 100.0
"""Time in which a random walk reaches the bias instability, s."""


def densities(model: NoiseModel, sensor: str) -> tuple[float, float | None]:
    """Return white noise and random walk of the bias, SI; None for an unknown random walk.

    The random walk is the larger of two: the rate random walk, and a walk that reaches the bias
    instability in 100 s.

    Parameters
    ----------
    model : NoiseModel
        Model of one axis.
    sensor : {"gyro", "accel"}
        Sensor of the model.

    Raises
    ------
    ValueError
        If the model is for another quantity, or its white noise is not known.
    """
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
        walks.append(_FLICKER_FLOOR * float(model.bias_instability) * math.sqrt(3.0 / _HORIZON_S))
    return float(model.angle_random_walk), max(walks, default=None)
