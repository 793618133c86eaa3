"""The table of a batch: a row for each log and axis."""

from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any

from zerorate._native import __version__
from zerorate.io.readers.parquet import native_file
from zerorate.record import atomic_path
from zerorate.tasks.batch.fleet import Fleet
from zerorate.tasks.batch.inputs import SUMMARY_MARK
from zerorate.tasks.batch.task import Outcome, Settings
from zerorate.texts import printable


def write_summary(
    outcomes: Iterable[Outcome], fleet: Fleet, settings: Settings, path: Path
) -> None:
    """Write the table as Parquet; a failed log has one row, without an axis."""
    import pyarrow as pa
    import pyarrow.parquet as pq

    metadata: dict[bytes | str, bytes | str]
    metadata = {SUMMARY_MARK: settings.command, "zerorate version": __version__}
    schema = pa.schema(_types(settings.does.columns), metadata=metadata)
    table = pa.Table.from_pylist(list(_rows(outcomes, fleet)), schema=schema)
    with atomic_path(path, force=True) as temporary, native_file(temporary, "wb") as file:
        pq.write_table(table, file, compression="zstd")


def _types(columns: Mapping[str, type]) -> list[tuple[str, Any]]:
    import pyarrow as pa

    of = {str: pa.string(), int: pa.int64(), float: pa.float64(), bool: pa.bool_()}
    common = dict.fromkeys(("log", "axis", "status", "error", "unit"), str) | {"seconds": float}
    types = [(name, of[kind]) for name, kind in (common | dict(columns)).items()]
    return [*types, *((name, pa.list_(pa.string())) for name in ("outlying", "notes"))]


def _rows(outcomes: Iterable[Outcome], fleet: Fleet) -> Iterator[dict[str, object]]:
    for one in outcomes:
        common = {
            "log": printable(one.name),
            "status": one.status,
            "error": None if one.error is None else printable(one.error),
            "seconds": one.seconds,
            "notes": list(map(printable, one.notes)),
        }
        for row in one.rows or ({},):
            yield {**common, "outlying": fleet.of(one.name, row.get("axis")), **row}
