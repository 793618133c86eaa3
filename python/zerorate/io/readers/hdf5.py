"""HDF5 files: data sets by their path, with rate and unit in data sets or attributes."""

from __future__ import annotations

import math
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from zerorate.io.log import LogError
from zerorate.io.names import spelled, with_suffix
from zerorate.io.readers.arrays import SCALARS, from_arrays, without_common_folder
from zerorate.io.readers.stored import Stored
from zerorate.io.table import Column, Content, Format
from zerorate.texts import extra_needed

__all__ = ["FORMAT", "read_matlab_hdf5"]

_Node = Any


def _read(path: Path) -> Content:
    return _content(path, "an HDF5 file", matlab=False)


FORMAT = Format("hdf5", "an HDF5 file", (".h5", ".hdf5"), (b"\x89HDF\r\n\x1a\n",), _read)


def read_matlab_hdf5(path: Path) -> Content:
    """Return the content of a MAT file of version 7.3, which is HDF5."""
    return _content(path, "a MAT file", matlab=True)


def _content(path: Path, called: str, matlab: bool) -> Content:
    h5py = _h5py(called)
    arrays: dict[str, Stored] = {}

    links: list[str | bytes] = []

    def note(name: str | bytes, link: object) -> None:
        if isinstance(link, h5py.ExternalLink):
            links.append(name)

    def add(name: str, node: _Node) -> None:
        arrays.update(_arrays(path, name, node, matlab))

    with h5py.File(path) as file:
        file.visititems_links(note)
        if links:
            raise LogError(_elsewhere(str(links[0])))
        arrays |= _attributes(file)
        file.visititems(add)
    return Content.of(from_arrays(without_common_folder(arrays)))


def _h5py(called: str) -> Any:  # noqa: ANN401
    try:
        import h5py
    except ImportError:
        raise ImportError(extra_needed("h5py", "hdf5", called)) from None
    return h5py


def _elsewhere(name: str) -> str:
    return f"'{name}' lies in another file, expected an HDF5 file that holds all its data"


def _arrays(path: Path, key: str | bytes, node: _Node, matlab: bool) -> dict[str, Stored]:
    """Return what a group or data set at some path in the file holds, by name."""
    name = str(key)  # one that is no text comes as bytes
    if name.startswith("#"):
        return {}
    if not hasattr(node, "dtype"):
        return {f"{name}/{own}": array for own, array in _attributes(node).items()}
    if node.is_virtual or node.external:
        raise LogError(_elsewhere(name))
    if node.shape is None:
        return {}
    if node.dtype.names is not None:
        return {f"{name}/{field}": _stored(path, key, node, field) for field in node.dtype.names}
    if name.rpartition("/")[2] in SCALARS:
        return {name: Stored.of(_scalar(node, matlab))}
    if node.dtype.kind not in "fiub" or node.ndim not in (1, 2):
        return {}
    array = _stored(path, key, node)
    return {_with_unit(name, node): _transposed(array).upright() if matlab else array}


def _stored(path: Path, key: str | bytes, node: _Node, field: str | None = None) -> Stored:
    """Return a data set, or a field of one with named fields, that is read when asked for."""

    def read() -> Column:
        with _h5py("an HDF5 file").File(path) as file:
            again = file[key]
            _check_written(again, str(key))
            values: Column = again[()] if field is None else again[field]
            return values

    return Stored(node.shape, node.dtype if field is None else node.dtype[field], read)


def _transposed(array: Stored) -> Stored:
    # MATLAB writes its columns as rows.
    return Stored(array.shape[::-1], array.dtype, lambda: array.read().T)


def _check_written(node: _Node, name: str) -> None:
    """Refuse a data set that declares more than was ever written: the rest would be zeros."""
    if node.chunks is None:
        written = node.id.get_storage_size() // node.dtype.itemsize
    else:
        written = node.id.get_num_chunks() * math.prod(node.chunks)
    if written < node.size:
        raise LogError(f"'{name}' declares {node.size} values, but only {written} were written")


def _with_unit(name: str, node: _Node) -> str:
    """Return the name with the suffix of the unit that an attribute tells, if one does."""
    for key in ("unit", "units"):
        unit = node.attrs.get(key)
        if isinstance(unit, str):
            return with_suffix(name, spelled(unit))
    return name


def _attributes(node: _Node) -> dict[str, Stored]:
    told = {key: np.asarray(node.attrs[key]) for key in SCALARS if key in node.attrs}
    return {key: Stored.of(_texts(value)) for key, value in told.items()}


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
