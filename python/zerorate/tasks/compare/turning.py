"""Measures of methods on a rotating sensor with a reference."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from zerorate import metrics
from zerorate.metrics import MotionError
from zerorate.metrics.motion import shift_samples
from zerorate.record import LogError
from zerorate.tasks.compare.measures import Row, mean_nis, measure_or_nan
from zerorate.tasks.compare.methods import AxisResult, MethodSpec, name_of, run_on_axis
from zerorate.tasks.compare.trial import Reference, Trial
from zerorate.types import Floats

MIN_MOVING_RATE_RAD_S: Final = math.radians(2.0)
"""Smallest reference rate that counts as motion, rad/s."""

_MAX_DELAY_S: Final = 0.5
"""Largest time offset between reference and gyro, s."""

_DELAY_MARGIN_SAMPLES: Final = 4
"""Additional samples for the search of a delay."""


@dataclass(frozen=True, eq=False)
class ReferenceFit:
    """A reference in the unit, sign and time of its gyro.

    Attributes
    ----------
    axis : str
        Gyro of the log that agrees best with the reference.
    raw, rate : ndarray, shape (n,)
        Output of the gyro, and the reference.
    scale : float
        Gyro output per unit of reference.
    offset : float
        Gyro output when the reference does not rotate.
    delay : float
        Delay of the gyro, s.
    """

    axis: str
    raw: Floats
    rate: Floats
    scale: float
    offset: float
    delay: float

    def note(self, source: str, name: str) -> str:
        """Return a sentence on the result of the fit."""
        return (
            f"{source}: {name} fits {self.axis}: gyro = {self.scale:.4g} times the reference, late "
            f"by {1e3 * self.delay:.3g} ms; the reference is corrected for scale, sign and delay"
        )


def fit_reference(recording: Trial, reference: Reference) -> ReferenceFit:
    """Return the reference with unit, sign and time of the gyro that agrees best with it.

    Raises
    ------
    LogError
        If the record is too short, the reference is constant, or no gyro agrees with it.
    """
    log = recording.log
    if not log.duration > 2.0 * _MAX_DELAY_S + _DELAY_MARGIN_SAMPLES / log.rate:
        raise LogError(
            f"{recording.source}: motion needs more than {2.0 * _MAX_DELAY_S:g} s, "
            f"got {log.duration:g} s"
        )
    lines = [_fit_line(z, reference.rate) for z in log.data.T]
    best = int(np.argmax([abs(fit.correlation) for fit in lines]))
    z, fit = np.ascontiguousarray(log.data[:, best]), lines[best]
    try:
        delay = float(metrics.delay(np.sign(fit.scale) * reference.rate, z, log.rate, _MAX_DELAY_S))
    except ValueError as error:
        raise LogError(f"{recording.source}: no gyro follows {reference.name}: {error}") from None
    aligned = shift_samples(reference.rate, delay * log.rate)
    fit = _fit_line(z, aligned)
    return ReferenceFit(log.names[best], z, fit.scale * aligned, fit.scale, fit.offset, delay)


def turning_rows(
    recording: Trial, match: ReferenceFit, methods: Sequence[MethodSpec], samples: Floats
) -> Iterator[Row]:
    """Yield the measures of every method on the gyro of the reference.

    Parameters
    ----------
    recording, match : Trial, ReferenceFit
        Recording, and its reference from `fit_reference`.
    methods : sequence of str or OwnMethod
        Methods to measure.
    samples : ndarray, shape (n, k)
        Input of the methods: the recording's data, or a contaminated copy.
    """
    truth = match.raw - match.rate
    z = np.ascontiguousarray(samples[:, recording.log.names.index(match.axis)])

    def gain() -> float:
        return float(metrics.best_ema(match.raw, recording.log.rate, truth=truth).gain)

    for method in methods:
        result = run_on_axis(method, z, recording.log.rate, gain, recording.log.unit)
        values = _row_values(result, match, recording.log.rate)
        label = name_of(method)
        yield Row(recording.source, match.axis, label, recording.angle, values, result.causal)


def _row_values(result: AxisResult, match: ReferenceFit, rate: float) -> dict[str, float]:
    compensated = None if result.bias is None else match.raw - result.bias
    moving = np.abs(match.rate) > MIN_MOVING_RATE_RAD_S
    return {
        **_motion_values("compensated", _motion_error(match, compensated, rate)),
        **_motion_values("smooth", _motion_error(match, result.smooth, rate)),
        "angle_drift": _angle_drift(match, compensated, rate),
        "nis_rest": mean_nis(result, ~moving & np.isfinite(match.rate)),
        "nis_motion": mean_nis(result, moving),
    }


def _motion_error(match: ReferenceFit, estimate: Floats | None, rate: float) -> MotionError | None:
    if estimate is None:
        return None
    return metrics.motion_error(match.rate, estimate, rate, raw=match.raw)


def _motion_values(name: str, error: MotionError | None) -> dict[str, float]:
    fields = ("rmse", "delay", "rmse_undelayed", "rmse_lowpass")
    return {
        f"{name}_{field}": math.nan if error is None else float(getattr(error, field))
        for field in fields
    }


def _angle_drift(match: ReferenceFit, estimate: Floats | None, rate: float) -> float:
    """Return the largest error of the integrated angle."""
    if estimate is None:
        return math.nan
    errors = estimate - match.rate
    present = errors[np.isfinite(errors)]
    return measure_or_nan(lambda: np.abs(np.cumsum(present)).max() / rate)


@dataclass(frozen=True)
class _Line:
    scale: float
    offset: float
    correlation: float


def _fit_line(z: Floats, reference: Floats) -> _Line:
    """Return the straight line with the smallest residual of the gyro's output."""
    present = np.isfinite(z) & np.isfinite(reference)
    if not present.any():
        return _Line(0.0, 0.0, 0.0)
    x, y = reference[present], z[present]
    dx, dy = x - x.mean(), y - y.mean()
    power, total, both = (float(np.dot(a, b)) for a, b in ((dx, dx), (dy, dy), (dx, dy)))
    if not (power > 0.0 and total > 0.0):
        return _Line(0.0, float(y.mean()), 0.0)
    scale = both / power
    return _Line(scale, float(y.mean() - scale * x.mean()), both / math.sqrt(power * total))
