"""Conversion of foreign notations of numbers: 1,234.5 and 1.0D-03 and 0x1F4A.

Unambiguous cells determine the notation of a text, and a note states it.
"""

from __future__ import annotations

import re
from typing import Final

_FORTRAN: Final = re.compile(rb"((?<![\w.])[+-]?[0-9]*\.[0-9]*)[dD](?=[+-]?[0-9]{1,3}(?![\w.]))")
_HEXADECIMAL: Final = re.compile(rb"(?<![\w.])0[xX]([0-9A-Fa-f]{1,8})(?![\w.])")
_SIGNED_DIGITS: Final = (4, 8)
"""Digits of hexadecimal numbers with 16 or 32 bits, which have a sign."""
_POINTS: Final = {b",": b"[.]", b".": b"[,]"}
"""Thousands separators that can also be decimal points; each with its counterpart."""
_SPACES: Final = dict.fromkeys([m.encode() for m in ("'", "\u2019", "\u202f", "\u00a0")], b"[.,]")
"""Thousands separators that have no other meaning."""
_DELIMITERS: Final = (b";", b"\t", b"|")
_QUOTED: Final = re.compile(rb'"([+-]?[0-9][0-9,]*(?:\.[0-9]*)?)"')
_COMMA_IN_QUOTES: Final = re.compile(rb'"[+-]?[0-9]+,[0-9.,]+"')
_QUOTED_THOUSANDS: Final = re.compile(rb"[+-]?[1-9][0-9]{0,2}(?:,[0-9]{3})+(?:\.[0-9]*)?")
_QUOTED_DECIMALS: Final = re.compile(rb"[+-]?[0-9]+,[0-9]+")
_LINES: Final = 40
"""Number of lines tested for the notation."""


def plain_numbers(raw: bytes) -> tuple[bytes, list[str]]:
    """Return a text with plain numbers, and notes on the changes; the lines stay the same."""
    notes: list[str] = []
    for rewrite in (_fortran, _hexadecimal, _thousands):
        raw, note = rewrite(raw)
        notes += [note] if note else []
    return raw, notes


def _head(raw: bytes) -> bytes:
    """Return the first lines; the last of them are rows."""
    return b"\n".join(raw[: 1 << 16].splitlines()[:_LINES])


def _fortran(raw: bytes) -> tuple[bytes, str]:
    if not _FORTRAN.search(_head(raw)):
        return raw, ""
    return _FORTRAN.sub(rb"\1E", raw), "exponents are read as in Fortran: 1.0D-03 for 0.001"


def _hexadecimal(raw: bytes) -> tuple[bytes, str]:
    lines = _head(raw).splitlines()
    found = [_HEXADECIMAL.findall(line) for line in lines]
    # A device's address is the same in all rows; samples change.
    if 2 * sum(map(bool, found)) < max(len(lines), 2) or len(set(map(tuple, found))) < 3:
        return raw, ""
    note = "hexadecimal cells are read as whole numbers, those of 4 and 8 digits with a sign"
    return _HEXADECIMAL.sub(lambda found: b"%d" % _whole(found[1]), raw), note


def _whole(digits: bytes) -> int:
    value, bits = int(digits, 16), 4 * len(digits)
    return value - (1 << bits) if len(digits) in _SIGNED_DIGITS and value >> (bits - 1) else value


def _thousands(raw: bytes) -> tuple[bytes, str]:
    """Return a text without thousands separators, if they are unambiguous."""
    lines = _head(raw).splitlines() or [b""]
    delimiter = next((mark for mark in _DELIMITERS if mark in lines[-1]), None)
    if delimiter is None:
        return _quoted_commas(raw) if b'"' in b"".join(lines) else (raw, "")
    for mark, points in (_POINTS | _SPACES).items():
        if mark not in raw or not re.search(points, raw):
            continue
        begin = rb'(?m)(?:^|(?<=[ "' + delimiter + rb"]))[+-]?[0-9]{1,3}(?:" + re.escape(mark)
        decimals, end = rb"(?:" + points + rb"[0-9]+)", rb'(?=[ "]*(?:\r?$|' + re.escape(delimiter)
        sure, any_cell = (
            re.compile(begin + rb"[0-9]{3})+" + decimals + count + end + rb"))")
            for count in (b"" if mark in _POINTS else b"?", b"?")
        )
        if sure.search(raw):
            plain = any_cell.sub(lambda found: found[0].replace(mark, b""), raw)  # noqa: B023
            return plain, f"marks between thousands are left out: {mark.decode()!r}"
    return raw, ""


def _quoted_commas(raw: bytes) -> tuple[bytes, str]:
    """Return a text with quoted numbers with commas made plain, if they are unambiguous."""
    if not _COMMA_IN_QUOTES.search(raw):
        return raw, ""
    cells = [found[1] for found in _QUOTED.finditer(raw) if b"," in found[1]]
    if all(map(_QUOTED_THOUSANDS.fullmatch, cells)) and any(b"." in cell for cell in cells):
        plain, note = b"", "marks between thousands are left out: ','"
    elif all(map(_QUOTED_DECIMALS.fullmatch, cells)) and not all(
        map(_QUOTED_THOUSANDS.fullmatch, cells)
    ):
        plain, note = b".", "commas in quoted numbers are read as decimal points"
    else:
        return raw, ""
    return _QUOTED.sub(lambda found: found[1].replace(b",", plain), raw), note
