"""White noise smaller than the step of the samples, from the number of samples at each level."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final

import numpy as np

from zerorate._native import log_normal_cdf
from zerorate.noise.coefficient import Coefficient
from zerorate.noise.fit import FittedModel, coefficient_of
from zerorate.noise.quantities import UNKNOWN, si_unit
from zerorate.types import Floats

_MAX_LEVEL_SHARE: Final = 0.25
"""Largest ratio of the number of levels to the number of samples of a stepped record."""
_FINE_DEVIATION: Final = 0.58
"""Standard deviation over the step above which the samples' spectrum is the noise's spectrum."""
_LOCAL_S: Final = 2.0
_MIN_LOCAL_SAMPLES: Final = 100
_WINDOW_S: Final = 10.0
_MIN_WINDOW_SAMPLES: Final = 20
_CORRELATION_SAMPLES: Final = 200
_LAGS: Final = 5
_REACH: Final = 4
_DEVIATIONS: Final = np.geomspace(0.05, 1.0, 25)
_FARTHEST: Final = 1.5
_LEVEL_STEP: Final = 0.05
"""Step of the levels that are tried for a window, over the standard deviation."""
_MAX_LOSS: Final = 2.71
"""Twice the loss of log likelihood at a one-sided bound of 95 %."""
_MODEL_ERROR: Final = 0.02
"""Relative reduction of the standard deviation by the fit of a level to each window."""
_MIN_DEVIATION: Final = 0.18
"""Standard deviation over the step below which only a bound is stated, because too few samples
leave a level.
"""
_FEW_LEVELS_ERROR: Final = 0.1
"""The same reduction for standard deviations near this limit."""
_NOTABLE_ROUNDING: Final = 0.02
_ONE_SIDED_95: Final = 1.6448536269514722


@dataclass(frozen=True)
class Coarse:
    """Noise of samples with a step larger than the noise.

    Parameters
    ----------
    step : float
        Step of the samples, in their unit.
    deviation : Coefficient or None
        Standard deviation of a sample's white noise, in the unit of the samples. None if the noise
        is not white; nothing is reported then.
    """

    step: float
    deviation: Coefficient | None


def find_coarse(record: Floats, rate: float) -> Coarse | None:
    """Return the noise of one axis if its step exceeds the noise, otherwise None."""
    present = record[np.isfinite(record)]
    step = find_step(present)
    if step == 0.0 or _local_deviation(present, rate) > _FINE_DEVIATION * step:
        return None
    levels = np.rint((present - present[0]) / step)
    if not _looks_white(levels):
        return Coarse(step, None)
    return Coarse(step, _deviation_of_counts(levels, rate).scaled(step))


def coarse_model(coarse: Coarse, rate: float, unit: str) -> FittedModel | None:
    """Return the model of white noise below the step, None if it is not identifiable."""
    if coarse.deviation is None:
        return None
    factor, quantity = si_unit(unit)
    white = coarse.deviation.scaled(factor / math.sqrt(rate))
    return FittedModel(angle_random_walk=white, quantity=quantity, method="counts")


def describe_coarse(coarse: Coarse, rate: float, unit: str) -> str:
    """Return the sentence on a step larger than the noise, with advice."""
    named = "" if unit == UNKNOWN else f" {unit}"
    steps = f"samples come in steps of {coarse.step:.3g}{named}, wider than the noise: "
    advice = "; log more decimals, or a smaller range"
    model = coarse_model(coarse, rate, unit)
    if model is None:
        return f"{steps}as the noise is not white, N is not identifiable{advice}"
    white, unit_of_white = coefficient_of(model, "angle_random_walk"), ""
    if model.quantity != "unknown":
        unit_of_white = " deg/sqrt(h)" if model.quantity == "angular rate" else " m/s/sqrt(h)"
        white = model.in_units(unit_of_white.strip())
    if not white.identifiable:
        return f"{steps}N is below {white.upper_bound:.2g}{unit_of_white}{advice}"
    return f"{steps}N is read from how often each step occurs{advice}"


def describe_rounding(record: Floats, rate: float) -> str:
    """Return a note if rounding contributes more than 2 % to N, otherwise ""."""
    present = record[np.isfinite(record)]
    step = find_step(present)
    if step == 0.0:
        return ""
    share = step**2 / 12.0 / _local_deviation(present, rate) ** 2
    added = 1.0 / math.sqrt(1.0 - share) - 1.0 if share < 1.0 else math.inf
    if added <= _NOTABLE_ROUNDING:
        return ""
    return f"rounding to steps of {step:.3g} adds {100.0 * added:.0f} % to the white noise"


def find_step(present: Floats) -> float:
    """Return the step of samples, 0 without a step or if all samples are equal."""
    levels, counts = np.unique(present, return_counts=True)
    if levels.size < 2 or levels.size > _MAX_LEVEL_SHARE * present.size:
        return 0.0
    distances, weights = np.diff(levels), np.minimum(counts[1:], counts[:-1])
    order = np.argsort(distances)
    total = np.cumsum(weights[order])
    return float(distances[order][np.searchsorted(total, 0.5 * total[-1])])


def _local_deviation(present: Floats, rate: float) -> float:
    """Return the standard deviation about a line in short windows."""
    width = min(max(round(_LOCAL_S * rate), _MIN_LOCAL_SAMPLES), present.size)
    if width < 3:
        return math.inf
    windows = present[: present.size // width * width].reshape(-1, width)
    windows = windows - windows.mean(axis=1, keepdims=True)
    line = np.arange(width) - 0.5 * (width - 1)
    slopes = windows @ line / (line @ line)
    squares = np.sum((windows - slopes[:, None] * line) ** 2, axis=1) / (width - 2)
    return math.sqrt(float(np.mean(squares)))


def _looks_white(levels: Floats) -> bool:
    width = min(_CORRELATION_SAMPLES, levels.size)
    windows = levels[: levels.size // width * width].reshape(-1, width)
    windows = windows - windows.mean(axis=1, keepdims=True)
    square = float(np.sum(windows**2))
    if square == 0.0:
        return True
    # Correlation of samples from subtracting the mean of each window.
    limit = 0.02 + 4.0 / math.sqrt(levels.size) + 1.0 / width
    lags = range(1, min(_LAGS, width - 1) + 1)
    return all(
        abs(float(np.sum(windows[:, lag:] * windows[:, :-lag]))) <= limit * square for lag in lags
    )


def _deviation_of_counts(levels: Floats, rate: float) -> Coefficient:
    """Return the standard deviation over the step with the largest likelihood of the counts."""
    counts = _count_levels(levels, max(round(_WINDOW_S * rate), _MIN_WINDOW_SAMPLES))
    likelihood = np.array([_likelihood(counts, deviation) for deviation in _DEVIATIONS])
    loss = 2.0 * (likelihood.max() - likelihood)
    best = int(np.argmin(loss))
    above = np.flatnonzero((loss > _MAX_LOSS) & (np.arange(loss.size) > best))
    upper = _crossing(loss, above[0] - 1, above[0]) if above.size else float(_DEVIATIONS[-1])
    is_inside = 0 < best < loss.size - 1
    value, curvature = _summit(loss, best) if is_inside else (upper, math.nan)
    has_few_levels = value < _MIN_DEVIATION
    upper *= 1.0 + (_FEW_LEVELS_ERROR if has_few_levels else _MODEL_ERROR)
    if has_few_levels or not is_inside or loss[0] <= _MAX_LOSS:
        return Coefficient(0.0, upper / _ONE_SIDED_95, False, upper)
    error = math.hypot(math.sqrt(2.0 / curvature) * value, _MODEL_ERROR * value)
    return Coefficient(value, error, True, value + _ONE_SIDED_95 * error)


def _count_levels(levels: Floats, width: int) -> Floats:
    """Return the counts of levels near the most frequent one, shape (windows, 2 reach + 1)."""
    counts = []
    for first in range(0, levels.size, width):
        window = levels[first : first + width]
        values, often = np.unique(window, return_counts=True)
        offsets = np.clip(values - values[np.argmax(often)], -_REACH, _REACH) + _REACH
        counts.append(np.bincount(offsets.astype(int), often, 2 * _REACH + 1))
    return np.array(counts)


def _likelihood(counts: Floats, deviation: float) -> float:
    """Return the log likelihood with the best level of each window."""
    levels = np.arange(-_FARTHEST, _FARTHEST, _LEVEL_STEP * deviation)
    edges = np.arange(-_REACH - 0.5, _REACH + 1.0)
    below = np.exp(log_normal_cdf(((edges - levels[:, None]) / deviation).ravel()))
    below = below.reshape(levels.size, edges.size)
    log_shares = np.log(np.maximum(np.diff(below, axis=1), 1e-12))
    trials = counts @ log_shares.T
    best = np.clip(np.argmax(trials, axis=1), 1, levels.size - 2)
    before, summit, after = (
        np.take_along_axis(trials, best[:, None] + side, axis=1)[:, 0] for side in (-1, 0, 1)
    )
    bend = np.maximum(2.0 * summit - before - after, 1e-9)
    return float(np.sum(summit + (after - before) ** 2 / (8.0 * bend)))


def _crossing(loss: Floats, i: int, j: int) -> float:
    """Return the standard deviation between two values at which the loss reaches the bound's."""
    share = (_MAX_LOSS - loss[i]) / (loss[j] - loss[i])
    return float(_DEVIATIONS[i] * (_DEVIATIONS[j] / _DEVIATIONS[i]) ** share)


def _summit(loss: Floats, best: int) -> tuple[float, float]:
    """Return the standard deviation of the smallest loss, and the curvature by its logarithm."""
    x = np.log(_DEVIATIONS[best - 1 : best + 2])
    square, slope, _ = np.polyfit(x - x[1], loss[best - 1 : best + 2], 2)
    return float(math.exp(x[1] - 0.5 * slope / square)), float(2.0 * square)
