"""Text tables: comma, semicolon, tab or blanks between cells, with or without a header.

The layout is found from the first lines. Then the fastest parser that takes the file is used:
pyarrow, NumPy, or line by line; all give the same numbers. The last one alone names the line
and column of a fault, so every failure of the others ends there.
"""

from __future__ import annotations

import csv
import io
import json
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from zerorate.io.log import LogError
from zerorate.io.table import Column, Content, Format, Metadata, Table, listed_names

__all__ = ["FORMAT", "META_MARK", "MISSING", "text_header"]

MISSING = frozenset(
    ("", "nan", "NaN", "NAN", "-nan", "NA", "N/A", "n/a", "na", "null", "NULL", "None", "none", "-")
)
META_MARK = "zerorate"
_BOM = b"\xef\xbb\xbf"
_HEAD = 1 << 17
_LINE = re.compile(rb"[^\r\n]*(?:\r\n|\n|\r|\Z)")


@dataclass(frozen=True)
class _Layout:
    """Where the rows begin (byte offset, lines before it) and how a row is read.

    ``delimiter`` is None for any run of blanks; ``first_row`` holds the cells of the first row.
    """

    offset: int
    lines_before: int
    delimiter: str | None
    decimal_comma: bool
    width: int
    names: tuple[str, ...] | None
    first_row: tuple[str, ...]
    meta: Metadata = field(default_factory=Metadata)

    def split(self, line: str) -> list[str]:
        """Return the cells of a line."""
        return _split(line, self.delimiter)


@dataclass(frozen=True)
class _Line:
    number: int
    offset: int
    text: str

    @property
    def comment(self) -> bool:
        return self.text[0] in "#%"


def _find_layout(raw: bytes) -> _Layout:
    """Return the layout of a text table; LogError if its first lines are no such table."""
    _check_is_text(raw)
    lines = [line for line in _head_lines(raw) if line.text]
    body = [line for line in lines if not line.comment]
    if not body:
        raise LogError("the file holds no rows, expected a table of numbers")
    delimiter = _delimiter(body[min(1, len(body) - 1)].text)
    cells = [_split(line.text, delimiter) for line in body[:50]]
    decimal_comma = delimiter != "," and _has_decimal_comma(cells)
    headed = not _all_numbers(cells[0], decimal_comma)
    if headed and len(body) == 1:
        raise LogError(f"line {body[0].number} is a header without rows, expected numbers below it")
    first = body[1] if headed else body[0]
    row = cells[1] if headed else cells[0]
    names: tuple[str, ...] | None
    if headed:
        _check_has_number(first, row, decimal_comma)
        names = _header(cells[0], row, body[0].number, first.number)
    else:
        names = _names_in_comment(lines, first, delimiter, len(row))
    return _Layout(
        offset=first.offset,
        lines_before=first.number - 1,
        delimiter=delimiter,
        decimal_comma=decimal_comma,
        width=len(row),
        names=names,
        first_row=tuple(row),
        meta=_metadata(lines, first),
    )


def _decoded(raw: bytes) -> str:
    """Return the text of UTF-8 bytes, or of Latin-1 where they are not UTF-8."""
    raw = raw.removeprefix(_BOM)
    try:
        return raw.decode("utf-8")
    except UnicodeDecodeError:
        return raw.decode("latin-1")


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
        yield _Line(number, offset, _decoded(found[0]).strip("\r\n").strip(" "))
        offset, number = found.end(), number + 1


def _delimiter(line: str) -> str | None:
    for mark in (";", "\t", ","):
        if mark in line:
            return mark
    return None if len(line.split()) > 1 else ","


def _split(line: str, delimiter: str | None) -> list[str]:
    if delimiter is None:
        return [cell.strip('"') for cell in line.split()]
    row = next(csv.reader([line.rstrip("\r\n")], delimiter=delimiter), [])
    return [cell.strip() for cell in row]


def _has_decimal_comma(rows: list[list[str]]) -> bool:
    cells = [cell for row in rows for cell in row]
    numbers = [cell for cell in cells if re.fullmatch(r"[+-]?\d*[.,]\d*([eE][+-]?\d+)?", cell)]
    return any("," in n for n in numbers) and not any("." in n for n in numbers)


def _is_number(cell: str, decimal_comma: bool) -> bool:
    try:
        float(cell.replace(",", ".") if decimal_comma else cell)
    except ValueError:
        return False
    return True


def _all_numbers(cells: list[str], decimal_comma: bool) -> bool:
    return all(cell in MISSING or _is_number(cell, decimal_comma) for cell in cells)


def _check_has_number(line: _Line, cells: list[str], decimal_comma: bool) -> None:
    if not any(cell in MISSING or _is_number(cell, decimal_comma) for cell in cells):
        raise LogError(f"line {line.number} holds no number, expected a row of a table of numbers")


def _header(cells: list[str], row: list[str], line: int, row_line: int) -> tuple[str, ...]:
    if len(cells) == len(row) - 1 and not row[-1]:
        cells = [*cells, ""]  # rows that end in a delimiter
    if len(cells) != len(row):
        raise LogError(
            f"the header on line {line} names {len(cells)} columns, "
            f"but line {row_line} has {len(row)} cells"
        )
    return tuple(cell or f"column_{i}" for i, cell in enumerate(cells))


def _names_in_comment(
    lines: list[_Line], first: _Line, delimiter: str | None, width: int
) -> tuple[str, ...] | None:
    """Return the names in the comment just above the first row, as ROS and NumPy write them."""
    above = [line for line in lines if line.number < first.number]
    if not above:
        return None
    cells = _split(above[-1].text.lstrip("#% "), delimiter)
    if len(cells) != width or all(_is_number(cell, False) for cell in cells):
        return None
    return tuple(cell or f"column_{i}" for i, cell in enumerate(cells))


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
        names = fields.get("names")
        return Metadata(
            rate=fields.get("rate"),
            unit=fields.get("unit"),
            sensor=fields.get("sensor"),
            names=None if names is None else tuple(names),
        )
    except (ValueError, AttributeError, TypeError):
        raise LogError(f"the comment '{META_MARK} {text[:40]}' is no JSON object") from None


_Kinds = list[type[np.float64] | type[np.int64]]


def _read(path: Path) -> Content:
    raw = path.read_bytes()
    layout = _find_layout(raw)
    table = Table(
        width=layout.width,
        load=lambda wanted: _load(raw, layout, list(wanted)),
        names=layout.names,
        meta=layout.meta,
    )
    return Content.of(listed_names(table))


FORMAT = Format("text", "a text table", (".csv", ".tsv", ".txt", ".dat"), (), _read)


def _load(raw: bytes, layout: _Layout, wanted: list[int]) -> list[Column]:
    kinds = _kinds(layout, wanted)
    body = _body(raw, layout)
    for parse in (_by_arrow, _by_numpy):
        columns = parse(body, layout, wanted, kinds)
        if columns is not None:
            return columns
    return _by_line(raw, layout, wanted)


def _kinds(layout: _Layout, wanted: list[int]) -> _Kinds:
    """Return int64 for columns of integers too long for a float64, such as nanoseconds."""
    cells = (layout.first_row[i].lstrip("+-") for i in wanted)
    return [np.int64 if cell.isdigit() and len(cell) > 15 else np.float64 for cell in cells]


def _body(raw: bytes, layout: _Layout) -> bytes:
    body = raw[layout.offset :]
    if b"#" in body or b"%" in body:
        lines = body.splitlines(keepends=True)
        body = b"".join(line for line in lines if not line.lstrip().startswith((b"#", b"%")))
    return _single_blanks(body) if layout.delimiter is None else body


def _single_blanks(body: bytes) -> bytes:
    body = body.replace(b"\t", b" ").strip(b" ")
    while b"  " in body:
        body = body.replace(b"  ", b" ")
    return body.replace(b"\n ", b"\n").replace(b" \n", b"\n").replace(b" \r", b"\r")


def _by_arrow(
    body: bytes, layout: _Layout, wanted: list[int], kinds: _Kinds
) -> list[Column] | None:
    try:
        import pyarrow as pa
        from pyarrow import csv as arrow_csv
    except ImportError:
        return None
    labels = [str(i) for i in range(layout.width)]
    types = {
        labels[i]: pa.from_numpy_dtype(np.dtype(kind))
        for i, kind in zip(wanted, kinds, strict=True)
    }
    try:
        table = arrow_csv.read_csv(
            io.BytesIO(body),
            read_options=arrow_csv.ReadOptions(column_names=labels),
            parse_options=arrow_csv.ParseOptions(delimiter=layout.delimiter or " "),
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


def _by_numpy(
    body: bytes, layout: _Layout, wanted: list[int], kinds: _Kinds
) -> list[Column] | None:
    # Every column is named, the unwanted ones as one byte, so that NumPy checks the row's width.
    types = dict(zip(wanted, kinds, strict=True))
    fields = [(f"c{i}", types.get(i, "S1")) for i in range(layout.width)]
    text = _decoded(body.replace(b",", b".") if layout.decimal_comma else body)
    try:
        rows = np.loadtxt(
            io.StringIO(text),
            dtype=np.dtype(fields),
            delimiter=layout.delimiter,
            comments=None,
            quotechar='"',
            ndmin=1,
        )
    except (ValueError, OverflowError):
        return None
    return [np.ascontiguousarray(rows[f"c{i}"]) for i in wanted]


def _by_line(raw: bytes, layout: _Layout, wanted: list[int]) -> list[Column]:
    columns: list[list[float]] = [[] for _ in wanted]
    lines = io.StringIO(_decoded(raw), newline=None)
    for number, line in enumerate(lines, start=1):
        if number <= layout.lines_before or not line.strip() or line.lstrip()[0] in "#%":
            continue
        cells = layout.split(line)
        if len(cells) != layout.width:
            raise LogError(
                f"line {number} has {len(cells)} cells, expected {layout.width} "
                "as in the lines before it"
            )
        for values, index in zip(columns, wanted, strict=True):
            values.append(_number(cells[index], number, index, layout))
    return [_as_array(values) for values in columns]


def _number(cell: str, line: int, index: int, layout: _Layout) -> float:
    text = cell.strip()
    if text in MISSING:
        return float("nan")
    try:
        if text.lstrip("+-").isdigit():
            return int(text)
        return float(text.replace(",", ".") if layout.decimal_comma else text)
    except ValueError:
        name = layout.names[index] if layout.names is not None else f"column_{index}"
        raise LogError(
            f"line {line}, column '{name}': '{_shortened(cell)}' is not a number"
        ) from None


def _shortened(cell: str) -> str:
    return cell if len(cell) <= 40 else cell[:37] + "..."


def _as_array(values: Sequence[float]) -> Column:
    long = max((abs(v) for v in values if isinstance(v, int)), default=0) >= 10**15
    if long and all(isinstance(v, int) and abs(v) < 2**63 for v in values):
        return np.array(values, dtype=np.int64)
    return np.array(values, dtype=np.float64)


def text_header(names: Sequence[str], delimiter: str) -> str:
    """Return the header line of a text table, without its end."""
    line = io.StringIO()
    csv.writer(line, delimiter=delimiter, lineterminator="").writerow(names)
    return line.getvalue()
