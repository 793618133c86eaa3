"""MAT files: variables, and fields of structures by path."""

from __future__ import annotations

from importlib.util import find_spec
from pathlib import Path

from zerorate.io.readers.arrays import SCALAR_NAMES, from_arrays, strip_common_folder
from zerorate.io.readers.hdf5 import read_matlab_hdf5
from zerorate.io.readers.isolated import run_isolated
from zerorate.io.readers.lazy_array import LazyArray
from zerorate.io.table import Column, Content
from zerorate.texts import describe_missing_extra

_MARK = b"MATLAB 5.0"


def read(path: Path) -> Content:
    """Return the content of a MAT file of version 5 to 7.3."""
    with path.open("rb") as file:
        if not file.read(len(_MARK)).startswith(_MARK):
            return read_matlab_hdf5(path)
    arrays = {name: LazyArray.of(array) for name, array in _load_arrays(path).items()}
    return Content.of(from_arrays(strip_common_folder(arrays)))


def _load_arrays(path: Path) -> dict[str, Column]:
    """Return the arrays in a file, read by SciPy in a separate process.

    Damaged bytes can crash the interpreter, without an exception.
    """
    if find_spec("scipy") is None:
        raise ImportError(describe_missing_extra("scipy", "mat", "a MAT file"))
    names, arrays = run_isolated("mat_arrays", path, SCALAR_NAMES)
    return dict(zip(names, arrays, strict=True))
