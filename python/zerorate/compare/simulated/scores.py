"""How far one method is from the true drift."""

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from zerorate.compare.simulated.hindsight import best_moving_average
from zerorate.compare.simulated.methods import HINDSIGHT, Estimate, Method, known, name_of

__all__ = ["Score", "Trial"]

Floats = npt.NDArray[np.float64]


class Score(NamedTuple):
    """Mean squared error of each record, shape (k,), and how often it was within one sigma."""

    squares: Floats
    coverage: float


class Trial(NamedTuple):
    """Records of gyros of one model: output and true drift, shape (n, k), deg/s, rate in Hz.

    The samples from `first` on count.
    """

    signal: Floats
    truth: Floats
    rate: float
    first: int

    def score(self, method: str | Method) -> Score:
        """Return the score of a method; its coverage is NaN if it gives no sigma."""
        if method == HINDSIGHT:
            return Score(best_moving_average(self.signal, self.truth, self.first), np.nan)
        answer = known(method)(self.signal, self.rate)
        drift = answer.drift if isinstance(answer, Estimate) else answer
        if drift.shape != self.truth.shape:
            raise ValueError(
                f"{name_of(method)} must answer the shape of the records {self.truth.shape}, "
                f"got {drift.shape}"
            )
        error = np.abs(drift[self.first :] - self.truth[self.first :])
        return Score(np.mean(error**2, axis=0), self._coverage(error, answer))

    def _coverage(self, error: Floats, answer: Floats | Estimate) -> float:
        if not isinstance(answer, Estimate):
            return np.nan
        return float(np.mean(error <= answer.sigma[self.first :]))
