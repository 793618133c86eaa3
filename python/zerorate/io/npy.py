"""NumPy files: one array (.npy), or several by name (.npz). Pickled objects are never loaded."""

from __future__ import annotations

import zipfile
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from zerorate.io.columns import looks_like_time
from zerorate.io.errors import LogError
from zerorate.io.table import Column, Metadata, Table

_SCALARS = ("rate", "unit", "names", "sensor")


def read_npy(path: Path) -> Table:
    """Return the table in an .npy file."""
    try:
        array = np.load(path, allow_pickle=False)
    except (ValueError, EOFError, OSError) as error:
        raise LogError(f"cannot be read as an .npy array of numbers ({_reason(error)})") from None
    return _from_array(array)


def read_npz(path: Path) -> Table:
    """Return the table in an .npz file."""
    try:
        with path.open("rb") as file, np.load(file, allow_pickle=False) as archive:
            arrays = {name: archive[name] for name in archive.files}
    except (ValueError, EOFError, OSError, zipfile.BadZipFile) as error:
        raise LogError(f"cannot be read as .npz arrays of numbers ({_reason(error)})") from None
    meta = _metadata(arrays)
    columns = {name: array for name, array in arrays.items() if name not in _SCALARS}
    if "data" in columns:
        return _with_data(columns, meta)
    return _one_array_a_column(columns, meta)


def _reason(error: Exception) -> str:
    text = str(error)
    if "allow_pickle" in text or "pickle" in text:
        return "it holds Python objects"
    if isinstance(error, EOFError) or "reshape" in text or "read" in text.lower():
        return "it is truncated"
    return "it is damaged"


def _from_array(array: Column) -> Table:
    if array.dtype.names is not None:
        fields = {name: array[name].reshape(-1) for name in array.dtype.names}
        _check_rows(array)
        return _named(fields, Metadata())
    columns = _columns(array, "the array")
    return Table(len(columns), lambda wanted: [columns[i] for i in wanted])


def _check_rows(array: Column) -> None:
    if array.ndim != 1 or array.size == 0:
        raise LogError(f"the array has shape {array.shape}, expected rows of named columns (n,)")


def _columns(array: Column, what: str) -> list[Column]:
    if array.ndim not in (1, 2) or 0 in array.shape:
        raise LogError(
            f"{what} has shape {array.shape}, expected (n,) or (n, k) with samples in it"
        )
    if array.ndim == 2 and array.shape[1] > max(64, array.shape[0]):
        raise LogError(
            f"{what} has shape {array.shape}, expected (n, k) with one sample a row; transpose it"
        )
    return [array] if array.ndim == 1 else list(array.T)


def _with_data(arrays: Mapping[str, Column], meta: Metadata) -> Table:
    columns = _columns(arrays["data"], "the array 'data'")
    names = meta.names or tuple(f"column_{i}" for i in range(len(columns)))
    if len(names) != len(columns):
        raise LogError(f"'names' lists {len(names)} names for {len(columns)} columns of 'data'")
    time = next((name for name in arrays if looks_like_time(name)), None)
    first = 0 if time is None else 1
    if time is not None:
        columns = [arrays[time], *columns]
        names = (time, *names)
        _check_lengths(dict(enumerate(columns)))
    return Table(
        width=len(columns),
        load=lambda wanted: [columns[i] for i in wanted],
        names=names,
        meta=meta,
        time=None if time is None else 0,
        data=tuple(range(first, len(columns))),
    )


def _one_array_a_column(arrays: Mapping[str, Column], meta: Metadata) -> Table:
    time = [name for name in arrays if looks_like_time(name)]
    others = [name for name in arrays if name not in time]
    if len(others) == 1 and arrays[others[0]].ndim == 2:
        kept = {name: arrays[name] for name in time}
        return _with_data(kept | {"data": arrays[others[0]]}, meta)
    if not others:
        raise LogError("the file holds no array of samples, expected 'data' or one a column")
    flat = {name: array for name, array in arrays.items() if array.ndim == 1 and array.size}
    return _named(flat, meta)


def _named(arrays: Mapping[str, Column], meta: Metadata) -> Table:
    if not arrays:
        raise LogError("the file holds no columns, expected one-dimensional arrays of samples")
    _check_lengths(arrays)
    columns = list(arrays.values())
    return Table(
        width=len(columns),
        load=lambda wanted: [columns[i] for i in wanted],
        names=tuple(arrays),
        meta=meta,
    )


def _check_lengths(arrays: Mapping[str, Column] | Mapping[int, Column]) -> None:
    lengths = {len(array) if array.ndim == 1 else -1 for array in arrays.values()}
    if len(lengths) > 1:
        shapes = ", ".join(str(array.shape) for array in arrays.values())
        raise LogError(
            f"the arrays differ in length ({shapes}), expected one value a sample in each"
        )


def _metadata(arrays: Mapping[str, Column]) -> Metadata:
    rate = _scalar(arrays, "rate", "fiu")
    unit = _scalar(arrays, "unit", "U")
    sensor = _scalar(arrays, "sensor", "U")
    names = arrays.get("names")
    if names is not None and (names.dtype.kind != "U" or names.ndim > 1):
        raise LogError("'names' must be an array of strings")
    return Metadata(
        rate=None if rate is None else float(rate.item()),
        unit=None if unit is None else str(unit),
        sensor=None if sensor is None else str(sensor),
        names=None if names is None else tuple(str(name) for name in names.reshape(-1)),
    )


def _scalar(arrays: Mapping[str, Column], key: str, kinds: str) -> np.generic | None:
    array = arrays.get(key)
    if array is None:
        return None
    if array.size != 1 or array.dtype.kind not in kinds:
        expected = "number" if "f" in kinds else "string"
        raise LogError(
            f"'{key}' has shape {array.shape} and type {array.dtype}, expected one {expected}"
        )
    scalar: np.generic = array.reshape(-1)[0]
    return scalar
