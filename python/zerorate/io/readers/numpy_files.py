"""NumPy's files: a single array, or several by name; only requested arrays are read."""

from __future__ import annotations

import math
import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import IO

from numpy.lib import format as npy

from zerorate.io.limits import check_bytes
from zerorate.io.readers.arrays import from_array, from_arrays
from zerorate.io.readers.lazy_array import LazyArray
from zerorate.io.table import Column, Content
from zerorate.record.log import LogError

_SUFFIX = ".npy"


def read_npy(path: Path) -> Content:
    """Return the array in a file as a table."""

    def read() -> Column:
        with path.open("rb") as file:
            return npy.read_array(file, allow_pickle=False)

    with path.open("rb") as file:
        return Content.of(
            from_array(_make_lazy_array(path, file, path.stat().st_size, "the array", read))
        )


def read_npz(path: Path) -> Content:
    """Return the arrays in an archive as a table."""
    arrays = {}
    with zipfile.ZipFile(path) as archive:
        for info in archive.infolist():
            if info.filename.endswith(_SUFFIX):
                name = info.filename.removesuffix(_SUFFIX)
                arrays[name] = _read_member(path, archive, info, name)
    return Content.of(from_arrays(arrays))


def _read_member(
    path: Path, archive: zipfile.ZipFile, info: zipfile.ZipInfo, name: str
) -> LazyArray:
    def read() -> Column:
        with zipfile.ZipFile(path) as archive_again, archive_again.open(info) as file:
            array = npy.read_array(file, allow_pickle=False)
            # The checksum is tested at the end of the member.
            if file.read(1):
                raise LogError(f"'{name}' holds more than it declares: it is damaged")
            return array

    with archive.open(info) as file:
        return _make_lazy_array(path, file, info.file_size, f"'{name}'", read)


def _make_lazy_array(
    path: Path, file: IO[bytes], size: int, what: str, read: Callable[[], Column]
) -> LazyArray:
    """Return the array that a header declares; LogError if the file is too small for it."""
    version = npy.read_magic(file)
    # Version 3 differs only in field names that are not Latin-1.
    read_header = npy.read_array_header_1_0 if version == (1, 0) else npy.read_array_header_2_0
    shape, _, dtype = read_header(file)
    if dtype.hasobject:
        raise LogError(f"{what} holds Python objects, expected numbers")
    if dtype.itemsize == 0:
        raise LogError(f"{what} holds {dtype}, which has no bytes, expected numbers")
    declared, available_bytes = math.prod(shape) * dtype.itemsize, size - file.tell()
    if declared > available_bytes or min(shape, default=0) < 0:
        raise LogError(
            f"{what} declares the shape {shape} of {dtype}, but {available_bytes} bytes of "
            "it are there: "
            "it is truncated or damaged"
        )
    check_bytes(path, declared, what)
    return LazyArray.of(read()) if version > (2, 0) else LazyArray(shape, dtype, read)
