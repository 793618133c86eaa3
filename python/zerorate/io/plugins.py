"""Readers from other packages: the entry points of the group ``zerorate.readers``.

The name of an entry point is a suffix, such as ``.acm``. Its object is a function of the path of a
file. It returns one of three: columns by name; columns and metadata (the fields of `Metadata`); a
complete `Content`. The package is imported when a file with this suffix is read.
"""

from __future__ import annotations

from dataclasses import replace
from importlib.metadata import EntryPoint, entry_points
from pathlib import Path
from typing import Any, Final

from zerorate.io.readers.objects import make_table
from zerorate.io.table import Content, Format, Metadata
from zerorate.record.log import LogError

GROUP: Final = "zerorate.readers"


def plugin_formats() -> tuple[Format, ...]:
    """Return a format for each entry point, sorted by suffix."""
    points = sorted(entry_points(group=GROUP), key=lambda point: point.name)
    return tuple(map(_make_format, points))


def find_plugin(suffix: str) -> Format | None:
    """Return the format of a suffix from another package, if any; LogError if there are two."""
    found = [form for form in plugin_formats() if suffix in form.suffixes]
    if len(found) > 1:
        packages = " and ".join(form.description for form in found)
        raise LogError(f"two packages read '{suffix}': {packages}; uninstall one of them")
    return found[0] if found else None


def _make_format(point: EntryPoint) -> Format:
    package = point.dist.name if point.dist is not None else point.module
    suffix = point.name.lower()

    def read(path: Path, /) -> Content:
        return _content_of(point.load()(path), point.value)

    return Format(suffix.removeprefix("."), f"a file of {package}", (suffix,), (), read)


def _content_of(answer: Any, reader: str) -> Content:  # noqa: ANN401
    """Return the content from a reader's return value."""
    if isinstance(answer, Content):
        return answer
    columns, known = answer if isinstance(answer, tuple) else (answer, None)
    try:
        table = make_table(columns)[1]
        if known is not None:
            table = replace(table, meta=Metadata(**known))
    except TypeError as error:
        raise LogError(f"the reader {reader} does not return columns: {error}") from None
    return Content.of(table)
