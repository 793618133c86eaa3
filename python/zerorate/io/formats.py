"""The formats of files, and the opening of a source: a file, a bag's folder, or an object."""

from __future__ import annotations

import os
import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final

import numpy.typing as npt

from zerorate.io.damage import guarded_content
from zerorate.io.log import LogError
from zerorate.io.parts import Part
from zerorate.io.readers import (
    ardupilot,
    arrow,
    camera,
    hdf5,
    matlab,
    mavlink,
    numpy_files,
    parquet,
    px4,
    ros,
    text,
)
from zerorate.io.readers.dataflash import is_text_log
from zerorate.io.readers.objects import ArrowStream, described, table_of
from zerorate.io.table import Content, Format
from zerorate.texts import printable

LogSource = (
    str | os.PathLike[str] | Mapping[str, npt.ArrayLike] | npt.NDArray[Any] | ArrowStream | Part
)

FORMATS: Final = (
    text.FORMAT,
    numpy_files.NPY,
    numpy_files.NPZ,
    parquet.FORMAT,
    arrow.FORMAT,
    hdf5.FORMAT,
    matlab.FORMAT,
    *ros.FORMATS,
    px4.FORMAT,
    ardupilot.FORMAT,
    ardupilot.TEXT,
    mavlink.FORMAT,
    camera.FORMAT,
)
"""To add one, see "Adding a reader" in CONTRIBUTING.md."""

_TEXT = text.FORMAT
_BINARY = tuple(form for form in FORMATS if form.marks or form.looks)
_BAG_FOLDER = next(form for form in FORMATS if form.kind == "ros2")
_HEAD = 16


def label_of(source: LogSource) -> str:
    """Return what messages and outputs call a source."""
    if isinstance(source, (str, os.PathLike)):
        return printable(str(Path(source)))
    if isinstance(source, Part):
        return source.label
    return described(source)


def opened(source: LogSource) -> tuple[str, Content]:
    """Return the format of a source and its content."""
    if isinstance(source, (str, os.PathLike)):
        file = Path(source)
        check_readable(file)
        form = format_of(file)
        return form.kind, guarded_content(form, file)
    if isinstance(source, Part):
        return source.kind, source.content
    kind, table = table_of(source)
    return kind, Content.of(table)


def check_readable(file: Path) -> None:
    """Raise the OSError that says why a path is no file or bag that can be read."""
    if file.is_dir() and not ros.is_bag_folder(file) and not text.is_sensor_folder(file):
        raise IsADirectoryError(
            f"{file} is a folder, expected a log file, a ROS 2 bag, or a folder of files that are "
            "named after sensors, such as Gyroscope.csv"
        )
    if not file.exists():
        raise FileNotFoundError(f"{file} does not exist")
    inside = file.iterdir() if file.is_dir() else ()
    for one in (file, *inside):
        # Whoever reads a pipe may wait for ever, and nobody reads it twice.
        if one.exists() and not one.is_file() and not one.is_dir():
            raise OSError(f"{one} is a pipe, a socket or a device, expected a file; copy it to one")
    if not os.access(file, os.R_OK):
        raise PermissionError(f"{file} cannot be read: permission denied")


def format_of(file: Path) -> Format:
    """Return the format of a file or bag; LogError if suffix and content disagree."""
    if ros.is_bag_folder(file):
        return _BAG_FOLDER
    if text.is_sensor_folder(file):
        return text.FOLDER
    suffix = file.suffix.lower()
    form = next((form for form in FORMATS if suffix in form.suffixes), None)
    if form is None and _holds_a_table(file):
        form = _TEXT
    if form is _TEXT and _is_log_as_text(file):
        return ardupilot.TEXT
    if form is None:
        known = ", ".join(suffix for form in FORMATS for suffix in form.suffixes)
        raise LogError(f"unknown suffix '{file.suffix}'; known: {known}")
    with file.open("rb") as opened_file:
        head = opened_file.read(_HEAD)
    if not head:
        raise LogError(f"the file is empty, expected {form.called}")
    _check_content(form, head)
    return form


def _holds_a_table(file: Path) -> bool:
    """Whether a file of another suffix, such as ``.log``, is a text with lines of numbers."""
    with file.open("rb") as opened_file:
        head = opened_file.read(1 << 12)
    known = binary_format(head) is not None
    return not known and text.is_text(head) and len(re.findall(rb"[0-9][^\n]*\n", head)) > 1


def _is_log_as_text(file: Path) -> bool:
    with file.open("rb") as opened_file:
        return is_text_log(opened_file.read(1 << 12))


def binary_format(head: bytes) -> Format | None:
    """Return the format whose files begin so, None for a text."""
    return next((form for form in _BINARY if form.fits(head)), None)


def _check_content(form: Format, head: bytes) -> None:
    content = binary_format(head) or _TEXT
    if content is not form and not form.fits(head):
        found = "something else" if content is _TEXT else content.called
        raise LogError(f"by its suffix {form.called}, by its content {found}; rename or convert it")
