"""Measures of methods on a sensor whose orientation is known."""

import math
from collections.abc import Callable, Iterator, Sequence
from functools import partial
from typing import Final

import numpy as np

from zerorate import metrics
from zerorate.faults import given, said
from zerorate.geometry import rotations
from zerorate.record import Log, LogError
from zerorate.tasks.compare.measures import Row, consistency, if_possible
from zerorate.tasks.compare.methods import (
    HINDSIGHT,
    AxisResult,
    Chosen,
    first_rest,
    name_of,
    on_axis,
)
from zerorate.tasks.compare.trial import Orientation, Trial
from zerorate.tasks.compare.turning import MOVING
from zerorate.types import Booleans, Floats

Growth = Callable[[str, Floats], dict[str, float]]

HORIZONS: Final = (1.0, 10.0, 60.0)
"""Seconds to integrate."""

_FIRST_REST: Final = "first rest"

_SPEED_OVER: Final = 0.2
"""Seconds over which the reference's speed is taken."""


def orientation_rows(
    recording: Trial, truth: Orientation, methods: Sequence[Chosen], seen: Floats
) -> Iterator[Row]:
    """Yield the measures of every method, the axes together.

    A best average in hindsight is not among them: it would have to be chosen for three axes.

    Parameters
    ----------
    recording, truth : Trial, Orientation
        What methods are judged by.
    methods : sequence of str or OwnMethod
        What is judged.
    seen : ndarray, shape (n, 3)
        What they are fed with: the record's data, or a contaminated copy.
    """
    log = recording.log
    if log.channels != 3:
        raise LogError(
            said(
                f"{recording.source}: orientation needs three gyros, got {', '.join(log.names)}; "
                "choose with ",
                given("columns"),
            )
        )
    # Where the reference is missing it is taken to turn.
    turns = ~(turning_speed(truth.quaternions, log.rate, _SPEED_OVER) <= MOVING)
    known = [method for method in methods if method != HINDSIGHT]
    for method in (*known[:1], _FIRST_REST, *known[1:]):
        found = [_on_axis(method, np.ascontiguousarray(z), log) for z in seen.T]
        growth = partial(_growth, truth.quaternions, log.rate)
        values = _measured(log.data, found, growth) | _consistency(found, turns)
        causal = all(one.causal for one in found)
        yield Row(recording.source, "all", name_of(method), recording.angle, values, causal)


def _on_axis(method: Chosen, z: Floats, log: Log) -> AxisResult:
    if method == _FIRST_REST:
        return first_rest(z, log.rate)
    return on_axis(method, z, log.rate, _no_gain, log.unit)


def _no_gain() -> float:
    raise ValueError("there is no best average of three axes at once")


def _measured(raw: Floats, found: list[AxisResult], growth: Growth) -> dict[str, float]:
    biases = [one.bias for one in found if one.bias is not None]
    values = growth("growth", raw - np.column_stack(biases)) if biases else {}
    smooth = [one.smooth for one in found if one.smooth is not None]
    if smooth:
        values |= growth("smooth_growth", np.column_stack(smooth))
    return values


def _growth(quaternions: Floats, rate: float, name: str, rates: Floats) -> dict[str, float]:
    measure = partial(metrics.orientation_error_growth, rates, quaternions, rate)
    horizons = {f"{name}_{horizon:g}": (horizon,) for horizon in HORIZONS}
    return {key: if_possible(partial(measure, horizons=h)) for key, h in horizons.items()}


def _consistency(found: list[AxisResult], moving: Booleans) -> dict[str, float]:
    parts = {"nis_rest": ~moving, "nis_motion": moving}
    return {
        name: float(np.mean([consistency(one, where) for one in found]))
        for name, where in parts.items()
    }


def turning_speed(quaternions: Floats, rate: float, over: float) -> Floats:
    """Return how fast a reference turns, taken over so many seconds, rad/s.

    NaN at the ends and where it is missing.
    """
    span = max(1, round(over * rate))
    q = rotations.unit(quaternions)
    turned = rotations.angle(rotations.product(rotations.inverse(q[:-span]), q[span:]))
    speed = np.full(len(q), math.nan)
    speed[span // 2 : span // 2 + turned.size] = turned * rate / span
    return speed
