"""Measures of methods on a sensor that turns next to a reference."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from zerorate import metrics
from zerorate.metrics import MotionError
from zerorate.metrics.motion import moved
from zerorate.record import LogError
from zerorate.tasks.compare.measures import Row, consistency, if_possible
from zerorate.tasks.compare.methods import AxisResult, Chosen, name_of, on_axis
from zerorate.tasks.compare.trial import Reference, Trial
from zerorate.types import Floats

MOVING: Final = math.radians(2.0)
"""rad/s: a reference that turns faster moves."""

_LATEST: Final = 0.5
"""Seconds by which a reference and a gyro may disagree on the time."""

_ENDS: Final = 4
"""Samples that a delay needs besides."""


@dataclass(frozen=True, eq=False)
class Fitted:
    """A reference in the unit, sign and time of the gyro that it belongs to.

    Attributes
    ----------
    axis : str
        The gyro of the log that follows the reference best.
    raw, rate : ndarray, shape (n,)
        Its output, and the reference.
    scale : float
        What one unit of the reference is worth in the gyro's.
    offset : float
        What the gyro shows when the reference does not turn.
    delay : float
        By how much the gyro is late, s.
    """

    axis: str
    raw: Floats
    rate: Floats
    scale: float
    offset: float
    delay: float

    def note(self, source: str, name: str) -> str:
        """Return what was fitted, as a sentence."""
        return (
            f"{source}: {name} fits {self.axis}: gyro = {self.scale:.4g} times the reference, late "
            f"by {1e3 * self.delay:.3g} ms; scale, sign and delay are taken out of the reference"
        )


def fitted(recording: Trial, reference: Reference) -> Fitted:
    """Return the reference as the gyro that follows it best would see it.

    Raises
    ------
    LogError
        If the record is too short, the reference constant, or no gyro follows it.
    """
    log = recording.log
    if not log.duration > 2.0 * _LATEST + _ENDS / log.rate:
        raise LogError(
            f"{recording.source}: motion needs more than {2.0 * _LATEST:g} s, "
            f"got {log.duration:g} s"
        )
    fits = [_fit(z, reference.rate) for z in log.data.T]
    best = int(np.argmax([abs(fit.correlation) for fit in fits]))
    z, fit = np.ascontiguousarray(log.data[:, best]), fits[best]
    try:
        late = float(metrics.delay(np.sign(fit.scale) * reference.rate, z, log.rate, _LATEST))
    except ValueError as error:
        raise LogError(f"{recording.source}: no gyro follows {reference.name}: {error}") from None
    timely = moved(reference.rate, late * log.rate)
    fit = _fit(z, timely)
    return Fitted(log.names[best], z, fit.scale * timely, fit.scale, fit.offset, late)


def turning_rows(
    recording: Trial, match: Fitted, methods: Sequence[Chosen], seen: Floats
) -> Iterator[Row]:
    """Yield the measures of every method on the gyro that the reference belongs to.

    Parameters
    ----------
    recording, match : Trial, Fitted
        What methods are judged by.
    methods : sequence of str or OwnMethod
        What is judged.
    seen : ndarray, shape (n, k)
        What they are fed with: the record's data, or a contaminated copy.
    """
    truth = match.raw - match.rate
    z = np.ascontiguousarray(seen[:, recording.log.names.index(match.axis)])

    def gain() -> float:
        return float(metrics.best_ema(match.raw, recording.log.rate, truth=truth).gain)

    for method in methods:
        found = on_axis(method, z, recording.log.rate, gain, recording.log.unit)
        values = _measured(found, match, recording.log.rate)
        label = name_of(method)
        yield Row(recording.source, match.axis, label, recording.angle, values, found.causal)


def _measured(found: AxisResult, match: Fitted, rate: float) -> dict[str, float]:
    compensated = None if found.bias is None else match.raw - found.bias
    moving = np.abs(match.rate) > MOVING
    return {
        **_motion("compensated", _error(match, compensated, rate)),
        **_motion("smooth", _error(match, found.smooth, rate)),
        "angle_drift": _angle_drift(match, compensated, rate),
        "nis_rest": consistency(found, ~moving & np.isfinite(match.rate)),
        "nis_motion": consistency(found, moving),
    }


def _error(match: Fitted, estimate: Floats | None, rate: float) -> MotionError | None:
    if estimate is None:
        return None
    return metrics.motion_error(match.rate, estimate, rate, raw=match.raw)


def _motion(name: str, error: MotionError | None) -> dict[str, float]:
    fields = ("rmse", "delay", "rmse_undelayed", "rmse_lowpass")
    return {
        f"{name}_{field}": math.nan if error is None else float(getattr(error, field))
        for field in fields
    }


def _angle_drift(match: Fitted, estimate: Floats | None, rate: float) -> float:
    """Return the largest error of the integrated angle."""
    if estimate is None:
        return math.nan
    wrong = estimate - match.rate
    present = wrong[np.isfinite(wrong)]
    return if_possible(lambda: np.abs(np.cumsum(present)).max() / rate)


@dataclass(frozen=True)
class _Line:
    scale: float
    offset: float
    correlation: float


def _fit(z: Floats, reference: Floats) -> _Line:
    """Return the straight line that leaves least of the gyro's output."""
    there = np.isfinite(z) & np.isfinite(reference)
    if not there.any():
        return _Line(0.0, 0.0, 0.0)
    x, y = reference[there], z[there]
    dx, dy = x - x.mean(), y - y.mean()
    power, total, both = (float(np.dot(a, b)) for a, b in ((dx, dx), (dy, dy), (dx, dy)))
    if not (power > 0.0 and total > 0.0):
        return _Line(0.0, float(y.mean()), 0.0)
    scale = both / power
    return _Line(scale, float(y.mean() - scale * x.mean()), both / math.sqrt(power * total))
