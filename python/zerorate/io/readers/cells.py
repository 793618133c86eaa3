"""Cells of text tables: splitting of lines, and detection of numbers.

A cell never spans lines. Quotes are syntax only if they enclose a whole cell. If any quote in a
line does not, all quotes in this line are ordinary characters.
"""

from __future__ import annotations

import csv
import math
import re
from typing import Final

MISSING: Final = frozenset(
    ("", "nan", "NaN", "NAN", "-nan", "NA", "N/A", "n/a", "na", "null", "NULL", "None", "none", "-")
)
_DECIMAL: Final = r"(?:[0-9]+(?:\.[0-9]*)?|\.[0-9]+)(?:e[+-]?[0-9]+)?"
_NUMBER: Final = re.compile(
    rf"[+-]?(?:{_DECIMAL}|inf(?:inity)?|nan(?:\([a-z0-9_]*\))?)", re.ASCII | re.IGNORECASE
)
"""Decimal numbers as in C; Python's own also accept ``1_000`` and digits of all scripts."""

_WHOLE: Final = re.compile(r"[+-]?[0-9]{1,19}", re.ASCII)


_FORMULA: Final = re.compile(r"'*[=+\-@\t\r\n＝＋－＠]")


def make_inert(text: str) -> str:
    """Return a text as a cell that no spreadsheet reads as a formula; an apostrophe is prepended.

    The characters are listed by OWASP under "CSV Injection".
    """
    return f"'{text}" if _FORMULA.match(text) else text


def undo_inert(cell: str) -> str:
    """Return the original text of a cell from `make_inert`."""
    return cell[1:] if cell.startswith("'") and _FORMULA.match(cell) else cell


def split_cells(line: str, delimiter: str | None) -> list[str]:
    """Return the cells of a line; with the delimiter None, any run of blanks separates them."""
    line = line.rstrip("\r\n")
    cells = _unquote(line, delimiter) if '"' in line else None
    return [cell.strip() for cell in (line.split(delimiter) if cells is None else cells)]


def has_stray_quotes(line: str, delimiter: str | None) -> bool:
    """Return True if a line has a quote outside a pair around a whole cell."""
    return '"' in line and _unquote(line.rstrip("\r\n"), delimiter) is None


def _unquote(line: str, delimiter: str | None) -> list[str] | None:
    if delimiter is None:
        line, delimiter = " ".join(line.split()), " "
    try:
        skips = delimiter != " "
        rows = csv.reader([line], delimiter=delimiter, skipinitialspace=skips, strict=True)
        return next(rows)
    except csv.Error:
        return None


def is_comment(line: str) -> bool:
    """Return True if a line is a comment."""
    return line.lstrip(" \t").startswith(("#", "%", "//"))


def is_blank(line: str, delimiter: str | None) -> bool:
    """Return True if a line has no cells; empty cells between tabs count as cells."""
    return not (line.strip(" \r\n") if delimiter == "\t" else line.strip())


def is_number(cell: str, decimal_comma: bool) -> bool:
    """Return True if a cell contains a number."""
    return _NUMBER.fullmatch(_to_decimal_point(cell, decimal_comma)) is not None


def parse_whole(cell: str) -> int | None:
    """Return the integer in a cell; None for other texts, and for more than 64 bits."""
    text = cell.strip()
    return int(text) if _WHOLE.fullmatch(text) else None


def parse_number(cell: str, decimal_comma: bool) -> float:
    """Return the number in a cell, NaN if it is missing.

    Raises
    ------
    ValueError
        If the cell has no number, or a number too large for a double. The message continues a
        sentence that begins with the cell.
    """
    text = cell.strip()
    if text in MISSING:
        return math.nan
    text = _to_decimal_point(text, decimal_comma)
    if _NUMBER.fullmatch(text) is None:
        raise ValueError("is not a number")
    value = math.nan if text.endswith(")") else float(text)
    if math.isinf(value) and text[-1].isdigit():
        raise ValueError("is beyond the largest double, 1.8e308")
    return value


def _to_decimal_point(text: str, decimal_comma: bool) -> str:
    # Comma and point are swapped, so that a decimal point raises an error.
    return text.translate(_SWAP_COMMAS) if decimal_comma else text


_SWAP_COMMAS: Final = str.maketrans(",.", ".,")
