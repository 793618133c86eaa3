"""The logs of a batch: what its patterns and folders name, without what zerorate has written."""

import os
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from zerorate.io.readers.parquet import native_file
from zerorate.tasks.batch.patterns import SUFFIXES, find

SUMMARY: Final = "summary.parquet"
SUMMARY_MARK: Final = b"zerorate batch"
"""Key of the summary's metadata by which it is known wherever it lies."""

_RESULT: Final = re.compile("-zerorate(?=-|$)")
"""What every command adds to the name of a log whose results it writes."""

_TRUTH: Final = "-truth"
"""What ``zerorate simulate`` adds to the name of a log for the file of its true drift."""


@dataclass(frozen=True)
class Inputs:
    """Files below a common folder.

    Attributes
    ----------
    root : Path
        The folder.
    files : tuple of Path
        The logs, sorted.
    failed : mapping of Path to str
        What is named but cannot be read, and why.
    left_out : tuple of Path
        What is named but was written by zerorate.
    """

    root: Path
    files: tuple[Path, ...]
    failed: Mapping[Path, str]
    left_out: tuple[Path, ...]


def inputs(patterns: Sequence[str]) -> Inputs:
    """Return what folders and patterns name; FileNotFoundError if one of them names no log.

    What zerorate has written is left out wherever it lies, unless a pattern asks for it: results,
    by the mark in their name, the summary of a batch, and the true drift next to a simulated log.
    """
    found = [find(pattern) for pattern in patterns]
    root = Path(os.path.commonpath([one.root for one in found]))
    logs: set[Path] = set()
    left_out: set[Path] = set()
    for pattern, one in zip(patterns, found, strict=True):
        own = {path for path in one.files if _is_written(path, pattern)}
        if not one.files - own and not one.failed:
            raise FileNotFoundError(_nothing(pattern, len(own)))
        logs |= one.files - own
        left_out |= own - logs
    failed = {path: why for one in found for path, why in one.failed.items()}
    return Inputs(root, tuple(sorted(logs)), failed, tuple(sorted(left_out - logs)))


def command_of(summary: Path) -> str | None:
    """Return which command wrote the summary of a batch; None for any other file."""
    import pyarrow as pa
    import pyarrow.parquet as pq

    try:
        metadata = pq.read_schema(native_file(summary)).metadata
    except (OSError, pa.ArrowException):
        return None
    name = (metadata or {}).get(SUMMARY_MARK)
    return None if name is None else name.decode()


def _is_written(path: Path, pattern: str) -> bool:
    """Return whether zerorate has written a file that a pattern names, but does not ask for."""
    asked = Path(pattern).stem
    if path.name == SUMMARY:
        return command_of(path) is not None
    if _RESULT.search(path.stem):
        return not _RESULT.search(asked)
    log = path.with_name(path.stem.removesuffix(_TRUTH) + path.suffix)
    return path.stem.endswith(_TRUTH) and not asked.endswith(_TRUTH) and log.exists()


def _nothing(pattern: str, written: int) -> str:
    if Path(pattern).is_dir():
        which = f"no file in the folder '{pattern}' ends in one of {', '.join(SUFFIXES)}"
    else:
        which = f"no file matches '{pattern}'"
    return f"{which} but {written} that zerorate has written" if written else which
