"""Text tables: comma, semicolon, tab or blanks between cells, with or without a header.

The layout is found from the first lines; `zerorate.io.readers.parsers` reads the rows.
"""

from __future__ import annotations

import csv
import io
import json
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from zerorate.io.clocks.iso8601 import is_date
from zerorate.io.log import LogError
from zerorate.io.readers.cells import MISSING, from_inert, inert, is_comment, is_number, split
from zerorate.io.readers.parsers import Layout, decoded, notes_on_quotes, parsed, texts
from zerorate.io.table import Content, Format, Metadata, Table, listed_names

__all__ = ["FORMAT", "META_MARK", "text_header"]

META_MARK = "zerorate"
_BOM = b"\xef\xbb\xbf"
_HEAD = 1 << 17
_LINE = re.compile(rb"[^\r\n]*(?:\r\n|\n|\r|\Z)")


@dataclass(frozen=True)
class _Line:
    number: int
    offset: int
    text: str

    @property
    def comment(self) -> bool:
        return is_comment(self.text)


def _find_layout(raw: bytes) -> tuple[Layout, Metadata]:
    """Return the layout and metadata of a text table; LogError if its first lines are none."""
    _check_is_text(raw)
    lines = [line for line in _head_lines(raw) if line.text]
    body = [line for line in lines if not line.comment]
    if not body:
        raise LogError("the file holds no rows, expected a table of numbers")
    delimiter = _delimiter(body[min(1, len(body) - 1)].text)
    cells = [split(line.text, delimiter) for line in body[:50]]
    decimal_comma = delimiter != "," and _has_decimal_comma(cells)
    told = _names_in_comment(lines, body[0], delimiter, len(cells[0]))
    # Rows with a text in them, such as a frame, are no header below one in a comment.
    below_names = told is not None and any(is_number(cell, decimal_comma) for cell in cells[0])
    headed = not below_names and not _all_numbers(cells[0], decimal_comma)
    if headed and len(body) == 1:
        raise LogError(f"line {body[0].number} is a header without rows, expected numbers below it")
    first = body[1] if headed else body[0]
    row = cells[1] if headed else cells[0]
    names: tuple[str, ...] | None
    if headed:
        _check_has_number(first, row, decimal_comma)
        names = _header(cells[0], row, body[0].number, first.number)
    else:
        names = told
    layout = Layout(
        offset=first.offset,
        lines_before=first.number - 1,
        delimiter=delimiter,
        decimal_comma=decimal_comma,
        width=len(row),
        names=names,
        first_row=tuple(row),
    )
    return layout, _metadata(lines, first)


def _check_is_text(raw: bytes) -> None:
    if raw.startswith((b"\xff\xfe", b"\xfe\xff")):
        raise LogError("the text is UTF-16, expected UTF-8")
    head = raw[:_HEAD]
    strange = sum(
        head.count(bytes([code])) for code in range(32) if code not in (9, 10, 11, 12, 13)
    )
    if b"\0" in head or strange > 0.01 * len(head):
        raise LogError("the content is binary, expected a text table")


def _head_lines(raw: bytes) -> Iterator[_Line]:
    start = len(_BOM) if raw.startswith(_BOM) else 0
    # One line more than the head, so that a long line is never cut in the middle.
    newline = raw.find(b"\n", _HEAD)
    stop = len(raw) if newline < 0 else newline + 1
    offset = start
    number = 1
    while offset < stop and offset < _HEAD:
        found = _LINE.match(raw, offset)
        if found is None or found.end() == offset:
            return
        yield _Line(number, offset, decoded(found[0]).strip("\r\n").strip(" "))
        offset, number = found.end(), number + 1


def _delimiter(line: str) -> str | None:
    line = re.sub(r'"[^"]*"', "", line)
    for mark in (";", "\t", ","):
        if mark in line:
            return mark
    return None if len(line.split()) > 1 else ","


def _has_decimal_comma(rows: list[list[str]]) -> bool:
    cells = [cell for row in rows for cell in row]
    numbers = [cell for cell in cells if re.fullmatch(r"[+-]?\d*[.,]\d*([eE][+-]?\d+)?", cell)]
    return any("," in n for n in numbers) and not any("." in n for n in numbers)


def _all_numbers(cells: list[str], decimal_comma: bool) -> bool:
    return all(cell in MISSING or is_number(cell, decimal_comma) or is_date(cell) for cell in cells)


def _check_has_number(line: _Line, cells: list[str], decimal_comma: bool) -> None:
    if not any(cell in MISSING or is_number(cell, decimal_comma) for cell in cells):
        raise LogError(f"line {line.number} holds no number, expected a row of a table of numbers")


def _header(cells: list[str], row: list[str], line: int, row_line: int) -> tuple[str, ...]:
    if len(cells) == len(row) - 1 and not row[-1]:
        cells = [*cells, ""]  # rows that end in a delimiter
    if len(cells) != len(row):
        raise LogError(
            f"the header on line {line} names {len(cells)} columns, "
            f"but line {row_line} has {len(row)} cells"
        )
    return _names(cells)


def _names_in_comment(
    lines: list[_Line], first: _Line, delimiter: str | None, width: int
) -> tuple[str, ...] | None:
    """Return the names in the comment just above the first row, as ROS and NumPy write them."""
    above = [line for line in lines if line.number < first.number]
    if not above:
        return None
    cells = split(above[-1].text.lstrip("#% "), delimiter)
    if len(cells) != width or all(is_number(cell, False) for cell in cells):
        return None
    return _names(cells)


def _names(cells: list[str]) -> tuple[str, ...]:
    return tuple(from_inert(cell) or f"column_{i}" for i, cell in enumerate(cells))


def _metadata(lines: list[_Line], first: _Line) -> Metadata:
    for line in lines:
        mark, _, text = line.text.lstrip("#% ").partition(" ")
        if line.number < first.number and line.comment and mark == META_MARK:
            return _metadata_from_json(text)
    return Metadata()


def _metadata_from_json(text: str) -> Metadata:
    """Return the metadata in a JSON object; LogError if it is none."""
    try:
        fields = json.loads(text)
    except (ValueError, RecursionError):
        fields = None
    if not isinstance(fields, dict):
        raise LogError(f"the comment '{META_MARK} {text[:40]}' is no JSON object")
    known = ("rate", "unit", "sensor", "names")
    return Metadata(**{key: value for key, value in fields.items() if key in known})


def _read(path: Path) -> Content:
    raw = path.read_bytes()
    layout, meta = _find_layout(raw)
    table = Table(
        width=layout.width,
        load=lambda wanted: parsed(raw, layout, list(wanted)),
        names=layout.names,
        labels=lambda index: texts(raw, layout, index),
        meta=replace(meta, notes=(*meta.notes, *notes_on_quotes(raw, layout))),
    )
    return Content.of(listed_names(table))


FORMAT = Format("text", "a text table", (".csv", ".tsv", ".txt", ".dat"), (), _read)


def text_header(names: Sequence[str], delimiter: str) -> str:
    """Return the header line of a text table, without its end."""
    line = io.StringIO()
    csv.writer(line, delimiter=delimiter, lineterminator="").writerow(map(inert, names))
    return line.getvalue()
