"""The numbers of one axis before or after a filter."""

import math

import numpy as np
import numpy.typing as npt

from zerorate import metrics
from zerorate.replay.result import Score

__all__ = ["score"]

Floats = npt.NDArray[np.float64]


def score(
    axis: str,
    method: str,
    raw: Floats,
    series: Floats,
    truth: Floats | None,
    rate: float,
    horizons: tuple[float, ...],
) -> Score:
    """Measure one series of shape (n,), over the samples that are present in `raw`."""
    # Numbers near the largest double overflow when squared: the answer is then infinite.
    with np.errstate(over="ignore", invalid="ignore"):
        before, after = _present(raw, raw), _present(raw, series)
        spread = _deviation(before)
        deviation = _deviation(after)
        return Score(
            axis=axis,
            method=method,
            mean=float(after.mean()) if after.size else math.nan,
            deviation=deviation,
            reduction=deviation / spread if spread > 0.0 else math.nan,
            coasting=tuple(_coasting(raw, series, rate, horizon) for horizon in horizons),
            error=math.nan if truth is None else _error(truth, raw, series),
        )


def _present(raw: Floats, series: Floats) -> Floats:
    there = np.isfinite(raw)
    return series if there.all() else series[there]


def _deviation(z: Floats) -> float:
    if z.size == 0:
        return math.nan
    # The deviation of equal samples may come out as a rounding error instead of 0.
    return 0.0 if z.max() == z.min() else float(z.std())


def _coasting(raw: Floats, series: Floats, rate: float, horizon: float) -> float:
    if not 1 <= round(horizon * rate) < raw.size:
        return math.nan
    try:
        return float(metrics.coasting_error(raw, series, rate, horizon))
    except ValueError:
        return math.nan


def _error(truth: Floats, raw: Floats, series: Floats) -> float:
    wrong = _present(raw, series - truth)
    return math.sqrt(float(np.dot(wrong, wrong)) / wrong.size) if wrong.size else math.nan
