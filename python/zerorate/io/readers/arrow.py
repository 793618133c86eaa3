"""Arrow: schemas, columns and metadata of tables; IPC files and streams."""

from __future__ import annotations

import json
import os
import re
import reprlib
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any, Final

import numpy as np

from zerorate.io.clocks.names import has_time_name
from zerorate.io.limits import check_bytes
from zerorate.io.table import Column, Content, Metadata, Table, apply_listed_names
from zerorate.record.log import LogError
from zerorate.texts import describe_missing_extra

_MAX_ROWS_AT_ONCE: Final = 1 << 18
"""Largest number of rows of a column in Arrow's memory."""

# Any, because the stubs of pyarrow come from another package and are incomplete.
_Schema = Any
_Chunks = Any


def import_pyarrow(what: str) -> Any:  # noqa: ANN401
    """Return the module pyarrow, or raise an error that names its user."""
    try:
        import pyarrow
        import pyarrow.ipc
    except ImportError:
        raise ImportError(describe_missing_extra("pyarrow", "io", what)) from None
    return pyarrow


def arrow_table(schema: _Schema, read: Callable[[Sequence[int]], Sequence[_Chunks]]) -> Table:
    """Return the table of a schema; ``read`` returns the columns with some indices."""
    if len(schema) == 0:
        raise LogError("there are no columns")

    def load(wanted: Sequence[int]) -> list[Column]:
        _check_types(schema, wanted)
        return [_to_numpy(column) for column in read(wanted)]

    def labels(index: int) -> Column:
        pa = import_pyarrow("Arrow")
        values: Column = read([index])[0].cast(pa.string()).to_numpy(zero_copy_only=False)
        return values

    meta = _make_metadata(schema.metadata or {})
    names = tuple(map(_of_levels, _column_names(schema)))
    table = Table(len(schema), load, names=names, meta=meta, labels=labels)
    return apply_listed_names(replace(table, time=_index_of_pandas(schema)))


def _of_levels(name: str) -> str:
    """Return the name of a pandas column with several levels, joined by slashes."""
    if not re.fullmatch(r"\('.*'\)", name):
        return name
    return "/".join(re.findall(r"'([^']*)'", name))


def _index_of_pandas(schema: _Schema) -> int | None:
    """Return the column that was the time index of a pandas frame; None if there is none."""
    try:
        listed = json.loads((schema.metadata or {}).get(b"pandas", b"{}"))["index_columns"]
    except (ValueError, KeyError, TypeError, RecursionError):
        return None
    if len(listed) != 1 or not isinstance(listed[0], str) or listed[0] not in schema.names:
        return None
    index = int(schema.get_field_index(listed[0]))
    types = import_pyarrow("Arrow").types
    kind = schema.field(index).type if index >= 0 else None
    return index if kind and (types.is_timestamp(kind) or types.is_duration(kind)) else None


def add_pieces(
    table: Table,
    schema: _Schema,
    rows: int,
    read: Callable[[Sequence[int], int], Iterator[Sequence[_Chunks]]],
    check: Callable[[Sequence[int]], None],
) -> Table:
    """Return the table with `rows` rows, which ``read`` can also return in pieces.

    ``check`` raises an error for columns that are too large to load.
    """

    def pieces(wanted: Sequence[int], most: int) -> Iterator[list[Column]]:
        _check_types(schema, wanted)
        for columns in read(wanted, most):
            yield [_to_numpy(column) for column in columns]

    def load(wanted: Sequence[int]) -> list[Column]:
        if rows <= _MAX_ROWS_AT_ONCE:
            return table.load(wanted)
        _check_types(schema, wanted)
        check(wanted)
        # Arrow does not release its memory: a long log would need twice the memory.
        return [
            _join_parts((_to_numpy(part) for (part,) in read([i], _MAX_ROWS_AT_ONCE)), rows)
            for i in wanted
        ]

    return replace(table, load=load, pieces=pieces, rows=rows)


def _join_parts(parts: Iterator[Column], rows: int) -> Column:
    """Return a column of `rows` rows from its parts; a part with nulls may have doubles."""
    whole, row_count = np.empty(0), 0
    for part in parts:
        if row_count == 0:
            whole = np.empty(rows, part.dtype)
        elif part.dtype != whole.dtype:
            whole = whole.astype(np.result_type(whole, part))
        if row_count + len(part) > len(whole):  # more rows than the file states
            return np.concatenate([whole[:row_count], part])
        whole[row_count : row_count + len(part)] = part
        row_count += len(part)
    return whole[:row_count]


def _column_names(schema: _Schema) -> tuple[str, ...]:
    try:
        return tuple(schema.names)
    except UnicodeDecodeError:
        raise LogError("a column's name is no UTF-8 text: the content is damaged") from None


def _check_types(schema: _Schema, wanted: Sequence[int]) -> None:
    for index in wanted:
        _check_type(schema.field(index))


def _check_type(field: _Schema) -> None:
    types = import_pyarrow("Arrow").types
    known = (
        types.is_integer,
        types.is_floating,
        types.is_boolean,
        types.is_timestamp,
        types.is_duration,
    )
    texts = (types.is_string, types.is_large_string, types.is_string_view)
    if has_time_name(field.name) and any(is_text(field.type) for is_text in texts):
        return
    if not any(is_known(field.type) for is_known in known):
        raise LogError(f"column '{field.name}' holds {field.type}, expected numbers")


def _to_numpy(column: _Chunks) -> Column:
    pa = import_pyarrow("Arrow")
    chunks = getattr(column, "chunks", [column])
    plain = pa.types.is_integer(column.type) or pa.types.is_floating(column.type)
    if plain and chunks and not column.null_count:
        # `to_numpy` would import an installed pandas, which takes longer than all else.
        parts = [np.from_dlpack(chunk) for chunk in chunks]
        return parts[0] if len(parts) == 1 else np.concatenate(parts)
    if pa.types.is_boolean(column.type):
        column = column.cast(pa.int8())
    values: Column = column.to_numpy(zero_copy_only=False)
    return values


def to_arrow(column: Column) -> _Chunks:
    """Return an array of doubles or flags for Arrow; doubles are not copied."""
    pa = import_pyarrow("Arrow")
    if column.dtype == np.bool_:
        bits = pa.py_buffer(np.packbits(column, bitorder="little"))
        return pa.Array.from_buffers(pa.bool_(), len(column), [None, bits])
    # `pa.array` would import pandas.
    doubles = pa.py_buffer(np.ascontiguousarray(column, dtype=np.float64))
    return pa.Array.from_buffers(pa.float64(), len(column), [None, doubles])


def _make_metadata(pairs: Mapping[bytes, bytes]) -> Metadata:
    text = {key.decode(errors="replace"): value for key, value in pairs.items()}
    return Metadata(
        rate=_parse_rate(text.get("rate")),
        unit=_decode_text(text.get("unit")),
        sensor=_decode_text(text.get("sensor")),
        names=_parse_names(text.get("names")),
    )


def _decode_text(value: bytes | None) -> str | None:
    return None if value is None else value.decode(errors="replace")


def _parse_rate(value: bytes | None) -> float | None:
    try:
        return None if value is None else float(value)
    except ValueError:
        shown = reprlib.repr(value)
        raise LogError(f"the metadata's rate is {shown}, expected a number of Hz") from None


def _parse_names(value: bytes | None) -> tuple[str, ...] | None:
    try:
        listed = json.loads(value or b"null")
    except (ValueError, RecursionError):
        return None
    strings = isinstance(listed, list) and all(isinstance(name, str) for name in listed)
    return tuple(listed) if strings else None


_FILE_MARK = b"ARROW1"


def read(path: Path) -> Content:
    """Return the table in an Arrow IPC file or stream, also called Feather."""

    def load(wanted: Sequence[int]) -> list[Any]:
        fields = sorted(wanted)
        with _open_reader(path, fields) as reader:
            columns = _read_batches(path, reader)
        # Without it, a buffer shorter than stated would be read beyond its end.
        columns.validate()
        return [columns.column(fields.index(index)) for index in wanted]

    with _open_reader(path, None) as reader:
        schema = reader.schema
    return Content.of(arrow_table(schema, load))


def _read_batches(path: Path, reader: Any) -> Any:  # noqa: ANN401
    """Return all batches as a table; LogError if they are too large for the size of the file."""
    count = getattr(reader, "num_record_batches", None)
    source = reader if count is None else map(reader.get_batch, range(count))
    batches, byte_count = [], 0
    for batch in source:
        byte_count += batch.nbytes
        check_bytes(path, byte_count, "the table")
        batches.append(batch)
    schema = batches[0].schema if batches else reader.schema
    return import_pyarrow("Arrow IPC").Table.from_batches(batches, schema)


@contextmanager
def _open_reader(path: Path, fields: list[int] | None) -> Iterator[Any]:
    pa = import_pyarrow("Arrow IPC")
    with path.open("rb") as file:
        is_file = file.read(len(_FILE_MARK)) == _FILE_MARK
    open_as = pa.ipc.open_file if is_file else pa.ipc.open_stream
    options = pa.ipc.IpcReadOptions(included_fields=fields)
    with pa.memory_map(os.fsencode(path)) as source, open_as(source, options=options) as reader:
        yield reader
