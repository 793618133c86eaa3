"""One table of all logs: a row for each log and axis."""

from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any, Final

from zerorate.io import atomic_path
from zerorate.run.batch.outcome import Outcome

__all__ = ["SUMMARY", "write_summary"]

SUMMARY: Final = "summary.parquet"

_TEXTS: Final = ("log", "axis", "status", "error", "unit")
_COUNTS: Final = ("samples", "missing")
_NUMBERS: Final = (
    "seconds",
    "rate",
    "raw_mean",
    "raw_deviation",
    "raw_coasting_10s",
    "raw_coasting_60s",
    "drift_mean",
    "drift_deviation",
    "drift_coasting_10s",
    "drift_coasting_60s",
    "reduction",
    "angle_random_walk",
    "rate_random_walk",
    "bias",
    "bias_sigma",
    "time_at_rest",
)


def write_summary(outcomes: Iterable[Outcome], path: Path) -> None:
    """Write the table as Parquet; a failed log has one row, without an axis."""
    import pyarrow as pa
    import pyarrow.parquet as pq

    types: list[tuple[str, Any]] = [(name, pa.string()) for name in _TEXTS]
    types += [(name, pa.int64()) for name in _COUNTS]
    types += [(name, pa.float64()) for name in _NUMBERS]
    table = pa.Table.from_pylist(list(_rows(outcomes)), schema=pa.schema(types))
    with atomic_path(path, force=True) as temporary:
        pq.write_table(table, temporary, compression="zstd")


def _rows(outcomes: Iterable[Outcome]) -> Iterator[dict[str, object]]:
    for one in outcomes:
        common = {
            "log": one.name,
            "status": one.status,
            "error": one.error,
            "seconds": one.seconds,
        }
        for row in one.rows or ({},):
            yield {**common, **row}
