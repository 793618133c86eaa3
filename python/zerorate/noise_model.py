"""The noise of a gyro at rest, as the coefficients of IEEE Std 952-1997, annex C."""

import math
from dataclasses import dataclass, fields
from functools import reduce
from typing import Final

import numpy as np
import numpy.typing as npt

__all__ = ["FLICKER_FLOOR", "NoiseModel"]

FLICKER_FLOOR: Final = math.sqrt(2.0 * math.log(2.0) / math.pi)
"""Allan deviation of flicker noise over its bias instability B, 0.664."""

_SIGNED: Final = {"rate_ramp"}


@dataclass(frozen=True)
class NoiseModel:
    """Noise coefficients of a gyro at rest, in SI units; a term left at zero is absent.

    Parameters
    ----------
    angle_random_walk : float
        N in rad/s/sqrt(Hz): white noise of rate, two-sided density N^2.
    bias_instability : float
        B in rad/s: flicker noise, density B^2 / (2 pi f). The flat part of the Allan deviation
        lies at 0.664 B.
    rate_random_walk : float
        K in rad/s^2/sqrt(Hz), the same as rad/s/sqrt(s): density (K / (2 pi f))^2.
    rate_ramp : float
        R in rad/s^2: a drift of R t. The only term that may be negative.

    Raises
    ------
    ValueError
        If a coefficient is not a finite number, or negative where that means nothing.

    Notes
    -----
    `zerorate.units.convert` turns data-sheet units (deg/sqrt(h), deg/h) into these.

    Examples
    --------
    >>> model = NoiseModel(angle_random_walk=1e-4, bias_instability=2e-5)
    >>> [round(1e5 * float(s), 3) for s in model.allan_deviation([1.0, 1e4])]
    [10.088, 1.332]
    """

    angle_random_walk: float = 0.0
    bias_instability: float = 0.0
    rate_random_walk: float = 0.0
    rate_ramp: float = 0.0

    def __post_init__(self) -> None:
        """Refuse what is not a number; keep plain floats whatever was given."""
        for field in fields(self):
            value = _checked(field.name, getattr(self, field.name))
            object.__setattr__(self, field.name, value)

    def allan_deviation(self, taus: npt.ArrayLike) -> npt.NDArray[np.float64]:
        """Return the model's Allan deviation curve.

        Parameters
        ----------
        taus : array_like
            Averaging times in s, positive, any shape.

        Returns
        -------
        ndarray of float64, the shape of `taus`
            sqrt(N^2/tau + (2 ln 2/pi) B^2 + K^2 tau/3 + R^2 tau^2/2) in rad/s. The continuous
            curve: a sampled random walk lies above it by a factor sqrt(1 + 1/(2 m^2)) where
            tau is m samples.

        Raises
        ------
        ValueError
            If a tau is not positive and finite.
        """
        tau = np.asarray(taus, dtype=np.float64)
        if not np.all(np.isfinite(tau) & (tau > 0.0)):
            raise ValueError("averaging times must be positive and finite")
        terms = (
            self.angle_random_walk / np.sqrt(tau),
            np.full_like(tau, FLICKER_FLOOR * self.bias_instability),
            self.rate_random_walk * np.sqrt(tau / 3.0),
            abs(self.rate_ramp) * tau / math.sqrt(2.0),
        )
        return reduce(np.hypot, terms)


def _checked(name: str, value: object) -> float:
    try:
        number = float(value)  # type: ignore[arg-type]
    except (TypeError, ValueError):
        raise ValueError(f"{name} must be a number, got {value!r}") from None
    if not math.isfinite(number):
        raise ValueError(f"{name} must be finite, got {number}")
    if number < 0.0 and name not in _SIGNED:
        raise ValueError(f"{name} must not be negative, got {number}")
    return number
