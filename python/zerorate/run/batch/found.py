"""From patterns to tasks: which logs there are, and where each one's output goes."""

import glob
import os
from collections.abc import Iterable, Sequence
from pathlib import Path

from zerorate.run.batch.settings import Settings
from zerorate.run.batch.task import Task

__all__ = ["find_tasks"]


def find_tasks(
    patterns: Sequence[str], output: Path, settings: Settings, force: bool = False
) -> list[Task]:
    """Return a task for each file that a pattern matches, by name; outputs mirror the folders.

    Raises
    ------
    FileNotFoundError
        If a pattern matches no file.
    ValueError
        If two logs would be written to one place.
    """
    # Absolute, since a worker may stand elsewhere; links are kept, as a cluster may mount them so.
    folder = Path(os.path.abspath(output))
    found = {path for pattern in patterns for path in _matches(pattern, folder)}
    root = Path(os.path.commonpath([_fixed_part(pattern) for pattern in patterns]))
    tasks = [_task(path, path.relative_to(root), folder, settings, force) for path in sorted(found)]
    _check_apart(tasks)
    return tasks


def _matches(pattern: str, output: Path) -> list[Path]:
    paths = [Path(path) for path in glob.glob(os.path.abspath(pattern), recursive=True)]
    # What an earlier run wrote is not to be filtered again.
    files = [path for path in paths if path.is_file() and not path.is_relative_to(output)]
    if not files:
        raise FileNotFoundError(f"no file matches '{pattern}'")
    return files


def _fixed_part(pattern: str) -> str:
    """Return the deepest folder of a pattern that does not depend on what it matches."""
    path = Path(os.path.abspath(pattern))
    fixed = [folder for folder in path.parents if not glob.has_magic(str(folder))]
    return str(fixed[0])


def _task(source: Path, relative: Path, output: Path, settings: Settings, force: bool) -> Task:
    name = relative.as_posix()
    state = source.stat()
    return Task(
        name=name,
        source=source,
        output=output / relative.with_name(f"{relative.stem}-zerorate.{settings.format}"),
        settings=settings,
        fingerprint=settings.fingerprint(name, state.st_size, state.st_mtime_ns),
        force=force,
    )


def _check_apart(tasks: Iterable[Task]) -> None:
    owners: dict[Path, str] = {}
    for task in tasks:
        other = owners.setdefault(task.output, task.name)
        if other != task.name:
            raise ValueError(f"'{other}' and '{task.name}' would both become {task.output.name}")
