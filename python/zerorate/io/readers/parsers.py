"""The parsers of text tables: plain rows, pyarrow, NumPy and line by line, with the same numbers.

The last one says what a table is and names the line and column of a fault. The others return None
for whatever they might take differently. That of plain rows, which most tables have, is given them
as they are; pyarrow and NumPy are given the rows without comments and quotes.
"""

from __future__ import annotations

import io
import re
import warnings
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any, Final, NoReturn

import numpy as np

from zerorate._native import parse_rows
from zerorate.io.clocks.iso8601 import dates, fault_among, is_date
from zerorate.io.readers.cells import (
    MISSING,
    has_stray_quotes,
    is_blank,
    is_comment,
    number,
    split,
    whole,
)
from zerorate.io.table import Column
from zerorate.record.log import LogError

BOM: Final = b"\xef\xbb\xbf"
# At the beginning of a line alone, or a long one would take the square of its length.
_QUOTED: Final = re.compile(rb'(?<![^\r\n])[^\r\n"]*"[^\r\n]*')
_LINE_END: Final = re.compile(rb"\r\n|\r|\n")
_REMARKS: Final = (b"#", b"%", b"//")
_HEXADECIMAL: Final = re.compile(rb"0[xX]")
_SWAPPED: Final = bytes.maketrans(b",.", b".,")
_DELIMITERS: Final = (",", ";", "\t", "|", None)
"""Those of plain rows; a blank alone may stand in an empty line."""
_WORDS: Final = [word.encode() for word in MISSING]
_Kinds = list[type[np.float64] | type[np.int64] | type[np.str_]]
_TEXT: Final = 64
"""Characters of a date that are kept, more than any has."""


@dataclass(frozen=True)
class Layout:
    """Where the rows begin (byte offset, lines before it) and how a row is read.

    ``delimiter`` is None for any run of blanks; ``first_row`` holds the cells of the first row.
    A line that repeats the ``header`` is no row.
    """

    offset: int
    lines_before: int
    delimiter: str | None
    decimal_comma: bool
    width: int
    names: tuple[str, ...] | None
    first_row: tuple[str, ...]
    header: str | None = None


def decoded(raw: bytes) -> str:
    """Return the text of UTF-8 bytes, or of Latin-1 where they are not UTF-8."""
    raw = raw.removeprefix(BOM)
    try:
        return raw.decode("utf-8")
    except UnicodeDecodeError:
        return raw.decode("latin-1")


def parsed(raw: bytes, layout: Layout, wanted: list[int]) -> list[Column]:
    """Return the columns at some indices; LogError that names line and column of a fault."""
    kinds = _kinds(layout, wanted)
    columns = _plain(raw, layout, wanted, kinds)
    if columns is not None:
        return columns
    body = _body(raw, layout)
    for parse in (_by_arrow, _by_numpy):
        columns = _with_dates(parse(body, layout, wanted, kinds), kinds)
        # An infinity may be a number that is too large, which the last parser tells apart.
        if columns is not None and not any(map(_has_infinity, columns)):
            return columns
    return _by_line(raw, layout, wanted, kinds)


def _with_dates(columns: list[Column] | None, kinds: _Kinds) -> list[Column] | None:
    """Return the columns with texts as times, None if some are none."""
    found: list[Column] = []
    for column, kind in zip(columns or (), kinds, strict=columns is not None):
        times = dates(column.tolist()) if kind is np.str_ else column
        if times is None:
            return None
        found.append(times)
    return found or None


def _has_infinity(column: Column) -> bool:
    return column.dtype.kind == "f" and bool(np.isinf(column).any())


def texts(raw: bytes, layout: Layout, index: int) -> Column:
    """Return a column as it is written; LogError if a row has more cells or fewer."""
    return np.array([cells[index] for _, cells in _rows(raw, layout)], dtype=object)


def notes_on_lines(raw: bytes, layout: Layout) -> Iterator[str]:
    """Yield sentences on headers among the rows, and on quotes that are ordinary characters."""
    again = _headers(raw, layout)
    if again:
        yield f"the header stands {again} more time{'s' * (again > 1)} among the rows; left out"
    if b'"' not in raw:
        return  # found out in a hundredth of the time of a search line by line
    stray = [
        found.start()
        for found in _QUOTED.finditer(raw)
        if _is_stray(decoded(found[0]), layout.delimiter)
    ]
    if stray:
        line = 1 + sum(1 for _ in _LINE_END.finditer(raw, 0, stray[0]))
        others = f" and {len(stray) - 1} more" if len(stray) > 1 else ""
        yield (
            f"line {line}{others}: a quote does not close around a cell, and cells do not span "
            "lines, so quotes there are read as ordinary characters"
        )


def _is_stray(line: str, delimiter: str | None) -> bool:
    return not is_comment(line) and has_stray_quotes(line, delimiter)


def _kinds(layout: Layout, wanted: list[int]) -> _Kinds:
    """Return what columns hold, by their first row: numbers, or the text of dates."""
    return [_kind(layout.first_row[i]) for i in wanted]


def _kind(cell: str) -> type[np.float64] | type[np.int64] | type[np.str_]:
    if is_date(cell):
        return np.str_
    # Some integers are too long for a float64, such as nanoseconds.
    digits = cell.lstrip("+-")
    return np.int64 if digits.isdigit() and len(digits) > 15 else np.float64


def _plain(raw: bytes, layout: Layout, wanted: list[int], kinds: _Kinds) -> list[Column] | None:
    """Return the columns of rows that hold nothing but plain numbers."""
    slots = {index: slot for slot, index in enumerate(wanted)}
    if np.str_ in kinds or len(slots) < len(wanted) or layout.delimiter not in _DELIMITERS:
        return None
    end = len(raw)
    while raw[end - 1 : end] in (b"\n", b"\r"):
        end -= 1
    if end <= layout.offset or _headers(raw, layout):
        return None
    out = np.empty((len(wanted), 1 + raw.count(b"\n", layout.offset, end)))
    whole = [kind is np.int64 for kind in kinds]
    plain = parse_rows(
        raw,
        layout.offset,
        end,
        None if layout.delimiter is None else ord(layout.delimiter),
        ord("," if layout.decimal_comma else "."),
        [slots.get(i, -1) for i in range(layout.width)],
        whole,
        _WORDS,
        out,
    )
    if not plain:
        return None
    return [column.view(kind) for column, kind in zip(out, kinds, strict=True)]


def _body(raw: bytes, layout: Layout) -> bytes:
    body = raw[layout.offset :]
    if any(mark in body for mark in _REMARKS):
        lines = body.splitlines(keepends=True)
        body = b"".join(line for line in lines if not line.lstrip(b" \t").startswith(_REMARKS))
    if _headers(raw, layout):
        lines = body.splitlines(keepends=True)
        body = b"".join(line for line in lines if decoded(line).strip() != layout.header)
    if b'"' in body:
        body = _QUOTED.sub(partial(_without_quotes, delimiter=layout.delimiter), body)
    return _single_blanks(body) if layout.delimiter is None else body


def _headers(raw: bytes, layout: Layout) -> int:
    """Return how often the header stands among the rows, as where a device was started anew."""
    if not layout.header:
        return 0
    # Latin-1 is what `decoded` falls back to.
    encodings = {layout.header.encode(), layout.header.encode("latin-1", "ignore")}
    return sum(raw.count(b"\n" + header, layout.offset) for header in encodings)


def _without_quotes(line: re.Match[bytes], delimiter: str | None) -> bytes:
    """Return a line with its cells in no need of quotes; what is no number may become another."""
    mark = delimiter or " "
    cells = (cell or "NA" for cell in split(decoded(line[0]), delimiter))
    return mark.join("?" if mark in cell else cell for cell in cells).encode()


def _single_blanks(body: bytes) -> bytes:
    body = body.replace(b"\t", b" ").strip(b" ")
    while b"  " in body:
        body = body.replace(b"  ", b" ")
    return body.replace(b"\n ", b"\n").replace(b" \n", b"\n").replace(b" \r", b"\r")


def _by_arrow(body: bytes, layout: Layout, wanted: list[int], kinds: _Kinds) -> list[Column] | None:
    try:
        import pyarrow as pa
        from pyarrow import csv as arrow_csv
    except ImportError:
        return None
    if np.int64 in kinds and _HEXADECIMAL.search(body):
        return None  # which it would take for whole numbers
    labels = [str(i) for i in range(layout.width)]
    types = {
        labels[i]: pa.string() if kind is np.str_ else pa.from_numpy_dtype(np.dtype(kind))
        for i, kind in zip(wanted, kinds, strict=True)
    }
    try:
        table = arrow_csv.read_csv(
            io.BytesIO(body),
            read_options=arrow_csv.ReadOptions(column_names=labels),
            parse_options=arrow_csv.ParseOptions(
                delimiter=layout.delimiter or " ", quote_char=False
            ),
            convert_options=arrow_csv.ConvertOptions(
                column_types=types,
                include_columns=[labels[i] for i in wanted],
                null_values=list(MISSING),
                decimal_point="," if layout.decimal_comma else ".",
            ),
        )
    except pa.ArrowException:
        return None
    return [table.column(i).to_numpy() for i in range(len(wanted))]


def _by_numpy(body: bytes, layout: Layout, wanted: list[int], kinds: _Kinds) -> list[Column] | None:
    # Every column is named, the unwanted ones as one byte, so that NumPy checks the row's width.
    types = {
        i: f"U{_TEXT}" if kind is np.str_ else kind for i, kind in zip(wanted, kinds, strict=True)
    }
    fields = [(f"c{i}", types.get(i, "S1")) for i in range(layout.width)]
    text = decoded(body.translate(_SWAPPED) if layout.decimal_comma else body)
    try:
        with warnings.catch_warnings():
            # Older versions make 1 of 1.5 in a column of whole numbers, and warn of it.
            warnings.simplefilter("error", DeprecationWarning)
            rows = np.loadtxt(
                io.StringIO(text),
                dtype=np.dtype(fields),
                delimiter=layout.delimiter,
                comments=None,
                quotechar=None,
                ndmin=1,
            )
    except (ValueError, OverflowError, DeprecationWarning):
        return None
    return [np.ascontiguousarray(rows[f"c{i}"]) for i in wanted]


def _by_line(raw: bytes, layout: Layout, wanted: list[int], kinds: _Kinds) -> list[Column]:
    columns: list[list[Any]] = [[] for _ in wanted]
    lines = []
    for line, cells in _rows(raw, layout):
        lines.append(line)
        for values, index, kind in zip(columns, wanted, kinds, strict=True):
            if kind is np.str_:
                values.append(cells[index])
                continue
            exact = whole(cells[index]) if kind is np.int64 else None
            values.append(_value(cells[index], line, index, layout) if exact is None else exact)
    return [
        _dates(values, lines, index, layout) if kind is np.str_ else _as_array(values, kind)
        for values, kind, index in zip(columns, kinds, wanted, strict=True)
    ]


def _dates(cells: list[str], lines: list[int], index: int, layout: Layout) -> Column:
    """Return the times in a column of texts; LogError that names line and column of a fault."""
    found = dates(cells)
    if found is None:
        at, reason = fault_among(cells)
        _refuse(cells[at], lines[at], index, layout, reason)
    return found


def _rows(raw: bytes, layout: Layout) -> Iterator[tuple[int, list[str]]]:
    """Yield the number and the cells of each row; LogError if it has more cells or fewer."""
    for at, line in enumerate(io.StringIO(decoded(raw), newline=None), start=1):
        if at <= layout.lines_before or is_blank(line, layout.delimiter) or is_comment(line):
            continue
        if line.strip() == layout.header:
            continue
        cells = split(line, layout.delimiter)
        if len(cells) != layout.width:
            raise LogError(
                f"line {at} has {len(cells)} cells, expected {layout.width} "
                "as in the lines before it"
            )
        yield at, cells


def _value(cell: str, line: int, index: int, layout: Layout) -> float:
    try:
        return number(cell, layout.decimal_comma)
    except ValueError as error:
        _refuse(cell, line, index, layout, str(error))


def _refuse(cell: str, line: int, index: int, layout: Layout, reason: str) -> NoReturn:
    name = layout.names[index] if layout.names is not None else f"column_{index}"
    shown = cell if len(cell) <= 40 else cell[:37] + "..."
    raise LogError(f"line {line}, column '{name}': '{shown}' {reason}") from None


def _as_array(values: Sequence[float], kind: type[np.generic]) -> Column:
    whole = kind is np.int64 and all(isinstance(v, int) and -(2**63) <= v < 2**63 for v in values)
    return np.array(values, dtype=np.int64 if whole else np.float64)
