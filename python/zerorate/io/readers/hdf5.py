"""HDF5 files: data sets by path; rate and unit in data sets or attributes."""

from __future__ import annotations

from collections.abc import Iterator
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np

from zerorate.io.limits import max_bytes
from zerorate.io.readers.arrays import SCALAR_NAMES, from_arrays, strip_common_folder
from zerorate.io.readers.isolated import run_isolated
from zerorate.io.readers.lazy_array import LazyArray
from zerorate.io.table import Column, Content
from zerorate.record.names import add_unit_suffix, canonical_spelling
from zerorate.texts import describe_missing_extra


def read(path: Path) -> Content:
    """Return the arrays in an HDF5 file."""
    return _read_content(path, "an HDF5 file", matlab=False)


def read_matlab_hdf5(path: Path) -> Content:
    """Return the content of a MAT file of version 7.3, which has the format HDF5."""
    return _read_content(path, "a MAT file", matlab=True)


def _read_content(path: Path, called: str, matlab: bool) -> Content:
    """Return the content of a file, read by its library in a separate process.

    With some damaged files the library never returns.
    """
    if find_spec("h5py") is None:
        raise ImportError(describe_missing_extra("h5py", "hdf5", called))
    entries, small = run_isolated("hdf5_listing", path, SCALAR_NAMES, matlab)
    read = iter(small)
    arrays = {_entry_name(entry): _make_array(path, entry, read, matlab) for entry in entries}
    return Content.of(from_arrays(strip_common_folder(arrays)))


def _entry_name(entry: dict[str, Any]) -> str:
    """Return the name of an entry, with a suffix for the unit in its attribute."""
    unit = entry.get("unit")
    return (
        entry["name"] if unit is None else add_unit_suffix(entry["name"], canonical_spelling(unit))
    )


def _make_array(
    path: Path, entry: dict[str, Any], read: Iterator[Column], matlab: bool
) -> LazyArray:
    """Return an entry of the listing as an array, already read or to be read on request."""
    if entry["key"] is None:
        return LazyArray.of(next(read))

    def values() -> Column:
        return run_isolated("hdf5_values", path, entry["key"], entry["field"], max_bytes(path))[1][
            0
        ]

    array = LazyArray(tuple(entry["shape"]), np.dtype(entry["dtype"]), values)
    return _transpose(array).flatten_vector() if matlab and entry["field"] is None else array


def _transpose(array: LazyArray) -> LazyArray:
    # MATLAB stores its columns as rows.
    return LazyArray(array.shape[::-1], array.dtype, lambda: array.read().T)
