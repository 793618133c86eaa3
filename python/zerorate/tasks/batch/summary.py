"""Table of a batch: one row for each log and axis."""

from collections.abc import Collection, Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any, Final

from zerorate._native import __version__
from zerorate.io.readers.parquet import open_native_file
from zerorate.record import atomic_path
from zerorate.tasks.batch.fleet import Fleet
from zerorate.tasks.batch.inputs import SUMMARY_MARK
from zerorate.tasks.batch.task import Outcome, Record, Settings
from zerorate.texts import make_printable

_SETTINGS_MARK: Final = b"zerorate settings"
"""Key in the summary's metadata for the hash of the settings."""


def write_summary(
    outcomes: Iterable[Outcome], fleet: Fleet, settings: Settings, path: Path
) -> None:
    """Write the table as Parquet; a failed log has one row, without an axis."""
    import pyarrow as pa
    import pyarrow.parquet as pq

    metadata: dict[bytes | str, bytes | str]
    metadata = {
        SUMMARY_MARK: settings.command,
        "zerorate version": __version__,
        _SETTINGS_MARK: settings.digest(),
    }
    schema = pa.schema(_schema_fields(settings.operation.columns), metadata=metadata)
    table = pa.Table.from_pylist(list(batch_rows(outcomes, fleet)), schema=schema)
    with atomic_path(path, force=True) as temporary, open_native_file(temporary, "wb") as file:
        pq.write_table(table, file, compression="zstd")


def read_earlier(path: Path, settings: Settings, names: Collection[str]) -> tuple[Outcome, ...]:
    """Return the outcomes of other logs from an earlier run with the same settings.

    A finished log counts only if its output and its record still exist.
    """
    import pyarrow as pa
    import pyarrow.parquet as pq

    try:
        table = pq.read_table(open_native_file(path), columns=["log", "status", "error"])
    except (OSError, KeyError, pa.ArrowException):
        return ()
    digest = (table.schema.metadata or {}).get(_SETTINGS_MARK)
    if digest != settings.digest().encode():
        return ()
    rows = {row["log"]: row for row in table.to_pylist() if row["log"] not in names}
    found = (_earlier_outcome(row, path.parent, settings) for row in rows.values())
    return tuple(outcome for outcome in found if outcome is not None)


def _earlier_outcome(row: Mapping[str, str], folder: Path, settings: Settings) -> Outcome | None:
    name = row["log"]
    if row["status"] == "failed":
        return Outcome(name, "failed", error=row["error"])
    output, path = settings.operation.paths(folder / name, settings.format)
    record = Record.read(path, output)
    if record is None:
        return None
    return Outcome(name, "skipped", record.seconds, record.rows, notes=record.notes)


def _schema_fields(columns: Mapping[str, type]) -> list[tuple[str, Any]]:
    import pyarrow as pa

    arrow_types = {str: pa.string(), int: pa.int64(), float: pa.float64(), bool: pa.bool_()}
    common = dict.fromkeys(("log", "axis", "status", "error", "unit"), str) | {"seconds": float}
    types = [(name, arrow_types[kind]) for name, kind in (common | dict(columns)).items()]
    return [*types, *((name, pa.list_(pa.string())) for name in ("outlying", "notes"))]


def batch_rows(outcomes: Iterable[Outcome], fleet: Fleet) -> Iterator[dict[str, object]]:
    """Yield the rows of the summary: one for each log and axis, one for each failed log."""
    for outcome in outcomes:
        common = {
            "log": make_printable(outcome.name),
            "status": outcome.status,
            "error": None if outcome.error is None else make_printable(outcome.error),
            "seconds": outcome.seconds,
            "notes": list(map(make_printable, outcome.notes)),
        }
        for row in outcome.rows or ({},):
            yield {**common, "outlying": fleet.of(outcome.name, row.get("axis")), **row}
