"""HDF5 files: data sets by their path, with rate and unit in data sets or attributes."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from zerorate.io.arrays import SCALARS, from_arrays, upright, without_common_folder
from zerorate.io.log import LogError
from zerorate.io.names import spelled, with_suffix
from zerorate.io.table import Column, Content, Format

__all__ = ["FORMAT", "read_matlab_hdf5"]

_Node = Any


def _read(path: Path) -> Content:
    return _content(path, "an HDF5 file", matlab=False)


FORMAT = Format("hdf5", "HDF5", (".h5", ".hdf5"), (b"\x89HDF\r\n\x1a\n",), _read)


def read_matlab_hdf5(path: Path) -> Content:
    """Return the content of a MAT file of version 7.3, which is HDF5."""
    return _content(path, "a MAT file", matlab=True)


def _content(path: Path, called: str, matlab: bool) -> Content:
    h5py = _h5py(called)
    arrays: dict[str, Column] = {}
    try:
        with h5py.File(path) as file:
            arrays |= _attributes(file)
            # A name that is no text comes as bytes.
            file.visititems(lambda name, node: arrays.update(_arrays(str(name), node, matlab)))
    except (OSError, RuntimeError, KeyError, ValueError):
        raise LogError(f"cannot be read as {called}: it is truncated or damaged") from None
    return Content.of(from_arrays(without_common_folder(arrays)))


def _h5py(called: str) -> Any:  # noqa: ANN401
    try:
        import h5py
    except ImportError:
        raise ImportError(f"{called} needs h5py: pip install 'zerorate[hdf5]'") from None
    return h5py


def _arrays(name: str, node: _Node, matlab: bool) -> dict[str, Column]:
    """Return what a group or data set at some path holds, by name."""
    if name.startswith("#"):
        return {}
    if not hasattr(node, "dtype"):
        return {f"{name}/{key}": array for key, array in _attributes(node).items()}
    if node.dtype.names is not None:
        rows = node[()]
        return {f"{name}/{field}": rows[field] for field in node.dtype.names}
    if name.rpartition("/")[2] in SCALARS:
        return {name: _scalar(node, matlab)}
    if node.dtype.kind not in "fiub" or node.ndim not in (1, 2):
        return {}
    # MATLAB writes its columns as rows.
    return {_with_unit(name, node): upright(node[()].T) if matlab else node[()]}


def _with_unit(name: str, node: _Node) -> str:
    """Return the name with the suffix of the unit that an attribute tells, if one does."""
    for key in ("unit", "units"):
        unit = node.attrs.get(key)
        if isinstance(unit, str):
            return with_suffix(name, spelled(unit))
    return name


def _attributes(node: _Node) -> dict[str, Column]:
    return {key: _texts(np.asarray(node.attrs[key])) for key in SCALARS if key in node.attrs}


def _scalar(node: _Node, matlab: bool) -> Column:
    if matlab and node.attrs.get("MATLAB_class") == b"char":
        return np.array("".join(map(chr, node[()].reshape(-1))))
    return _texts(np.asarray(node[()]))


def _texts(array: Column) -> Column:
    """Return bytes and Python strings as NumPy's, other arrays as they are."""
    if array.dtype.kind not in "OS":
        return array
    texts = [t.decode(errors="replace") if isinstance(t, bytes) else str(t) for t in _flat(array)]
    return np.array(texts).reshape(array.shape)


def _flat(array: Column) -> Iterator[object]:
    yield from array.reshape(-1).tolist()
