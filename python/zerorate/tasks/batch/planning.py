"""Tasks of a batch: logs, outputs, and results of earlier runs."""

import os
from collections.abc import Iterable
from pathlib import Path

from zerorate.tasks.batch.inputs import Inputs, LogFile
from zerorate.tasks.batch.task import Outcome, Settings, Task


def make_tasks(
    log_files: Inputs, output: Path, settings: Settings, force: bool = False
) -> tuple[list[Task], list[Outcome]]:
    """Return a task for each log, with an output in a mirrored folder, and the failures.

    Raises
    ------
    ValueError
        If two logs would have the same output.
    """
    # Absolute, because a worker may have another working folder; links stay, as in a cluster's
    # mounts.
    folder = Path(os.path.abspath(output))
    tasks, failed = [], dict(log_files.failed)
    for log in log_files.files:
        try:
            tasks.append(_make_task(log, folder, settings, force))
        except OSError as error:
            failed[log.name] = error.strerror or str(error)
    _check_distinct_outputs(tasks)
    return tasks, [Outcome(name, "failed", error=why) for name, why in failed.items()]


def _make_task(log: LogFile, folder: Path, settings: Settings, force: bool) -> Task:
    if ".." in Path(log.name).parts:
        raise OSError("its path in the store leads out of the folder of results")
    output, record = settings.operation.paths(folder / log.name, settings.format)
    fingerprint = settings.fingerprint(log.name, *log.read_state())
    return Task(log.name, log.source, output, record, settings, fingerprint, force)


def _check_distinct_outputs(tasks: Iterable[Task]) -> None:
    owners: dict[Path, str] = {}
    for task in tasks:
        other = owners.setdefault(task.output, task.name)
        if other != task.name:
            raise ValueError(
                f"'{other}' and '{task.name}' would both become {task.output.name}: "
                "choose one of them by a pattern such as '**/*.csv'"
            )
