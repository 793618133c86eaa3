"""What a filter that tunes itself found the sensor to be, as noise coefficients."""

from typing import Final

import numpy as np
import numpy.typing as npt

from zerorate.noise.quantities import term_of
from zerorate.units import convert

__all__ = ["last_known", "noise_units"]

Floats = npt.NDArray[np.float64]

_RATES: Final = ("rad/s", "deg/s", "deg/h")


def last_known(values: Floats) -> Floats:
    """Return the last row's value of each column, or the last one before that is not NaN."""
    known = np.isfinite(values)
    last = len(values) - 1 - known[::-1].argmax(axis=0)
    found: Floats = values[last, np.arange(values.shape[1])]
    return found


def noise_units(unit: str) -> tuple[tuple[str, float], tuple[str, float]]:
    """Return unit and factor of the angle random walk and the rate random walk of a log's unit."""
    if unit not in _RATES:
        return (f"{unit} √s", 1.0), (f"{unit}/√s", 1.0)
    factor = convert(1.0, unit, "rad/s")
    terms = (term_of("angular rate", field) for field in ("angle_random_walk", "rate_random_walk"))
    first, second = (
        (t.shown.replace("sqrt(h)", "√h"), factor * convert(1.0, t.unit, t.shown)) for t in terms
    )
    return first, second
