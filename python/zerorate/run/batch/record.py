"""The record beside a filtered log, which says how it was made and that it is whole."""

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Self

from zerorate.io import atomic_path
from zerorate.run.batch.outcome import Row

__all__ = ["Record"]


@dataclass(frozen=True)
class Record:
    """What a finished log leaves besides its data.

    It is a file of its own, not metadata of the filtered log, which stays the same bytes as those
    of a single replay, in every format.
    """

    fingerprint: str
    output_bytes: int
    seconds: float
    rows: tuple[Row, ...]

    @classmethod
    def beside(cls, output: Path) -> Self | None:
        """Return the record of a filtered log if both are there and belong together."""
        try:
            fields = json.loads(record_path(output).read_bytes())
            found = cls(**{**fields, "rows": tuple(fields["rows"])})
            return found if output.stat().st_size == found.output_bytes else None
        except (OSError, ValueError, TypeError, KeyError):
            return None

    def write(self, output: Path) -> None:
        """Write the record of a filtered log that is in its place."""
        with atomic_path(record_path(output), force=True) as temporary:
            temporary.write_text(json.dumps(vars(self), indent=1) + "\n")

    @staticmethod
    def discard(output: Path) -> None:
        """Remove the record before another log takes the place of the one it speaks of."""
        record_path(output).unlink(missing_ok=True)


def record_path(output: Path) -> Path:
    """Return where the record of a filtered log lies."""
    return output.with_suffix(".json")
