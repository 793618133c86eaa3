"""Parsers of text tables: plain rows at once, or line by line, with equal results.

Most tables have plain rows, at least after comments, quotes and repeated headers are removed. The
line parser defines the format, and names line and column of an error.
"""

from __future__ import annotations

import io
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any, Final, NoReturn

import numpy as np

from zerorate._native import parse_rows
from zerorate.faults import keyword_argument, make_sentence
from zerorate.io.clocks.iso8601 import find_fault, is_date, parse_dates
from zerorate.io.readers.cells import (
    MISSING,
    has_stray_quotes,
    is_blank,
    is_comment,
    is_number,
    parse_number,
    parse_whole,
    split_cells,
)
from zerorate.io.table import Column
from zerorate.record.log import LogError

BOM: Final = b"\xef\xbb\xbf"
_LINE_END: Final = re.compile(rb"\r\n|\r|\n")
_TIME_OF_DAY: Final = re.compile(r"\d{1,4}[-/.:]\w+[-/.:]\d.*")
_LINE: Final = re.compile(rb"[^\r\n]*(?:\r\n|\n|\r)|[^\r\n]+\Z")
_BEFORE: Final = 50
"""Number of lines before the last one that show its number of decimals."""
_TAIL: Final = 1 << 16
_FEW: Final = 0.1
"""Largest share of torn lines that can be left out."""
_NO_ROW: Final = re.compile(rb"\n[ \t]*(?:(?:#|%|//)[^\n]*)?(?=\n|\Z)")
_NO_ROW_OF_TABS: Final = re.compile(rb"\n(?: *|[ \t]*(?:#|%|//)[^\n]*)(?=\n|\Z)")
"""Lines that are no rows, with the line end before them for a fast search."""
_ODD_MARKS: Final = (b'"', b"#", b"%", b"//")
"""Characters in lines that are no plain rows."""
_DELIMITERS: Final = (",", ";", "\t", "|", None)
"""Delimiters of plain rows; blanks also occur in empty lines."""
_MISSING_WORDS: Final = [word.encode() for word in MISSING]
_Kinds = list[type[np.float64] | type[np.int64] | type[np.str_]]


@dataclass(frozen=True)
class Layout:
    """Layout of a text: position of the first row (byte offset, lines before it) and its format.

    ``delimiter`` is None for runs of blanks. ``first_row`` contains the cells of the first row. A
    line equal to ``header`` is no row.
    """

    offset: int
    lines_before: int
    delimiter: str | None
    decimal_comma: bool
    width: int
    names: tuple[str, ...] | None
    first_row: tuple[str, ...]
    header: str | None = None


def decode_text(raw: bytes) -> str:
    """Return the text of UTF-8 bytes, or of Latin-1 if they are not UTF-8."""
    raw = raw.removeprefix(BOM)
    try:
        return raw.decode("utf-8")
    except UnicodeDecodeError:
        return raw.decode("latin-1")


def is_value(cell: str, decimal_comma: bool = False) -> bool:
    """Return True if a cell contains a number or a time, not a name."""
    return is_number(cell, decimal_comma) or is_date(cell) or bool(_TIME_OF_DAY.fullmatch(cell))


def parse_columns(raw: bytes, layout: Layout, wanted: list[int]) -> list[Column]:
    """Return the columns with some indices; a LogError names line and column of an error."""
    kinds = _find_kinds(layout, wanted)
    odd = any(raw.find(mark, layout.offset) >= 0 for mark in _ODD_MARKS)
    odd = odd or _count_headers(raw, layout) > 0
    columns = None if odd else _plain(raw, layout.offset, layout, wanted, kinds)
    if columns is None:
        columns = _plain(_plain_rows(raw, layout), 0, layout, wanted, kinds)
    if columns is not None:
        return columns
    try:
        return _by_line(raw, layout, wanted, kinds)
    except LogError as error:
        whole, torn = without_torn(raw, layout)
        rest = whole.count(b"\n") + whole.count(b"\r")
        few = 0 < len(torn) <= _FEW * rest
        remedy = make_sentence(
            keyword_argument("torn", "skip", "torn='skip'"), " leaves such lines out"
        )
        raise error.with_context("", make_sentence("; ", remedy) if few else "") from None


def without_torn(raw: bytes, layout: Layout) -> tuple[bytes, list[int]]:
    """Return the bytes of a table's complete lines, and the numbers of all other lines."""
    kept, torn = [raw[: layout.offset]], []
    columns = range(layout.width)
    kinds = _find_kinds(layout, list(columns))
    words = [not (is_value(cell, layout.decimal_comma)) for cell in layout.first_row]
    lines = _LINE.finditer(raw, layout.offset)
    for at, found in enumerate(lines, start=layout.lines_before + 1):
        line = decode_text(found[0])
        cells = split_cells(line, layout.delimiter)
        no_row = is_blank(line, layout.delimiter) or is_comment(line)
        if no_row or line.strip() == layout.header or _is_whole(cells, kinds, words, layout):
            kept.append(found[0])
        else:
            torn.append(at)
    return b"".join(kept), torn


def _is_whole(cells: list[str], kinds: _Kinds, words: list[bool], layout: Layout) -> bool:
    return len(cells) == layout.width and all(
        word
        or cell in MISSING
        or (is_date(cell) if kind is np.str_ else is_number(cell, layout.decimal_comma))
        for cell, kind, word in zip(cells, kinds, words, strict=True)
    )


def without_torn_end(raw: bytes, layout: Layout) -> tuple[bytes, int | None]:
    """Return the bytes without a last line cut by the end of the file, and its number.

    A cut line has no line end, and fewer cells than the lines before it. Or its last number has
    fewer decimals than theirs.
    """
    end = raw.rstrip(b"\0")
    begin = max(end.rfind(b"\n"), end.rfind(b"\r")) + 1
    if begin <= layout.offset or begin == len(end):
        return (end, None) if begin == len(end) else (raw, None)
    before = [
        split_cells(decode_text(line), layout.delimiter)
        for line in end[layout.offset : begin].splitlines()[-_BEFORE:]
    ]
    cells = split_cells(decode_text(end[begin:]), layout.delimiter)
    own = replace(layout, offset=begin)
    _, torn = without_torn(end, own)
    cut = bool(torn) and len(cells) <= layout.width
    if not cut and len(cells) == layout.width and len(before) == _BEFORE:
        decimals = {_decimals(row[-1]) for row in before if len(row) == layout.width}
        cut = len(decimals) == 1 and _decimals(cells[-1]) < decimals.pop()
    if not cut:
        return raw, None
    return end[:begin], 1 + sum(1 for _ in _LINE_END.finditer(end, 0, begin))


def _decimals(cell: str) -> int:
    return len(cell) - 1 - max(cell.rfind("."), cell.rfind(",")) if re.search("[.,]", cell) else -1


def read_texts(raw: bytes, layout: Layout, index: int) -> Column:
    """Return a column as text; LogError if a row has too many or too few cells."""
    return np.array([cells[index] for _, cells in _read_rows(raw, layout)], dtype=object)


def describe_lines(raw: bytes, layout: Layout) -> Iterator[str]:
    """Yield sentences on headers among the rows, and on quotes read as characters."""
    repeat_count = _count_headers(raw, layout)
    if repeat_count:
        yield (
            f"the header stands {repeat_count} more time{'s' * (repeat_count > 1)} among the "
            "rows; left out"
        )
    stray = [
        start
        for start, end in _quoted_lines(raw)
        if _without_quotes(raw[start:end], layout.delimiter) is None
        and _is_stray(decode_text(raw[start:end]), layout.delimiter)
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


def _find_kinds(layout: Layout, wanted: list[int]) -> _Kinds:
    """Return the kinds of columns from the first row: numbers, or dates as text."""
    return [_find_kind(layout.first_row[i]) for i in wanted]


def _find_kind(cell: str) -> type[np.float64] | type[np.int64] | type[np.str_]:
    if is_date(cell):
        return np.str_
    # Some integers, such as nanoseconds, are too long for float64.
    digits = cell.lstrip("+-")
    return np.int64 if digits.isdigit() and len(digits) > 15 else np.float64


def _plain(
    raw: bytes, begin: int, layout: Layout, wanted: list[int], kinds: _Kinds
) -> list[Column] | None:
    """Return the columns of plain rows with numbers and dates; None for any other rows."""
    slots = {i: slot for slot, i in enumerate(wanted) if kinds[slot] is not np.str_}
    if len(set(wanted)) < len(wanted) or layout.delimiter not in _DELIMITERS:
        return None
    end = len(raw)
    while raw[end - 1 : end] in (b"\n", b"\r"):
        end -= 1
    if end <= begin:
        return None
    out = np.empty((len(wanted), 1 + raw.count(b"\n", begin, end)))
    is_plain = parse_rows(
        raw,
        begin,
        end,
        None if layout.delimiter is None else ord(layout.delimiter),
        ord("," if layout.decimal_comma else "."),
        [slots.get(i, -1) for i in range(layout.width)],
        [kind is np.int64 for kind in kinds],
        _MISSING_WORDS,
        out,
    )
    if not is_plain:
        return None
    columns = []
    for column, kind, i in zip(out, kinds, wanted, strict=True):
        text = kind is np.str_
        values = parse_dates(_cells(raw[begin:end], layout, i)) if text else column.view(kind)
        if values is None:
            return None
        columns.append(values)
    return columns


def _cells(rows: bytes, layout: Layout, index: int) -> list[str]:
    """Return the cells of one column of plain rows."""
    lines = rows.decode("ascii", "replace").split("\n")
    return [line.split(layout.delimiter, index + 1)[index].strip() for line in lines]


def _plain_rows(raw: bytes, layout: Layout) -> bytes:
    """Return the rows without comments, empty lines, repeated headers and quotes."""
    rows = raw[layout.offset :]
    if b"\r" in rows:
        rows = rows.replace(b"\r\n", b"\n").replace(b"\r", b"\n")
    no_row = _NO_ROW_OF_TABS if layout.delimiter == "\t" else _NO_ROW
    rows = no_row.sub(b"", b"\n" + rows)[1:]
    if _count_headers(raw, layout):
        lines = rows.split(b"\n")
        rows = b"\n".join(line for line in lines if decode_text(line).strip() != layout.header)
    if b'"' in rows:
        rows = b"".join(_strip_quotes(rows, layout.delimiter))
    return rows


def _count_headers(raw: bytes, layout: Layout) -> int:
    """Return the number of headers among the rows, from restarts of a device."""
    if not layout.header:
        return 0
    # Latin-1 is the second choice of `decode_text`.
    encodings = {layout.header.encode(), layout.header.encode("latin-1", "ignore")}
    return sum(raw.count(b"\n" + header, layout.offset) for header in encodings)


def _strip_quotes(rows: bytes, delimiter: str | None) -> Iterator[bytes]:
    """Yield the text in pieces; cells that need their quotes become question marks."""
    mark = delimiter or " "
    done = 0
    for start, end in _quoted_lines(rows):
        yield rows[done:start]
        bare = _without_quotes(rows[start:end], delimiter)
        if bare is None:
            cells = [cell or "NA" for cell in split_cells(decode_text(rows[start:end]), delimiter)]
            bare = mark.join("?" if mark in c or '"' in c else c for c in cells).encode()
        yield bare
        done = end
    yield rows[done:]


def _without_quotes(line: bytes, delimiter: str | None) -> bytes | None:
    """Return a line without quotes, if every cell is quoted and plain; None for other lines."""
    line, mark = line.rstrip(b"\r"), (delimiter or " ").encode()
    if not (line.startswith(b'"') and line.endswith(b'"')) or line.count(b'"') % 2:
        return None
    bare = line[1:-1].replace(b'"' + mark + b'"', mark)
    is_plain = b'"' not in bare and line.count(b'"') == 2 * bare.count(mark) + 2
    return bare if is_plain and delimiter is not None else None


def _quoted_lines(text: bytes) -> Iterator[tuple[int, int]]:
    """Yield start and end of the lines with a quote; other lines are skipped quickly."""
    mark = b"\n" if b"\n" in text else b"\r"
    quote = text.find(b'"')
    while quote >= 0:
        end = text.find(mark, quote)
        end = len(text) if end < 0 else end
        yield text.rfind(mark, 0, quote) + 1, end
        quote = text.find(b'"', end)


def _by_line(raw: bytes, layout: Layout, wanted: list[int], kinds: _Kinds) -> list[Column]:
    columns: list[list[Any]] = [[] for _ in wanted]
    lines = []
    for line, cells in _read_rows(raw, layout):
        lines.append(line)
        for values, index, kind in zip(columns, wanted, kinds, strict=True):
            if kind is np.str_:
                values.append(cells[index])
                continue
            exact = parse_whole(cells[index]) if kind is np.int64 else None
            values.append(
                _parse_value(cells[index], line, index, layout) if exact is None else exact
            )
    return [
        _make_dates(values, lines, index, layout) if kind is np.str_ else _to_array(values, kind)
        for values, kind, index in zip(columns, kinds, wanted, strict=True)
    ]


def _make_dates(cells: list[str], lines: list[int], index: int, layout: Layout) -> Column:
    """Return the times in a column of texts; a LogError names line and column of an error."""
    times = parse_dates(cells)
    if times is None:
        at, reason = find_fault(cells)
        _raise_fault(cells[at], lines[at], index, layout, reason)
    return times


def _read_rows(raw: bytes, layout: Layout) -> Iterator[tuple[int, list[str]]]:
    """Yield the line number and cells of each row; LogError for too many or too few cells."""
    for at, line in enumerate(io.StringIO(decode_text(raw), newline=None), start=1):
        if at <= layout.lines_before or is_blank(line, layout.delimiter) or is_comment(line):
            continue
        if line.strip() == layout.header:
            continue
        cells = split_cells(line, layout.delimiter)
        if len(cells) != layout.width:
            raise LogError(
                f"line {at} has {len(cells)} cells, expected {layout.width} "
                "as in the lines before it"
            )
        yield at, cells


def _parse_value(cell: str, line: int, index: int, layout: Layout) -> float:
    try:
        return parse_number(cell, layout.decimal_comma)
    except ValueError as error:
        _raise_fault(cell, line, index, layout, str(error))


def _raise_fault(cell: str, line: int, index: int, layout: Layout, reason: str) -> NoReturn:
    name = layout.names[index] if layout.names is not None else f"column_{index}"
    shown = cell if len(cell) <= 40 else cell[:37] + "..."
    raise LogError(f"line {line}, column '{name}': '{shown}' {reason}") from None


def _to_array(values: Sequence[float], kind: type[np.generic]) -> Column:
    is_whole = kind is np.int64 and all(
        isinstance(v, int) and -(2**63) <= v < 2**63 for v in values
    )
    return np.array(values, dtype=np.int64 if is_whole else np.float64)
