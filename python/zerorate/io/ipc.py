"""Arrow IPC files and streams, of which Feather is one name."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from zerorate.io.arrow import arrow_table, needs_pyarrow
from zerorate.io.errors import LogError
from zerorate.io.table import Table

__all__ = ["FILE_MARK", "STREAM_MARK", "read_ipc"]

FILE_MARK = b"ARROW1"
STREAM_MARK = b"\xff\xff\xff\xff"


def read_ipc(path: Path) -> Table:
    """Return the table in an Arrow IPC file or stream."""

    def read(wanted: Sequence[int]) -> list[Any]:
        fields = sorted(wanted)
        with _opened(path, fields) as reader:
            columns = reader.read_all().columns
        return [columns[fields.index(index)] for index in wanted]

    with _opened(path, None) as reader:
        schema = reader.schema
    return arrow_table(schema, read)


@contextmanager
def _opened(path: Path, fields: list[int] | None) -> Iterator[Any]:
    pa = needs_pyarrow("Arrow IPC")
    with path.open("rb") as file:
        whole = file.read(len(FILE_MARK)) == FILE_MARK
    open_as = pa.ipc.open_file if whole else pa.ipc.open_stream
    options = pa.ipc.IpcReadOptions(included_fields=fields)
    try:
        with pa.memory_map(str(path)) as source, open_as(source, options=options) as reader:
            yield reader
    except (pa.ArrowException, OSError):
        raise LogError("cannot be read as Arrow IPC: it is truncated or damaged") from None
