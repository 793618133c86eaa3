"""One log of a batch: the function that every engine runs."""

import time
from dataclasses import dataclass
from pathlib import Path

from zerorate._native import __version__
from zerorate.io import LogError, open_log
from zerorate.run.batch.outcome import Outcome, Row, Status
from zerorate.run.batch.record import Record
from zerorate.run.batch.rows import rows_of
from zerorate.run.batch.settings import Settings
from zerorate.run.replay import replay_to_file
from zerorate.run.replay.workers import on_threads

__all__ = ["Task", "run_task"]


@dataclass(frozen=True)
class Task:
    """A log to filter: absolute paths, and what its record will say."""

    name: str
    source: Path
    output: Path
    settings: Settings
    fingerprint: str
    force: bool = False
    version: str = __version__

    def finished(self, status: Status) -> Outcome | None:
        """Return what the record says, if this log is finished with these settings."""
        found = None if self.force else Record.beside(self.output)
        if found is None or found.fingerprint != self.fingerprint:
            return None
        return Outcome(self.name, status, found.seconds, found.rows)


def run_task(task: Task) -> Outcome:
    """Filter one log and write it with its record; a fault becomes a failed outcome.

    Running it again, even twice at once, leaves the same files.
    """
    begin = time.perf_counter()
    try:
        _check_version(task.version)
        # A worker may have died between the record and its answer.
        if (earlier := task.finished("done")) is not None:
            return earlier
        with on_threads(1):
            rows = _filter(task)
        seconds = time.perf_counter() - begin
        Record(task.fingerprint, task.output.stat().st_size, seconds, rows).write(task.output)
        return Outcome(task.name, "done", seconds, rows)
    except Exception as error:
        # Whatever is wrong with one log must not stop the others.
        return Outcome(task.name, "failed", time.perf_counter() - begin, error=_told(error))


def _filter(task: Task) -> tuple[Row, ...]:
    options = task.settings
    columns = None if options.columns is None else list(options.columns)
    recording = open_log(task.source, options.rate, columns, options.unit)
    task.output.parent.mkdir(parents=True, exist_ok=True)
    Record.discard(task.output)
    result = replay_to_file(
        recording,
        task.output,
        methods=[options.method],
        output=options.output,
        motion=options.motion,
        force=True,
    )
    return rows_of(result)


def _check_version(expected: str) -> None:
    if __version__ != expected:
        raise RuntimeError(f"the worker has zerorate {__version__}, expected {expected}")


def _told(error: Exception) -> str:
    """Return one line, with the kind of an error that does not explain itself."""
    line = " ".join(str(error).split())
    return line if isinstance(error, LogError | OSError) else f"{type(error).__name__}: {line}"
