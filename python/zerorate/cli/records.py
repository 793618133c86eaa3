"""The records that a command reads from one file: the whole of it, or its parts."""

import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from zerorate.io import split_log
from zerorate.io.formats import LogSource


@dataclass(frozen=True)
class Record:
    """What is read as one log.

    Attributes
    ----------
    source : LogSource
        The file, or a part of it.
    title : str
        Of its results; empty for a whole file.
    ending : str
        Of the names of its files; empty for a whole file.
    """

    source: LogSource
    title: str = ""
    ending: str = ""


def records(log: Path, group_by: str | int | None) -> Sequence[Record]:
    """Return the records in a file: itself, or one for each value in a column."""
    if group_by is None:
        return [Record(log)]
    parts = split_log(log, group_by)
    endings: dict[str, None] = {}
    for name in parts:
        ending = "-" + re.sub(r"[^\w.-]+", "_", name)[:40]
        # Names may differ in what no file's name should hold.
        endings[f"{ending}-{len(endings)}" if ending in endings else ending] = None
    return [
        Record(part, part.label, ending)
        for part, ending in zip(parts.values(), endings, strict=True)
    ]


def print_title(record: Record, first: bool) -> None:
    """Print what the results that follow are of, where there are several."""
    if record.title:
        print(record.title if first else f"\n{record.title}")
