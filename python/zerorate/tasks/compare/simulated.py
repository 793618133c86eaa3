"""Methods on simulated gyros: ratio of their error to the error of the optimal filter."""

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Final, NamedTuple

import numpy as np

from zerorate.faults import ArgumentError
from zerorate.metrics.averages import best_shared_ema
from zerorate.progress import Progress, choose_reporter
from zerorate.simulation import Contamination
from zerorate.simulation.models import MODELS, GyroModel, simulate_records
from zerorate.simulation.optimal_filter import optimum
from zerorate.tasks.compare.methods import (
    HINDSIGHT_METHOD,
    Estimate,
    Method,
    MethodSpec,
    causal_method,
    check_name,
    name_of,
)
from zerorate.tasks.compare.own_method import prefix_errors
from zerorate.types import Booleans, Floats

_SEED: Final = 1
_SIGMA_SPAN_S: Final = 10.0
"""Time span of the mean drift to which a stated sigma refers, s."""


@dataclass(frozen=True, eq=False)
class Regret:
    """Regret of methods on models of gyros: their error relative to the optimal filter.

    Attributes
    ----------
    methods : tuple of str
        Names of the methods.
    models : tuple of GyroModel
        The gyros.
    regret : ndarray, shape (models, methods)
        RMS error of the method, divided by the optimal filter's RMS error on the same records. Both
        errors are relative to the true drift.
    sigma : ndarray, shape (models, methods)
        Standard error of the regret, from the scatter between records; NaN for one record.
    coverage : ndarray, shape (models, methods)
        Share of samples with an error below the standard deviation that the method states. NaN if
        it states none. 0.683 if the standard deviation is right and errors are Gaussian.
    optimum : ndarray, shape (models,)
        RMSE of the Kalman filter with the true model, deg/s.
    causal : ndarray of bool, shape (methods,)
        True if the method used no later samples. This is known for methods of the package, and
        tested for your own methods.
    contamination : Contamination or None
        Contamination of the records; the optimal filter always gets clean records.
    """

    methods: tuple[str, ...]
    models: tuple[GyroModel, ...]
    regret: Floats
    sigma: Floats
    coverage: Floats
    optimum: Floats
    causal: Booleans
    contamination: Contamination | None = None

    @property
    def lasting_mask(self) -> Booleans:
        """Mask of models that are not transient, shape (models,)."""
        return np.array([not model.transient for model in self.models])

    @property
    def mean(self) -> Floats:
        """Mean regret over models that are not transient, shape (methods,); else NaN."""
        return self._over_models(np.mean)

    @property
    def worst(self) -> Floats:
        """Largest regret over models that are not transient, shape (methods,); else NaN."""
        return self._over_models(np.max)

    def part(
        self, methods: Sequence[str], first: int, contamination: Contamination | None
    ) -> "Regret":
        """Return consecutive methods from an index on, with these names."""
        columns = slice(first, first + len(methods))
        fields = ("regret", "sigma", "coverage", "causal")
        parts = {name: getattr(self, name)[..., columns] for name in fields}
        return replace(self, methods=tuple(methods), contamination=contamination, **parts)

    def _over_models(self, summary: Callable[..., Floats]) -> Floats:
        lasting_regret = self.regret[self.lasting_mask]
        return (
            summary(lasting_regret, axis=0)
            if len(lasting_regret)
            else np.full(len(self.methods), np.nan)
        )


class _Score(NamedTuple):
    """Mean squared error of each record, shape (k,), share within one sigma, causality."""

    squares: Floats
    coverage: float
    causal: bool = True


class _Trial(NamedTuple):
    """Records of a model's gyros: output and true drift, shape (n, k), deg/s, rate in Hz.

    Scores use the samples from `first` on.
    """

    signal: Floats
    truth: Floats
    rate: float
    first: int

    def score(self, method: MethodSpec | Method) -> _Score:
        """Return the score of a method; its coverage is NaN without a sigma."""
        if method == HINDSIGHT_METHOD:
            return _Score(best_shared_ema(self.signal, self.truth, self.first), np.nan)
        answer = causal_method(method)(self.signal, self.rate)
        estimate = answer if isinstance(answer, Estimate) else Estimate(answer, None)
        drift = estimate.drift
        if drift.shape != self.truth.shape:
            raise ValueError(
                f"{name_of(method)} must return the shape of the records {self.truth.shape}, "
                f"got {drift.shape}"
            )
        error = np.abs(drift[self.first :] - self.truth[self.first :])
        return _Score(
            np.mean(error**2, axis=0), self._coverage(drift, estimate.sigma), estimate.causal
        )

    def _coverage(self, drift: Floats, sigma: Floats | None) -> float:
        """Return the share of mean drifts over the next ten seconds within one sigma."""
        if sigma is None:
            return np.nan
        n = len(self.truth)
        total = np.vstack((np.zeros(self.truth.shape[1]), np.cumsum(self.truth, axis=0)))
        first = np.arange(self.first, n - 1)
        last = np.minimum(first + max(round(_SIGMA_SPAN_S * self.rate), 1), n - 1)
        mean = (total[last + 1] - total[first + 1]) / (last - first)[:, None]
        return float(np.mean(np.abs(drift[first] - mean) <= sigma[first]))


def run(
    methods: Sequence[MethodSpec | Method],
    *,
    models: Sequence[GyroModel] | None = None,
    seeds: int = 12,
    rate: float = 100.0,
    duration: float = 1800.0,
    score_from: float = 120.0,
    progress: Progress | None = None,
) -> Regret:
    """Measure the errors of methods on simulated gyros relative to the optimal filter.

    Parameters
    ----------
    methods : sequence of str, OwnMethod or callable
        Names, methods of the user, or callables. Names: ``"raw"``, ``"mean"`` of all samples to
        date, ``"ema"`` (the moving average with the best gain in hindsight for each model), and
        methods of `zerorate.DriftFilter` with its defaults. A callable gets k records, shape (n,
        k), and their rate. It returns the drift, or an `Estimate` of drift and sigma. All names
        must differ.
    models : sequence of GyroModel, optional
        The gyros; default all of `MODELS`.
    seeds : int
        Number of records per model, at least 1; default 12.
    duration : float
        Length of a record, s; default half an hour.
    rate : float
        Samples per second, Hz; default 100, as in the table of models.
    score_from : float
        Start of scoring, s; default two minutes.
    progress : callable, optional
        Called with the name of the model and the fraction done. By default a notebook shows a bar.

    Returns
    -------
    Regret
        Regrets. The RMS over samples and seeds is computed before the ratio; otherwise favourable
        seeds would dominate.

    Raises
    ------
    ValueError
        If a name is unknown or repeated, there is no model or seed, or the record is not longer
        than `score_from`. Also if a callable returns another shape.
    MethodError
        If a method of the user fails.

    Examples
    --------
    >>> found = run(["raw", "mean"], models=MODELS[:1], seeds=1, duration=60.0, score_from=20.0)
    >>> found.regret[:, 1].round(6).tolist()
    [1.0]
    """
    names = _check_methods(methods)
    gyros = tuple(MODELS if models is None else models)
    span = scored_span(duration, score_from, rate)
    if not gyros or seeds < 1:
        raise ValueError(f"regret needs models and seeds, got {len(gyros)} and {seeds}")
    report = choose_reporter(progress)
    rows: list[list[_Score]] = []
    for model in gyros:
        scores: list[_Score] = []
        with prefix_errors(f"simulated gyro {model.name}"):
            for score in _scores(model, methods, seeds, rate, span):
                scores.append(score)
                done = len(rows) + len(scores) / (1 + len(methods))
                report(model.name, done / len(gyros))
        rows.append(scores)
    return _compute_regret(names, gyros, rows)


def run_contaminated(
    methods: Sequence[MethodSpec],
    faults: Sequence[Contamination],
    *,
    seeds: int = 12,
    duration: float = 1800.0,
    progress: Progress | None = None,
) -> list[Regret]:
    """Return the regret on clean records, then the regret with each fault.

    With faults, the best moving average in hindsight is left out: it would know the outliers.

    Parameters
    ----------
    methods : sequence of str or OwnMethod
        Names as in `run`, and methods of the user.
    faults : sequence of Contamination
        Faults, all different.
    seeds, duration, progress
        As in `run`.

    Raises
    ------
    ValueError, MethodError
        As in `run`.
    """
    causal_methods = [method for method in methods if method != HINDSIGHT_METHOD]
    faulty_methods = [
        _contaminate_method(method, fault) for fault in faults for method in causal_methods
    ]
    regret = run([*methods, *faulty_methods], seeds=seeds, duration=duration, progress=progress)
    firsts = range(len(methods), len(methods) + len(faulty_methods), max(1, len(causal_methods)))
    parts = zip(firsts, faults if causal_methods else (), strict=True)
    names = list(map(name_of, causal_methods))
    return [
        regret.part(regret.methods[: len(methods)], 0, None),
        *(regret.part(names, first, fault) for first, fault in parts),
    ]


def _contaminate_method(method: MethodSpec, fault: Contamination) -> Method:
    """Return a method with contaminated input."""

    def fed(signal: Floats, rate: float) -> Floats | Estimate:
        return causal_method(method)(fault.apply(signal, rate, _SEED), rate)

    fed.__name__ = f"{name_of(method)}, {fault}"
    return fed


def _scores(
    model: GyroModel,
    methods: Sequence[MethodSpec | Method],
    seeds: int,
    rate: float,
    span: tuple[int, int],
) -> Iterator[_Score]:
    """Yield the score of the optimum, then of each method."""
    first, n = span
    signal, truth = simulate_records(model, rate, n, range(seeds))
    trial = _Trial(signal, truth, rate, first)
    yield trial.score(lambda z, _: optimum(model, rate, n).filtered(z)[0])
    for method in methods:
        yield trial.score(method)


def _check_methods(methods: Sequence[MethodSpec | Method]) -> tuple[str, ...]:
    names = tuple(name_of(method) for method in methods)
    if not names or len(set(names)) < len(names):
        raise ArgumentError("methods", f"must be at least one and all different, got {list(names)}")
    for method in methods:
        check_name(method)
    return names


def _compute_regret(
    names: tuple[str, ...], models: tuple[GyroModel, ...], rows: Sequence[Sequence[_Score]]
) -> Regret:
    """Return the regret from the scores of each model; the optimum is the first score."""
    squares = np.array([[score.squares for score in scores] for scores in rows])
    coverage = np.array([[score.coverage for score in scores[1:]] for scores in rows])
    causal = np.logical_and.reduce([[score.causal for score in scores[1:]] for scores in rows])
    optimum_squares = squares[:, :1]
    regret = np.sqrt(squares.mean(axis=2)[:, 1:] / optimum_squares.mean(axis=2))
    optimum_error = np.sqrt(optimum_squares.mean(axis=(1, 2)))
    sigma = _ratio_error(squares[:, 1:], optimum_squares)
    return Regret(names, models, regret, sigma, coverage, optimum_error, causal)


def _ratio_error(squares: Floats, optimum_squares: Floats) -> Floats:
    """Return the standard error of the root of a ratio of means, to first order."""
    records = squares.shape[2]
    if records == 1:
        return np.full(squares.shape[:2], np.nan)
    ratio = squares.mean(axis=2) / optimum_squares.mean(axis=2)
    residual = squares - ratio[:, :, np.newaxis] * optimum_squares
    slope = 2.0 * np.sqrt(ratio) * optimum_squares.mean(axis=2)
    sigma: Floats = residual.std(axis=2, ddof=1) / (math.sqrt(records) * slope)
    return sigma


def scored_span(duration: float, score_from: float, rate: float) -> tuple[int, int]:
    """Return the index of the first scored sample and the number of samples."""
    if not (0.0 <= score_from < duration < math.inf and 0.0 < rate < math.inf):
        raise ArgumentError(
            "rate",
            f"must be positive and score_from from 0 to below duration, got {rate} Hz, "
            f"{score_from} s and {duration} s",
        )
    first, n = round(score_from * rate), round(duration * rate)
    if not first < n:
        raise ValueError(f"no sample at {rate} Hz lies between {score_from} s and {duration} s")
    return first, n
