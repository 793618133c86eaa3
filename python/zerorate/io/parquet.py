"""Parquet files, of which only the columns asked for are read."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from zerorate.io.arrow import arrow_table, needs_pyarrow
from zerorate.io.errors import LogError
from zerorate.io.log import Log
from zerorate.io.table import Column, Table

TIME_NAME = "time_s"


def read_parquet(path: Path) -> Table:
    """Return the table in a Parquet file."""
    pa, pq = _pyarrow()
    try:
        schema = pq.read_schema(path)
    except (pa.ArrowException, OSError):
        raise LogError("cannot be read as Parquet: it is truncated or damaged") from None
    return arrow_table(schema, lambda wanted: _load(path, [schema.names[i] for i in wanted]))


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
    pa = needs_pyarrow("Parquet")
    import pyarrow.parquet as pq

    return pa, pq


def _load(path: Path, names: list[str]) -> list[Any]:
    pa, pq = _pyarrow()
    try:
        # Not `read_table`: it loads the whole machinery of data sets first.
        with pq.ParquetFile(path) as file:
            table = file.read(columns=names)
    except (pa.ArrowException, OSError):
        raise LogError("cannot be read as Parquet: it is truncated or damaged") from None
    return [table.column(name) for name in names]
