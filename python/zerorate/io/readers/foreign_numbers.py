"""Numbers that are written otherwise, rewritten as plain ones: 1,234.5 and 1.0D-03 and 0x1F4A.

What a text holds is decided by cells that can mean nothing else; a note says so.
"""

from __future__ import annotations

import re
from typing import Final

_FORTRAN: Final = re.compile(rb"((?<![\w.])[+-]?[0-9]*\.[0-9]*)[dD](?=[+-]?[0-9]{1,3}(?![\w.]))")
_HEXADECIMAL: Final = re.compile(rb"(?<![\w.])0[xX]([0-9A-Fa-f]{1,8})(?![\w.])")
_SIGNED_DIGITS: Final = (4, 8)
"""Digits of numbers of 16 and 32 bits, whose highest bit is their sign."""
_SPACE_MARKS: Final = tuple(mark.encode() for mark in ("'", "\u2019", "\u202f", "\u00a0"))
_SPACE: Final = b"(?:" + b"|".join(_SPACE_MARKS) + b")"
_SPACES: Final = re.compile(rb"(?<=[0-9])" + _SPACE + rb"(?=[0-9]{3}(?![0-9]))")
_SPACED: Final = re.compile(rb"(?<![\w.])[+-]?[0-9]{1,3}(?:" + _SPACE + rb"[0-9]{3})+(?![\w])")
_GROUPED: Final = {
    b",": re.compile(rb"(?<![\w.,])[+-]?[0-9]{1,3}(?:,[0-9]{3})+\.[0-9]"),
    b".": re.compile(rb"(?<![\w.,])[+-]?[0-9]{1,3}(?:\.[0-9]{3})+,[0-9]"),
}
"""A number with marks between thousands and the other mark before its decimals."""
_THOUSANDS: Final = {
    b",": re.compile(rb"(?<=[0-9]),(?=[0-9]{3}(?![0-9]))"),
    b".": re.compile(rb"(?<=[0-9])\.(?=[0-9]{3}(?![0-9]))"),
}
_QUOTED: Final = re.compile(rb'"([+-]?[0-9][0-9,]*(?:\.[0-9]*)?)"')
_COMMA_IN_QUOTES: Final = re.compile(rb'"[+-]?[0-9]+,[0-9.,]+"')
_QUOTED_THOUSANDS: Final = re.compile(rb"[+-]?[1-9][0-9]{0,2}(?:,[0-9]{3})+(?:\.[0-9]*)?")
_QUOTED_DECIMALS: Final = re.compile(rb"[+-]?[0-9]+,[0-9]+")
_LINES: Final = 40
"""Lines that show how numbers are written."""


def plain_numbers(raw: bytes) -> tuple[bytes, list[str]]:
    """Return a text with plain numbers, and notes on what was rewritten; lines stay in place."""
    notes: list[str] = []
    for rewritten, note in (_fortran(raw), _hexadecimal(raw)):
        if note:
            raw, notes = rewritten, [*notes, note]
    rewritten, note = _thousands(raw)
    return (rewritten, [*notes, note]) if note else (raw, notes)


def _head(raw: bytes) -> bytes:
    """Return the first lines, of which the last ones are rows."""
    return b"\n".join(raw[: 1 << 16].splitlines()[:_LINES])


def _fortran(raw: bytes) -> tuple[bytes, str]:
    if not _FORTRAN.search(_head(raw)):
        return raw, ""
    return _FORTRAN.sub(rb"\1E", raw), "exponents are read as in Fortran: 1.0D-03 for 0.001"


def _hexadecimal(raw: bytes) -> tuple[bytes, str]:
    lines = _head(raw).splitlines()
    found = [_HEXADECIMAL.findall(line) for line in lines]
    # The address of a device is the same in all rows.
    if 2 * sum(map(bool, found)) < max(len(lines), 2) or len(set(map(tuple, found))) < 3:
        return raw, ""
    note = "hexadecimal cells are read as whole numbers, those of 4 and 8 digits with a sign"
    return _HEXADECIMAL.sub(lambda found: b"%d" % _whole(found[1]), raw), note


def _whole(digits: bytes) -> int:
    value, bits = int(digits, 16), 4 * len(digits)
    return value - (1 << bits) if len(digits) in _SIGNED_DIGITS and value >> (bits - 1) else value


def _thousands(raw: bytes) -> tuple[bytes, str]:
    """Return a text without marks between thousands."""
    if any(mark in raw for mark in _SPACE_MARKS) and _SPACED.search(raw):
        return _SPACES.sub(b"", raw), "spaces and apostrophes between thousands are left out"
    head = _head(raw)
    if (b";" in head or b"\t" in head) and b"," in raw and b"." in raw:
        for mark, grouped in _GROUPED.items():
            if grouped.search(raw):
                name = "commas" if mark == b"," else "points"
                return _THOUSANDS[mark].sub(b"", raw), f"{name} between thousands are left out"
    return _quoted_commas(raw) if b'"' in head else (raw, "")


def _quoted_commas(raw: bytes) -> tuple[bytes, str]:
    """Return a text in which quoted numbers with commas are plain, where it is sure how."""
    if not _COMMA_IN_QUOTES.search(raw):
        return raw, ""
    cells = [found[1] for found in _QUOTED.finditer(raw) if b"," in found[1]]
    if all(map(_QUOTED_THOUSANDS.fullmatch, cells)) and any(b"." in cell for cell in cells):
        plain, note = b"", "commas between thousands are left out"
    elif all(map(_QUOTED_DECIMALS.fullmatch, cells)) and not all(
        map(_QUOTED_THOUSANDS.fullmatch, cells)
    ):
        plain, note = b".", "commas in quoted numbers are read as decimal points"
    else:
        return raw, ""
    return _QUOTED.sub(lambda found: found[1].replace(b",", plain), raw), note
