"""What came of methods on simulated gyros."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from zerorate.compare.simulated.models import DeviceModel
from zerorate.compare.simulated.scores import Score

__all__ = ["Regret", "from_scores"]

Floats = npt.NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Regret:
    """Regret of methods on models of gyros.

    Attributes
    ----------
    methods : tuple of str
        Names of the methods.
    models : tuple of DeviceModel
        The gyros.
    regret : ndarray, shape (models, methods)
        RMSE to the true drift over that of the optimum on the same records.
    sigma : ndarray, shape (models, methods)
        Standard error of the regret, from how records differ; NaN for one record.
    coverage : ndarray, shape (models, methods)
        Share of samples and records whose error is within one sigma of the method, 0.683 for an
        honest Gaussian one; NaN for a method that gives no sigma.
    optimum : ndarray, shape (models,)
        RMSE of the Kalman filter that knows the model, deg/s.
    """

    methods: tuple[str, ...]
    models: tuple[DeviceModel, ...]
    regret: Floats
    sigma: Floats
    coverage: Floats
    optimum: Floats

    @property
    def lasting(self) -> npt.NDArray[np.bool_]:
        """Which models are not transient, shape (models,)."""
        return np.array([not model.transient for model in self.models])

    @property
    def mean(self) -> Floats:
        """Mean over the models that are not transient, shape (methods,); NaN if there is none."""
        return self._over_models(np.mean)

    @property
    def worst(self) -> Floats:
        """Largest over the models that are not transient, shape (methods,); NaN if none."""
        return self._over_models(np.max)

    def _over_models(self, summary: Callable[..., Floats]) -> Floats:
        kept = self.regret[self.lasting]
        return summary(kept, axis=0) if len(kept) else np.full(len(self.methods), np.nan)


def from_scores(
    names: tuple[str, ...], models: tuple[DeviceModel, ...], rows: Sequence[Sequence[Score]]
) -> Regret:
    """Return the regret from the scores of each model: those of the optimum, then the methods."""
    squares = np.array([[score.squares for score in scores] for scores in rows])
    coverage = np.array([[score.coverage for score in scores[1:]] for scores in rows])
    least = squares[:, :1]
    regret = np.sqrt(squares.mean(axis=2)[:, 1:] / least.mean(axis=2))
    optimum_error = np.sqrt(least.mean(axis=(1, 2)))
    return Regret(names, models, regret, _error(squares[:, 1:], least), coverage, optimum_error)


def _error(squares: Floats, least: Floats) -> Floats:
    """Return the standard error of the root of a ratio of means, to first order."""
    records = squares.shape[2]
    if records == 1:
        return np.full(squares.shape[:2], np.nan)
    ratio = squares.mean(axis=2) / least.mean(axis=2)
    residual = squares - ratio[:, :, np.newaxis] * least
    slope = 2.0 * np.sqrt(ratio) * least.mean(axis=2)
    sigma: Floats = residual.std(axis=2, ddof=1) / (math.sqrt(records) * slope)
    return sigma
