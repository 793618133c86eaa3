"""Parquet files: read by column and in pieces, written in row groups."""

from __future__ import annotations

import json
import os
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Final, Self

import numpy as np

from zerorate.io.limits import check_bytes
from zerorate.io.readers.arrow import add_pieces, arrow_table, import_pyarrow, to_arrow
from zerorate.io.table import Column, Content
from zerorate.record.log import Header, Log

TIME_NAME = "time_s"
_BUFFER_BYTES: Final = 1 << 20


def read(path: Path) -> Content:
    """Return the table in a Parquet file."""
    with _open_file(path) as file:
        schema, rows = file.schema_arrow, file.metadata.num_rows

    def check(wanted: Sequence[int]) -> None:
        byte_count = rows * sum(map(_value_bytes, (schema.field(i) for i in wanted)))
        check_bytes(path, byte_count, "the table")

    def load(wanted: Sequence[int]) -> list[Any]:
        check(wanted)
        names, positions = _find_positions(schema.names, wanted)
        with _open_file(path) as file:
            table = file.read(columns=names)
        return [table.column(i) for i in positions]

    def pieces(wanted: Sequence[int], most: int) -> Iterator[Sequence[Any]]:
        names, positions = _find_positions(schema.names, wanted)
        # Without it, pyarrow would keep every column chunk: the whole file in the end.
        with _open_file(path, buffer_size=_BUFFER_BYTES, pre_buffer=False) as file:
            for batch in file.iter_batches(most, columns=names, use_threads=False):
                yield [batch.column(i) for i in positions]

    table = arrow_table(schema, load)
    return Content.of(add_pieces(table, schema, rows, pieces, check))


def write_parquet(log: Log, path: Path, names: Sequence[str]) -> None:
    """Write a log and its extra columns, with rate, unit and names as key-value metadata."""
    columns = [log.sampled, *np.asfortranarray(log.data).T, *log.extra.values()]
    with RowGroupWriter(path, [TIME_NAME, *names, *log.extra], make_metadata(log)) as file:
        file.write(columns)


def make_metadata(log: Log | Header) -> dict[str, str]:
    """Return the metadata for a log's file."""
    fields = {"rate": repr(log.rate), "unit": log.unit, "names": json.dumps(log.names)}
    if "sensor" in log.meta:
        fields["sensor"] = str(log.meta["sensor"])
    return fields


def _value_bytes(field: Any) -> int:  # noqa: ANN401
    """Return the size of a value in a column, bytes; for texts, with its offset."""
    try:
        return max(int(field.type.bit_width) // 8, 1)
    except ValueError:
        return 8


def _find_positions(listed: Sequence[str], wanted: Sequence[int]) -> tuple[list[str], list[int]]:
    """Return the names to read, and the positions of the columns; equal names are all read."""
    names = list(dict.fromkeys(listed[i] for i in wanted))
    read = [i for name in names for i, own in enumerate(listed) if own == name]
    return names, [read.index(i) for i in wanted]


@contextmanager
def _open_file(path: Path, **options: Any) -> Iterator[Any]:  # noqa: ANN401
    import_pyarrow("Parquet")
    import pyarrow.parquet as pq

    # `read_table` would load a large module for data sets first.
    with open_native_file(path) as raw, pq.ParquetFile(raw, **options) as file:
        yield file


_GROUP_ROWS: Final = 1 << 17


def open_native_file(path: Path, mode: str = "rb") -> Any:  # noqa: ANN401  # its package is optional
    """Return an open file for pyarrow; its name may not be UTF-8."""
    return import_pyarrow("Parquet").OSFile(os.fsencode(path), mode)


class RowGroupWriter:
    """Writer of a Parquet file; the bytes do not depend on the pieces.

    Parameters
    ----------
    path : Path
        File to write.
    names : sequence of str
        Names of the columns, which are doubles or flags.
    metadata : mapping
        Metadata of the file, keys and values.
    """

    def __init__(self, path: Path, names: Sequence[str], metadata: Mapping[str, str]) -> None:
        self._arrow = import_pyarrow("Parquet")
        self._path = path
        self._names = list(names)
        self._metadata = metadata
        self._pending: list[list[Column]] = []
        self._rows = 0
        self._writer: Any = None
        self._file: Any = None

    def __enter__(self) -> Self:
        """Return the file itself."""
        return self

    def __exit__(self, kind: type[BaseException] | None, *fault: object) -> None:
        """Write the remaining rows, unless an error occurred, and close the file."""
        try:
            if kind is None and self._pending:
                self._write_group()
        finally:
            if self._writer is not None:
                self._writer.close()
                self._file.close()

    def write(self, columns: Sequence[Column]) -> None:
        """Add a piece of all columns; complete groups are written."""
        rows, done = len(columns[0]), 0
        while done < rows:
            end = min(rows, done + _GROUP_ROWS - self._rows)
            self._pending.append([column[done:end] for column in columns])
            self._rows += end - done
            done = end
            if self._rows == _GROUP_ROWS:
                self._write_group()

    def _write_group(self) -> None:
        pending = zip(*self._pending, strict=True)
        # A group has one page per column whatever the pieces are, so pieces need not be joined.
        arrays = [self._arrow.chunked_array(map(to_arrow, parts)) for parts in pending]
        self._pending, self._rows = [], 0
        # Without nulls (NaN is a number), rows are not tested for missing values.
        fields = [
            self._arrow.field(name, array.type, nullable=False)
            for name, array in zip(self._names, arrays, strict=True)
        ]
        schema = self._arrow.schema(fields, metadata=self._metadata)
        if self._writer is None:
            self._writer = self._open_writer(schema)
        table = self._arrow.Table.from_arrays(arrays, schema=schema)
        self._writer.write_table(table, row_group_size=_GROUP_ROWS)

    def _open_writer(self, schema: Any) -> Any:  # noqa: ANN401
        import pyarrow.parquet as pq

        # Doubles of a sensor hardly ever repeat, so a dictionary is useless. Splitting the bytes by
        # significance compresses better than stronger compression of whole numbers.
        doubles = [field.name for field in schema if self._arrow.types.is_float64(field.type)]
        self._file = open_native_file(self._path, "wb")
        return pq.ParquetWriter(
            self._file,
            schema,
            compression="lz4",
            use_dictionary=False,
            use_byte_stream_split=doubles,
            # Minimum and maximum times let readers of a time span skip row groups.
            write_statistics=[TIME_NAME] if TIME_NAME in self._names else False,
        )
