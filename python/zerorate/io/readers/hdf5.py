"""HDF5 files: data sets by their path, with rate and unit in data sets or attributes."""

from __future__ import annotations

from collections.abc import Iterator
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np

from zerorate.io.limits import most_bytes
from zerorate.io.readers.apart import asked
from zerorate.io.readers.arrays import SCALARS, from_arrays, without_common_folder
from zerorate.io.readers.stored import Stored
from zerorate.io.table import Column, Content
from zerorate.record.names import spelled, with_suffix
from zerorate.texts import extra_needed


def read(path: Path) -> Content:
    """Return the arrays in an HDF5 file."""
    return _content(path, "an HDF5 file", matlab=False)


def read_matlab_hdf5(path: Path) -> Content:
    """Return the content of a MAT file of version 7.3, which is HDF5."""
    return _content(path, "a MAT file", matlab=True)


def _content(path: Path, called: str, matlab: bool) -> Content:
    """Return the content of a file whose library reads it in a process of its own.

    On some damaged files it would never come back.
    """
    if find_spec("h5py") is None:
        raise ImportError(extra_needed("h5py", "hdf5", called))
    entries, small = asked("hdf5_listing", path, SCALARS, matlab)
    read = iter(small)
    arrays = {_name(entry): _array(path, entry, read, matlab) for entry in entries}
    return Content.of(from_arrays(without_common_folder(arrays)))


def _name(entry: dict[str, Any]) -> str:
    """Return the name of an entry, with the suffix of the unit that an attribute tells."""
    unit = entry.get("unit")
    return entry["name"] if unit is None else with_suffix(entry["name"], spelled(unit))


def _array(path: Path, entry: dict[str, Any], read: Iterator[Column], matlab: bool) -> Stored:
    """Return an entry of the listing: one that was read, or one to read when it is asked for."""
    if entry["key"] is None:
        return Stored.of(next(read))

    def values() -> Column:
        return asked("hdf5_values", path, entry["key"], entry["field"], most_bytes(path))[1][0]

    array = Stored(tuple(entry["shape"]), np.dtype(entry["dtype"]), values)
    return _transposed(array).upright() if matlab and entry["field"] is None else array


def _transposed(array: Stored) -> Stored:
    # MATLAB writes its columns as rows.
    return Stored(array.shape[::-1], array.dtype, lambda: array.read().T)
