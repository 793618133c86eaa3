"""Conversion of every error of a file's reader into one LogError."""

from __future__ import annotations

import errno
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Final

from zerorate.io.limits import check_columns
from zerorate.io.table import Column, Content, Format, Table
from zerorate.record.log import LogError
from zerorate.texts import escape_line

_DATA_ERRNOS: Final = (None, errno.EINVAL)
"""Error numbers of OSError for bad content; other numbers are faults of the system."""


def read_guarded(form: Format, file: Path) -> Content:
    """Return the content of a file; errors of its reader, also later ones, become one sentence.

    Raises
    ------
    LogError
        If the reader fails, except for ImportError and for OSError of the system.
    """
    with _translate_errors(form.description):
        content = form.read(file)
        for table in content.tables.values():
            check_columns(table.width)
        tables = {
            topic: _guard_table(table, form.description) for topic, table in content.tables.items()
        }
        return replace(content, tables=tables)


@contextmanager
def _translate_errors(called: str) -> Iterator[None]:
    try:
        yield
    except (LogError, ImportError):
        raise
    except MemoryError:
        raise LogError(f"cannot be read as {called}: it needs more memory than there is") from None
    except Exception as error:  # damaged bytes can raise any exception
        if isinstance(error, OSError) and error.errno not in _DATA_ERRNOS:
            raise
        why = f"truncated, damaged or of a foreign kind ({_describe_error(error)})"
        raise LogError(f"cannot be read as {called}: {why}") from error


def _describe_error(error: Exception) -> str:
    text = str(error).strip().partition("\n")[0].rstrip(".")
    text = escape_line(text) or type(error).__name__
    return text if len(text) <= 120 else text[:117] + "..."


def _guard_table(table: Table, called: str) -> Table:
    names = None if table.names is None else tuple(map(escape_line, table.names))
    rows = table.rows
    pieces = None if table.pieces is None else _guard_pieces(table.pieces, rows, called)

    def labels(index: int) -> Column:
        with _translate_errors(called):
            return (table.labels or (lambda i: table.load([i])[0]))(index)

    def load(wanted: Sequence[int]) -> list[Column]:
        with _translate_errors(called):
            columns = table.load(wanted)
            if table.pieces is not None:
                _check_rows(len(columns[0]) if columns else rows, rows)
            return columns

    return replace(table, load=load, labels=labels, names=names, pieces=pieces)


_Pieces = Callable[[Sequence[int], int], Iterator[list[Column]]]


def _guard_pieces(pieces: _Pieces, rows: int, called: str) -> _Pieces:
    def guarded(wanted: Sequence[int], most: int) -> Iterator[list[Column]]:
        with _translate_errors(called):
            row_count = 0
            for columns in pieces(wanted, most):
                row_count += len(columns[0]) if columns else 0
                if row_count > rows:
                    _check_rows(row_count, rows)
                yield columns
            _check_rows(row_count if wanted else rows, rows)

    return guarded


def _check_rows(read_rows: int, rows: int) -> None:
    """Raise LogError if a file has another number of rows than it declares."""
    if read_rows != rows:
        row_text = "more" if read_rows > rows else read_rows
        raise ValueError(f"it says that it has {rows} rows and holds {row_text}")
