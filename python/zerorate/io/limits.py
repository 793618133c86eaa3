"""Limits for reading a file: computing time, memory and number of columns."""

from __future__ import annotations

from pathlib import Path
from typing import Final

from zerorate.numerals import shorten
from zerorate.record.log import LogError

_BASE_BYTES: Final = 64 << 20
_BYTES_PER_FILE_BYTE: Final = 20
_BASE_SECONDS: Final = 3.0
_SECONDS_PER_MB: Final = 0.8
_MAX_COLUMNS: Final = 16_384
"""Largest number of columns, as in spreadsheets."""


def max_bytes(path: Path) -> int:
    """Return the limit of memory for the content of a file, or of a folder, bytes."""
    return _BASE_BYTES + _BYTES_PER_FILE_BYTE * _file_size(path)


def max_seconds(path: Path) -> float:
    """Return the limit of computing time for a process that reads a file, s."""
    return _BASE_SECONDS + _SECONDS_PER_MB * 1e-6 * _file_size(path)


def check_bytes(path: Path, declared: int, what: str) -> None:
    """Raise LogError for content much larger than its file, as in damaged files."""
    if declared > max_bytes(path):
        raise LogError(
            f"{what} would take {shorten(1e-6 * declared, 3)} MB of memory, more than "
            f"{_BYTES_PER_FILE_BYTE} "
            f"times the file of {shorten(1e-6 * _file_size(path), 3)} MB: it is damaged, or holds "
            "hardly "
            "anything but repetitions"
        )


def check_columns(width: int) -> None:
    """Raise LogError for a table with more columns than any recording."""
    if width > _MAX_COLUMNS:
        raise LogError(f"the table has {width} columns, expected at most {_MAX_COLUMNS}")


def _file_size(path: Path) -> int:
    files = path.iterdir() if path.is_dir() else [path]
    return sum(file.stat().st_size for file in files)
