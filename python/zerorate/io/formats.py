"""The formats of files, and the opening of a source: a file, a bag's folder, or an object."""

from __future__ import annotations

import os
import re
from collections.abc import Mapping
from importlib import import_module
from pathlib import Path
from typing import Any, Final

import numpy.typing as npt

from zerorate.io.beginnings import is_of_camera, is_telemetry, is_text, is_text_log
from zerorate.io.damage import guarded_content
from zerorate.io.parts import Part
from zerorate.io.readers.objects import ArrowStream, described, table_of
from zerorate.io.table import Content, Format, Needs, Reader
from zerorate.record.log import LogError
from zerorate.texts import printable

LogSource = (
    str | os.PathLike[str] | Mapping[str, npt.ArrayLike] | npt.NDArray[Any] | ArrowStream | Part
)


def _by(module: str, function: str = "read") -> Reader:
    """Return a reader whose module is imported when a file is read by it."""

    def read(path: Path, /) -> Content:
        found: Reader = getattr(import_module(f"zerorate.io.readers.{module}"), function)
        return found(path)

    return read


_ROS: Final = Needs("rosbags", "ros")
_ARROW: Final = Needs("pyarrow", "io")
_ULOG: Final = b"ULog\x01\x12\x35"
_MAT: Final = (b"MATLAB 5.0", b"MATLAB 7.3")
_IPC: Final = (b"ARROW1", b"\xff\xff\xff\xff")
_VIDEOS: Final = (".mp4", ".mov", ".360", ".insv", ".bbl", ".bfl", ".gcsv")
_CAMERA: Final = Needs("telemetry_parser", "camera")

TEXT: Final = Format("text", "a text table", (".csv", ".tsv", ".txt", ".dat"), (), _by("text"))
FORMATS: Final = (
    TEXT,
    Format("npy", "an .npy array", (".npy",), (b"\x93NUMPY",), _by("numpy_files", "read_npy")),
    Format("npz", "an .npz", (".npz",), (b"PK\x03\x04",), _by("numpy_files", "read_npz")),
    Format("parquet", "Parquet", (".parquet", ".pq"), (b"PAR1",), _by("parquet"), _ARROW),
    Format("arrow", "Arrow IPC", (".arrow", ".feather", ".ipc"), _IPC, _by("arrow"), _ARROW),
    Format(
        "hdf5",
        "an HDF5 file",
        (".h5", ".hdf5"),
        (b"\x89HDF\r\n\x1a\n",),
        _by("hdf5"),
        Needs("h5py", "hdf5"),
    ),
    Format("mat", "a MAT file", (".mat",), _MAT, _by("matlab"), Needs("scipy", "mat")),
    Format("ros1", "a ROS 1 bag", (".bag",), (b"#ROSBAG V2.0",), _by("ros"), _ROS),
    Format("ros2", "a ROS 2 bag", (".db3",), (b"SQLite format 3",), _by("ros"), _ROS),
    Format("mcap", "MCAP", (".mcap",), (b"\x89MCAP0\r\n",), _by("ros"), _ROS),
    Format("ulog", "a ULog", (".ulg",), (_ULOG,), _by("px4")),
    Format(
        "dataflash",
        "a DataFlash log",
        (".bin",),
        (b"\xa3\x95\x80",),
        _by("ardupilot", "read_binary"),
    ),
    Format("dataflash text", "a DataFlash log as text", (), (), _by("ardupilot", "read_text")),
    Format(
        "mavlink", "a telemetry log of MAVLink", (".tlog",), (), _by("mavlink"), looks=is_telemetry
    ),
    Format(
        "camera", "a video or flight recorder", _VIDEOS, (), _by("camera"), _CAMERA, is_of_camera
    ),
)
"""To add one, see "Adding a reader" in CONTRIBUTING.md."""

_FOLDER: Final = Format("folder", "a folder of text tables", (), (), _by("text", "read_folder"))
_BINARY = tuple(form for form in FORMATS if form.marks or form.looks)
_BAG_FOLDER, _LOG_AS_TEXT = (
    next(form for form in FORMATS if form.kind == kind) for kind in ("ros2", "dataflash text")
)
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
    if file.is_dir() and not is_bag_folder(file) and not _is_sensor_folder(file):
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


def is_bag_folder(path: Path) -> bool:
    """Whether a folder is a ROS 2 bag."""
    return (path / "metadata.yaml").is_file()


def _is_sensor_folder(path: Path) -> bool:
    """Whether a folder holds text tables that are named after their sensors."""
    if not path.is_dir():
        return False
    from zerorate.io.readers.text import sensor_files

    return bool(sensor_files(path))


def format_of(file: Path) -> Format:
    """Return the format of a file or bag; LogError if suffix and content disagree."""
    if is_bag_folder(file):
        return _BAG_FOLDER
    if _is_sensor_folder(file):
        return _FOLDER
    suffix = file.suffix.lower()
    form = next((form for form in FORMATS if suffix in form.suffixes), None)
    if form is None and _holds_a_table(file):
        form = TEXT
    if form is TEXT and _is_log_as_text(file):
        return _LOG_AS_TEXT
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
    return not known and is_text(head) and len(re.findall(rb"[0-9][^\n]*\n", head)) > 1


def _is_log_as_text(file: Path) -> bool:
    with file.open("rb") as opened_file:
        return is_text_log(opened_file.read(1 << 12))


def binary_format(head: bytes) -> Format | None:
    """Return the format whose files begin so, None for a text."""
    return next((form for form in _BINARY if form.fits(head)), None)


def _check_content(form: Format, head: bytes) -> None:
    content = binary_format(head) or TEXT
    if content is not form and not form.fits(head):
        found = "something else" if content is TEXT else content.called
        raise LogError(f"by its suffix {form.called}, by its content {found}; rename or convert it")
