"""Parquet files, of which only the columns asked for are read."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Final

import numpy as np

from zerorate.io.arrow import arrow_table, in_pieces, needs_pyarrow
from zerorate.io.errors import LogError
from zerorate.io.header import Header
from zerorate.io.log import Log
from zerorate.io.row_groups import RowGroups
from zerorate.io.table import Column, Table

TIME_NAME = "time_s"
_BUFFER: Final = 1 << 20


def read_parquet(path: Path) -> Table:
    """Return the table in a Parquet file."""
    with _opened(path) as file:
        schema, rows = file.schema_arrow, file.metadata.num_rows
    table = arrow_table(schema, lambda wanted: _load(path, [schema.names[i] for i in wanted]))

    def read(wanted: Sequence[int], most: int) -> Iterator[Sequence[Any]]:
        return _pieces(path, [schema.names[i] for i in wanted], most)

    return in_pieces(table, schema, rows, read)


def write_parquet(log: Log, path: Path, names: Sequence[str], beside: Mapping[str, Column]) -> None:
    """Write a log and columns beside it; its rate, unit and names as key-value metadata."""
    columns = [log.time, *np.asfortranarray(log.data).T, *beside.values()]
    with RowGroups(path, [TIME_NAME, *names, *beside], about(log)) as file:
        file.write(columns)


def about(log: Log | Header) -> dict[str, str]:
    """Return the metadata of a file of a log."""
    fields = {"rate": repr(log.rate), "unit": log.unit, "names": json.dumps(log.names)}
    if "sensor" in log.meta:
        fields["sensor"] = str(log.meta["sensor"])
    return fields


def _pyarrow() -> tuple[Any, Any]:
    pa = needs_pyarrow("Parquet")
    import pyarrow.parquet as pq

    return pa, pq


@contextmanager
def _opened(path: Path, **options: int) -> Iterator[Any]:
    pa, pq = _pyarrow()
    try:
        # Not `read_table`: it loads the whole machinery of data sets first.
        with pq.ParquetFile(path, **options) as file:
            yield file
    except (pa.ArrowException, OSError):
        raise LogError("cannot be read as Parquet: it is truncated or damaged") from None


def _load(path: Path, names: list[str]) -> list[Any]:
    with _opened(path) as file:
        table = file.read(columns=names)
    return [table.column(name) for name in names]


def _pieces(path: Path, names: list[str], most: int) -> Iterator[Sequence[Any]]:
    # Else pyarrow would keep every column chunk it has read, which is the whole file in the end.
    with _opened(path, buffer_size=_BUFFER, pre_buffer=False) as file:
        for batch in file.iter_batches(most, columns=names, use_threads=False):
            yield [batch.column(name) for name in names]
