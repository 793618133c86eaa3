"""How long a filter takes to follow a step, which is the price of its quiet output."""

import math
from typing import Final

import numpy as np
import numpy.typing as npt

from zerorate.run.replay.history import History

__all__ = ["memory"]

Floats = npt.NDArray[np.float64]

_REACHED: Final = 1.0 - math.exp(-1.0)


def memory(history: History, order: tuple[int, int] | None, rate: float) -> Floats:
    """Return the time in which each axis' estimate makes 63 % of a step, s.

    The filter is taken as it stood at the end. Of a published method the gain is the median over
    the record's second half, since a fading gain goes up and down.

    Parameters
    ----------
    history : History
        Of a filter of k axes.
    order : (int, int) or None
        Orders (p, q) of its model; None for a random walk, which is an exponential average: the
        gain is the part of a small step that it makes in a sample.
    rate : float
        Samples per second, Hz.

    Returns
    -------
    ndarray of float64, shape (k,)
        One sample's time at least. NaN where the filter was not started up, infinity where its
        estimate would not get so far within the record.
    """
    late = history.samples > history.samples[-1] // 2
    gains = history.gain[late].swapaxes(0, 1)
    most = int(history.samples[-1])
    if order is None:
        samples = [_samples_of_walk(gain[:, 0], most) for gain in gains]
    else:
        samples = [
            _samples(coefficients, _middle(gain), order[0], most)
            for coefficients, gain in zip(history.coefficients[-1], gains, strict=True)
        ]
    return np.array(samples, dtype=np.float64) / rate


def _middle(gain: Floats) -> Floats:
    """Return the median of shape (m, p + 1), without the zeros of missing samples."""
    used = gain[gain[:, 0] != 0.0]
    median: Floats = np.median(used, axis=0) if used.size else np.full(gain.shape[1], np.nan)
    return median


def _samples_of_walk(gain: Floats, most: int) -> float:
    """Return 1/K for the last gain that was not that of a missing sample."""
    used = gain[gain > 0.0]
    samples = 1.0 / float(used[-1]) if used.size else math.nan
    return math.inf if samples > most else samples


def _samples(coefficients: Floats, gain: Floats, p: int, most: int) -> float:
    """Return the first sample count, found by halving, at which the response is reached."""
    if not (np.isfinite(coefficients).all() and np.isfinite(gain).all()):
        return math.nan
    step = _step_matrix(coefficients[:p], gain)
    high = 1
    while not _response(step, high) >= _REACHED:
        high *= 2
        if high > 2 * most:
            return math.inf
    low = high // 2
    while high - low > 1:
        middle = (low + high) // 2
        low, high = (low, middle) if _response(step, middle) >= _REACHED else (middle, high)
    return float(high)


def _step_matrix(phi: Floats, gain: Floats) -> Floats:
    """Return one step of x = (I - K H) A x + K z, the input z appended to the state."""
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


def _response(step: Floats, samples: int) -> float:
    with np.errstate(all="ignore"):
        return float(np.linalg.matrix_power(step, samples)[0, -1])
