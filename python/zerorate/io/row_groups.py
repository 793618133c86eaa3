"""Columns to a Parquet file, piece by piece."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from types import TracebackType
from typing import Any, Final, Self

import numpy as np

from zerorate.io.arrow import needs_pyarrow, to_arrow
from zerorate.io.table import Column

__all__ = ["RowGroups"]

_ROWS: Final = 1 << 17


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

    def __enter__(self) -> Self:
        """Return the file itself."""
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        """Write what waits, unless something went wrong, and close the file."""
        try:
            if kind is None and self._waiting:
                self._write_group()
        finally:
            if self._writer is not None:
                self._writer.close()

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
        columns = [parts[0] if len(parts) == 1 else np.concatenate(parts) for parts in waiting]
        self._waiting, self._rows = [], 0
        table = self._arrow.table([to_arrow(column) for column in columns], names=self._names)
        table = table.replace_schema_metadata(self._metadata)
        if self._writer is None:
            self._writer = self._opened(table.schema)
        self._writer.write_table(table, row_group_size=_ROWS)

    def _opened(self, schema: Any) -> Any:  # noqa: ANN401
        import pyarrow.parquet as pq

        # Doubles of a sensor hardly ever repeat: a dictionary is made in vain. By bytes of one
        # weight they shrink to less than by any stronger compression of whole numbers.
        doubles = [field.name for field in schema if self._arrow.types.is_float64(field.type)]
        return pq.ParquetWriter(
            self._path,
            schema,
            compression="lz4",
            use_dictionary=False,
            use_byte_stream_split=doubles,
        )
