"""An identification as plain text: tables of every axis, and the verdict on it."""

from collections.abc import Iterator, Sequence

from zerorate.identify.identification import Identification
from zerorate.io import Log
from zerorate.show.report.identify_tables import tables
from zerorate.show.report.tables import as_text
from zerorate.show.report.text import WIDTH, bulleted, on_clock

__all__ = ["format_identify", "log_notes"]


def format_identify(found: Sequence[Identification]) -> str:
    """Return the tables and the verdict of every axis, at most `WIDTH` columns wide.

    Parameters
    ----------
    found : sequence of Identification
        One an axis.

    Returns
    -------
    str
        Lines without an end.
    """
    return "\n\n\n".join("\n\n".join(_parts(one)) for one in found)


def log_notes(log: Log) -> tuple[str, ...]:
    """Return the sentences on a log's clock and columns."""
    return (*on_clock(log), *log.meta.get("notes", ()))


def _parts(found: Identification) -> Iterator[str]:
    title = f"{found.name} [{found.unit}]"[:WIDTH]
    yield f"{title}\n{'=' * len(title)}"
    yield from map(as_text, tables(found))
    yield f"Verdict\n{bulleted(found.verdict)}"
