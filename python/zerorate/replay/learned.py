"""What a filter that tunes itself found the sensor to be, as noise coefficients."""

from typing import Final

import numpy as np
import numpy.typing as npt

from zerorate.noise.quantities import term_of
from zerorate.replay.history import History
from zerorate.units import convert

__all__ = ["angle_random_walk", "last_known", "noise_units", "rate_random_walk"]

Floats = npt.NDArray[np.float64]

_RATES: Final = ("rad/s", "deg/s", "deg/h")


def angle_random_walk(history: History, rate: float) -> Floats:
    """Return the density of the white noise, unit of the data times root second, shape (m, k).

    It follows from the gain K = P / (P + R), so it is the noise against which the drift is weighed:
    noise that averages out within a quarter of a second, which R of the samples has, is not in it.
    NaN in motion and where a sample is missing.
    """
    gain = history.gain[:, :, 0]
    with np.errstate(divide="ignore", invalid="ignore"):
        ratio = np.where(gain > 0.0, 1.0 / gain - 1.0, np.nan)
    return history.bias_sigma * np.sqrt(ratio / rate)


def rate_random_walk(history: History, rate: float) -> Floats:
    """Return how far the drift walks in a root second, unit of the data, shape (m, k)."""
    return np.sqrt(history.process_noise * rate)


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
