"""Drift models of the gyros of one log, and tests of them: ``zerorate identify``."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping
from contextvars import copy_context
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Literal, NoReturn, Unpack

from zerorate.checks.preparation import AS_MEASURED_CHOICES
from zerorate.faults import ArgumentError, keyword_argument, make_sentence, sentence_of
from zerorate.identification.arma import MAX_ORDER
from zerorate.identification.as_json import as_json
from zerorate.identification.identification import MIN_SAMPLES, Identification, Method
from zerorate.identification.identification import identify as identify_axis
from zerorate.identification.order import Criterion
from zerorate.noise.records import as_record
from zerorate.noise.sample_notes import describe_samples
from zerorate.progress import Progress, choose_reporter
from zerorate.record.log import Log, LogError, notes_of
from zerorate.tasks.imu import prepare_imu
from zerorate.tasks.saving import Files, text_writer
from zerorate.tasks.source import ReadingArguments, Source, name_source_in_errors
from zerorate.tasks.workers import thread_pool
from zerorate.views import Result, page_of

Panels = Literal["usual", "all"]


@dataclass(frozen=True)
class Identified(Result):
    """The drift models of the gyros of one log, as `zerorate.identify` returns them.

    Parameters
    ----------
    axes : tuple of Identification
        Tests and models of each axis.
    source : str
        Name of the log.
    notes : tuple of str
        Sentences on the log and on excluded axes.
    alarms : tuple of str
        Contradictions in the log, one sentence each.

    Examples
    --------
    >>> import numpy as np
    >>> import zerorate as zr
    >>> a = np.random.default_rng(1).standard_normal(20_001)
    >>> found = zr.identify({"gyro_z_dps": a[1:] + 0.6 * a[:-1]}, rate=100.0)
    >>> [(axis.name, axis.model.order) for axis in found.axes]
    [('gyro_z_dps', (0, 1))]
    """

    axes: tuple[Identification, ...]
    source: str
    notes: tuple[str, ...] = ()
    alarms: tuple[str, ...] = ()

    def to_json(self) -> str:
        """Return all numbers as JSON."""
        return as_json(self.axes, Path(self.source).name, self.notes)

    def save(
        self,
        output: str | os.PathLike[str] = ".",
        *,
        force: bool = False,
        figure: bool = True,
        panels: Panels = "usual",
        **choices: Any,  # noqa: ANN401
    ) -> list[Path]:
        """Write a page with tables and figures, and all numbers as JSON; see `Result.save`.

        Parameters
        ----------
        output : str or path
            Folder for the files, or the name of one of them.
        force : bool
            Replace existing files.
        figure : bool
            Draw a figure of each axis in the page.
        panels : {"usual", "all"}
            Panels of each figure.
        """
        return super().save(output, force=force, drawn=figure, panels=panels, **choices)


def identify(
    source: Source,
    *,
    order: tuple[int, int] | None = None,
    criterion: Criterion = "aic",
    max_order: int = 10,
    estimator: Method = "css",
    segments: int = 100,
    outliers: Literal["hampel", "moving-average"] | None = None,
    smooth: int = 1,
    decimate: int = 1,
    trend: Literal["mean", "linear"] | None = None,
    fix: bool = False,
    progress: Progress | None = None,
    **reading: Unpack[ReadingArguments],
) -> Identified:
    """Find an ARMA model of the drift of each axis of a gyro at rest, and test it.

    The recording is checked first; rates are not changed. ``zerorate identify`` does the same.
    `zerorate.identification.identify` does this for the samples of one axis.

    Parameters
    ----------
    source : Recording, Log, path, data frame or mapping of arrays
        Recording with a gyro.
    order : (int, int), optional
        Orders p, q of the model. Default: chosen by the criterion.
    criterion : str
        Criterion for the orders: "fpe", "aic", "aicc", "bic" or "hq".
    max_order : int
        Largest order of the autoregressive models.
    estimator : str
        Estimator of the ARMA model: "css" (conditional sum of squares) or "exact" (exact
        likelihood).
    segments : int
        Number of parts of the record that the tests of stationarity compare.
    outliers : {"hampel", "moving-average"}, optional
        Method that replaces outliers before the fit.
    smooth : int
        Length of a moving average that is applied before the fit, samples.
    decimate : int
        Factor by which the sampling rate is reduced, after a low-pass filter.
    trend : {"mean", "linear"}, optional
        Trend that is subtracted before the fit.
    fix : bool
        Correct the gyro's unit or axes if a motion clearly contradicts them.
    progress : callable, optional
        Called with the name of the step and the fraction done. By default a notebook shows a bar.
    **reading
        Arguments of `zerorate.read_log`, if the source is a file.

    Returns
    -------
    Identified
        Tests and models of each axis. The result has the methods `table`, `plot` and `save`.

    Raises
    ------
    LogError
        If the source cannot be read, or no axis can be modelled.
    ValueError
        If an argument is not as described.

    Examples
    --------
    >>> import zerorate as zr
    >>> noise = zr.NoiseModel(angle_random_walk=1e-4)
    >>> z, _ = zr.simulate(noise, rate=100.0, duration=60.0, seed=1)
    >>> zr.identify({"gyro_z_radps": z}, rate=100.0).axes[0].whiteness.white
    True
    """
    if order is not None and not (len(order) == 2 and 0 <= min(order) <= max(order) <= MAX_ORDER):
        raise ArgumentError("order", f"takes p and q from 0 to {MAX_ORDER}, got {order}")
    report = choose_reporter(progress)
    report("reading", 0.0)
    prepared = prepare_imu(source, reading, replace(AS_MEASURED_CHOICES, fix=fix))
    name, log = prepared.recording.source, prepared.recording.gyro
    options = {
        "order": order, "criterion": criterion, "max_order": max_order, "method": estimator,
        "segments": segments, "outliers": outliers, "smooth": smooth, "decimate": decimate,
        "trend": trend,
    }  # fmt: skip
    with name_source_in_errors(name, prepared.alarms):
        if log is None:
            raise LogError("there is no gyro")
        axes, left_out = _identify_axes(log, options, report)
        hidden = tuple(
            f"{column}: {sentence}"
            for column, z in zip(log.names, log.data.T, strict=True)
            for sentence in describe_samples(z, log.rate, log.unit)
        )
    notes = (*notes_of(log, evenly_spaced=True), *hidden, *left_out)
    return Identified(axes, name, notes, prepared.alarms)


def _identify_axes(
    log: Log, options: Mapping[str, Any], progress: Progress
) -> tuple[tuple[Identification, ...], tuple[str, ...]]:
    """Return the identification of each axis, and the reasons for axes left out."""
    fractions = [0.0] * log.channels

    def of_axis(i: int) -> Identification | ValueError:
        def tell(step: str, fraction: float) -> None:
            fractions[i] = fraction
            progress(step, sum(fractions) / log.channels)

        try:
            z, name = log.data[:, i], log.names[i]
            return identify_axis(z, log.rate, name=name, unit=log.unit, progress=tell, **options)
        except ValueError as error:
            return error

    results = _run_parallel(of_axis, log.channels)
    axes = tuple(outcome for outcome in results if isinstance(outcome, Identification))
    pairs = zip(log.names, results, strict=True)
    reasons = {
        name: sentence_of(outcome) for name, outcome in pairs if isinstance(outcome, ValueError)
    }
    if not axes:
        _raise_refusal(log, reasons)
    return axes, tuple(make_sentence(f"{name} is left out: ", why) for name, why in reasons.items())


def _run_parallel(
    work: Callable[[int], Identification | ValueError], count: int
) -> list[Identification | ValueError]:
    with thread_pool() as executor:
        # Each thread gets a copy of the caller's context variables, such as argument names.
        jobs = [executor.submit(copy_context().run, work, i) for i in range(count)]
        return [job.result() for job in jobs]


def _raise_refusal(log: Log, reasons: Mapping[str, str]) -> NoReturn:
    """Raise LogError if no column can be modelled, or else the error of the arguments."""
    for z in log.data.T:
        try:
            as_record(z, MIN_SAMPLES, "identification")
        except ValueError:
            listed = [part for n, why in reasons.items() for part in ("; ", f"column '{n}': ", why)]
            hint = "; others are chosen with ", keyword_argument("columns", "", "columns")
            raise LogError(make_sentence(*listed[1:], *hint)) from None
    name, reason = next(iter(reasons.items()))
    raise ValueError(make_sentence(f"{name}: ", reason))


def files_of(result: Identified, *, drawn: bool = True, panels: Panels = "usual") -> Files:
    """Return the files of identifications: a page, with figures on request, and JSON.

    The page is made when it is written; ImportError without matplotlib (extra ``plot``).
    """

    def page(path: Path) -> None:
        text_writer(page_of(result, drawn, panels == "all"))(path)

    writers = [page, text_writer(result.to_json())]
    return Files("-zerorate-identify", ".html", writers, [".json"], {})
