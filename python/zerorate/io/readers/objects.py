"""Objects in memory with a log: data frames, Arrow tables, dicts and arrays."""

from __future__ import annotations

import sys
from collections.abc import Callable, Mapping
from typing import Any, Final, Protocol

import numpy as np

from zerorate.io.clocks.names import has_time_name, looks_like_time
from zerorate.io.readers.arrays import (
    SCALAR_NAMES,
    find_metadata,
    from_array,
    from_arrays,
    strip_common_folder,
)
from zerorate.io.readers.arrow import arrow_table, import_pyarrow
from zerorate.io.readers.lazy_array import LazyArray
from zerorate.io.table import Column, Table
from zerorate.record.log import LogError
from zerorate.record.missing import without_masks

_Frame = Any
_Series = Any

_WIDE_DTYPES = {"f": np.float64, "i": np.int64, "u": np.uint64, "b": np.bool_}


def from_pandas(frame: _Frame) -> Table:
    """Return the table of a pandas DataFrame; an index of times becomes the time column.

    The frame's ``attrs`` can state the rate, the unit and the sensor.
    """
    series = [frame.iloc[:, i] for i in range(frame.shape[1])]
    names = [_join_label(label) for label in frame.columns]
    if not series:
        raise LogError("there are no columns")
    has_time_index = _is_time(frame.index) and not any(map(looks_like_time, names))
    if has_time_index:
        series, names = [frame.index, *series], [str(frame.index.name or "time"), *names]
    counts = type(frame.index).__name__ == "RangeIndex" or frame.index.dtype.kind not in "fiu"
    if not has_time_index and not counts:
        # The values show if this column is the clock.
        series, names = [*series, frame.index], [*names, str(frame.index.name or "index")]
    has_names = any(isinstance(label, (str, tuple)) for label in frame.columns)
    return Table(
        width=len(series),
        load=lambda wanted: [_from_pandas(series[i], names[i]) for i in wanted],
        labels=lambda index: np.asarray(series[index], dtype=object),
        names=tuple(names) if has_names else None,
        meta=find_metadata(_find_scalars(frame.attrs)),
        time=0 if has_time_index else None,
    )


def from_polars(frame: _Frame) -> Table:
    """Return the table of a polars DataFrame."""
    if frame.width == 0:
        raise LogError("there are no columns")
    return Table(
        width=frame.width,
        load=lambda wanted: [_from_polars(frame.to_series(i)) for i in wanted],
        labels=lambda index: np.array(frame.to_series(index).to_list(), dtype=object),
        names=tuple(frame.columns),
    )


def _find_scalars(attributes: Mapping[Any, Any]) -> dict[str, LazyArray]:
    return {k: LazyArray.of(np.asarray(v)) for k, v in attributes.items() if k in SCALAR_NAMES}


def _join_label(label: object) -> str:
    return "/".join(map(str, label)) if isinstance(label, tuple) else str(label)


def _is_time(index: _Series) -> bool:
    name = index.name
    return index.dtype.kind in "Mm" or (isinstance(name, str) and has_time_name(name))


def _from_pandas(series: _Series, name: str) -> Column:
    kind = series.dtype.kind
    if kind in "Mm":
        # Times with a zone become UTC, without Python objects.
        return np.asarray(series.to_numpy(dtype=f"{kind}8[{_resolution(series.dtype)}]"))
    if kind == "O" and has_time_name(name):
        return np.asarray(series.to_numpy(dtype=object))
    if kind not in _WIDE_DTYPES:
        raise LogError(f"column '{name}' holds {series.dtype}, expected numbers")
    if isinstance(series.dtype, np.dtype):
        return np.asarray(series.to_numpy())
    if series.isna().any():
        return np.asarray(series.to_numpy(dtype=np.float64, na_value=np.nan))
    return np.asarray(series.to_numpy(dtype=_WIDE_DTYPES[kind]))


def _resolution(dtype: Any) -> str:  # noqa: ANN401
    """Return the unit of a type of times of NumPy, Arrow or pandas."""
    if isinstance(dtype, np.dtype):
        return np.datetime_data(dtype)[0]
    return str(getattr(dtype, "pyarrow_dtype", dtype).unit)


def _from_polars(series: _Series) -> Column:
    kind = series.dtype
    if kind == _polars().Boolean:
        series = series.cast(_polars().Int8)
    elif not (kind.is_numeric() or kind.is_temporal() or _is_text_of_time(series)):
        raise LogError(f"column '{series.name}' holds {kind}, expected numbers")
    return np.asarray(series.to_numpy())


def _is_text_of_time(series: _Series) -> bool:
    return series.dtype == _polars().String and has_time_name(series.name)


def _polars() -> Any:  # noqa: ANN401
    import polars

    return polars


_FRAME_READERS: Final[dict[str, Callable[[Any], Table]]] = {
    "pandas": from_pandas,
    "polars": from_polars,
}


class ArrowStream(Protocol):
    """Object with a stream of Arrow rows: frames and tables of many packages."""

    def __arrow_c_stream__(self, requested_schema: object = None, /) -> object:
        """Return a capsule with the stream."""


def describe_object(source: object) -> str:
    """Return the package and class of an object, such as ``pandas DataFrame``."""
    kind = type(source)
    package = kind.__module__.partition(".")[0]
    return kind.__name__ if package == "builtins" else f"{package} {kind.__name__}"


def make_table(source: object) -> tuple[str, Table]:
    """Return the kind of an object and its table; TypeError if it has no table."""
    if isinstance(source, Mapping):
        return "arrays", _from_mapping(source)
    if isinstance(source, np.ndarray):
        return "array", from_array(LazyArray.of(_fill_masked(source)))
    for package, read in _FRAME_READERS.items():
        # A frame can exist only if its package is loaded.
        frame = getattr(sys.modules.get(package), "DataFrame", None)
        if frame is not None and isinstance(source, frame):
            return package, read(source)
    if hasattr(source, "__arrow_c_stream__"):
        return "arrow", _from_stream(source)
    raise TypeError(
        f"a log is read from a file, a data frame, a table or arrays, got {describe_object(source)}"
    )


def _from_mapping(source: Mapping[Any, Any]) -> Table:
    arrays = {
        str(name): LazyArray.of(_make_array(str(name), values)) for name, values in source.items()
    }
    return from_arrays(strip_common_folder(arrays))


def _make_array(name: str, values: Any) -> Column:  # noqa: ANN401
    try:
        array = without_masks(values)
    except OverflowError:
        raise LogError(f"'{name}' holds a number beyond the largest double, 1.8e308") from None
    except ValueError:
        raise LogError(f"'{name}' is ragged, expected an array of numbers") from None
    return array


def _fill_masked(array: Column) -> Column:
    """Return the array with NaN for masked values; a structured array as columns."""
    if array.dtype.names is None or not isinstance(array, np.ma.MaskedArray):
        return without_masks(array)
    fields = {name: without_masks(array[name]) for name in array.dtype.names}
    types = [(name, field.dtype, field.shape[1:]) for name, field in fields.items()]
    rows = np.empty(array.shape, types)
    for name, field in fields.items():
        rows[name] = field
    return rows


def _from_stream(source: ArrowStream) -> Table:
    pa = import_pyarrow(describe_object(source))
    try:
        table = pa.RecordBatchReader.from_stream(source).read_all()
    except (pa.ArrowException, TypeError):
        raise LogError("it is no table of Arrow, expected named columns") from None
    return arrow_table(table.schema, lambda wanted: [table.column(i) for i in wanted])
