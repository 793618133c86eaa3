"""What methods make of a sensor whose orientation is known."""

import math
from collections.abc import Iterator, Sequence
from functools import partial
from typing import Final

import numpy as np
import numpy.typing as npt

from zerorate import metrics
from zerorate.compare.measures import consistency, if_possible
from zerorate.compare.methods import Answer, answer, first_rest
from zerorate.compare.recording import Recording
from zerorate.compare.result import Row
from zerorate.compare.turning import MOVING
from zerorate.io import LogError
from zerorate.metrics import BestEma, rotations

__all__ = ["HORIZONS", "orientation_rows"]

Floats = npt.NDArray[np.float64]
Flags = npt.NDArray[np.bool_]

HORIZONS: Final = (1.0, 10.0, 60.0)
"""Seconds to integrate."""

_FIRST_REST: Final = "first rest"

_SPEED_OVER: Final = 0.2
"""Seconds over which the reference's speed is taken."""


def orientation_rows(recording: Recording, methods: Sequence[str]) -> Iterator[Row]:
    """Yield the measures of every method, the axes together.

    A best average in hindsight is not among them: it would have to be chosen for three axes.
    """
    log, moving = recording.log, _moving(recording)
    if log.channels != 3:
        raise LogError(
            f"{recording.source}: orientation needs three gyros, got {', '.join(log.names)}; "
            "choose with columns="
        )
    known = [method for method in methods if method != "ema"]
    for method in (*known[:1], _FIRST_REST, *known[1:]):
        answers = [_answer(method, np.ascontiguousarray(z), log.rate) for z in log.data.T]
        values = _measured(recording, answers, moving)
        yield Row(recording.source, "all", method, recording.angle, values)


def _answer(method: str, z: Floats, rate: float) -> Answer:
    return first_rest(z, rate) if method == _FIRST_REST else answer(method, z, rate, _no_ema)


def _no_ema() -> BestEma:
    raise ValueError("there is no best average of three axes at once")


def _measured(recording: Recording, answers: list[Answer], moving: Flags) -> dict[str, float]:
    log = recording.log
    compensated = log.data - np.column_stack([found.bias for found in answers])
    smooth = [found.smooth for found in answers if found.smooth is not None]
    values = _growth("growth", recording, compensated)
    if len(smooth) == len(answers):
        values |= _growth("smooth_growth", recording, np.column_stack(smooth))
    return values | {
        "nis_rest": _mean(answers, ~moving),
        "nis_motion": _mean(answers, moving),
    }


def _growth(name: str, recording: Recording, rates: Floats) -> dict[str, float]:
    assert recording.quaternions is not None  # the kind of the recording says so
    measure = partial(
        metrics.orientation_error_growth, rates, recording.quaternions, recording.log.rate
    )
    horizons = {f"{name}_{horizon:g}": (horizon,) for horizon in HORIZONS}
    return {key: if_possible(partial(measure, horizons=h)) for key, h in horizons.items()}


def _mean(answers: list[Answer], where: Flags) -> float:
    return float(np.mean([consistency(found, where) for found in answers]))


def _moving(recording: Recording) -> Flags:
    """Return when the reference turns; where it is missing it is taken to."""
    assert recording.quaternions is not None  # the kind of the recording says so
    q = rotations.unit(recording.quaternions)
    span = max(1, round(_SPEED_OVER * recording.log.rate))
    speed = np.full(len(q), math.inf)
    turned = rotations.angle(rotations.product(rotations.inverse(q[:-span]), q[span:]))
    middle = slice(span // 2, span // 2 + turned.size)
    speed[middle] = np.where(np.isfinite(turned), turned * recording.log.rate / span, math.inf)
    return speed > MOVING
