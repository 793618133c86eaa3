"""Measures of methods on a sensor with known orientation."""

import math
from collections.abc import Callable, Iterator, Sequence
from functools import partial
from typing import Final

import numpy as np

from zerorate import metrics
from zerorate.faults import keyword_argument, make_sentence
from zerorate.geometry import rotations
from zerorate.record import Log, LogError
from zerorate.tasks.compare.measures import Row, mean_nis, measure_or_nan
from zerorate.tasks.compare.methods import (
    HINDSIGHT_METHOD,
    AxisResult,
    MethodSpec,
    first_rest_bias,
    name_of,
    run_on_axis,
)
from zerorate.tasks.compare.trial import Orientation, Trial
from zerorate.tasks.compare.turning import MIN_MOVING_RATE_RAD_S
from zerorate.types import Booleans, Floats

Growth = Callable[[str, Floats], dict[str, float]]

HORIZONS: Final = (1.0, 10.0, 60.0)
"""Lengths of integration, s."""

_FIRST_REST_METHOD: Final = "first rest"

_SPEED_WINDOW_S: Final = 0.2
"""Window for the speed of the reference, s."""


def orientation_rows(
    recording: Trial, truth: Orientation, methods: Sequence[MethodSpec], samples: Floats
) -> Iterator[Row]:
    """Yield the measures of every method, for all axes together.

    There is no best moving average, because it would have one gain for three axes.

    Parameters
    ----------
    recording, truth : Trial, Orientation
        Recording, and its true orientation.
    methods : sequence of str or OwnMethod
        Methods to measure.
    samples : ndarray, shape (n, 3)
        Input of the methods: the recording's data, or a contaminated copy.
    """
    log = recording.log
    if log.channels != 3:
        raise LogError(
            make_sentence(
                f"{recording.source}: orientation needs three gyros, got {', '.join(log.names)}; "
                "choose with ",
                keyword_argument("columns"),
            )
        )
    # If the reference is missing, it counts as rotating.
    is_turning = ~(
        turning_speed(truth.quaternions, log.rate, _SPEED_WINDOW_S) <= MIN_MOVING_RATE_RAD_S
    )
    other_methods = [method for method in methods if method != HINDSIGHT_METHOD]
    for method in (*other_methods[:1], _FIRST_REST_METHOD, *other_methods[1:]):
        results = [_run_on_axis(method, np.ascontiguousarray(z), log) for z in samples.T]
        growth = partial(_growth, truth.quaternions, log.rate)
        values = _growth_values(log.data, results, growth) | _nis_values(results, is_turning)
        causal = all(result.causal for result in results)
        yield Row(recording.source, "all", name_of(method), recording.angle, values, causal)


def _run_on_axis(method: MethodSpec, z: Floats, log: Log) -> AxisResult:
    if method == _FIRST_REST_METHOD:
        return first_rest_bias(z, log.rate)
    return run_on_axis(method, z, log.rate, _refuse_gain, log.unit)


def _refuse_gain() -> float:
    raise ValueError("an average of three axes has no best gain")


def _growth_values(raw: Floats, results: list[AxisResult], growth: Growth) -> dict[str, float]:
    biases = [result.bias for result in results if result.bias is not None]
    values = growth("growth", raw - np.column_stack(biases)) if biases else {}
    smooth = [result.smooth for result in results if result.smooth is not None]
    if smooth:
        values |= growth("smooth_growth", np.column_stack(smooth))
    return values


def _growth(quaternions: Floats, rate: float, name: str, rates: Floats) -> dict[str, float]:
    measure = partial(metrics.orientation_error_growth, rates, quaternions, rate)
    horizons = {f"{name}_{horizon:g}": (horizon,) for horizon in HORIZONS}
    return {key: measure_or_nan(partial(measure, horizons=h)) for key, h in horizons.items()}


def _nis_values(results: list[AxisResult], moving: Booleans) -> dict[str, float]:
    parts = {"nis_rest": ~moving, "nis_motion": moving}
    return {
        name: float(np.mean([mean_nis(result, where) for result in results]))
        for name, where in parts.items()
    }


def turning_speed(quaternions: Floats, rate: float, window: float) -> Floats:
    """Return the angular speed of a reference over windows of this length (s), rad/s.

    NaN at the ends and where the reference is missing.
    """
    span = max(1, round(window * rate))
    q = rotations.unit(quaternions)
    angles = rotations.angle(rotations.product(rotations.inverse(q[:-span]), q[span:]))
    speed = np.full(len(q), math.nan)
    speed[span // 2 : span // 2 + angles.size] = angles * rate / span
    return speed
