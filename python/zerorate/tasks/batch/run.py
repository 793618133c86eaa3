"""A batch, from patterns to the summary."""

import os
import time
from collections import Counter
from collections.abc import Callable, Generator, Iterable, Sequence
from contextlib import AbstractContextManager, closing, nullcontext
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Final, Literal, Unpack

from zerorate.faults import make_sentence
from zerorate.io.remote import is_address
from zerorate.progress import choose_counter
from zerorate.record import atomic_path, check_writable
from zerorate.record.atomic import remove_leftovers
from zerorate.tasks.batch.cluster import connect_scheduler
from zerorate.tasks.batch.cluster import local_cluster as on_local_cluster
from zerorate.tasks.batch.engines import Engine, Processes, TaskResult, WorkerDeath, run_with_retry
from zerorate.tasks.batch.fleet import Fleet, fleet_of
from zerorate.tasks.batch.inputs import SUMMARY, Inputs, command_of, find_inputs
from zerorate.tasks.batch.planning import make_tasks
from zerorate.tasks.batch.reporting import REPORT
from zerorate.tasks.batch.stored_inputs import find_stored_inputs
from zerorate.tasks.batch.summary import read_earlier, write_summary
from zerorate.tasks.batch.task import BatchArguments, Outcome, Settings, Task, run_task
from zerorate.tasks.saving import Files, figure_writer, text_writer
from zerorate.texts import describe_missing_extra
from zerorate.views import Result, page_of

OVERVIEW: Final = "overview.html"

Progress = Callable[[int, int], None]
"""Function of the number of finished logs and the number of all logs."""


@dataclass(frozen=True)
class BatchResult(Result):
    """Outcome of every log, as `zerorate.batch` returns it.

    Parameters
    ----------
    outcomes : tuple of Outcome
        One outcome for each log, sorted by name.
    summary : Path
        Table of all logs.
    seconds : float
        Duration of the batch, s.
    fleet : Fleet
        Outliers among the logs.
    left_out : tuple of Path
        Files that the sources named, left out because zerorate wrote them.
    settings : Settings
        Settings of the batch.
    earlier : tuple of Outcome
        Outcomes of further logs in the summary, from earlier runs.
    """

    outcomes: tuple[Outcome, ...]
    summary: Path
    seconds: float
    fleet: Fleet
    left_out: tuple[Path, ...]
    settings: Settings
    earlier: tuple[Outcome, ...] = ()

    @property
    def in_summary(self) -> tuple[Outcome, ...]:
        """Outcomes of all logs in the summary, sorted by name."""
        return tuple(sorted((*self.outcomes, *self.earlier), key=lambda one: one.name))

    @property
    def source(self) -> str:
        """Name of the folder of the results."""
        return self.summary.absolute().parent.name

    @property
    def command(self) -> str:
        """Command that ran on each log."""
        return self.settings.command

    @property
    def failed(self) -> tuple[Outcome, ...]:
        """Logs without a result."""
        return tuple(outcome for outcome in self.outcomes if outcome.status == "failed")

    @property
    def alarms(self) -> tuple[str, ...]:
        """Sentences on logs without a result, with the reason."""
        return tuple(
            make_sentence(f"{outcome.name}: ", outcome.error or "") for outcome in self.failed
        )

    @property
    def notes(self) -> tuple[str, ...]:
        """Notes with the number of logs that have them, the most frequent note first."""
        return tuple(
            make_sentence(f"{logs[0]}{_count_others(len(logs) - 1)}: ", note)
            for note, logs in self.logs_by_note.items()
        )

    @property
    def logs_by_note(self) -> dict[str, list[str]]:
        """Names of logs by note, the most frequent note first."""
        logs_by_note: dict[str, list[str]] = {}
        for outcome in self.outcomes:
            for note in outcome.notes:
                logs_by_note.setdefault(note, []).append(outcome.name)
        return dict(sorted(logs_by_note.items(), key=lambda pair: -len(pair[1])))

    @property
    def counts(self) -> Counter[str]:
        """Number of logs with each status."""
        return Counter(outcome.status for outcome in self.outcomes)

    @property
    def files(self) -> tuple[Path, ...]:
        """Files about all logs: the summary, and the overview of reports."""
        overview = self.summary.with_name(OVERVIEW)
        return (self.summary, overview) if self.command == REPORT.name else (self.summary,)

    def to_html(self) -> str:
        """Return the overview of reports as HTML, with links to the page of each log."""
        return page_of(self)


def _count_others(count: int) -> str:
    return f" and {count} other{'s' if count > 1 else ''}" if count else ""


def batch(
    sources: str | os.PathLike[str] | Sequence[str | os.PathLike[str]],
    folder: str | os.PathLike[str],
    *,
    command: Literal["replay", "allan", "report", "check"] = "replay",
    workers: int | None = None,
    local_cluster: int | None = None,
    scheduler: str | None = None,
    force: bool = False,
    progress: Progress | None = None,
    **settings: Unpack[BatchArguments],
) -> BatchResult:
    """Filter many logs, estimate their noise, report on them or check them; compare the logs.

    Each log is processed separately. A log that fails, or kills its worker twice, is reported, and
    the other logs continue. A run may be stopped at any time; the next run skips finished logs. The
    summary keeps logs of earlier runs with the same settings. ``zerorate batch`` does the same.

    Parameters
    ----------
    sources : str, path, or sequence of these
        Folders with logs, files, or patterns such as ``"logs/**/*.parquet"``. All sources can
        instead be addresses in an object store, such as ``"s3://bucket/logs"``, which pyarrow
        reads. Brackets may also be part of a file's name. ``**`` visits each folder once, even if
        links lead to it again. Files written by zerorate are left out unless a pattern names them.
    folder : path
        Folder of the results, created if missing; it mirrors the folders of the sources. It
        contains the result of each log, its record in JSON, and ``summary.parquet``. With "report",
        it also contains ``overview.html``. Each command needs its own folder.
    command : {"replay", "allan", "report", "check"}
        Command on each log. "replay": filter the log. "allan": find the noise of gyros and
        accelerometers. "report": report on the IMU. "check": check units, signs and axes.
    workers : int, optional
        Number of worker processes; default one per core.
    local_cluster : int, optional
        Number of workers of a Dask cluster on this machine, instead of `workers`.
    scheduler : str, optional
        Address of a running Dask scheduler, instead of `workers`. Its workers need the same paths.
    force : bool
        Process finished logs again. Default False.
    progress : callable, optional
        Called with the number of finished logs and the number of all logs. By default a notebook
        shows a bar.
    **settings
        Arguments of `zerorate.tasks.batch.Settings` for reading, filtering and writing, such as
        ``unit="deg/s"`` or ``motion="hold"``.

    Returns
    -------
    BatchResult
        Outcome of each log, and the outliers among the logs. The result has the methods `table`,
        `plot` and `save`.

    Raises
    ------
    ValueError
        If an argument is not valid, or two logs would have the same output file. Also if the folder
        has the summary of another command.
    OSError
        If a source has no log, or the output cannot be written.
    ImportError
        If pyarrow or, for a cluster, distributed is not installed.

    Examples
    --------
    >>> import tempfile
    >>> from pathlib import Path
    >>> import numpy as np
    >>> import zerorate as zr
    >>> folder = Path(tempfile.mkdtemp())
    >>> z = np.random.default_rng(1).standard_normal(3000)
    >>> zr.write_log(zr.Log(np.arange(3000) / 100, 100, z, ["gyro_z"]), folder / "a.parquet")
    >>> result = zr.batch(f"{folder}/*.parquet", folder / "out", workers=1)
    >>> result.counts["done"], sorted(path.name for path in (folder / "out").iterdir())
    (1, ['a-zerorate.json', 'a-zerorate.parquet', 'summary.parquet'])
    """
    begin = time.perf_counter()
    _check_pyarrow()
    listed = [sources] if isinstance(sources, str | os.PathLike) else sources
    batch_settings, folder = Settings(command=command, **settings), Path(folder)
    engine = _choose_engine(workers, local_cluster, scheduler)
    log_files = _find_logs([os.fspath(one) for one in listed])
    tasks, unread = make_tasks(log_files, folder, batch_settings, force)
    summary = folder / SUMMARY
    _check_summary(summary, batch_settings)
    folder.mkdir(parents=True, exist_ok=True)
    check_writable(summary, force=True)
    ends = {task.name: end for task in tasks if (end := task.read_outcome("skipped")) is not None}
    todo = [task for task in tasks if task.name not in ends]
    if todo:
        with closing(_run_tasks(engine, todo, sweeping=scheduler is None)) as outcomes_of_run:
            ends |= _collect_outcomes(outcomes_of_run, len(todo), choose_counter(progress))
    finished = (_check_output(task, ends[task.name]) for task in tasks)
    outcomes = tuple(sorted((*finished, *unread), key=lambda one: one.name))
    earlier = read_earlier(summary, batch_settings, {one.name for one in outcomes})
    rows = {one.name: one.rows for one in (*outcomes, *earlier)}
    fleet = fleet_of(rows, batch_settings.operation.quantities)
    seconds = time.perf_counter() - begin
    result = BatchResult(
        outcomes, summary, seconds, fleet, log_files.left_out, batch_settings, earlier
    )
    folder.mkdir(parents=True, exist_ok=True)
    _write_tables(result)
    return result


def _write_tables(result: BatchResult) -> None:
    """Write the tables of all logs: the summary, and the overview of reports."""
    write_summary(result.in_summary, result.fleet, result.settings, result.summary)
    for overview in result.files[1:]:
        with atomic_path(overview, force=True) as temporary:
            text_writer(result.to_html())(temporary)


def files_of(result: BatchResult) -> Files:
    """Return the files of a batch: the table of all logs, the overview of reports, a figure."""

    def table(path: Path) -> None:
        write_summary(result.in_summary, result.fleet, result.settings, path)

    pages = [text_writer(result.to_html())] if result.files[1:] else []
    endings = [".html"] if pages else []
    figures = {"": figure_writer(result.plot)}
    return Files("-zerorate-batch", ".parquet", [table, *pages], endings, figures)


def _collect_outcomes(ends: Iterable[Outcome], count: int, report: Progress) -> dict[str, Outcome]:
    """Return the outcomes by name, and report their number as they arrive."""
    outcomes: dict[str, Outcome] = {}
    report(0, count)
    for end in ends:
        outcomes[end.name] = end
        report(len(outcomes), count)
    return outcomes


def _run_tasks(
    engine: AbstractContextManager[Engine], tasks: list[Task], sweeping: bool
) -> Generator[Outcome]:
    """Yield the outcome of each task, then remove files of killed workers."""
    completed = False
    try:
        with engine as running, closing(run_with_retry(running, run_task, tasks)) as ends:
            for end in ends:
                yield _outcome_of_end(end)
        completed = True
    finally:
        # On a shared cluster, started tasks continue after an interrupt.
        if completed or sweeping:
            remove_leftovers(path for task in tasks for path in (task.output, task.record))


def _outcome_of_end(end: TaskResult[Task, Outcome] | WorkerDeath[Task]) -> Outcome:
    if isinstance(end, WorkerDeath):
        return Outcome(end.task.name, "failed", error=f"{end.reason}, alone as well")
    return end.answer


def _check_output(task: Task, outcome: Outcome) -> Outcome:
    """Return the outcome; failed if the output was removed in the meantime."""
    if outcome.status == "failed" or task.output.exists():
        return outcome
    return replace(outcome, status="failed", error=f"{task.output} was removed during the run")


def _choose_engine(
    workers: int | None, local_cluster: int | None, scheduler: str | None
) -> AbstractContextManager[Engine]:
    if sum(one is not None for one in (workers, local_cluster, scheduler)) > 1:
        raise ValueError("workers, local_cluster and scheduler exclude each other")
    if scheduler is not None:
        return connect_scheduler(scheduler)
    if local_cluster is not None:
        return on_local_cluster(local_cluster)
    return nullcontext(Processes(workers))


def _find_logs(sources: Sequence[str]) -> Inputs:
    """Return the logs of folders, files and patterns, or of addresses in a store."""
    return find_stored_inputs(sources) if any(map(is_address, sources)) else find_inputs(sources)


def _check_pyarrow() -> None:
    try:
        import pyarrow  # noqa: F401
    except ImportError:
        raise ImportError(describe_missing_extra("pyarrow", "io", "a batch")) from None


def _check_summary(summary: Path, settings: Settings) -> None:
    """Raise an error if the folder has the summary of another command, which would be replaced."""
    other = command_of(summary)
    if other is not None and other != settings.command:
        raise ValueError(
            f"{summary} is of command '{other}': give '{settings.command}' a folder of its own"
        )
