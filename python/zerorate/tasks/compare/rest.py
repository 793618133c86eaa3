"""Measures of methods on a sensor at rest."""

import math
from collections.abc import Iterator, Sequence
from typing import Final

import numpy as np

from zerorate import metrics
from zerorate._native import exponential_mean
from zerorate.metrics import BestEma
from zerorate.noise.motion_check import moving_spans
from zerorate.noise.records import is_constant
from zerorate.numerals import shorten
from zerorate.record import LogError
from zerorate.tasks.compare.measures import Row, mean_nis, measure_or_nan
from zerorate.tasks.compare.methods import (
    HINDSIGHT_METHOD,
    AxisResult,
    MethodSpec,
    name_of,
    run_on_axis,
)
from zerorate.tasks.compare.trial import Trial
from zerorate.types import Floats

HORIZONS: Final = (10.0, 60.0)
"""Lengths of coasting, s."""

_LEARNING_TIME_S: Final = 120.0


def scoring_start(duration: float) -> float:
    """Return the start of scoring for a record of this length, both in s."""
    return min(_LEARNING_TIME_S, duration / 3.0)


def scored_axes(recording: Trial) -> list["ScoredAxis"]:
    """Return the axes of a recording with their best averages."""
    columns = zip(recording.log.names, recording.log.data.T, strict=True)
    return [ScoredAxis(np.ascontiguousarray(z), recording, name) for name, z in columns]


def rest_rows(
    recording: Trial, axes: Sequence["ScoredAxis"], methods: Sequence[MethodSpec], samples: Floats
) -> Iterator[Row]:
    """Yield the measures of every axis and method.

    Parameters
    ----------
    recording, axes : Trial, sequence of ScoredAxis
        Recording, and its axes from `scored_axes`.
    methods : sequence of str or OwnMethod
        Methods to measure.
    samples : ndarray, shape (n, k)
        Input of the methods: the recording's data, or a contaminated copy.
    """
    for name, scored, column in zip(recording.log.names, axes, samples.T, strict=True):
        z = np.ascontiguousarray(column)
        for method in methods:
            result = scored.run(method, z)
            values = scored.measure(method, result, z)
            label = name_of(method)
            yield Row(recording.source, name, label, recording.angle, values, result.causal)


def rest_notes(recording: Trial) -> Iterator[str]:
    """Yield notes: there is no reference, and the spans in which the sensor seems to move."""
    yield f"{recording.source}: without a reference, so it is assumed to be at rest"
    for name, z in zip(recording.log.names, recording.log.data.T, strict=True):
        if is_constant(z, np.nanmax(z)):
            yield f"{recording.source}: {name}: all samples are equal, so errors cannot be measured"
        spans = moving_spans(z, recording.log.rate)
        if spans:
            seconds = sum(span.end - span.start for span in spans)
            moves = f"{name} seems to move for {seconds:.0f} s"
            yield f"{recording.source}: {moves}, which counts as error"


class ScoredAxis:
    """One axis with its best averages, to which methods are compared."""

    def __init__(self, z: Floats, recording: Trial, axis: str) -> None:
        rate = recording.log.rate
        self._z, self._rate, self._unit = z, rate, recording.log.unit
        self._start = scoring_start(z.size / rate)
        bests = {horizon: self._find_best_ema(horizon) for horizon in HORIZONS}
        self._bests = {horizon: best for horizon, best in bests.items() if best is not None}
        if not self._bests:
            raise LogError(
                f"{recording.source}: {axis} holds no {HORIZONS[0]:g} s without missing samples to "
                f"coast through after the first {shorten(self._start, 3)} s"
            )

    def run(self, method: MethodSpec, samples: Floats) -> AxisResult:
        """Run a method on these samples of the axis."""
        return run_on_axis(method, samples, self._rate, self._gain, self._unit)

    def measure(self, method: MethodSpec, result: AxisResult, samples: Floats) -> dict[str, float]:
        """Return the measures of a method's output for these input samples."""
        values = {}
        for horizon in HORIZONS:
            estimate = result.estimate
            if method == HINDSIGHT_METHOD and horizon in self._bests:
                # Each horizon has its own best gain.
                estimate = exponential_mean(samples, float(self._bests[horizon].gain))
            error = self._coasting_error(estimate, horizon)
            values[f"coasting_{horizon:g}"] = error
            values[f"coasting_{horizon:g}_over_best"] = error / self._best_error(horizon)
        return values | self._other_measures(result)

    def _other_measures(self, result: AxisResult) -> dict[str, float]:
        z, x = self._scored_part(self._z), self._scored_part(result.estimate)
        counted = np.arange(self._z.size) >= self._z.size - z.size
        return {
            "allan_ratio": _allan_ratio(self._z, result, self._rate),
            "nis": mean_nis(result, counted),
            "reduction": measure_or_nan(lambda: metrics.reduction(z, x)),
        }

    def _coasting_error(self, estimate: Floats, horizon: float) -> float:
        z, x = self._scored_part(self._z), self._scored_part(estimate)
        return measure_or_nan(lambda: metrics.coasting_error(z, x, self._rate, horizon))

    def _best_error(self, horizon: float) -> float:
        """Return the error of the best average; NaN if it does not exist or is zero."""
        least = float(self._bests[horizon].error) if horizon in self._bests else 0.0
        return least if least > 0.0 else math.nan

    def _gain(self) -> float:
        return float(self._bests[max(self._bests)].gain)

    def _find_best_ema(self, horizon: float) -> BestEma | None:
        try:
            return metrics.best_ema(self._z, self._rate, horizon, start=self._start)
        except ValueError:
            return None

    def _scored_part(self, x: Floats) -> Floats:
        return x[round(self._start * self._rate) :]


def _allan_ratio(z: Floats, result: AxisResult, rate: float) -> float:
    """Return the ratio of Allan deviations at ten times the time constant."""
    return measure_or_nan(
        lambda: metrics.allan_ratio(z, result.estimate, rate, result.time_constant).ratio[0]
    )
