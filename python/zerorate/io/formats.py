"""The formats of files: each with its suffixes, its first bytes, and its reader."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from zerorate.io import hdf5, ipc, matlab
from zerorate.io.bags import read_bag
from zerorate.io.errors import LogError
from zerorate.io.npy import read_npy, read_npz
from zerorate.io.parquet import read_parquet
from zerorate.io.table import Table
from zerorate.io.text import read_text

__all__ = ["FORMATS", "NO_TOPICS", "Format", "format_of", "is_bag_folder"]

NO_TOPICS: Final = "topic= chooses among the topics of a ROS recording; this is none"
_HEAD = 16


@dataclass(frozen=True)
class Format:
    """A format of files.

    ``marks`` are the beginnings a file of it may have, none for text; ``read`` takes the file and
    the topic asked for.
    """

    kind: str
    called: str
    suffixes: tuple[str, ...]
    marks: tuple[bytes, ...]
    read: Callable[[Path, str | None], Table]


def _alone(read: Callable[[Path], Table]) -> Callable[[Path, str | None], Table]:
    """Return a reader of a format without topics."""

    def refusing(file: Path, topic: str | None) -> Table:
        if topic is not None:
            raise LogError(NO_TOPICS)
        return read(file)

    return refusing


FORMATS: Final = (
    Format(
        "text",
        "a text table",
        (".csv", ".tsv", ".txt", ".dat"),
        (),
        _alone(lambda file: read_text(file.read_bytes())),
    ),
    Format("npy", "an .npy array", (".npy",), (b"\x93NUMPY",), _alone(read_npy)),
    Format("npz", "an .npz", (".npz",), (b"PK\x03\x04",), _alone(read_npz)),
    Format("parquet", "Parquet", (".parquet", ".pq"), (b"PAR1",), _alone(read_parquet)),
    Format(
        "arrow",
        "Arrow IPC",
        (".arrow", ".feather", ".ipc"),
        (ipc.FILE_MARK, ipc.STREAM_MARK),
        _alone(ipc.read_ipc),
    ),
    Format("hdf5", "HDF5", (".h5", ".hdf5"), (hdf5.MARK,), _alone(hdf5.read_hdf5)),
    Format(
        "mat",
        "a MAT file",
        (".mat",),
        (matlab.MARK, matlab.MARK_HDF5),
        _alone(matlab.read_mat),
    ),
    Format("ros1", "a ROS 1 bag", (".bag",), (b"#ROSBAG V2.0",), read_bag),
    Format("ros2", "a ROS 2 bag", (".db3",), (b"SQLite format 3",), read_bag),
    Format("mcap", "MCAP", (".mcap",), (b"\x89MCAP0\r\n",), read_bag),
)
_TEXT, *_BINARY = FORMATS
_BAG_FOLDER = next(form for form in FORMATS if form.kind == "ros2")


def is_bag_folder(path: Path) -> bool:
    """Whether a folder is a ROS 2 bag."""
    return (path / "metadata.yaml").is_file()


def format_of(file: Path) -> Format:
    """Return the format of a file or bag; LogError if suffix and content disagree."""
    if is_bag_folder(file):
        return _BAG_FOLDER
    suffix = file.suffix.lower()
    form = next((form for form in FORMATS if suffix in form.suffixes), None)
    if form is None:
        known = ", ".join(suffix for form in FORMATS for suffix in form.suffixes)
        raise LogError(f"unknown suffix '{file.suffix}'; known: {known}")
    with file.open("rb") as opened:
        head = opened.read(_HEAD)
    if not head:
        raise LogError(f"the file is empty, expected {form.called}")
    _check_content(form, head)
    return form


def _check_content(form: Format, head: bytes) -> None:
    content = next((other for other in _BINARY if head.startswith(other.marks)), _TEXT)
    if content is not form and not head.startswith(form.marks):
        found = "something else" if content is _TEXT else content.called
        raise LogError(f"by its suffix {form.called}, by its content {found}; rename or convert it")
