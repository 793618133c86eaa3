"""The filters' way through a log."""

from collections.abc import Sequence
from concurrent.futures import wait
from typing import Final, Unpack, get_args

import numpy as np
import numpy.typing as npt

from zerorate._native import DriftFilter
from zerorate.io import Log, LogError
from zerorate.replay.allan import AllanCurves
from zerorate.replay.history import moments
from zerorate.replay.measure import Measuring
from zerorate.replay.memory import memory
from zerorate.replay.passes import FilterOptions, Run, Watch
from zerorate.replay.result import Output, Replay, Score, compensated
from zerorate.replay.workers import Progress, silent, workers

__all__ = ["FilterOptions", "replay"]

Floats = npt.NDArray[np.float64]

_SLABS: Final = 50


def replay(
    log: Log,
    *,
    methods: Sequence[str] = ("kf", "akf", "fading", "auto"),
    output: Output | None = None,
    truth: npt.ArrayLike | None = None,
    horizons: Sequence[float] = (10.0, 60.0),
    allan: bool = True,
    progress: Progress | None = None,
    **options: Unpack[FilterOptions],
) -> Replay:
    """Filter every axis of a log with several methods and measure what each one did.

    Parameters
    ----------
    log : Log
        The recording.
    methods : sequence of str
        Methods of `zerorate.DriftFilter`, all different. The last is the chosen one, whose
        history is kept; by default the one that tunes itself, beside the published ones.
    output : {"estimate", "compensated"}, optional
        What the filtered log holds: the drift, or the raw rate minus it. The latter is the default
        of "auto", the former that of the published methods. Scores are of the drift in any case.
    truth : array_like, optional
        True drift, of the shape and unit of the log's data, where it is known.
    horizons : sequence of float
        Horizons of the coasting error, s; default 10 and 60.
    allan : bool
        Whether to compute the Allan deviations, which only a figure needs; default yes.
    progress : callable, optional
        Called in this thread with a step's name and the fraction of it that is done.
    **options
        Arguments of `zerorate.DriftFilter`, for every method that knows them.

    Returns
    -------
    Replay
        Filtered data, scores, history.

    Raises
    ------
    LogError
        If no axis holds a sample.
    ValueError
        If a method or an argument is not valid, or `truth` has another shape than the data.

    Examples
    --------
    >>> import numpy as np
    >>> z = 0.5 + 0.1 * np.random.default_rng(1).standard_normal(6000)
    >>> result = replay(Log(np.arange(6000) / 100.0, 100.0, z, ["gyro_z_dps"], "deg/s"))
    >>> [(s.method, s.reduction < 0.6) for s in result.scores]
    [('raw', False), ('kf', True), ('akf', True), ('fading', True), ('auto', True)]
    """
    report = silent if progress is None else progress
    known = None if truth is None else _like(truth, log)
    runs = {method: Run(log, method, options) for method in _checked(methods)}
    if not np.isfinite(log.data).any():
        raise LogError("no axis holds a sample: all are missing")
    *_, chosen = runs.values()
    kind = _output(output, chosen.filter)
    watch = Watch(log, chosen.filter, kind)
    _filter_all(log, runs, watch, report)
    drift_alone = kind == "estimate"
    answer = chosen.filtered if drift_alone else compensated(log.data, chosen.filtered)
    drift = {method: run.filtered for method, run in runs.items()}
    measuring = Measuring(log, drift, answer, watch.certain_rest(), known, tuple(horizons))
    curves: AllanCurves | None
    if allan:
        scores, curves = measuring.with_curves(report)
    else:
        scores, curves = measuring.scores(report), None
    return _result(measuring, runs, kind, watch, scores, curves)


def _result(
    measuring: Measuring,
    runs: dict[str, Run],
    output: Output,
    watch: Watch,
    scores: tuple[Score, ...],
    curves: AllanCurves | None,
) -> Replay:
    *_, chosen = (run.filter for run in runs.values())
    history = watch.recorder.history()
    return Replay(
        log=measuring.log,
        method=chosen.method,
        output=output,
        params=chosen.params,
        filtered=measuring.drift,
        scores=scores,
        horizons=measuring.horizons,
        speed={method: run.speed for method, run in runs.items()},
        guard_count={method: np.asarray(run.filter.guard_count) for method, run in runs.items()},
        ready=np.asarray(chosen.ready),
        status=tuple(chosen.status),
        history=history,
        memory=memory(history, chosen.order, measuring.log.rate),
        allan=curves,
        readings=watch.readings,
    )


def _output(asked: Output | None, filter_: DriftFilter) -> Output:
    """Return what is asked for, or what the method is for."""
    if asked is None:
        return "compensated" if filter_.method == "auto" else "estimate"
    if asked not in get_args(Output):
        raise ValueError(f"output must be 'estimate' or 'compensated', got {asked!r}")
    return asked


def _filter_all(log: Log, runs: dict[str, Run], watch: Watch, progress: Progress) -> None:
    """Run all filters side by side, and watch the last of them."""
    *others, chosen = runs.values()
    stops = moments(log.n)
    with workers() as executor:
        for slab in np.array_split(stops, min(_SLABS, len(stops))):
            ends = slab.tolist()
            jobs = [executor.submit(chosen.advance, ends, watch)]
            jobs += [executor.submit(run.advance, ends[-1:]) for run in others]
            wait(jobs)
            for job in jobs:
                job.result()
            progress("filtering", ends[-1] / log.n)
    for run in runs.values():
        _blank_before_first(log.data, run.filtered)


def _blank_before_first(raw: Floats, filtered: Floats) -> None:
    """Put NaN where a filter had nothing yet to predict from."""
    for z, y in zip(raw.T, filtered.T, strict=True):
        if not np.isfinite(z[0]):
            there = np.isfinite(z)
            y[: int(there.argmax()) if there.any() else None] = np.nan


def _checked(methods: Sequence[str]) -> list[str]:
    listed = list(methods)
    if not listed or len(set(listed)) < len(listed):
        raise ValueError(f"methods must be at least one and all different, got {listed}")
    return listed


def _like(truth: npt.ArrayLike, log: Log) -> Floats:
    known = np.asarray(truth, dtype=np.float64)
    known = known[:, np.newaxis] if known.ndim == 1 else known
    if known.shape != log.data.shape:
        raise ValueError(f"truth must have the log's shape {log.data.shape}, got {known.shape}")
    return known
