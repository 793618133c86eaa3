"""A log in memory through the filters."""

from collections.abc import Sequence
from dataclasses import fields
from typing import Any, Unpack

import numpy as np
import numpy.typing as npt

from zerorate.io import Log
from zerorate.io.logfile import LogFile
from zerorate.run.replay.allan import AllanCurves, AllanJob
from zerorate.run.replay.collect import Collected
from zerorate.run.replay.columns import compensated
from zerorate.run.replay.filters import Filters
from zerorate.run.replay.measure import Measures
from zerorate.run.replay.passes import FilterOptions
from zerorate.run.replay.pipeline import drive, summed_up
from zerorate.run.replay.result import Output, Replay, Summary
from zerorate.run.replay.workers import Progress, silent, workers

__all__ = ["FilterOptions", "replay"]

Floats = npt.NDArray[np.float64]


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
    recording = LogFile.of(log)
    filters = Filters(log.n, log.rate, log.channels, methods, output, options)
    known = None if truth is None else _like(truth, log)
    measures = Measures(recording.header, list(filters.runs), horizons, filters.holds, known)
    kept = Collected(log.data.shape, list(filters.runs), filters.notes)
    drive(recording, filters, (measures.take, kept.take), report)
    summary = summed_up(recording, filters, measures, horizons)
    curves = _curves(log, filters, kept, report) if allan else None
    report("measuring", 1.0)
    return Replay(
        **_said(summary), log=log, filtered=kept.filtered, allan=curves, readings=kept.readings
    )


def _curves(log: Log, filters: Filters, kept: Collected, progress: Progress) -> AllanCurves:
    """Return Allan deviations of the raw data and of the filter's answer, both at rest."""
    drift, readings = kept.filtered[filters.chosen.method], kept.readings
    answer = drift if filters.output == "estimate" else compensated(log.data, drift)
    raw = log.data
    if filters.holds and readings is not None:
        raw = np.where(readings.certain_rest(log.rate), raw, np.nan)
    # Predictions in a gap are no measurement: both curves are of the same samples.
    there = np.isfinite(raw)
    compared = answer if there.all() else np.where(there, answer, np.nan)
    with workers() as executor:
        job = AllanJob(executor, raw, compared, log.rate)
        for done in job:
            progress("measuring", done)
        return job.curves()


def _said(summary: Summary) -> dict[str, Any]:
    return {field.name: getattr(summary, field.name) for field in fields(summary)}


def _like(truth: npt.ArrayLike, log: Log) -> Floats:
    """Return the truth an axis after the other, shape (k, n)."""
    known = np.asarray(truth, dtype=np.float64)
    known = known[:, np.newaxis] if known.ndim == 1 else known
    if known.shape != log.data.shape:
        raise ValueError(f"truth must have the log's shape {log.data.shape}, got {known.shape}")
    return np.ascontiguousarray(known.T)
