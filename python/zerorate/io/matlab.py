"""MAT files: variables, and fields of structures by their path."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from zerorate.io.arrays import SCALARS, from_arrays, upright, without_common_folder
from zerorate.io.hdf5 import read_matlab_hdf5
from zerorate.io.log import LogError
from zerorate.io.table import Column, Content, Format

__all__ = ["FORMAT"]

_MARK = b"MATLAB 5.0"
_MARK_HDF5 = b"MATLAB 7.3"


def _read(path: Path) -> Content:
    """Return the content of a MAT file of version 5 to 7.3."""
    with path.open("rb") as file:
        if not file.read(len(_MARK)).startswith(_MARK):
            return read_matlab_hdf5(path)
    variables = _loaded(path)
    arrays: dict[str, Column] = {}
    for name, value in variables.items():
        if not name.startswith("__"):
            arrays.update(_arrays(name, value))
    return Content.of(from_arrays(without_common_folder(arrays)))


FORMAT = Format("mat", "a MAT file", (".mat",), (_MARK, _MARK_HDF5), _read)


def _loaded(path: Path) -> dict[str, Any]:
    try:
        from scipy.io import loadmat
    except ImportError:
        raise ImportError("a MAT file needs scipy: pip install 'zerorate[mat]'") from None
    try:
        variables: dict[str, Any] = loadmat(path)
    except Exception:  # what damaged bytes raise there has no common base
        raise LogError("cannot be read as a MAT file: it is truncated or damaged") from None
    return variables


def _arrays(name: str, value: Column) -> Iterator[tuple[str, Column]]:
    """Yield a variable, or the fields of a structure, by path."""
    if value.dtype.names is not None and value.size == 1:
        for field in value.dtype.names:
            yield from _arrays(f"{name}/{field}", np.asarray(value[field].reshape(-1)[0]))
    elif name.rpartition("/")[2] in SCALARS:
        yield name, _texts(value)
    elif value.dtype.kind in "fiub" and value.ndim == 2 and value.size > 1:
        yield name, upright(value)


def _texts(value: Column) -> Column:
    """Return a cell array of strings as NumPy's strings, other arrays as they are."""
    if value.dtype.kind != "O":
        return value
    return np.array([str(np.asarray(cell).reshape(-1)[0]) for cell in value.reshape(-1)])
