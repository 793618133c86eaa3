"""What each method makes of one axis."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
import numpy.typing as npt

from zerorate import metrics
from zerorate._native import DriftFilter, Trace
from zerorate.metrics import BestEma
from zerorate.run.replay.history import Recorder, memory

__all__ = ["FIRST_REST", "METHODS", "Answer", "answer", "first_rest"]

Floats = npt.NDArray[np.float64]
Flags = npt.NDArray[np.bool_]

METHODS: Final = ("raw", "mean", "ema", "kf", "akf", "fading", "fading+hold", "auto")
"""What is compared unless something else is asked for; ``+hold`` learns at rest only."""

FIRST_REST: Final = 10.0
"""Seconds at the start whose mean is taken for the bias."""

_BLOCKS: Final = 64


@dataclass(frozen=True, eq=False)
class Answer:
    """What a method answers to one axis of n samples.

    Attributes
    ----------
    estimate : ndarray, shape (n,)
        What is held when coasting: drift, or the smoothed rate of a sensor at rest.
    bias : ndarray, shape (n,)
        What is taken off the raw rate.
    smooth : ndarray or None
        The rate of a method that smooths, for use in place of the raw one; NaN where that is
        missing, for a prediction is no measurement.
    memory : float
        Time in which the estimate makes 63 % of a step, s; infinite if that time keeps growing,
        NaN if it is not known.
    sigma : ndarray or None
        Standard deviation of the bias.
    at_rest : ndarray of bool or None
        Whether the method took the sensor to be at rest.
    innovation, innovation_variance : ndarray or None
        Of a Kalman filter.
    """

    estimate: Floats
    bias: Floats
    smooth: Floats | None = None
    memory: float = np.nan
    sigma: Floats | None = None
    at_rest: Flags | None = None
    innovation: Floats | None = None
    innovation_variance: Floats | None = None


def answer(method: str, z: Floats, rate: float, ema: Callable[[], BestEma]) -> Answer:
    """Return what a method makes of one axis.

    Parameters
    ----------
    method : str
        One of `METHODS`, or any other method of `zerorate.DriftFilter`.
    z : ndarray, shape (n,)
        Raw rates.
    rate : float
        Samples per second, Hz.
    ema : callable
        Finds the best exponential moving average in hindsight, by what counts for this record.

    Raises
    ------
    ValueError
        If the filter knows no such method.
    """
    if method == "raw":
        return Answer(z, np.zeros_like(z), memory=0.0)
    if method == "mean":
        mean = metrics.running_mean(z)
        return Answer(mean, mean, memory=np.inf)
    if method == "ema":
        best = ema()
        return Answer(best.estimate, best.estimate, memory=1.0 / (float(best.gain) * rate))
    return _filtered(method, z, rate)


def first_rest(z: Floats, rate: float) -> Answer:
    """Return the bias of a user who lets the sensor rest for ten seconds at the start."""
    start = z[: max(1, round(FIRST_REST * rate))]
    present = start[np.isfinite(start)]
    bias = np.full(z.shape, present.mean() if present.size else np.nan)
    return Answer(bias, bias)


def _filtered(method: str, z: Floats, rate: float) -> Answer:
    # The filter itself says which methods it knows.
    name, held, _ = method.partition("+hold")
    arguments: dict[str, Any] = {"method": name} | ({"motion": "hold"} if held else {})
    filter_ = DriftFilter(rate, channels=1, **arguments)
    recorder, parts = Recorder(), []
    # The traces of a long record at once would fill the memory with what nobody reads.
    for block in np.array_split(z[:, np.newaxis], min(_BLOCKS, z.size)):
        parts.append(_readings(filter_.trace(block)))
        recorder.take(filter_)
    found: dict[str, Any]
    found = {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}
    if filter_.order is None:
        gain = float(filter_.gain[0, 0])
        return Answer(**found, memory=1.0 / (gain * rate) if gain > 0.0 else np.nan)
    seconds = float(memory(recorder.history(), filter_.order, rate)[0])
    smooth = np.where(np.isfinite(z), found["estimate"], np.nan)
    return Answer(**found, smooth=smooth, memory=seconds)


_READINGS: Final = {
    "estimate": "estimate",
    "bias": "bias",
    "bias_sigma": "sigma",
    "at_rest": "at_rest",
    "innovation": "innovation",
    "innovation_variance": "innovation_variance",
}


def _readings(trace: Trace) -> dict[str, Any]:
    """Return what of it is kept, of the one channel."""
    return {own: getattr(trace, name)[:, 0] for name, own in _READINGS.items()}
