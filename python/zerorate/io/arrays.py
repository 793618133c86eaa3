"""Arrays by name, or a single one, as a table: what NumPy files, HDF5, MAT and dicts hold."""

from __future__ import annotations

import zipfile
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from zerorate.io.log import LogError
from zerorate.io.names import looks_like_sensor, looks_like_time, split_unit
from zerorate.io.table import Column, Content, Format, Metadata, Table

__all__ = [
    "NPY",
    "NPZ",
    "SCALARS",
    "from_array",
    "from_arrays",
    "metadata_of",
    "upright",
    "without_common_folder",
]

SCALARS = ("rate", "unit", "names", "sensor")
_WIDEST = 64


def from_array(array: Column) -> Table:
    """Return the table of one array: of one or two dimensions, or structured."""
    if array.dtype.names is not None:
        _check_rows(array)
        return _named(_flat({name: array[name] for name in array.dtype.names}), Metadata())
    columns = _columns(array, "the array")
    return Table(len(columns), lambda wanted: [columns[i] for i in wanted])


def from_arrays(arrays: Mapping[str, Column]) -> Table:
    """Return the table of arrays by name, its rate, unit, names and sensor among them."""
    meta = metadata_of(arrays)
    columns = {name: array for name, array in arrays.items() if name not in SCALARS}
    if "data" in columns:
        return _with_data(columns, meta)
    return _one_array_a_column(columns, meta)


def without_common_folder(arrays: Mapping[str, Column]) -> dict[str, Column]:
    """Return ``imu/gyro_x``, ``imu/rate`` as ``gyro_x``, ``rate`` where all are in one folder."""
    folders = {name.partition("/")[0] if "/" in name else "" for name in arrays}
    if len(folders) != 1 or "" in folders:
        return dict(arrays)
    return without_common_folder({name.partition("/")[2]: a for name, a in arrays.items()})


def upright(array: Column) -> Column:
    """Return the row and column vectors of MATLAB as one dimension."""
    return array.reshape(-1) if array.ndim == 2 and 1 in array.shape else array


def _check_rows(array: Column) -> None:
    if array.ndim != 1 or array.size == 0:
        raise LogError(f"the array has shape {array.shape}, expected rows of named columns (n,)")


def _columns(array: Column, what: str) -> list[Column]:
    if array.ndim not in (1, 2) or 0 in array.shape:
        raise LogError(
            f"{what} has shape {array.shape}, expected (n,) or (n, k) with samples in it"
        )
    if array.ndim == 2 and _lies_down(array):
        raise LogError(
            f"{what} has shape {array.shape}, expected (n, k) with one sample a row; transpose it"
        )
    return [array] if array.ndim == 1 else list(array.T)


def _lies_down(array: Column) -> bool:
    return bool(array.shape[1] > max(_WIDEST, array.shape[0]))


def _with_data(arrays: Mapping[str, Column], meta: Metadata) -> Table:
    columns = _columns(arrays["data"], "the array 'data'")
    names = meta.names or tuple(f"column_{i}" for i in range(len(columns)))
    if len(names) != len(columns):
        raise LogError(f"'names' lists {len(names)} names for {len(columns)} columns of 'data'")
    time = next((name for name in arrays if looks_like_time(name)), None)
    first = 0 if time is None else 1
    if time is not None:
        columns = [upright(arrays[time]), *columns]
        names = (time, *names)
        _check_lengths(names, columns)
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
    if not others:
        raise LogError("there is no array of samples, expected 'data' or one a column")
    if len(others) == 1 and arrays[others[0]].ndim == 2 and not looks_like_sensor(others[0]):
        kept = {name: arrays[name] for name in time}
        return _with_data(kept | {"data": arrays[others[0]]}, meta)
    return _named(_flat(arrays), meta)


def _flat(arrays: Mapping[str, Column]) -> dict[str, Column]:
    columns: dict[str, Column] = {}
    for name, array in arrays.items():
        columns |= _as_columns(name, upright(array))
    return columns


def _as_columns(name: str, array: Column) -> dict[str, Column]:
    """Return the columns of an array: ``gyro_dps`` (n, 3) is ``gyro_x_dps`` and so on."""
    if array.ndim == 1 and array.size:
        return {name: array}
    if array.ndim != 2 or 0 in array.shape or (_lies_down(array) and not looks_like_sensor(name)):
        return {}
    columns = _columns(array, f"the array '{name}'")
    axes = "xyz" if len(columns) == 3 else map(str, range(len(columns)))
    stem = split_unit(name)[0]
    suffix = name[len(stem) :]
    return {f"{stem}_{axis}{suffix}": c for axis, c in zip(axes, columns, strict=True)}


def _named(arrays: Mapping[str, Column], meta: Metadata) -> Table:
    if not arrays:
        raise LogError("there are no columns, expected one-dimensional arrays of samples")
    names, columns = tuple(arrays), list(arrays.values())

    def load(wanted: Sequence[int]) -> list[Column]:
        chosen = [columns[i] for i in wanted]
        _check_lengths([names[i] for i in wanted], chosen)
        return chosen

    lengths = tuple(len(column) for column in columns)
    return Table(len(columns), load, names=names, meta=meta, lengths=lengths)


def _check_lengths(names: Sequence[str], columns: Sequence[Column]) -> None:
    if len({column.shape for column in columns}) > 1 or columns[0].ndim != 1:
        listed = ", ".join(f"'{n}' {c.shape}" for n, c in zip(names, columns, strict=True))
        raise LogError(
            f"the arrays differ in length ({listed}), expected one value a sample in each; "
            "choose with columns="
        )


def metadata_of(arrays: Mapping[str, Column]) -> Metadata:
    """Return what the scalars among some arrays say."""
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


def _read_npy(path: Path) -> Content:
    try:
        array = np.load(path, allow_pickle=False)
    except (ValueError, EOFError, OSError) as error:
        raise LogError(f"cannot be read as an .npy array of numbers ({_reason(error)})") from None
    return Content.of(from_array(array))


def _read_npz(path: Path) -> Content:
    try:
        with path.open("rb") as file, np.load(file, allow_pickle=False) as archive:
            arrays = {name: archive[name] for name in archive.files}
    except (ValueError, EOFError, OSError, zipfile.BadZipFile) as error:
        raise LogError(f"cannot be read as .npz arrays of numbers ({_reason(error)})") from None
    return Content.of(from_arrays(arrays))


def _reason(error: Exception) -> str:
    text = str(error)
    if "allow_pickle" in text or "pickle" in text:
        return "it holds Python objects"
    if isinstance(error, EOFError) or "reshape" in text or "read" in text.lower():
        return "it is truncated"
    return "it is damaged"


NPY = Format("npy", "an .npy array", (".npy",), (b"\x93NUMPY",), _read_npy)
NPZ = Format("npz", "an .npz", (".npz",), (b"PK\x03\x04",), _read_npz)
