"""The four numbers that every estimator wants, under its own names and in its own units."""

import math
from typing import TYPE_CHECKING, NamedTuple

from zerorate.noise.discrete import positive_rate
from zerorate.noise.quantities import Quantity, term_of

if TYPE_CHECKING:
    from zerorate.noise.model import NoiseModel

__all__ = ["Names", "Setting", "settings"]


class Names(NamedTuple):
    """What an estimator calls white noise and random walk of the gyro and the accelerometer."""

    gyro_noise: str
    gyro_walk: str
    accelerometer_noise: str
    accelerometer_walk: str


class Setting(NamedTuple):
    """One number of a configuration; not `identifiable` where it is an upper bound."""

    name: str
    value: float
    unit: str
    identifiable: bool

    @property
    def remark(self) -> str:
        """The unit, and whether the number is a bound only."""
        if self.identifiable:
            return self.unit
        return f"{self.unit}; upper bound, the record does not determine it"


def settings(
    names: Names,
    gyro: "NoiseModel",
    accelerometer: "NoiseModel | None",
    inflate: float,
    rate: float | None = None,
) -> list[Setting]:
    """Return the numbers times `inflate`: densities, or deviations per step at a rate in Hz."""
    factor = _positive("inflate", inflate)
    if rate is not None:
        factor *= math.sqrt(positive_rate(rate))
    found = []
    for model, noise, walk in (
        (_of(gyro, "angular rate"), names.gyro_noise, names.gyro_walk),
        (_of(accelerometer, "acceleration"), names.accelerometer_noise, names.accelerometer_walk),
    ):
        if model is not None:
            found.append(_setting(noise, model, "angle_random_walk", factor, rate))
            found.append(_setting(walk, model, "rate_random_walk", factor, rate))
    return found


def _setting(
    name: str, model: "NoiseModel", field: str, factor: float, rate: float | None
) -> Setting:
    coefficient = getattr(model, field)
    unit = term_of(model.quantity, field).unit
    if rate is not None:
        unit = unit.removesuffix("/sqrt(Hz)")
    return Setting(name, coefficient.conservative * factor, unit, coefficient.identifiable)


def _of(model: "NoiseModel | None", quantity: Quantity) -> "NoiseModel | None":
    if model is not None and model.quantity != quantity:
        raise ValueError(
            f"a model of {model.quantity} was given where one of {quantity} was expected: exports "
            "are called on the gyro's model, the other goes to accelerometer="
        )
    return model


def _positive(name: str, value: float) -> float:
    if not (math.isfinite(value) and value > 0.0):
        raise ValueError(f"{name} must be positive and finite, got {value}")
    return float(value)
