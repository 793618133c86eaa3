"""Tables from arrays by name or a single array: NumPy files, HDF5, MAT files and dicts."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import NoReturn

import numpy as np

from zerorate.faults import keyword_argument, make_sentence
from zerorate.io.clocks.names import looks_like_time, may_be_time
from zerorate.io.readers.lazy_array import Axis, LazyArray, load_axes
from zerorate.io.table import Column, Metadata, Table
from zerorate.record.log import LogError
from zerorate.record.names import looks_like_sensor, split_unit

_RATE_NAMES = (
    *("sampling_rate", "samplingRate", "SamplingRate", "sample_rate", "sampleRate", "SampleRate"),
    *("samplerate", "sampling_frequency", "sample_frequency", "fs", "Fs", "FS", "f_s"),
)
"""Names for the sampling rate; a single number with such a name is a rate."""
SCALAR_NAMES = ("rate", "unit", "names", "sensor", *_RATE_NAMES)
_MAX_WIDTH = 64


def from_array(array: LazyArray) -> Table:
    """Return the table of one array: with one or two dimensions, or structured."""
    if array.dtype.names is not None:
        _check_rows(array)
        rows = array.read()
        return _make_named_table(
            _flatten({name: LazyArray.of(rows[name]) for name in array.dtype.names}), Metadata()
        )
    axes = _split_axes(array, "the array")
    return Table(len(axes), lambda wanted: load_axes([axes[i] for i in wanted]))


def from_arrays(arrays: Mapping[str, LazyArray]) -> Table:
    """Return the table of arrays by name, with rate, unit, names and sensor among them."""
    # An array with such a name distinguishes the rows of several sensors, or is a column.
    rows = {n for n, array in arrays.items() if n == "sensor" and math.prod(array.shape) > 1}
    rows |= {n for n, array in arrays.items() if n in _RATE_NAMES and not _is_number(array)}
    meta = find_metadata({n: array for n, array in arrays.items() if n not in rows})
    columns = {n: array for n, array in arrays.items() if n not in SCALAR_NAMES or n in rows}
    if "data" in columns:
        return _make_data_table(columns, meta)
    return _make_column_table(columns, meta)


def strip_common_folder(arrays: Mapping[str, LazyArray]) -> dict[str, LazyArray]:
    """Return ``imu/gyro_x``, ``imu/rate`` as ``gyro_x``, ``rate`` if the folder is the only one."""
    folders = {name.partition("/")[0] if "/" in name else "" for name in arrays}
    if len(folders) != 1 or "" in folders:
        return dict(arrays)
    return strip_common_folder({name.partition("/")[2]: a for name, a in arrays.items()})


def _check_rows(array: LazyArray) -> None:
    if array.ndim != 1 or 0 in array.shape:
        raise LogError(f"the array has shape {array.shape}, expected rows of named columns (n,)")


def _split_axes(array: LazyArray, what: str) -> list[Axis]:
    if array.ndim not in (1, 2) or 0 in array.shape:
        raise LogError(
            f"{what} has shape {array.shape}, expected (n,) or (n, k) with samples in it"
        )
    if array.ndim == 2 and _is_transposed(array):
        raise LogError(
            f"{what} has shape {array.shape}, expected (n, k) with one sample a row; transpose it"
        )
    return [Axis(array)] if array.ndim == 1 else [Axis(array, i) for i in range(array.shape[1])]


def _is_transposed(array: LazyArray) -> bool:
    return array.shape[1] > max(_MAX_WIDTH, array.shape[0])


def _make_data_table(arrays: Mapping[str, LazyArray], meta: Metadata) -> Table:
    axes = _split_axes(arrays["data"], "the array 'data'")
    names = meta.names or tuple(f"column_{i}" for i in range(len(axes)))
    if len(names) != len(axes):
        raise LogError(f"'names' lists {len(names)} names for {len(axes)} columns of 'data'")
    time = next(iter(_find_times(arrays)), None)
    first = 0 if time is None else 1
    if time is not None:
        stamps = arrays[time].flatten_vector()
        if stamps.shape != arrays["data"].shape[:1]:
            _raise_length_error([(time, stamps), *zip(names, (a.array for a in axes), strict=True)])
        axes, names = [Axis(stamps), *axes], (time, *names)
    return Table(
        width=len(axes),
        load=lambda wanted: load_axes([axes[i] for i in wanted]),
        names=names,
        meta=meta,
        time=None if time is None else 0,
        data=tuple(range(first, len(axes))),
    )


def _find_times(arrays: Mapping[str, LazyArray]) -> list[str]:
    """Return the arrays of timestamps; an array with an ambiguous name must be long."""
    known = [name for name in arrays if looks_like_time(name)]
    return known or [
        name for name in arrays if may_be_time(name) and math.prod(arrays[name].shape) > 1
    ]


def _make_column_table(arrays: Mapping[str, LazyArray], meta: Metadata) -> Table:
    time = _find_times(arrays)
    data_names = [name for name in arrays if name not in time]
    if not data_names:
        raise LogError("there is no array of samples, expected 'data' or one a column")
    if (
        len(data_names) == 1
        and arrays[data_names[0]].ndim == 2
        and not looks_like_sensor(data_names[0])
    ):
        time_arrays = {name: arrays[name] for name in time}
        return _make_data_table(time_arrays | {"data": arrays[data_names[0]]}, meta)
    return _make_named_table(_flatten(arrays), meta)


def _flatten(arrays: Mapping[str, LazyArray]) -> dict[str, Axis]:
    columns: dict[str, Axis] = {}
    for name, array in arrays.items():
        columns |= _split_columns(name, array.flatten_vector())
    return columns


def _split_columns(name: str, array: LazyArray) -> dict[str, Axis]:
    """Return the columns of an array: ``gyro_dps`` (n, 3) becomes ``gyro_x_dps`` and so on."""
    if array.ndim == 1 and 0 not in array.shape:
        return {name: Axis(array)}
    if (
        array.ndim != 2
        or 0 in array.shape
        or (_is_transposed(array) and not looks_like_sensor(name))
    ):
        return {}
    columns = _split_axes(array, f"the array '{name}'")
    axes = "xyz" if len(columns) == 3 else map(str, range(len(columns)))
    stem = split_unit(name)[0]
    suffix = name[len(stem) :]
    return {f"{stem}_{axis}{suffix}": c for axis, c in zip(axes, columns, strict=True)}


def _make_named_table(axes: Mapping[str, Axis], meta: Metadata) -> Table:
    if not axes:
        raise LogError("there are no columns, expected one-dimensional arrays of samples")
    names, columns = tuple(axes), list(axes.values())

    def load(wanted: Sequence[int]) -> list[Column]:
        axes_wanted = [columns[i] for i in wanted]
        if len({axis.array.shape[0] for axis in axes_wanted}) > 1:
            _raise_length_error([(names[i], columns[i].array) for i in wanted])
        return load_axes(axes_wanted)

    lengths = tuple(axis.array.shape[0] for axis in columns)
    return Table(len(columns), load, names=names, meta=meta, lengths=lengths)


def _raise_length_error(arrays: Sequence[tuple[str, LazyArray]]) -> NoReturn:
    listed = ", ".join(f"'{name}' {array.shape[:1]}" for name, array in arrays)
    raise LogError(
        make_sentence(
            f"the arrays differ in length ({listed}), expected one value a sample in each; "
            "choose with ",
            keyword_argument("columns"),
        )
    )


def find_metadata(arrays: Mapping[str, LazyArray]) -> Metadata:
    """Return the metadata in the scalars of some arrays."""
    rate_name = next((name for name in ("rate", *_RATE_NAMES) if name in arrays), "rate")
    rate = _find_scalar(arrays, rate_name, "fiu")
    unit = _find_scalar(arrays, "unit", "U")
    sensor = _find_scalar(arrays, "sensor", "U")
    names = arrays.get("names")
    if names is not None and (names.dtype.kind != "U" or names.ndim > 1):
        raise LogError("'names' must be an array of strings")
    return Metadata(
        rate=None if rate is None else float(rate.item()),
        unit=None if unit is None else str(unit),
        sensor=None if sensor is None else str(sensor),
        names=None if names is None else tuple(str(name) for name in names.read().reshape(-1)),
        notes=()
        if rate is None or rate_name == "rate"
        else (f"rate {rate:g} Hz by '{rate_name}'",),
    )


def _is_number(array: LazyArray) -> bool:
    return math.prod(array.shape) == 1 and array.dtype.kind in "fiu"


def _find_scalar(arrays: Mapping[str, LazyArray], key: str, kinds: str) -> np.generic | None:
    array = arrays.get(key)
    if array is None:
        return None
    if math.prod(array.shape) != 1 or array.dtype.kind not in kinds:
        expected = "number" if "f" in kinds else "string"
        raise LogError(
            f"'{key}' has shape {array.shape} and type {array.dtype}, expected one {expected}"
        )
    scalar: np.generic = array.read().reshape(-1)[0]
    return scalar
