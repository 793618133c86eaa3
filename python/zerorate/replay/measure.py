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


@dataclass(frozen=True, eq=False)
class Measuring:
    """What is to be measured: the log, its series by method, raw first, and the truth, if known.

    Series and truth have shape (n, k), horizons are in s.
    """

    log: Log
    series: dict[str, Floats]
    truth: Floats | None
    horizons: tuple[float, ...]

    def scores(self, progress: Progress) -> tuple[Score, ...]:
        """Return the scores alone."""
        return self._scores(self._rows(), progress, 1.0)

    def with_curves(self, progress: Progress) -> tuple[tuple[Score, ...], AllanCurves]:
        """Return the scores, and Allan deviations of the first and the last series."""
        rows = self._rows()
        raw, *_, last = self.series.values()
        with workers() as executor:
            # Scores are many short NumPy calls, which threads would only hinder.
            # Predictions in a gap are no measurement: both curves are of the same samples.
            compared = last if np.isfinite(raw).all() else np.where(np.isfinite(raw), last, np.nan)
            job = AllanJob(executor, raw, compared, self.log.rate)
            scores = self._scores(rows, progress, 0.5)
            for done in job:
                progress("measuring", 0.5 + 0.5 * done)
            return scores, job.curves()

    def _rows(self) -> dict[str, Floats]:
        return {method: np.ascontiguousarray(data.T) for method, data in self.series.items()}

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
