"""Where a log comes from: a file, the folder of a ROS 2 bag, or an object in memory."""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy.typing as npt

from zerorate.io.errors import LogError
from zerorate.io.formats import NO_TOPICS, format_of, is_bag_folder
from zerorate.io.objects import ArrowStream, described, table_of
from zerorate.io.table import Table

__all__ = ["LogSource", "label_of", "opened"]

LogSource = str | os.PathLike[str] | Mapping[str, npt.ArrayLike] | npt.NDArray[Any] | ArrowStream


def label_of(source: LogSource) -> str:
    """Return what messages call a source."""
    return str(Path(source)) if isinstance(source, (str, os.PathLike)) else described(source)


def opened(source: LogSource, topic: str | None) -> tuple[str, Table]:
    """Return the format of a source and its table."""
    if isinstance(source, (str, os.PathLike)):
        file = Path(source)
        _check_readable(file)
        form = format_of(file)
        return form.kind, form.read(file, topic)
    if topic is not None:
        raise LogError(NO_TOPICS)
    return table_of(source)


def _check_readable(file: Path) -> None:
    if file.is_dir() and not is_bag_folder(file):
        raise IsADirectoryError(f"{file} is a folder, expected a log file or a ROS 2 bag")
    if not file.exists():
        raise FileNotFoundError(f"{file} does not exist")
    if not os.access(file, os.R_OK):
        raise PermissionError(f"{file} cannot be read: permission denied")
