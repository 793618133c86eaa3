"""Parquet files, of which only the columns asked for are read."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from zerorate.io.errors import LogError
from zerorate.io.log import Log
from zerorate.io.table import Column, Metadata, Table, listed_names

if TYPE_CHECKING:
    import pyarrow as pa

TIME_NAME = "time_s"


def read_parquet(path: Path) -> Table:
    """Return the table in a Parquet file."""
    pa, pq = _pyarrow()
    try:
        schema = pq.read_schema(path)
    except (pa.ArrowException, OSError):
        raise LogError("cannot be read as Parquet: it is truncated or damaged") from None
    table = Table(
        width=len(schema),
        load=lambda wanted: _load(path, schema, wanted),
        names=tuple(schema.names),
        meta=_metadata(schema.metadata or {}),
    )
    if table.width == 0:
        raise LogError("the file has no columns")
    return listed_names(table)


def write_parquet(log: Log, path: Path, names: Sequence[str], beside: Mapping[str, Column]) -> None:
    """Write a log and columns beside it; its rate, unit and names as key-value metadata."""
    pa, pq = _pyarrow()
    columns = [log.time, *np.asfortranarray(log.data).T, *beside.values()]
    fields = {"rate": repr(log.rate), "unit": log.unit, "names": json.dumps(log.names)}
    if "sensor" in log.meta:
        fields["sensor"] = str(log.meta["sensor"])
    table = pa.table(columns, names=[TIME_NAME, *names, *beside])
    pq.write_table(table.replace_schema_metadata(fields), path, compression="zstd")


def _pyarrow() -> tuple[Any, Any]:
    try:
        import pyarrow
        import pyarrow.parquet
    except ImportError:
        raise ImportError("Parquet needs pyarrow: pip install 'zerorate[io]'") from None
    return pyarrow, pyarrow.parquet


def _load(path: Path, schema: pa.Schema, wanted: Sequence[int]) -> list[Column]:
    pa, pq = _pyarrow()
    for index in wanted:
        _check_type(schema.field(index))
    names = [schema.names[i] for i in wanted]
    try:
        # Not `read_table`: it loads the whole machinery of data sets first.
        with pq.ParquetFile(path) as file:
            table = file.read(columns=names)
    except (pa.ArrowException, OSError):
        raise LogError("cannot be read as Parquet: it is truncated or damaged") from None
    return [_to_numpy(table.column(name)) for name in names]


def _check_type(field: pa.Field[Any]) -> None:
    types = _pyarrow()[0].types
    known = (types.is_integer, types.is_floating, types.is_boolean, types.is_timestamp)
    if not any(is_known(field.type) for is_known in known):
        raise LogError(f"column '{field.name}' holds {field.type}, expected numbers")


def _to_numpy(column: pa.ChunkedArray[Any]) -> Column:
    pa, _ = _pyarrow()
    if pa.types.is_boolean(column.type):
        column = column.cast(pa.int8())
    values: Column = column.to_numpy()
    return values


def _metadata(pairs: dict[bytes, bytes]) -> Metadata:
    text = {key.decode(errors="replace"): value for key, value in pairs.items()}
    return Metadata(
        rate=_rate(text.get("rate")),
        unit=_text(text.get("unit")),
        sensor=_text(text.get("sensor")),
        names=_names(text.get("names")),
    )


def _text(value: bytes | None) -> str | None:
    return None if value is None else value.decode(errors="replace")


def _rate(value: bytes | None) -> float | None:
    try:
        return None if value is None else float(value)
    except ValueError:
        raise LogError(f"the metadata's rate is {value!r}, expected a number of Hz") from None


def _names(value: bytes | None) -> tuple[str, ...] | None:
    try:
        listed = json.loads(value or b"null")
    except ValueError:
        return None
    strings = isinstance(listed, list) and all(isinstance(name, str) for name in listed)
    return tuple(listed) if strings else None
