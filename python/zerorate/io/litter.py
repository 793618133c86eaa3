"""Temporary files that killed processes left."""

from __future__ import annotations

import os
import re
from collections.abc import Iterable
from contextlib import suppress
from pathlib import Path
from typing import Final

__all__ = ["sweep"]

_TEMPORARY: Final = re.compile(r"\.(?P<stem>.+)\.[0-9a-f]{12}(?P<suffix>\.[^.]+|)")


def sweep(targets: Iterable[Path]) -> None:
    """Remove what `atomic_path` began for these files and a kill left behind, and no others.

    Nobody may be writing them. A file that cannot be removed stays: it harms nothing.
    """
    folders: dict[Path, set[tuple[str, str]]] = {}
    for target in targets:
        # A link's temporary file lies beside the file behind it.
        path = Path(os.path.realpath(target))
        folders.setdefault(path.parent, set()).add((path.stem[:80], path.suffix))
    for folder, known in folders.items():
        for path in folder.glob(".*.*"):
            found = _TEMPORARY.fullmatch(path.name)
            if found is not None and (found["stem"], found["suffix"]) in known:
                with suppress(OSError):
                    path.unlink()
