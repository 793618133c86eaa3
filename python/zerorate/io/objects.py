"""Objects in memory that hold a log: data frames, Arrow tables, dicts and arrays."""

from __future__ import annotations

import sys
from collections.abc import Callable, Mapping
from typing import Any, Final, Protocol

import numpy as np

from zerorate.io.arrays import from_array, from_arrays, without_common_folder
from zerorate.io.arrow import arrow_table, needs_pyarrow
from zerorate.io.errors import LogError
from zerorate.io.frames import from_pandas, from_polars
from zerorate.io.table import Column, Table

__all__ = ["ArrowStream", "described", "table_of"]


_FRAMES: Final[dict[str, Callable[[Any], Table]]] = {"pandas": from_pandas, "polars": from_polars}


class ArrowStream(Protocol):
    """Whatever hands out its rows as a stream of Arrow: frames and tables of many packages."""

    def __arrow_c_stream__(self, requested_schema: object = None, /) -> object:
        """Return a capsule with the stream."""


def described(source: object) -> str:
    """Return the package and class of an object, such as ``pandas DataFrame``."""
    kind = type(source)
    package = kind.__module__.partition(".")[0]
    return kind.__name__ if package == "builtins" else f"{package} {kind.__name__}"


def table_of(source: object) -> tuple[str, Table]:
    """Return the kind of an object and its table; TypeError if it holds none."""
    if isinstance(source, Mapping):
        return "arrays", _from_mapping(source)
    if isinstance(source, np.ndarray):
        return "array", from_array(source)
    for package, read in _FRAMES.items():
        # A frame exists only where its package is loaded.
        frame = getattr(sys.modules.get(package), "DataFrame", None)
        if frame is not None and isinstance(source, frame):
            return package, read(source)
    if hasattr(source, "__arrow_c_stream__"):
        return "arrow", _from_stream(source)
    raise TypeError(
        f"a log is read from a file, a data frame, a table or arrays, got {described(source)}"
    )


def _from_mapping(source: Mapping[Any, Any]) -> Table:
    arrays = {str(name): _array(str(name), values) for name, values in source.items()}
    return from_arrays(without_common_folder(arrays))


def _array(name: str, values: object) -> Column:
    try:
        array = np.asarray(values)
    except ValueError:
        raise LogError(f"'{name}' is ragged, expected an array of numbers") from None
    return array


def _from_stream(source: ArrowStream) -> Table:
    pa = needs_pyarrow(described(source))
    try:
        table = pa.RecordBatchReader.from_stream(source).read_all()
    except (pa.ArrowException, TypeError):
        raise LogError("it is no table of Arrow, expected named columns") from None
    return arrow_table(table.schema, lambda wanted: [table.column(i) for i in wanted])
