"""The formats of files, and the opening of a source: a file, a bag's folder, or an object."""

from __future__ import annotations

import io
import os
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from importlib import import_module
from pathlib import Path
from typing import Any, Final

import numpy.typing as npt

from zerorate.io.damage import read_guarded
from zerorate.io.parts import Part
from zerorate.io.plugins import find_plugin, plugin_formats
from zerorate.io.readers.objects import ArrowStream, describe_object, make_table
from zerorate.io.remote import Spooled, hide_secrets, is_address, spooled
from zerorate.io.signatures import is_camera_file, is_dataflash_text, is_telemetry, is_text
from zerorate.io.table import Column, Content, Format, Needs, Reader, Table
from zerorate.record.log import LogError
from zerorate.record.regular import check_regular
from zerorate.texts import make_printable

LogSource = (
    str
    | os.PathLike[str]
    | io.BytesIO
    | Mapping[str, npt.ArrayLike]
    | npt.NDArray[Any]
    | ArrowStream
    | Part
)


def _import_reader(module: str, function: str = "read") -> Reader:
    """Return a reader whose module is imported when a file is read by it."""

    def read(path: Path, /) -> Content:
        reader: Reader = getattr(import_module(f"zerorate.io.readers.{module}"), function)
        return reader(path)

    return read


_ROS: Final = Needs("rosbags", "ros")
_ARROW: Final = Needs("pyarrow", "io")
_ULOG_MARK: Final = b"ULog\x01\x12\x35"
_MAT_MARKS: Final = (b"MATLAB 5.0", b"MATLAB 7.3")
_IPC_MARKS: Final = (b"ARROW1", b"\xff\xff\xff\xff")
_VIDEO_SUFFIXES: Final = (".mp4", ".mov", ".360", ".insv", ".gcsv")
_TELEMETRY: Final = Needs("telemetry_parser", "camera")
"""For cameras other than GoPro's."""
_BLACKBOX_MARKS: Final = (b"H Product:Blackb",)
_HDF5: Final = Needs("h5py", "hdf5")
_MAVLINK: Final = "a telemetry log of MAVLink"
_CAMERAS: Final = "a video with telemetry"
_BLACKBOX: Final = "a blackbox log"

_TEXTS: Final = (".csv", ".tsv", ".txt", ".dat", ".json", ".jsonl", ".ndjson", ".gpx")
TEXT: Final = Format("text", "a text table", _TEXTS, (), _import_reader("text"))


def _format(
    kind: str,
    description: str,
    suffixes: tuple[str, ...],
    signatures: tuple[bytes, ...],
    reader: str,
    needs: Needs | None = None,
    matches_head: Callable[[bytes], bool] | None = None,
) -> Format:
    """Return a format of a module in ``readers``, or of a function of one: ``"ros"``, ``"a.b"``."""
    read = _import_reader(*reader.split("."))
    return Format(kind, description, suffixes, signatures, read, needs, matches_head)


_ARROWS: Final = (".arrow", ".feather", ".ipc")
FORMATS: Final = (
    TEXT,
    _format("npy", "an .npy array", (".npy",), (b"\x93NUMPY",), "numpy_files.read_npy"),
    _format("npz", "an .npz", (".npz",), (b"PK\x03\x04",), "numpy_files.read_npz"),
    _format("parquet", "Parquet", (".parquet", ".pq"), (b"PAR1",), "parquet", _ARROW),
    _format("arrow", "Arrow IPC", _ARROWS, _IPC_MARKS, "arrow", _ARROW),
    _format("hdf5", "an HDF5 file", (".h5", ".hdf5"), (b"\x89HDF\r\n\x1a\n",), "hdf5", _HDF5),
    _format("mat", "a MAT file", (".mat",), _MAT_MARKS, "matlab", Needs("scipy", "mat")),
    _format("ros1", "a ROS 1 bag", (".bag",), (b"#ROSBAG V2.0",), "ros", _ROS),
    _format("ros2", "a ROS 2 bag", (".db3",), (b"SQLite format 3",), "ros", _ROS),
    _format("mcap", "MCAP", (".mcap",), (b"\x89MCAP0\r\n",), "ros", _ROS),
    _format("ulog", "a ULog", (".ulg",), (_ULOG_MARK,), "px4"),
    _format("dataflash", "a DataFlash log", (".bin",), (b"\xa3\x95\x80",), "ardupilot.read_binary"),
    _format("dataflash text", "a DataFlash log as text", (), (), "ardupilot.read_text"),
    _format("mavlink", _MAVLINK, (".tlog",), (), "mavlink", matches_head=is_telemetry),
    _format("blackbox", _BLACKBOX, (".bbl", ".bfl"), _BLACKBOX_MARKS, "blackbox"),
    _format("camera", _CAMERAS, _VIDEO_SUFFIXES, (), "camera", _TELEMETRY, is_camera_file),
)
"""To add one, see "Adding a reader" in CONTRIBUTING.md."""


def known_formats() -> tuple[Format, ...]:
    """Return the formats that are read: those of this package, then those of others."""
    return (*FORMATS, *plugin_formats())


def known_suffixes() -> tuple[str, ...]:
    """Return the suffixes of all formats, each once."""
    return tuple(dict.fromkeys(suffix for form in known_formats() for suffix in form.suffixes))


_FOLDER_FORMAT: Final = Format(
    "folder", "a folder of text tables", (), (), _import_reader("text", "read_folder")
)
_BINARY_FORMATS = tuple(form for form in FORMATS if form.signatures or form.matches_head)
_BAG_FORMAT, _DATAFLASH_TEXT = (
    next(form for form in FORMATS if form.kind == kind) for kind in ("ros2", "dataflash text")
)
_HEAD_BYTES = 16
_SHEET: Final = "a spreadsheet: save the sheet as CSV, and read that"
_PACKED: Final = "compressed: unpack it, and read what is in it"
_TO_CONVERT: Final = {
    **dict.fromkeys((".xlsx", ".xlsm", ".xlsb", ".xls", ".ods", ".numbers"), _SHEET),
    **dict.fromkeys((".gz", ".zip", ".7z", ".bz2", ".xz", ".zst", ".rar", ".tgz"), _PACKED),
}
"""Suffixes of files that something else makes a log of, and what to do."""


def label_of(source: LogSource) -> str:
    """Return the name of a source for messages and outputs."""
    if isinstance(source, (str, os.PathLike)):
        name = hide_secrets(source) if is_address(source) else Path(source)
        return make_printable(str(name))
    if isinstance(source, Part):
        return source.label
    return describe_object(source)


def open_source(source: LogSource) -> tuple[str, Content]:
    """Return the format of a source and its content."""
    if isinstance(source, io.BytesIO) or is_address(source):
        return _of_copy(source)
    if isinstance(source, (str, os.PathLike)):
        file = Path(source)
        check_readable(file)
        form = find_format(file)
        return form.kind, read_guarded(form, file)
    if isinstance(source, Part):
        return source.kind, source.content
    kind, table = make_table(source)
    return kind, Content.of(table)


def _of_copy(source: str | io.BytesIO) -> tuple[str, Content]:
    """Return the format and the content of a copy, which is there as long as its tables."""
    form = TEXT
    if isinstance(source, io.BytesIO):
        form = find_binary_format(source.getvalue()[:_HEAD_BYTES]) or TEXT
    copy = spooled(source, form.suffixes[0])
    kind, content = open_source(copy.path)
    tables = {name: _keeping(table, copy) for name, table in content.tables.items()}
    return kind, replace(content, tables=tables)


def _keeping(table: Table, copy: Spooled) -> Table:
    def load(wanted: Sequence[int]) -> list[Column]:
        assert copy.path
        return table.load(wanted)

    return replace(table, load=load, pieces=None)


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
    for path in (file, *inside):
        # Whoever reads a pipe may wait for ever, and nobody reads it twice.
        if path.exists() and not path.is_dir():
            check_regular(path, path.stat().st_mode)
    if not os.access(file, os.R_OK):
        raise PermissionError(f"{file} cannot be read: permission denied")


def is_bag_folder(path: Path) -> bool:
    """Return True if a folder is a ROS 2 bag."""
    return (path / "metadata.yaml").is_file()


def _is_sensor_folder(path: Path) -> bool:
    """Return True if a folder holds text tables that are named after their sensors."""
    if not path.is_dir():
        return False
    from zerorate.io.readers.text import find_sensor_files

    return bool(find_sensor_files(path))


def find_format(file: Path) -> Format:
    """Return the format of a file or bag; LogError if suffix and content disagree."""
    if is_bag_folder(file):
        return _BAG_FORMAT
    if _is_sensor_folder(file):
        return _FOLDER_FORMAT
    suffix = file.suffix.lower()
    form = next((form for form in FORMATS if suffix in form.suffixes), None)
    plugin = find_plugin(suffix) if form is None else None
    if plugin is not None:
        return plugin
    if form is None and _is_text_table(file):
        form = TEXT
    if form is TEXT and _is_dataflash_text_file(file):
        return _DATAFLASH_TEXT
    if suffix in _TO_CONVERT:
        raise LogError(f"the file is {_TO_CONVERT[suffix]}")
    if form is None:
        known = ", ".join(known_suffixes())
        raise LogError(f"unknown suffix '{file.suffix}'; known: {known}")
    with file.open("rb") as opened_file:
        head = opened_file.read(_HEAD_BYTES)
    if not head:
        raise LogError(f"the file is empty, expected {form.description}")
    _check_content(form, head)
    return form


def _is_text_table(file: Path) -> bool:
    """Return True if a file of another suffix, such as ``.log``, has lines of numbers."""
    with file.open("rb") as opened_file:
        head = opened_file.read(1 << 12)
    is_binary = find_binary_format(head) is not None
    return not is_binary and is_text(head) and len(re.findall(rb"[0-9][^\n]*\n", head)) > 1


def _is_dataflash_text_file(file: Path) -> bool:
    with file.open("rb") as opened_file:
        return is_dataflash_text(opened_file.read(1 << 12))


def find_binary_format(head: bytes) -> Format | None:
    """Return the format whose files begin so, None for a text."""
    return next((form for form in _BINARY_FORMATS if form.fits(head)), None)


def _check_content(form: Format, head: bytes) -> None:
    content = find_binary_format(head) or TEXT
    if content is not form and not form.fits(head):
        content_name = "something else" if content is TEXT else content.description
        raise LogError(
            f"by its suffix {form.description}, by its content {content_name}; rename or convert it"
        )
