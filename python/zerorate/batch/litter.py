"""Temporary files of workers that were killed while they wrote."""

import re
from collections.abc import Iterable
from pathlib import Path
from typing import Final

from zerorate.batch.record import record_path

__all__ = ["sweep"]

_TEMPORARY: Final = re.compile(r"\.(?P<stem>.+)\.[0-9a-f]{12}(?P<suffix>\.\w+)")


def sweep(outputs: Iterable[Path]) -> None:
    """Remove the temporary files of these outputs and of their records, and no others.

    No task may run any more.
    """
    folders: dict[Path, set[tuple[str, str]]] = {}
    for output in outputs:
        for path in (output, record_path(output)):
            folders.setdefault(path.parent, set()).add((path.stem[:80], path.suffix))
    for folder, known in folders.items():
        for path in folder.glob(".*.*"):
            found = _TEMPORARY.fullmatch(path.name)
            if found is not None and (found["stem"], found["suffix"]) in known:
                path.unlink(missing_ok=True)
