"""Filtering of a recording: in memory with all series, or into a file."""

from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, closing
from dataclasses import fields, replace
from pathlib import Path
from typing import Any, Final, Unpack

import numpy as np
import numpy.typing as npt

from zerorate.faults import ArgumentError
from zerorate.io import LogFile, write_log
from zerorate.io.readers.parquet import TIME_NAME, RowGroupWriter, make_metadata
from zerorate.io.reading import describe_missing
from zerorate.io.writing import make_column_names
from zerorate.noise.sample_notes import describe_steps
from zerorate.options import METHODS, FilterOptions
from zerorate.progress import Progress, choose_reporter
from zerorate.record import Log, LogError, atomic_path
from zerorate.record.log import Header
from zerorate.record.missing import floats
from zerorate.tasks.exclusion_counts import ExclusionCounts
from zerorate.tasks.replay.filters import Block, Filters, Output
from zerorate.tasks.replay.history import time_constants
from zerorate.tasks.replay.measures import Measures
from zerorate.tasks.replay.motion import motion_of, note_on_motion
from zerorate.tasks.replay.result import (
    Readings,
    Replay,
    Summary,
    extra_columns,
    extra_names,
    subtract_bias,
    trailing_mean,
)
from zerorate.tasks.workers import BackgroundStep, prefetch, thread_pool
from zerorate.types import Booleans, Floats

BLOCK_ROWS: Final = 1 << 15
"""Samples per block: large enough for low overhead, small enough for the processor's caches."""

HORIZONS: Final = (10.0, 60.0)
"""Horizons of the coasting error, s."""

_STEPS_S: Final = 120.0
"""Time from the start used to find the step of the samples, s."""


def run_filters(
    log: Log,
    *,
    accel: Log | None = None,
    methods: Sequence[str] = METHODS,
    output: Output = "compensated",
    truth: npt.ArrayLike | None = None,
    horizons: Sequence[float] = HORIZONS,
    progress: Progress | None = None,
    **options: Unpack[FilterOptions],
) -> Replay:
    """Filter every axis of a log with several methods and measure each method.

    This is `zerorate.replay` without its preparation and defaults.

    Parameters
    ----------
    log : Log
        The log of a gyro.
    accel : Log, optional
        Accelerometer of the same body with three axes, on a clock with the same zero, in any unit.
        If it shows motion, methods that hold the bias in motion never count the gyro's samples as
        rest.
    methods : sequence of str
        Methods of `zerorate.DriftFilter`, all different. The last is chosen: its history is kept.
        Default: the published methods, then "auto".
    output : {"compensated", "estimate"}, default "compensated"
        Contents of the filtered log: the raw rate minus its bias, or the bias from the chosen
        method. Scores are always for the bias.
    truth : array_like, optional
        True bias if known, in the shape and unit of the log's data.
    horizons : sequence of float
        Horizons of the coasting error, s; default 10 and 60.
    progress : callable, optional
        Called in this thread with the name of the step and the fraction done. By default a notebook
        shows a bar.
    **options
        Arguments of `zerorate.DriftFilter`; each is passed to the methods that use it. If the unit
        of the log is known, `rest_limit` defaults to 10 deg/s; None means no limit.

    Returns
    -------
    Replay
        Filtered data, scores, history.

    Raises
    ------
    LogError
        If all samples are missing, or the accelerometer does not have three axes.
    ValueError
        If a method or an argument is not valid, no method uses an option, or `truth` has another
        shape than the data.

    Examples
    --------
    >>> import numpy as np
    >>> z = 0.5 + 0.1 * np.random.default_rng(1).standard_normal(6000)
    >>> result = run_filters(Log(np.arange(6000) / 100.0, 100.0, z, ["gyro_z_dps"], "deg/s"))
    >>> [s.method for s in result.scores if s.reduction < 0.6]
    ['kf', 'akf', 'fading', 'robust', 'auto']
    """
    report = choose_reporter(progress)
    source = LogFile.of(log)
    source, moving = _detect_motion(source, None if accel is None else LogFile.of(accel))
    filters = Filters(source.header, methods, output, options, moving)
    true_bias = None if truth is None else _check_truth(truth, log)
    measures = Measures(source.header, list(filters.runs), horizons, filters.holds, true_bias)
    series = _Series(log.data.shape, list(filters.runs), filters.records_state)
    steps = _Steps(source.header)
    _run_pipeline(source, filters, (measures.take, series.take, steps.take), report)
    summary = _summarise(source, filters, measures, horizons, steps)
    summary_fields: dict[str, Any] = {
        field.name: getattr(summary, field.name) for field in fields(summary)
    }
    true_rows = None if true_bias is None else true_bias.T
    if true_rows is not None:
        truth_at_end = [trailing_mean(axis, source.header.rate)[-1] for axis in true_rows.T]
        summary_fields["error_at_end"] = summary.history.bias[-1] - np.array(truth_at_end)
    return Replay(
        **summary_fields,
        log=log,
        filtered=series.filtered,
        readings=series.readings,
        truth=true_rows,
    )


def filter_to_file(
    recording: LogFile,
    path: Path,
    *,
    accel: LogFile | None = None,
    methods: Sequence[str] = METHODS,
    output: Output = "compensated",
    horizons: Sequence[float] = HORIZONS,
    force: bool = False,
    progress: Progress | None = None,
    rows: int = BLOCK_ROWS,
    **options: Unpack[FilterOptions],
) -> Summary:
    """Filter a recording block by block and write the filtered log.

    Parameters
    ----------
    recording : LogFile
        Recording from `zerorate.io.open_log`.
    path : Path
        The file to write, completely or not at all.
    accel : LogFile, optional
        Accelerometer as in `run_filters`; it needs one byte of memory per sample.
    methods, output, horizons, progress, **options
        As in `run_filters`.
    force : bool
        Replace an existing file. Default False.
    rows : int
        Number of samples per block; the results do not depend on it.

    Returns
    -------
    Summary
        Results of `run_filters` without the series.

    Raises
    ------
    LogError
        If the file cannot be read completely, or all samples are missing.
    ValueError
        If a method or an argument is not valid, or no method uses an option.
    OSError
        If the file cannot be written.
    """
    if path.suffix.lower() != ".parquet":
        result = run_filters(
            recording.log(),
            accel=None if accel is None else accel.log(),
            methods=methods,
            output=output,
            horizons=horizons,
            progress=progress,
            **options,
        )
        write_log(result.to_log(), path, force=force)
        return result.summary()
    recording, moving = _detect_motion(recording, accel)
    header = recording.header
    filters = Filters(header, methods, output, options, moving)
    measures = Measures(header, list(filters.runs), horizons, filters.holds)
    steps = _Steps(header)
    with atomic_path(path, force) as temporary:
        with _FilteredFile(temporary, recording, filters) as file:
            sinks = (measures.take, file.take, steps.take)
            _run_pipeline(recording, filters, sinks, choose_reporter(progress), rows)
        return _summarise(recording, filters, measures, horizons, steps)


def _detect_motion(gyro: LogFile, accel: LogFile | None) -> tuple[LogFile, Booleans | None]:
    """Return the log of a gyro with notes on the accelerometer, and the mask of motion."""
    if accel is None:
        return gyro, None
    moving = motion_of(accel, gyro)
    header = gyro.header.with_notes([note_on_motion(accel, moving, gyro.header.rate)])
    return replace(gyro, header=header), moving


def _run_pipeline(
    recording: LogFile,
    filters: Filters,
    sinks: Sequence[Callable[[Block], None]],
    progress: Progress,
    rows: int = BLOCK_ROWS,
) -> None:
    """Read blocks ahead, filter them, and pass them to every sink in a separate thread."""
    with ExitStack() as stack:
        executor = stack.enter_context(thread_pool())
        raws = stack.enter_context(closing(prefetch(recording.blocks(rows))))
        steps = [stack.enter_context(BackgroundStep(sink)) for sink in sinks]
        for block in filters.process_blocks(raws, executor):
            for step in steps:
                step.put(block)
            progress("filtering", block.end / recording.header.n)


def _summarise(
    recording: LogFile,
    filters: Filters,
    measures: Measures,
    horizons: Sequence[float],
    steps: "_Steps",
) -> Summary:
    """Return the summary of a recording after its last block."""
    measured = measures.finish()
    counts = measured.sample_counts
    if not counts.present_count.any():
        saturated = "" if filters.limit is None else f", or beyond the limit of {filters.limit:g}"
        raise LogError(f"no axis has a sample: all are missing{saturated}")
    header = recording.header
    chosen_filter, history = filters.chosen_filter, filters.recorder.history()
    return Summary(
        header=header.with_notes(
            [
                *describe_missing(header.names, (counts.missing_count == header.n).tolist()),
                *steps.describe(),
            ]
        ),
        method=chosen_filter.method,
        output=filters.output,
        params=chosen_filter.params,
        scores=measured.scores,
        compensated_deviation=measured.compensated_deviation,
        horizons=tuple(horizons),
        speed={method: run.speed for method, run in filters.runs.items()},
        guard_count={
            method: np.asarray(run.filter.guard_count) for method, run in filters.runs.items()
        },
        ready=np.asarray(chosen_filter.ready),
        status=tuple(chosen_filter.status),
        restart_count=np.asarray(chosen_filter.restart_count),
        history=history,
        time_constant=time_constants(history, chosen_filter.order, header.rate),
        sample_counts=counts,
        left_out=ExclusionCounts.of(chosen_filter),
    )


class _Steps:
    """First samples of each axis, to find the step of the samples."""

    def __init__(self, header: Header) -> None:
        self._header = header
        self._first = np.empty((header.channels, min(header.n, round(_STEPS_S * header.rate))))

    def take(self, block: Block) -> None:
        """Keep the samples that are among the first."""
        count = self._first.shape[1]
        if block.first < count:
            kept = self._first[:, block.first : block.end]
            kept[:] = block.raw[:, : kept.shape[1]]

    def describe(self) -> Iterator[str]:
        """Yield a sentence for each axis with too coarse steps."""
        rate, unit = self._header.rate, self._header.unit
        for name, z in zip(self._header.names, self._first, strict=True):
            sentence = describe_steps(z, rate, unit)
            if sentence:
                yield f"{name}: {sentence}"


class _Series:
    """Series in memory, assembled from blocks."""

    def __init__(self, shape: tuple[int, int], methods: Sequence[str], notes: bool) -> None:
        # Axis by axis, because measures and writers read the data this way.
        axes_first = shape[::-1]
        self._bias = {method: np.empty(axes_first) for method in methods}
        kinds = (np.float64, np.bool_, np.bool_)
        self._state = [np.empty(axes_first, dtype=kind) for kind in kinds] if notes else None

    def take(self, block: Block) -> None:
        """Store one block."""
        columns = np.s_[:, block.first : block.end]
        for method, bias in self._bias.items():
            bias[columns] = block.bias[method]
        if self._state is not None:
            parts = (block.bias_sigma, block.at_rest, block.stuck)
            for series, part in zip(self._state, parts, strict=True):
                series[columns] = part

    @property
    def filtered(self) -> dict[str, Floats]:
        """Bias by method, shape (n, k)."""
        return {method: bias.T for method, bias in self._bias.items()}

    @property
    def readings(self) -> Readings | None:
        """State of the chosen filter at every sample, if recorded."""
        return None if self._state is None else Readings(*(part.T for part in self._state))


class _FilteredFile(RowGroupWriter):
    """Writer of blocks into the filtered log."""

    def __init__(self, path: Path, recording: LogFile, filters: Filters) -> None:
        header = recording.header
        self._recording = recording
        # No reference to the filter: it processes the next block during writing.
        self._method = filters.chosen_filter.method
        self._compensates = filters.output == "compensated"
        every = extra_names(header.names, header.unit, limited=filters.limit is not None)
        others = [name for names in every for name in names] if self._compensates else []
        names = make_column_names(header.names, header.unit, others)
        super().__init__(path, [TIME_NAME, *names, *others], make_metadata(header))

    def take(self, block: Block) -> None:
        """Write one block."""
        time = self._recording.sampled(block.first, block.end)
        bias = block.bias[self._method]
        if not self._compensates or block.bias_sigma is None:
            self.write([time, *bias])
            return
        header = self._recording.header
        flags = [flag for flag in (block.at_rest, block.stuck, block.saturated) if flag is not None]
        others = extra_columns(header.names, header.unit, bias, block.bias_sigma, *flags)
        self.write([time, *subtract_bias(block.raw, bias), *others.values()])


def _check_truth(truth: npt.ArrayLike, log: Log) -> Floats:
    """Return the truth axis by axis, shape (k, n)."""
    true_bias = floats(truth, "truth")
    true_bias = true_bias[:, np.newaxis] if true_bias.ndim == 1 else true_bias
    if true_bias.shape != log.data.shape:
        raise ArgumentError(
            "truth", f"must have the log's shape {log.data.shape}, got {true_bias.shape}"
        )
    return np.ascontiguousarray(true_bias.T)
