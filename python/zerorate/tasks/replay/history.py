"""History of the chosen filter: its state at some moments, time constant, learned noise."""

import math
from dataclasses import dataclass
from typing import Final

import numpy as np

from zerorate._native import DriftFilter
from zerorate.noise.quantities import term_of
from zerorate.types import Floats, Integers
from zerorate.units import convert

_LINEAR_MOMENTS: Final = 600
_MOMENTS_PER_DECADE: Final = 60
_STEP_FRACTION: Final = 1.0 - math.exp(-1.0)
_RATE_UNITS: Final = ("rad/s", "deg/s", "deg/h")


@dataclass(frozen=True, eq=False)
class History:
    """State of a filter of k axes at m moments; NaN during an axis' start-up.

    The filter's model has the order (p, q).

    Parameters
    ----------
    samples : ndarray of int64, shape (m,)
        Number of samples processed up to this moment, including missing samples.
    measurement_noise : ndarray, shape (m, k)
        Variance R, unit of the data squared.
    gain : ndarray, shape (m, k, p + 1)
        Kalman gain; its first component weights the newest sample. For "auto", the state is only
        the drift, and p and q are 0.
    coefficients : ndarray, shape (m, k, p + q + 1)
        ARMA model [φ…, θ…, c], c in the unit of the data.
    angle_random_walk : ndarray, shape (m, k)
        Learned density of the white noise, unit of the data times root second.
    rate_random_walk : ndarray, shape (m, k)
        Random walk of the drift learned by "auto", unit of the data per root second.
    bias, bias_sigma : ndarray, shape (m, k)
        Drift and its standard deviation, in the unit of the data.
    """

    samples: Integers
    measurement_noise: Floats
    gain: Floats
    coefficients: Floats
    angle_random_walk: Floats
    rate_random_walk: Floats
    bias: Floats
    bias_sigma: Floats


def moments(n: int) -> Integers:
    """Return increasing sample counts up to n, dense at the start while a filter learns.

    Six hundred are equally spaced for a linear time axis. Sixty per decade are for a logarithmic
    axis.
    """
    even = np.linspace(n / _LINEAR_MOMENTS, n, _LINEAR_MOMENTS)
    decades = int(np.ceil(np.log10(n)))
    rising = np.logspace(0.0, decades, decades * _MOMENTS_PER_DECADE + 1)
    both = np.ceil(np.concatenate((even, rising))).astype(np.int64)
    return np.unique(both[both <= n])


class Recorder:
    """Recorder of a history, moment by moment."""

    def __init__(self) -> None:
        self._samples: list[int] = []
        self._rows: list[tuple[Floats, ...]] = []

    def take(self, filter_: DriftFilter) -> None:
        """Record the state of the filter."""
        ready = filter_.ready
        each = ready[:, np.newaxis]
        row = (
            np.where(ready, filter_.measurement_noise, np.nan),
            np.where(each, filter_.gain, np.nan),
            np.where(each, filter_.coefficients, np.nan),
            filter_.angle_random_walk,
            filter_.rate_random_walk,
            np.where(ready, filter_.bias, np.nan),
            np.where(ready, filter_.bias_sigma, np.nan),
        )
        self._samples.append(filter_.samples_seen)
        self._rows.append(row)

    def history(self) -> History:
        """Return the recorded history."""
        columns = (np.stack(column) for column in zip(*self._rows, strict=True))
        return History(np.array(self._samples, dtype=np.int64), *columns)


def time_constants(history: History, order: tuple[int, int] | None, rate: float) -> Floats:
    """Return the time in which each axis' estimate makes 63 % of a step, s.

    The filter's state at the end is used. For a published method, the gain is the median over the
    second half of the record, because a fading gain varies.

    Parameters
    ----------
    history : History
        History of a filter of k axes.
    order : (int, int) or None
        Orders (p, q) of the model. None for a random walk, an exponential average; its gain is the
        share of a small step that one sample corrects.
    rate : float
        Samples per second, Hz.

    Returns
    -------
    ndarray of float64, shape (k,)
        Time constants, at least one sample interval. NaN if the start-up is not over; infinity if
        the estimate does not make 63 % within the record.
    """
    late = history.samples > history.samples[-1] // 2
    gains = history.gain[late].swapaxes(0, 1)
    max_samples = int(history.samples[-1])
    if order is None:
        samples = [_random_walk_samples(gain[:, 0], max_samples) for gain in gains]
    else:
        samples = [
            _model_samples(coefficients, _median_gain(gain), order[0], max_samples)
            for coefficients, gain in zip(history.coefficients[-1], gains, strict=True)
        ]
    return np.array(samples, dtype=np.float64) / rate


def _median_gain(gain: Floats) -> Floats:
    """Return the median gain, shape (m, p + 1), without the zeros of missing samples."""
    used = gain[gain[:, 0] != 0.0]
    median: Floats = np.median(used, axis=0) if used.size else np.full(gain.shape[1], np.nan)
    return median


def _random_walk_samples(gain: Floats, max_samples: int) -> float:
    """Return 1/K for the last gain of a present sample."""
    used = gain[gain > 0.0]
    samples = 1.0 / float(used[-1]) if used.size else math.nan
    return math.inf if samples > max_samples else samples


def _model_samples(coefficients: Floats, gain: Floats, p: int, max_samples: int) -> float:
    """Return the first number of samples with a response of 63 %, found by bisection."""
    if not (np.isfinite(coefficients).all() and np.isfinite(gain).all()):
        return math.nan
    step = _step_matrix(coefficients[:p], gain)
    high = 1
    while not _step_response(step, high) >= _STEP_FRACTION:
        high *= 2
        if high > 2 * max_samples:
            return math.inf
    low = high // 2
    while high - low > 1:
        middle = (low + high) // 2
        low, high = (
            (low, middle) if _step_response(step, middle) >= _STEP_FRACTION else (middle, high)
        )
    return float(high)


def _step_matrix(phi: Floats, gain: Floats) -> Floats:
    """Return one step of x = (I - K H) A x + K z, with the input z appended to the state."""
    n = phi.size + 1
    transition = np.zeros((n, n))
    transition[0, : phi.size] = phi
    transition[0, -1] = 1.0
    transition[1 : phi.size, : phi.size - 1] = np.eye(phi.size - 1)
    transition[-1, -1] = 1.0
    step = np.eye(n + 1)
    step[:n, :n] = transition - np.outer(gain, transition[0])
    step[:n, n] = gain
    return step


def _step_response(step: Floats, samples: int) -> float:
    with np.errstate(all="ignore"):
        return float(np.linalg.matrix_power(step, samples)[0, -1])


def last_finite(values: Floats) -> Floats:
    """Return the last value of each column that is not NaN."""
    finite = np.isfinite(values)
    last = len(values) - 1 - finite[::-1].argmax(axis=0)
    result: Floats = values[last, np.arange(values.shape[1])]
    return result


def noise_units(unit: str) -> tuple[tuple[str, float], tuple[str, float]]:
    """Return units and factors of angle random walk and rate random walk for a log's unit."""
    if unit not in _RATE_UNITS:
        return (f"{unit} √s", 1.0), (f"{unit}/√s", 1.0)
    factor = convert(1.0, unit, "rad/s")
    terms = (term_of("angular rate", field) for field in ("angle_random_walk", "rate_random_walk"))
    first, second = (
        (t.shown.replace("sqrt(h)", "√h"), factor * convert(1.0, t.unit, t.shown)) for t in terms
    )
    return first, second
