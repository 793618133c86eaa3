"""Contents of sources other than their logs, read at first access."""

from __future__ import annotations

import os
import re
from collections.abc import Callable, Iterator, Sequence
from functools import partial
from pathlib import Path
from typing import Final, NamedTuple, NoReturn, TypeGuard

import numpy as np

from zerorate.io.columns import Timing
from zerorate.io.fixes import find_fixes
from zerorate.io.formats import LogSource, open_source
from zerorate.io.mounting import read_mounting
from zerorate.io.remote import is_address
from zerorate.io.table import Content
from zerorate.record.fixes import Fixes
from zerorate.record.log import LogError
from zerorate.record.mounting import Mounting
from zerorate.record.supplement import Supplement, TableColumns, return_none

_PARQUET, _ULOG = "parquet", "ulog"
_HEAD_BYTES: Final = 1 << 18
_UUID: Final = re.compile(rb"I.char\[(\d{1,3})\] sys_uuid", re.DOTALL)
"""Message of a ULog with the board's serial number."""


class SourceContent(NamedTuple):
    """A source, its format, and its content."""

    source: LogSource
    format: str
    content: Content


def make_supplement(opened_sources: Sequence[SourceContent], timing: Timing) -> Supplement:
    """Return the supplement of a recording from its sources.

    The recording keeps only the paths of its files, and files are opened again later. Fixes in
    objects are read now. Tables and device exist only for a single file.
    """
    fixes = partial(
        _first_fixes,
        [_make_fixes_reader(opened_source, timing) for opened_source in opened_sources],
    )
    files = [
        (Path(opened_source.source), opened_source.format)
        for opened_source in opened_sources
        if _is_file(opened_source.source)
    ]
    mounting = partial(_first_mounting, [path for path, form in files if form == _PARQUET])
    if len(opened_sources) > 1 or not files:
        return Supplement(fixes, mounting)
    ((path, form),) = files
    device = partial(_read_device, path) if form == _ULOG else return_none
    return Supplement(fixes, mounting, device, partial(_read_tables, path))


def _is_file(source: LogSource) -> TypeGuard[str | os.PathLike[str]]:
    return isinstance(source, (str, os.PathLike)) and not is_address(source)


def _make_fixes_reader(opened_source: SourceContent, timing: Timing) -> Callable[[], Fixes | None]:
    """Return a function that returns a source's fixes; it opens files again."""
    if timing.column is False:
        return return_none
    if _is_file(opened_source.source):
        return partial(find_fixes, opened_source.source, timing)
    try:
        return partial(
            _return_fixes, find_fixes(opened_source.source, timing, opened_source.content)
        )
    except LogError as error:
        return partial(_raise_error, error)


def _return_fixes(fixes: Fixes | None) -> Fixes | None:
    return fixes


def _raise_error(error: LogError) -> NoReturn:
    raise error


def _first_fixes(readers: Sequence[Callable[[], Fixes | None]]) -> Fixes | None:
    all_fixes = (read() for read in readers)
    return next((fixes for fixes in all_fixes if fixes is not None), None)


def _first_mounting(paths: Sequence[Path]) -> Mounting | None:
    """Return the mounting from the first file that states one."""
    return next((mounting for mounting in map(read_mounting, paths) if mounting.has_content), None)


def _read_device(path: Path) -> str | None:
    with path.open("rb") as file:
        head = file.read(_HEAD_BYTES)
    match = _UUID.search(head)
    if match is None:
        return None
    text = head[match.end() : match.end() + int(match[1])]
    return text.decode("ascii", "replace").strip("\0 ") or None


def _read_tables(path: Path, prefixes: tuple[str, ...]) -> Iterator[tuple[str, TableColumns]]:
    tables = open_source(path)[1].tables
    for name in sorted(tables):
        if name.startswith(prefixes):
            table = tables[name]
            columns = map(np.asarray, table.load(range(table.width)))
            labels = map(table.label, range(table.width))
            yield name, dict(zip(labels, columns, strict=True))
