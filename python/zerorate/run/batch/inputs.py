"""The logs of a batch: what its patterns name, without what a batch has written itself."""

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from zerorate.io.readers.parquet import native_file
from zerorate.run.batch.patterns import find
from zerorate.run.batch.task import OUTPUT_MARK, Record

__all__ = ["SUMMARY", "SUMMARY_MARK", "Inputs", "inputs"]

SUMMARY: Final = "summary.parquet"
SUMMARY_MARK: Final = b"zerorate batch"
"""Key of the summary's metadata by which it is known wherever it lies."""


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
        What matches a pattern but cannot be read, and why.
    left_out : tuple of Path
        What matches a pattern but is the output of a batch.
    """

    root: Path
    files: tuple[Path, ...]
    failed: Mapping[Path, str]
    left_out: tuple[Path, ...]


def inputs(patterns: Sequence[str], output: Path) -> Inputs:
    """Return what patterns name; FileNotFoundError if one of them names nothing.

    What a batch has written is left out, here or elsewhere, and in the output folder all that is
    named so.
    """
    found = [find(pattern) for pattern in patterns]
    root = Path(os.path.commonpath([one.root for one in found]))
    logs: set[Path] = set()
    left_out: set[Path] = set()
    for pattern, one in zip(patterns, found, strict=True):
        own = {path for path in one.files if _is_output(path, output)}
        if not one.files - own and not one.failed:
            also = f" but {len(own)} that a batch has written" if own else ""
            raise FileNotFoundError(f"no file matches '{pattern}'{also}")
        logs |= one.files - own
        left_out |= own
    failed = {path: why for one in found for path, why in one.failed.items()}
    return Inputs(root, tuple(sorted(logs)), failed, tuple(sorted(left_out)))


def _within(path: Path, folder: Path) -> bool:
    """Return whether a path lies in a folder, by its name or by where links lead."""
    real = os.path.realpath(path), os.path.realpath(folder)
    return path.is_relative_to(folder) or Path(real[0]).is_relative_to(real[1])


def _is_output(path: Path, output: Path) -> bool:
    if path.name == SUMMARY:
        return _is_summary(path)
    if not path.stem.endswith(OUTPUT_MARK):
        return False
    # In the output folder it may be one whose record a kill has prevented.
    return _within(path, output) or Record.of_either(path) is not None


def _is_summary(path: Path) -> bool:
    import pyarrow as pa
    import pyarrow.parquet as pq

    try:
        metadata = pq.read_schema(native_file(path)).metadata
    except (OSError, pa.ArrowException):
        return False
    return SUMMARY_MARK in (metadata or {})
