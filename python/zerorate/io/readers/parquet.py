"""Parquet files: read by column and by piece, written by row group."""

from __future__ import annotations

import json
import os
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Final, Self

import numpy as np

from zerorate.io.limits import check_bytes
from zerorate.io.readers.arrow import arrow_table, in_pieces, needs_pyarrow, to_arrow
from zerorate.io.table import Column, Content
from zerorate.record.log import Header, Log

TIME_NAME = "time_s"
_BUFFER: Final = 1 << 20


def read(path: Path) -> Content:
    """Return the table in a Parquet file."""
    with _opened(path) as file:
        schema, rows = file.schema_arrow, file.metadata.num_rows

    def check(wanted: Sequence[int]) -> None:
        taken = rows * sum(map(_bytes_of, (schema.field(i) for i in wanted)))
        check_bytes(path, taken, "the table")

    def load(wanted: Sequence[int]) -> list[Any]:
        check(wanted)
        names, places = _places(schema.names, wanted)
        with _opened(path) as file:
            table = file.read(columns=names)
        return [table.column(i) for i in places]

    def pieces(wanted: Sequence[int], most: int) -> Iterator[Sequence[Any]]:
        names, places = _places(schema.names, wanted)
        # Else pyarrow would keep every column chunk it has read, the whole file in the end.
        with _opened(path, buffer_size=_BUFFER, pre_buffer=False) as file:
            for batch in file.iter_batches(most, columns=names, use_threads=False):
                yield [batch.column(i) for i in places]

    table = arrow_table(schema, load)
    return Content.of(in_pieces(table, schema, rows, pieces, check))


def write_parquet(log: Log, path: Path, names: Sequence[str]) -> None:
    """Write a log and its extra columns; its rate, unit and names as key-value metadata."""
    columns = [log.sampled, *np.asfortranarray(log.data).T, *log.extra.values()]
    with RowGroups(path, [TIME_NAME, *names, *log.extra], about(log)) as file:
        file.write(columns)


def about(log: Log | Header) -> dict[str, str]:
    """Return the metadata of a file of a log."""
    fields = {"rate": repr(log.rate), "unit": log.unit, "names": json.dumps(log.names)}
    if "sensor" in log.meta:
        fields["sensor"] = str(log.meta["sensor"])
    return fields


def _bytes_of(field: Any) -> int:  # noqa: ANN401
    """Return the bytes of a value of a column, those of a text with its place."""
    try:
        return max(int(field.type.bit_width) // 8, 1)
    except ValueError:
        return 8


def _places(listed: Sequence[str], wanted: Sequence[int]) -> tuple[list[str], list[int]]:
    """Return the names to read, and where the columns then are: all of one name are read."""
    names = list(dict.fromkeys(listed[i] for i in wanted))
    read = [i for name in names for i, own in enumerate(listed) if own == name]
    return names, [read.index(i) for i in wanted]


@contextmanager
def _opened(path: Path, **options: Any) -> Iterator[Any]:  # noqa: ANN401
    needs_pyarrow("Parquet")
    import pyarrow.parquet as pq

    # Not `read_table`: it loads the whole machinery of data sets first.
    with native_file(path) as raw, pq.ParquetFile(raw, **options) as file:
        yield file


_ROWS: Final = 1 << 17


def native_file(path: Path, mode: str = "rb") -> Any:  # noqa: ANN401  # its package is optional
    """Return an open file of pyarrow; its name need not be UTF-8, as that of a path must."""
    return needs_pyarrow("Parquet").OSFile(os.fsencode(path), mode)


class RowGroups:
    """A Parquet file that is the same to the last byte whatever the pieces it is written in.

    Parameters
    ----------
    path : Path
        The file to write.
    names : sequence of str
        Of the columns, which hold doubles or flags.
    metadata : mapping
        Keys and values of the file.
    """

    def __init__(self, path: Path, names: Sequence[str], metadata: Mapping[str, str]) -> None:
        self._arrow = needs_pyarrow("Parquet")
        self._path = path
        self._names = list(names)
        self._metadata = metadata
        self._waiting: list[list[Column]] = []
        self._rows = 0
        self._writer: Any = None
        self._file: Any = None

    def __enter__(self) -> Self:
        """Return the file itself."""
        return self

    def __exit__(self, kind: type[BaseException] | None, *fault: object) -> None:
        """Write what waits, unless something went wrong, and close the file."""
        try:
            if kind is None and self._waiting:
                self._write_group()
        finally:
            if self._writer is not None:
                self._writer.close()
                self._file.close()

    def write(self, columns: Sequence[Column]) -> None:
        """Take a piece of all columns; whole groups are written."""
        rows, done = len(columns[0]), 0
        while done < rows:
            end = min(rows, done + _ROWS - self._rows)
            self._waiting.append([column[done:end] for column in columns])
            self._rows += end - done
            done = end
            if self._rows == _ROWS:
                self._write_group()

    def _write_group(self) -> None:
        waiting = zip(*self._waiting, strict=True)
        # A group is a page of each column, the same whatever the pieces: they need not be joined.
        arrays = [self._arrow.chunked_array(map(to_arrow, parts)) for parts in waiting]
        self._waiting, self._rows = [], 0
        # Where nothing can be missing (NaN is a number) no row is asked whether it is.
        fields = [
            self._arrow.field(name, array.type, nullable=False)
            for name, array in zip(self._names, arrays, strict=True)
        ]
        schema = self._arrow.schema(fields, metadata=self._metadata)
        if self._writer is None:
            self._writer = self._opened(schema)
        table = self._arrow.Table.from_arrays(arrays, schema=schema)
        self._writer.write_table(table, row_group_size=_ROWS)

    def _opened(self, schema: Any) -> Any:  # noqa: ANN401
        import pyarrow.parquet as pq

        # Doubles of a sensor hardly ever repeat: a dictionary is made in vain. By bytes of one
        # weight they shrink to less than by any stronger compression of whole numbers.
        doubles = [field.name for field in schema if self._arrow.types.is_float64(field.type)]
        self._file = native_file(self._path, "wb")
        return pq.ParquetWriter(
            self._file,
            schema,
            compression="lz4",
            use_dictionary=False,
            use_byte_stream_split=doubles,
            # By the least and the largest time whoever wants a span leaves out groups of rows.
            write_statistics=[TIME_NAME] if TIME_NAME in self._names else False,
        )
