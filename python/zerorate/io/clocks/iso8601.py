"""Dates and times as text: ISO 8601 and other notations."""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import Any, Final, NamedTuple

import numpy as np
import numpy.typing as npt

from zerorate.io.clocks.written import is_written_time, parse_written_times
from zerorate.io.readers.cells import MISSING
from zerorate.record.log import LogError

Dates = npt.NDArray[np.datetime64]

# Nanoseconds since 1970 in 64 bits range from 1678 to 2262.
_LOCAL: Final = (
    r"(?:1[7-9]|2[01])[0-9]{2}-[0-9]{2}-[0-9]{2}[T ][0-9]{2}:[0-9]{2}:[0-9]{2}(?:[.,][0-9]{1,9})?"
)
_ZONE: Final = r"(?:Z|[+-](?:[01][0-9]|2[0-3])(?::?[0-5][0-9])?)"
_PATTERNS: Final = {zoned: _LOCAL + (_ZONE if zoned else "") for zoned in (False, True)}
_CELL: Final = {zoned: re.compile(form) for zoned, form in _PATTERNS.items()}
# Possessive: backtracking would double the memory for a long column.
_COLUMN: Final = {zoned: re.compile(rf"(?:{form}\n)*+") for zoned, form in _PATTERNS.items()}
_SECONDS_CHARS: Final = 19
"""Number of characters up to the whole seconds."""
_MAX_TAIL_CHARS: Final = len(".123456789+12:34")
_OFFSET: Final = re.compile(r"([+-])([0-9]{2}):?([0-9]{2})?$")
_EXAMPLE: Final = "2024-05-01T12:00:00.010Z"


def is_date(cell: str) -> bool:
    """Return True if a text is a date and time of ISO 8601, or a time in another notation."""
    return _is_iso(cell) or is_written_time(cell)


def _is_iso(cell: str) -> bool:
    return any(form.fullmatch(cell) is not None for form in _CELL.values())


def parse_dates(cells: Sequence[str]) -> npt.NDArray[Any] | None:
    """Return texts as times to the nanosecond, in UTC if they have a zone; None if one is no time.

    All texts need the same notation, with a zone in all or in none. ISO 8601 may have a blank
    instead of the T. Times without a date are durations since midnight.
    """
    times = _parse_iso_dates(cells)
    return (
        parse_written_times(cells) if times is None and cells and not _is_iso(cells[0]) else times
    )


def _parse_iso_dates(cells: Sequence[str]) -> Dates | None:
    zoned = bool(cells) and _CELL[True].fullmatch(cells[0]) is not None
    if _COLUMN[zoned].fullmatch("\n".join([*cells, ""])) is None:
        return None
    try:
        seconds = np.array([cell[:_SECONDS_CHARS] for cell in cells], "datetime64[s]")
    except ValueError:  # the calendar does not have this day
        return None
    rest = [cell[_SECONDS_CHARS:] for cell in cells]
    times: Dates = seconds.astype("datetime64[ns]")
    times += _parse_fractions(rest)
    if zoned:
        times -= _parse_offsets(rest)
    return times


def _parse_fractions(rest: Sequence[str]) -> npt.NDArray[np.timedelta64]:
    """Return the fractions of seconds at the beginning of texts, in nanoseconds."""
    width = f"S{_MAX_TAIL_CHARS}"
    marks = np.array(rest, width).view(np.uint8).reshape(len(rest), _MAX_TAIL_CHARS)
    inside = (marks[:, 0] == ord(".")) | (marks[:, 0] == ord(","))
    nanoseconds = np.zeros(len(rest), np.int64)
    for position in range(1, 10):
        digit = marks[:, position].astype(np.int64) - ord("0")
        inside = inside & (digit >= 0) & (digit <= 9)
        nanoseconds += np.where(inside, digit, 0) * 10 ** (9 - position)
    return nanoseconds.astype("timedelta64[ns]")


def _parse_offsets(rest: Sequence[str]) -> npt.NDArray[np.timedelta64]:
    """Return the offsets from UTC in the zones at the end of texts."""
    minutes = [0 if text.endswith("Z") else _offset_minutes(text) for text in rest]
    return np.array(minutes, "timedelta64[m]")


def _offset_minutes(text: str) -> int:
    match = _OFFSET.search(text)
    assert match is not None
    ahead = 60 * int(match[2]) + int(match[3] or 0)
    return -ahead if match[1] == "-" else ahead


class Fault(NamedTuple):
    """Index of the first text that differs from the others, and the end of a sentence on it."""

    at: int
    reason: str


def find_fault(cells: Sequence[str]) -> Fault:
    """Return the first text that `parse_dates` cannot read, and the reason."""
    zoned = _CELL[True].fullmatch(cells[0]) is not None
    if is_written_time(cells[0]) and not _is_iso(cells[0]):
        return _find_unlike_first(cells)
    for index, cell in enumerate(cells):
        if cell.strip() in MISSING:
            return Fault(index, "is missing, expected a timestamp in every row")
        if _CELL[not zoned].fullmatch(cell):
            has = "no time zone" if zoned else "a time zone"
            return Fault(index, f"has {has}, unlike the first row")
        if not _CELL[zoned].fullmatch(cell):
            return Fault(index, f"is no date and time of ISO 8601 such as {_EXAMPLE}")
        if parse_dates([cell]) is None:
            return Fault(index, "is no date of the calendar")
    raise AssertionError("all texts are dates")


def _find_unlike_first(cells: Sequence[str]) -> Fault:
    for index, cell in enumerate(cells):
        if cell.strip() in MISSING:
            return Fault(index, "is missing, expected a timestamp in every row")
        if parse_written_times([cells[0], cell]) is None:
            return Fault(index, f"is no time as in the first row, '{cells[0]}'")
    return Fault(0, "is written otherwise than others")


def parse_date_column(column: npt.NDArray[Any], name: str) -> npt.NDArray[Any]:
    """Return a column of texts as times; a LogError names column and row of a bad text."""
    cells = [_text(value) for value in column.tolist()]
    times = parse_dates(cells)
    if times is None:
        at, reason = find_fault(cells)
        shown = cells[at] if len(cells[at]) <= 40 else cells[at][:37] + "..."
        raise LogError(f"time column '{name}', row {at} (counting from 0): '{shown}' {reason}")
    return times


def _text(value: object) -> str:
    if isinstance(value, bytes):
        return value.decode("utf-8", "replace")
    return "" if value is None or value != value else str(value)
