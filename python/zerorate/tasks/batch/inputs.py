"""Logs of a batch from patterns and folders, without files written by zerorate."""

import os
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path, PurePath
from typing import Final

from zerorate.io.formats import known_suffixes
from zerorate.io.readers.parquet import open_native_file
from zerorate.io.store import list_store
from zerorate.tasks.batch.command import LogPath
from zerorate.tasks.batch.patterns import find_files

SUMMARY: Final = "summary.parquet"
SUMMARY_MARK: Final = b"zerorate batch"
"""Key in the summary's metadata that identifies a summary."""

_RESULT_MARK: Final = re.compile("-zerorate(?=-|$)")
"""Text that every command adds to a log's name for its results."""

_TRUTH_SUFFIX: Final = "-truth"
"""Suffix that ``zerorate simulate`` adds to a log's name for its true drift."""


@dataclass(frozen=True)
class LogFile:
    """A log of a batch.

    Attributes
    ----------
    name : str
        Path of the log below the common folder of all logs, with slashes.
    source : Path or str
        Path of the file, or its address in an object store.
    state : tuple of int, optional
        Size in bytes and time of change in ns, if listed by a store.
    """

    name: str
    source: LogPath
    state: tuple[int, int] | None = None

    def read_state(self) -> tuple[int, int]:
        """Return size and time of change; for a bag, of all files in its folder.

        Raises OSError if the file cannot be read.
        """
        if self.state is not None:
            return self.state
        if isinstance(self.source, str):
            (stored,) = list_store(self.source).files
            return stored.size, stored.modified
        path = self.source
        states = [one.stat() for one in (path.iterdir() if path.is_dir() else [path])]
        return sum(one.st_size for one in states), max(one.st_mtime_ns for one in states)


@dataclass(frozen=True)
class Inputs:
    """The logs of a batch.

    Attributes
    ----------
    files : tuple of LogFile
        The logs, sorted by name.
    failed : mapping of str to str
        Names of unreadable files, with the reasons.
    left_out : tuple of Path
        Named files written by zerorate.
    """

    files: tuple[LogFile, ...]
    failed: Mapping[str, str]
    left_out: tuple[Path, ...]


def find_inputs(patterns: Sequence[str]) -> Inputs:
    """Return the logs of folders and patterns; FileNotFoundError if one has no log.

    Files written by zerorate are left out, unless a pattern names them. These are results
    (recognised by their names), summaries of a batch, and true drifts of simulated logs.
    """
    matches = [find_files(pattern) for pattern in patterns]
    root = Path(os.path.commonpath([matched.root for matched in matches]))
    logs: set[Path] = set()
    left_out: set[Path] = set()
    for pattern, matched in zip(patterns, matches, strict=True):
        own_outputs = {path for path in matched.files if _is_own_output(path, pattern)}
        if not matched.files - own_outputs and not matched.failed:
            raise FileNotFoundError(_describe_no_match(pattern, len(own_outputs)))
        logs |= matched.files - own_outputs
        left_out |= own_outputs - logs
    failed = {path: why for matched in matches for path, why in matched.failed.items()}
    return Inputs(
        tuple(LogFile(path.relative_to(root).as_posix(), path) for path in sorted(logs)),
        {path.relative_to(root).as_posix(): why for path, why in failed.items()},
        tuple(sorted(left_out - logs)),
    )


def command_of(summary: Path) -> str | None:
    """Return the command of a batch's summary; None for other files."""
    import pyarrow as pa
    import pyarrow.parquet as pq

    try:
        metadata = pq.read_schema(open_native_file(summary)).metadata
    except (OSError, pa.ArrowException):
        return None
    name = (metadata or {}).get(SUMMARY_MARK)
    return None if name is None else name.decode()


def is_result_name(path: PurePath, pattern: PurePath) -> bool:
    """Return True for the name of a result that a pattern matches only by accident."""
    has_mark = _RESULT_MARK.search(path.stem) is not None
    return has_mark and not _RESULT_MARK.search(pattern.stem)


def _is_own_output(path: Path, pattern: str) -> bool:
    """Return True if an output file of an earlier run matches the pattern only by accident."""
    pattern_stem = Path(pattern).stem
    if path.name == SUMMARY:
        return command_of(path) is not None
    if _RESULT_MARK.search(path.stem):
        return is_result_name(path, Path(pattern))
    log = path.with_name(path.stem.removesuffix(_TRUTH_SUFFIX) + path.suffix)
    return (
        path.stem.endswith(_TRUTH_SUFFIX)
        and not pattern_stem.endswith(_TRUTH_SUFFIX)
        and log.exists()
    )


def _describe_no_match(pattern: str, written: int) -> str:
    if Path(pattern).is_dir():
        which = f"no file in the folder '{pattern}' ends in one of {', '.join(known_suffixes())}"
    else:
        which = f"no file matches '{pattern}'"
    return f"{which} but {written} written by zerorate" if written else which
