"""Error of methods over that of the optimum, on simulated gyros."""

from collections.abc import Iterator, Sequence

from zerorate.compare.simulated.methods import Method, check, name_of
from zerorate.compare.simulated.models import MODELS, DeviceModel
from zerorate.compare.simulated.optimal import optimum
from zerorate.compare.simulated.records import records
from zerorate.compare.simulated.result import Regret, from_scores
from zerorate.compare.simulated.scores import Score, Trial
from zerorate.compare.simulated.span import span
from zerorate.progress import Progress, silent

__all__ = ["run"]


def run(
    methods: Sequence[str | Method],
    *,
    models: Sequence[DeviceModel] | None = None,
    seeds: int = 12,
    duration: float = 1800.0,
    rate: float = 100.0,
    score_from: float = 120.0,
    progress: Progress | None = None,
) -> Regret:
    """Measure how near to the optimum methods come on simulated gyros.

    Parameters
    ----------
    methods : sequence of str or callable
        ``"raw"``, ``"mean"`` of all samples so far, ``"ema"`` (a moving average whose gain is the
        best in hindsight for each model), methods of `zerorate.DriftFilter` with its defaults, or
        callables: with k records, shape (n, k), and their rate they answer the drift, or an
        `Estimate` of drift and sigma. All have different names.
    models : sequence of DeviceModel, optional
        The gyros; default all of `MODELS`.
    seeds : int
        Records of each model, from 1; default 12.
    duration : float
        Length of a record, s; default half an hour.
    rate : float
        Samples per second, Hz; default 100, for which the table of models is made.
    score_from : float
        Time from which errors count, s; default two minutes.
    progress : callable, optional
        Called with a model's name and the fraction of all that is done.

    Returns
    -------
    Regret
        RMS over samples and seeds before the ratio, which lucky seeds would rule otherwise.

    Raises
    ------
    ValueError
        If a name is not known or stands twice, no model or seed is given, the record is not longer
        than `score_from`, or a callable answers another shape.

    Examples
    --------
    >>> found = run(["raw", "mean"], models=MODELS[:1], seeds=1, duration=60.0, score_from=20.0)
    >>> found.regret[:, 1].round(6).tolist()
    [1.0]
    """
    names = _checked(methods)
    chosen = tuple(MODELS if models is None else models)
    counted = span(duration, score_from, rate)
    if not chosen or seeds < 1:
        raise ValueError(f"regret needs models and seeds, got {len(chosen)} and {seeds}")
    report = silent if progress is None else progress
    rows: list[list[Score]] = []
    for model in chosen:
        scores: list[Score] = []
        for score in _scores(model, methods, seeds, rate, counted):
            scores.append(score)
            done = len(rows) + len(scores) / (1 + len(methods))
            report(model.name, done / len(chosen))
        rows.append(scores)
    return from_scores(names, chosen, rows)


def _scores(
    model: DeviceModel,
    methods: Sequence[str | Method],
    seeds: int,
    rate: float,
    counted: tuple[int, int],
) -> Iterator[Score]:
    """Yield the score of the optimum, then of each method."""
    first, n = counted
    signal, truth = records(model, rate, n, range(seeds))
    trial = Trial(signal, truth, rate, first)
    yield trial.score(lambda z, _: optimum(model, rate, n).filtered(z)[0])
    for method in methods:
        yield trial.score(method)


def _checked(methods: Sequence[str | Method]) -> tuple[str, ...]:
    names = tuple(name_of(method) for method in methods)
    if not names or len(set(names)) < len(names):
        raise ValueError(f"methods must be at least one and all different, got {list(names)}")
    for method in methods:
        check(method)
    return names
