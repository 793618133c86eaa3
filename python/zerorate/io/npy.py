"""NumPy files: one array (.npy), or several by name (.npz). Pickled objects are never loaded."""

from __future__ import annotations

import zipfile
from pathlib import Path

import numpy as np

from zerorate.io.arrays import from_array, from_arrays
from zerorate.io.errors import LogError
from zerorate.io.table import Table


def read_npy(path: Path) -> Table:
    """Return the table in an .npy file."""
    try:
        array = np.load(path, allow_pickle=False)
    except (ValueError, EOFError, OSError) as error:
        raise LogError(f"cannot be read as an .npy array of numbers ({_reason(error)})") from None
    return from_array(array)


def read_npz(path: Path) -> Table:
    """Return the table in an .npz file."""
    try:
        with path.open("rb") as file, np.load(file, allow_pickle=False) as archive:
            arrays = {name: archive[name] for name in archive.files}
    except (ValueError, EOFError, OSError, zipfile.BadZipFile) as error:
        raise LogError(f"cannot be read as .npz arrays of numbers ({_reason(error)})") from None
    return from_arrays(arrays)


def _reason(error: Exception) -> str:
    text = str(error)
    if "allow_pickle" in text or "pickle" in text:
        return "it holds Python objects"
    if isinstance(error, EOFError) or "reshape" in text or "read" in text.lower():
        return "it is truncated"
    return "it is damaged"
