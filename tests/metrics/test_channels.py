"""What all metrics of two series share: channels, layouts, missing samples, refusals."""

import math

import numpy as np
import pytest

from support.signals import RATE, white
from zerorate import metrics

TWO_ARRAYS = {
    "reduction": metrics.reduction,
    "mean_shift": metrics.mean_shift,
    "rmse": metrics.rmse,
    "regret": lambda x, y: metrics.regret(y, x, 1.1 * np.asarray(x)),
    "coasting_error": lambda x, y: metrics.coasting_error(x, y, RATE, 0.1),
    "delay": lambda x, y: metrics.delay(x, y, RATE, 0.1),
    "nis": lambda x, y: metrics.nis(x, np.asarray(y) ** 2 + 1.0),
    "coverage": lambda x, y: metrics.coverage(x, np.abs(y)),
    "settling_time": lambda x, y: metrics.settling_time(x, y, 0.4, RATE),
    "motion_error": lambda x, y: metrics.motion_error(x, y, RATE, 0.1, raw=x).rmse_lowpass,
    "best_ema": lambda x, y: metrics.best_ema(x, RATE, truth=y).error,
}
BY_NAME = pytest.mark.parametrize("metric", TWO_ARRAYS.values(), ids=TWO_ARRAYS)


@BY_NAME
def test_channels_are_measured_alone(metric):
    x = np.cumsum(white(500, channels=3), axis=0)
    y = x + 0.1 * white(500, seed=2, channels=3)
    together = metric(x, y)
    assert together.shape == (3,)
    assert together.tolist() == [metric(x[:, i], y[:, i]) for i in range(3)]
    assert type(metric(x[:, 0], y[:, 0])) is float


@BY_NAME
def test_any_array_like_and_layout(metric):
    x = np.cumsum(white(400)).round(1)
    y = np.roll(x, 2)
    expected = metric(x, y)
    assert metric(x.tolist(), y.tolist()) == expected
    assert metric(np.repeat(x, 2)[::2], y) == expected
    assert metric(x[:, None], y[:, None]).tolist() == [expected]


@BY_NAME
def test_shapes_must_agree(metric):
    with pytest.raises(ValueError, match="shape"):
        metric(np.ones((10, 2)), np.ones((10, 3)))
    with pytest.raises(ValueError, match="shape"):
        metric(np.ones((10, 2, 2)), np.ones((10, 2, 2)))


@BY_NAME
def test_empty_and_all_missing_are_refused(metric):
    with pytest.raises(ValueError, match="is empty"):
        metric([], [])
    with pytest.raises(ValueError, match=r"no sample is present|no window"):
        metric(np.full(100, np.nan), np.ones(100))


@BY_NAME
def test_infinite_is_missing(metric):
    x = np.cumsum(white(500))
    y = x + 0.1 * white(500, seed=2)
    as_nan, as_inf = x.copy(), x.copy()
    as_nan[[30, 200, 201]] = np.nan
    as_inf[[30, 200, 201]] = [np.inf, -np.inf, np.inf]
    assert metric(as_nan, y) == metric(as_inf, y)
    assert math.isfinite(metric(as_nan, y))
