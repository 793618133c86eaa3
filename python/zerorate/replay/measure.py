"""All that is measured of a log and its filtered data."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from zerorate.io import Log
from zerorate.replay.allan import AllanCurves, AllanJob
from zerorate.replay.result import Score
from zerorate.replay.score import score
from zerorate.replay.workers import Progress, workers

__all__ = ["Measuring"]

Floats = npt.NDArray[np.float64]
Flags = npt.NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class Measuring:
    """What is to be measured: the log, its drift by method, and the true one, if known.

    Of a sensor that moves only what it shows at rest says something: `at_rest` tells where the
    chosen filter is certain of that, None stands for everywhere. All arrays have shape (n, k),
    horizons are in s.
    """

    log: Log
    drift: dict[str, Floats]
    answer: Floats
    at_rest: Flags | None
    truth: Floats | None
    horizons: tuple[float, ...]

    def scores(self, progress: Progress) -> tuple[Score, ...]:
        """Return the scores alone."""
        return self._scores(self._rows(), progress, 1.0)

    def with_curves(self, progress: Progress) -> tuple[tuple[Score, ...], AllanCurves]:
        """Return the scores, and Allan deviations of the raw data and of the filter's answer."""
        rows = self._rows()
        raw = self._measured()
        with workers() as executor:
            # Scores are many short NumPy calls, which threads would only hinder.
            # Predictions in a gap are no measurement: both curves are of the same samples.
            there = np.isfinite(raw)
            compared = self.answer if there.all() else np.where(there, self.answer, np.nan)
            job = AllanJob(executor, raw, compared, self.log.rate)
            scores = self._scores(rows, progress, 0.5)
            for done in job:
                progress("measuring", 0.5 + 0.5 * done)
            return scores, job.curves()

    def _measured(self) -> Floats:
        """Return the raw data, NaN where they say nothing of the drift."""
        data = self.log.data
        return data if self.at_rest is None else np.where(self.at_rest, data, np.nan)

    def _rows(self) -> dict[str, Floats]:
        series = {"raw": self._measured()} | self.drift
        return {method: np.ascontiguousarray(data.T) for method, data in series.items()}

    def _scores(self, rows: dict[str, Floats], progress: Progress, end: float) -> tuple[Score, ...]:
        scores = []
        for one in self._each(rows):
            scores.append(one)
            progress("measuring", end * len(scores) / (len(rows) * self.log.channels))
        return tuple(scores)

    def _each(self, rows: dict[str, Floats]) -> Iterator[Score]:
        log, raw = self.log, rows["raw"]
        for i, axis in enumerate(log.names):
            truth = None if self.truth is None else self.truth[:, i]
            for method, row in rows.items():
                yield score(axis, method, raw[i], row[i], truth, log.rate, self.horizons)
