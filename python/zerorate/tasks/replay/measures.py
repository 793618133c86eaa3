"""Measures of a replay: scores of each axis and counts of samples, block by block."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from zerorate._native import ReplayScores
from zerorate.record.log import Header
from zerorate.tasks.replay.filters import Block
from zerorate.types import Booleans, Floats, Integers

_ONSET_S: Final = 0.5
_MIN_ONSET_SAMPLES: Final = 8


@dataclass(frozen=True)
class Score:
    """Measures of one axis, for raw data or a method's bias; NaN if they have no meaning.

    Samples that are missing in the raw data are not used. If the chosen filter detects motion, only
    samples at rest are used.

    Parameters
    ----------
    axis, method : str
        Name of the channel, and name of the method or ``"raw"``.
    mean, deviation : float
        Mean and standard deviation, in the unit of the log.
    reduction : float
        Standard deviation of the bias divided by the standard deviation of the raw data. The ratio
        does not apply to the compensated rate.
    coasting : tuple of float
        `zerorate.metrics.coasting_error` at each horizon, unit times seconds.
    error : float
        RMS error against the true bias, if given.
    """

    axis: str
    method: str
    mean: float
    deviation: float
    reduction: float
    coasting: tuple[float, ...]
    error: float


@dataclass(frozen=True, eq=False)
class SampleCounts:
    """Counts of samples for each axis, shape (k,).

    Parameters
    ----------
    missing_count, present_count : ndarray of int64
        Numbers of missing (NaN or saturated) samples, and of all other samples.
    equal : ndarray of bool
        True if all present samples are equal.
    at_rest_count, stuck_count : ndarray of int64 or None
        Numbers of samples with the sensor at rest, and stuck, according to the chosen filter, if
        recorded.
    """

    missing_count: Integers
    present_count: Integers
    equal: Booleans
    at_rest_count: Integers | None
    stuck_count: Integers | None


@dataclass(frozen=True, eq=False)
class ReplayMeasures:
    """Measures over all samples.

    Parameters
    ----------
    scores : tuple of Score
        Axis by axis: the raw data, then each method.
    compensated_deviation : ndarray, shape (k,)
        Standard deviation of the raw rate minus the chosen method's bias, in the unit of the log.
    sample_counts : SampleCounts
        Counts of samples.
    """

    scores: tuple[Score, ...]
    compensated_deviation: Floats
    sample_counts: SampleCounts


class Measures:
    """Scores of every axis, for raw data and each method's bias; `truth` has shape (k, n).

    Only samples at rest are meaningful if a sensor moves. If the chosen filter `holds` the bias in
    motion, scores use only samples with certain rest. A stuck sensor is not at rest.
    """

    def __init__(
        self,
        header: Header,
        methods: Sequence[str],
        horizons: Sequence[float],
        holds: bool,
        truth: Floats | None = None,
    ) -> None:
        self._header, self._methods, self._horizons = header, tuple(methods), tuple(horizons)
        self._truth = truth
        self._lengths = [round(horizon * header.rate) for horizon in horizons]
        self._used = [i for i, m in enumerate(self._lengths) if 1 <= m < header.n]
        self._records_state = False
        self._stuck = np.zeros(header.channels, dtype=np.int64)
        delay = onset_samples(header.rate) if holds else None
        lengths = [self._lengths[i] for i in self._used]
        self._native = ReplayScores(header.channels, len(self._methods), lengths, delay)
        self._compensated = ReplayScores(header.channels, 0, [], delay)

    def take(self, block: Block) -> None:
        """Measure one block."""
        rest = block.rest
        self._records_state = rest is not None
        if block.stuck is not None:
            self._stuck += np.count_nonzero(block.stuck, axis=1)
        bias = [block.bias[method] for method in self._methods]
        self._compensated.take(block.raw - bias[-1], [], rest)
        truth = None if self._truth is None else self._truth[:, block.first : block.end]
        self._native.take(block.raw, bias, rest, truth)

    def finish(self) -> ReplayMeasures:
        """Return the scores and the statistics, after all blocks."""
        native = self._native.finish()
        sample_counts = SampleCounts(
            missing_count=native["missing"],
            present_count=native["present"],
            equal=native["least"] == native["most"],
            at_rest_count=native["at_rest"] if self._records_state else None,
            stuck_count=self._stuck if self._records_state else None,
        )
        scores = self._scores(_NativeScores(**{name: native[name] for name in _SCORE_FIELDS}))
        return ReplayMeasures(
            tuple(scores), self._compensated.finish()["deviation"][:, 0], sample_counts
        )

    def _scores(self, native: "_NativeScores") -> list[Score]:
        if self._truth is None:
            native.error[:] = np.nan
        coasting = np.full((*native.mean.shape, len(self._lengths)), np.nan)
        coasting[..., self._used] = native.coasting / self._header.rate
        return [
            _make_score(native, i, j, (axis, method), coasting[i, j])
            for i, axis in enumerate(self._header.names)
            for j, method in enumerate(("raw", *self._methods))
        ]


@dataclass(frozen=True, eq=False)
class _NativeScores:
    """Native results (k, m + 1), and coasting errors with an axis of horizons."""

    mean: Floats
    deviation: Floats
    error: Floats
    coasting: Floats


_SCORE_FIELDS = ("mean", "deviation", "error", "coasting")


def _make_score(
    native: _NativeScores, i: int, j: int, labels: tuple[str, str], coasting: Floats
) -> Score:
    raw, deviation = float(native.deviation[i, 0]), float(native.deviation[i, j])
    return Score(
        *labels,
        mean=float(native.mean[i, j]),
        deviation=deviation,
        reduction=deviation / raw if raw > 0.0 else np.nan,
        coasting=tuple(coasting.tolist()),
        error=float(native.error[i, j]),
    )


def onset_samples(rate: float) -> int:
    """Return the number of samples before a detected motion in which the motion may have begun."""
    return max(round(_ONSET_S * rate), _MIN_ONSET_SAMPLES)
