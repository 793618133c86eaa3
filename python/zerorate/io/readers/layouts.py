"""Layout of a text table from its first lines: preamble, header, units, first row.

A row is a line with numbers and the number of cells that most such lines have. Above the first row
is the header, with one or several lines, and optionally a line of units. Above the header, the
preamble describes the whole file, for example its rate.
"""

from __future__ import annotations

import json
import re
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import islice
from typing import Final, NamedTuple

from zerorate.io.clocks.names import UNIT_SPELLINGS, looks_like_time
from zerorate.io.readers.cells import (
    MISSING,
    is_comment,
    is_number,
    parse_whole,
    split_cells,
    undo_inert,
)
from zerorate.io.readers.parsers import BOM, Layout, decode_text, is_value
from zerorate.io.table import Metadata
from zerorate.record.log import LogError
from zerorate.record.names import is_unit
from zerorate.record.words import parse_name

META_MARK: Final = "zerorate"
_HEAD_BYTES: Final = 1 << 17
_LINE: Final = re.compile(rb"[^\r\n]*(?:\r\n|\n|\r|\Z)")
_SEP: Final = re.compile(r'"?sep=(.)"?[,;\t]*', re.IGNORECASE)
STATED_RATE: Final = re.compile(
    r"(?:rate|frequency|odr)\W{0,6}([0-9.]+) ?Hz|\bat ([0-9.]+) ?Hz", re.IGNORECASE
)
_RULE: Final = re.compile(r"[|+:=\-\s]*(?:-{3}|={3})[|+:=\-\s]*$")
"""Line drawn below the names."""
_EMPTY_CELLS: Final = ("", "-")
"""Texts for a missing value in a row, and for no unit in a line of units."""
_MAX_HEAD_LINES: Final = 400
"""Largest number of lines to find the width of a row."""
_MAX_COMMA_ROWS: Final = 50
"""Number of rows tested for a decimal comma."""


_REMEDY: Final = (
    "; export it as CSV: names, then rows with as many cells (lines of JSON and of pairs such as "
    "gx=0.1 are read as well)"
)


class Line(NamedTuple):
    """Line of a file, with its number from 1 and its offset."""

    number: int
    offset: int
    text: str

    @property
    def comment(self) -> bool:
        """True if the line is a comment."""
        return is_comment(self.text)


def find_layout(raw: bytes, names: tuple[str, ...] | None = None) -> tuple[Layout, Metadata]:
    """Return the layout and metadata of a text table; LogError if the file has none.

    ``names`` are the columns' names, if the file states them outside of a header.
    """
    lines = [line for line in _read_head_lines(raw) if line.text and not _RULE.match(line.text)]
    mark = _SEP.fullmatch(lines[0].text) if lines else None
    lines = lines[1:] if mark else lines
    body = [line for line in lines if not line.comment]
    if not body:
        raise LogError(f"the file holds no rows, expected a table of numbers{_REMEDY}")
    delimiter = mark[1] if mark else delimiter_of(_find_sample_row(body).text)
    cells = [split_cells(line.text, delimiter) for line in body[:_MAX_HEAD_LINES]]
    notes: tuple[str, ...] = ()
    if _begins_within(cells):
        notes, body, cells = (_begun(body[0]),), body[1:], cells[1:]
    width = len(split_cells(_find_sample_row(body).text, delimiter))
    rows = [row for row in cells if len(row) == width][:_MAX_COMMA_ROWS]
    decimal_comma = delimiter != "," and _has_decimal_comma(rows)
    column_names = names or _find_comment_names(lines, body[0], delimiter, len(cells[0]))
    below_names = column_names is not None and any(
        is_number(cell, decimal_comma) for cell in cells[0]
    )
    at = 0 if below_names else _find_first_row(cells, decimal_comma)
    if at == len(body):
        raise LogError(f"line {body[0].number} is a header without rows, expected numbers below it")
    first, row, at_row = body[at], cells[at], at
    header = None
    if not below_names and at:
        _check_has_number(first, row, decimal_comma)
        column_names, at = _find_header(cells, body, at)
        if column_names is None and all(cell in MISSING or is_value(cell) for cell in cells[at]):
            notes = (_begun(body[at]),)
        # An empty line below the names does not mean a restart of the device.
        header = body[at].text if any(cells[at]) else None
    column_names = column_names and _mark_empty_times(column_names, cells[at_row:])
    layout = Layout(
        offset=first.offset,
        lines_before=first.number - 1,
        delimiter=delimiter,
        decimal_comma=decimal_comma,
        width=len(row),
        names=column_names,
        first_row=tuple(row),
        header=header,
    )
    meta = _find_metadata(lines, first)
    return layout, replace(meta, notes=(*meta.notes, *notes))


def _begins_within(cells: list[list[str]]) -> bool:
    """Return True if a file begins in the middle of a row, above the line of names."""
    if len(cells) < 3 or not len(cells[0]) == len(cells[1]) == len(cells[2]):
        return False
    named = not any(is_value(cell) for cell in cells[1]) and all(cells[1])
    return named and all(map(is_value, cells[0])) and any(map(is_value, cells[2]))


def _begun(line: Line) -> str:
    return f"line {line.number} is begun within; left out"


def first_lines(raw: bytes, count: int) -> list[Line]:
    """Return the first lines of a file that are neither empty nor comments."""
    return [
        *islice((line for line in _read_head_lines(raw) if line.text and not line.comment), count)
    ]


def _read_head_lines(raw: bytes) -> Iterator[Line]:
    """Yield complete lines from the beginning of a file."""
    start = len(BOM) if raw.startswith(BOM) else 0
    # Read one line more than necessary, so that no line is cut.
    newline = raw.find(b"\n", _HEAD_BYTES)
    stop = len(raw) if newline < 0 else newline + 1
    offset = start
    number = 1
    while offset < stop and offset < _HEAD_BYTES:
        match = _LINE.match(raw, offset)
        if match is None or match.end() == offset:
            return
        yield Line(number, offset, decode_text(match[0]).strip("\r\n").strip(" "))
        offset, number = match.end(), number + 1


def _find_sample_row(body: Sequence[Line]) -> Line:
    """Return a line that is a row, not part of a preamble."""
    if len(body) <= 2:
        return body[-1]
    middle = body[len(body) // 2]
    return middle if re.search(r"\d", middle.text) else body[-1]


def delimiter_of(line: str) -> str | None:
    """Return the delimiter of the cells of a line; None for blanks."""
    line = re.sub(r'"[^"]*"', "", line)
    for mark in (";", "\t", ",", "|"):
        if mark in line:
            return mark
    return None if len(line.split()) > 1 else ","


def _has_decimal_comma(rows: list[list[str]]) -> bool:
    cells = [cell for row in rows for cell in row]
    numbers = [cell for cell in cells if re.fullmatch(r"[+-]?\d*[.,]\d*([eE][+-]?\d+)?", cell)]
    return any("," in n for n in numbers) and not any("." in n for n in numbers)


def _find_first_row(cells: list[list[str]], decimal_comma: bool) -> int:
    """Return the index of the first row; the second line if no line certainly is a row."""
    values = [sum(1 for cell in row if is_value(cell, decimal_comma)) for row in cells]
    # A line above the rows may have numbers, but fewer than a row.
    has_value = [2 * count >= max(values[len(values) // 2], 1) and count > 0 for count in values]
    widths = Counter(
        len(row) for row, has_number in zip(cells, has_value, strict=True) if has_number
    )
    if not widths:
        return 1
    (width, _), *_ = sorted(widths.items(), key=lambda item: (-item[1], -item[0]))
    at = next(i for i, row in enumerate(cells) if has_value[i] and len(row) == width)
    at = _find_first_gappy_row(cells, at, decimal_comma)
    following = cells[at + 1] if at + 1 < len(cells) else None
    if following is not None and len(following) == width:
        return at + _is_header(cells[at], following, decimal_comma)
    return at + (at == 0 and not all(cell in MISSING or is_value(cell) for cell in cells[at]))


def _find_first_gappy_row(cells: list[list[str]], at: int, decimal_comma: bool) -> int:
    """Return the first line above a row that is also a row, with many values missing.

    Lines without cells count as rows between two rows, and as a space below a header.
    """
    first = at
    for above in reversed(range(at)):
        filled = [cell for cell in cells[above] if cell not in _EMPTY_CELLS]
        is_row = all(cell in MISSING or is_value(cell, decimal_comma) for cell in filled)
        if len(cells[above]) != len(cells[at]) or not is_row:
            break
        first = above if filled else first
    return first


def _is_header(row: list[str], following: list[str], decimal_comma: bool) -> bool:
    """Return True if a line has names: words in columns that have numbers in the next line."""
    return any(
        cell not in MISSING and not is_value(cell, decimal_comma) and is_value(below, decimal_comma)
        for cell, below in zip(row, following, strict=True)
    )


def _check_has_number(line: Line, cells: list[str], decimal_comma: bool) -> None:
    if not any(cell in MISSING or is_value(cell, decimal_comma) for cell in cells):
        raise LogError(
            f"line {line.number} holds no number, expected a row of a table of numbers{_REMEDY}"
        )


def _find_header(
    cells: list[list[str]], body: Sequence[Line], at: int
) -> tuple[tuple[str, ...] | None, int]:
    """Return the names above the first row, and the index of their last line."""
    row = cells[at]
    rows: list[list[str]] = []
    above = at - 1
    while above >= 0 and (
        not rows or _is_header_part(cells[above], rows[0], body[above : above + 2])
    ):
        fitting = _fit_width(cells[above], row)
        if fitting is None or (rows and _is_padded(fitting)):
            break
        rows.insert(0, fitting)
        above -= 1
    if not rows:
        torn = all(cell in MISSING or is_value(cell) for cell in cells[at - 1])
        if at > 1 or (torn and len(cells[at - 1]) < len(row)):
            return None, at - 1
        raise LogError(_describe_width(cells[at - 1], row, body[at - 1].number, body[at].number))
    units = next((own for own in rows if len(rows) > 1 and _are_units(own)), None)
    name_rows = [own for own in rows if own is not units]
    merged = _merge_names(name_rows)
    if units is not None:
        pairs = zip(merged, units, strict=True)
        merged = [_add_unit(name, unit) for name, unit in pairs]
    return _make_names(merged), at - 1


def _mark_empty_times(names: tuple[str, ...], rows: list[list[str]]) -> tuple[str, ...]:
    """Return the names; time columns that are always empty are renamed."""
    return tuple(
        f"{name} (empty)"
        if looks_like_time(name) and all(len(row) > i and row[i] in MISSING for row in rows)
        else name
        for i, name in enumerate(names)
    )


def _is_header_part(cells: list[str], below: list[str], lines: Sequence[Line]) -> bool:
    """Return True if a line above a header belongs to the header, not to the preamble."""
    if lines[0].number != lines[1].number - 1 or (any(map(is_value, cells)) and cells[0]):
        return _is_block(cells)
    is_known = any(parse_name(f"{cell} x").kind for cell in cells if cell)
    return _are_units(below) or (len(cells) > 2 and ("" in cells or is_known))


def _is_padded(cells: list[str]) -> bool:
    """Return True if a preamble line is padded with delimiters to the width of a row."""
    return not any(cells[1:]) and not parse_name(f"{cells[0]} x").kind


def _is_block(cells: list[str]) -> bool:
    """Return True if a line names blocks of columns: cells separated by empty cells."""
    return 4 * sum(1 for cell in cells if cell) < len(cells)


def _fit_width(cells: list[str], row: list[str]) -> list[str] | None:
    """Return a header line with as many cells as a row; None if it does not fit."""
    if len(cells) == len(row) + 1 and not cells[-1]:
        return cells[:-1]
    if len(cells) == len(row) - 1 and not row[-1]:
        return [*cells, ""]  # rows that end with a delimiter
    return cells if len(cells) == len(row) else None


def _describe_width(cells: list[str], row: list[str], line: int, row_line: int) -> str:
    sentence = f"the header on line {line} names {len(cells)} columns, but line {row_line} has"
    if len(row) == 2 * len(cells) and all(parse_whole(cell) is not None for cell in row):
        return (
            f"{sentence} {len(row)} whole numbers: they are written with a decimal comma, "
            "which cannot be distinguished from the commas between cells; write semicolons "
            "between cells, or decimal points"
        )
    return f"{sentence} {len(row)} cells{_REMEDY}"


def _are_units(cells: list[str]) -> bool:
    """Return True if a header line contains units, in brackets or known."""
    filled = [cell for cell in cells if cell]
    bracketed = all(re.fullmatch(r"[\[(].*[\])]", cell) for cell in filled)
    return bool(filled) and (bracketed or 2 * sum(map(_is_unit, filled)) >= len(filled))


def _is_unit(text: str) -> bool:
    return is_unit(text) or text.strip().lower() in UNIT_SPELLINGS


def _add_unit(name: str, cell: str) -> str:
    unit = cell.strip("[]") if cell.startswith("[") else cell
    unit = unit[1:-1] if unit.startswith("(") and unit.endswith(")") else unit
    return f"{name} [{unit}]" if _is_unit(unit) else name


def _merge_names(rows: list[list[str]]) -> list[str]:
    """Return one line of names from several; a cell applies to the empty cells to its right.

    If names repeat after that, the first line distinguishes them.
    """
    *upper, names = rows
    for above in reversed(upper):
        repeated = [name for name in names if name and names.count(name) > 1]
        begins = [i for i, name in enumerate(names) if repeated and name == repeated[0]]
        if above is upper[0] and len(upper) > 1 and begins:
            return _prefix_blocks(names, above, begins)
        names = [
            " ".join(filter(None, pair)) for pair in zip(_fill_cells(above), names, strict=True)
        ]
    return names


def _fill_cells(cells: list[str]) -> list[str]:
    """Return cells with empty cells filled from the left."""
    last = ""
    return [last := cell or last for cell in cells]


def _prefix_blocks(names: list[str], above: list[str], begins: list[int]) -> list[str]:
    """Return names with the name of their block, from the line above, in front."""
    result = list(names)
    for begin, end in zip(begins, [*begins[1:], len(names)], strict=True):
        texts = [cell for cell in above[begin:end] if cell and not is_value(cell)]
        for i in range(begin, end):
            result[i] = " ".join(filter(None, [*texts[-1:], names[i]]))
    return result


def _find_comment_names(
    lines: Sequence[Line], first: Line, delimiter: str | None, width: int
) -> tuple[str, ...] | None:
    """Return the names in the comment above the first row, as ROS and NumPy write them."""
    above = [line for line in lines if line.number < first.number]
    if not above:
        return None
    *upper, cells = [split_cells(line.text.lstrip("#%/ "), delimiter) for line in above[-2:]]
    if upper and len(upper[0]) == len(cells) and _are_units(cells) and not _are_units(upper[0]):
        cells = [_add_unit(name, unit) for name, unit in zip(upper[0], cells, strict=True)]
    if len(cells) != width or all(is_number(cell, False) for cell in cells):
        return None
    return _make_names(cells)


def _make_names(cells: Sequence[str]) -> tuple[str, ...]:
    return tuple(undo_inert(cell) or f"column_{i}" for i, cell in enumerate(cells))


def _find_metadata(lines: Sequence[Line], first: Line) -> Metadata:
    above = [line for line in lines if line.number < first.number]
    for line in above:
        mark, _, text = line.text.lstrip("#% ").partition(" ")
        if line.comment and mark == META_MARK:
            return _parse_metadata(text)
    rates = {
        float(match[1] or match[2])
        for match in (STATED_RATE.search(line.text.replace(",", " ")) for line in above)
        if match is not None
    }
    return Metadata(rate=rates.pop() if len(rates) == 1 else None)


def _parse_metadata(text: str) -> Metadata:
    """Return the metadata in a JSON object; LogError if the text is no JSON object."""
    try:
        fields = json.loads(text)
    except (ValueError, RecursionError):
        fields = None
    if not isinstance(fields, dict):
        raise LogError(f"the comment '{META_MARK} {text[:40]}' is no JSON object")
    known = ("rate", "unit", "sensor", "names")
    return Metadata(**{key: value for key, value in fields.items() if key in known})
