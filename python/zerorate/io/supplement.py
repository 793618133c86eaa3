"""What sources hold next to the logs of their sensors, read when it is first asked for."""

from __future__ import annotations

import os
import re
from collections.abc import Callable, Iterator, Sequence
from functools import partial
from pathlib import Path
from typing import Final, NamedTuple, NoReturn, TypeGuard

import numpy as np

from zerorate.io.columns import Timing
from zerorate.io.fixes import fixes_among
from zerorate.io.formats import LogSource, opened
from zerorate.io.mounting import read_mounting
from zerorate.io.table import Content
from zerorate.record.fixes import Fixes
from zerorate.record.log import LogError
from zerorate.record.mounting import Mounting
from zerorate.record.supplement import Supplement, TableColumns, nothing

_PARQUET, _ULOG = "parquet", "ulog"
_HEAD: Final = 1 << 18
_UUID: Final = re.compile(rb"I.char\[(\d{1,3})\] sys_uuid", re.DOTALL)
"""The message of a ULog with the number of the board."""


class Opened(NamedTuple):
    """A source, its format, and its content."""

    source: LogSource
    format: str
    content: Content


def supplement_of(opened_sources: Sequence[Opened], timing: Timing) -> Supplement:
    """Return what sources hold.

    Files are opened again for it, so that the recording keeps only their paths; the fixes of
    objects are read here. Tables and device are those of a single file.
    """
    fixes = partial(_first, [_fixes_of(one, timing) for one in opened_sources])
    files = [(Path(one.source), one.format) for one in opened_sources if _is_file(one.source)]
    mounting = partial(_mounting, [path for path, form in files if form == _PARQUET])
    if len(opened_sources) > 1 or not files:
        return Supplement(fixes, mounting)
    ((path, form),) = files
    device = partial(_device, path) if form == _ULOG else nothing
    return Supplement(fixes, mounting, device, partial(_tables, path))


def _is_file(source: LogSource) -> TypeGuard[str | os.PathLike[str]]:
    return isinstance(source, (str, os.PathLike))


def _fixes_of(one: Opened, timing: Timing) -> Callable[[], Fixes | None]:
    """Return what gives the fixes of a source: a file that is opened later, or what is known."""
    if timing.column is False:
        return nothing
    if _is_file(one.source):
        return partial(fixes_among, one.source, timing)
    try:
        return partial(_known, fixes_among(one.source, timing, one.content))
    except LogError as error:
        return partial(_fault, error)


def _known(fixes: Fixes | None) -> Fixes | None:
    return fixes


def _fault(error: LogError) -> NoReturn:
    raise error


def _first(readers: Sequence[Callable[[], Fixes | None]]) -> Fixes | None:
    found = (read() for read in readers)
    return next((fixes for fixes in found if fixes is not None), None)


def _mounting(paths: Sequence[Path]) -> Mounting | None:
    """Return what the first file that says anything of it says of the mounting."""
    return next((told for told in map(read_mounting, paths) if told.stated), None)


def _device(path: Path) -> str | None:
    with path.open("rb") as file:
        head = file.read(_HEAD)
    found = _UUID.search(head)
    if found is None:
        return None
    text = head[found.end() : found.end() + int(found[1])]
    return text.decode("ascii", "replace").strip("\0 ") or None


def _tables(path: Path, prefixes: tuple[str, ...]) -> Iterator[tuple[str, TableColumns]]:
    tables = opened(path)[1].tables
    for name in sorted(tables):
        if name.startswith(prefixes):
            table = tables[name]
            columns = map(np.asarray, table.load(range(table.width)))
            labels = map(table.label, range(table.width))
            yield name, dict(zip(labels, columns, strict=True))
