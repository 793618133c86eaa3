"""Dates and times as text: the timestamps of ISO 8601, and those that are written otherwise."""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import Any, Final, NamedTuple

import numpy as np
import numpy.typing as npt

from zerorate.io.clocks.written import is_written_time, written_times
from zerorate.io.readers.cells import MISSING
from zerorate.record.log import LogError

Dates = npt.NDArray[np.datetime64]

# Nanoseconds since 1970 reach from 1678 to 2262.
_LOCAL: Final = (
    r"(?:1[7-9]|2[01])[0-9]{2}-[0-9]{2}-[0-9]{2}[T ][0-9]{2}:[0-9]{2}:[0-9]{2}(?:[.,][0-9]{1,9})?"
)
_ZONE: Final = r"(?:Z|[+-](?:[01][0-9]|2[0-3])(?::?[0-5][0-9])?)"
_FORMS: Final = {zoned: _LOCAL + (_ZONE if zoned else "") for zoned in (False, True)}
_ONE: Final = {zoned: re.compile(form) for zoned, form in _FORMS.items()}
# Possessive, or a long column would take as much memory again to go back in.
_ALL: Final = {zoned: re.compile(rf"(?:{form}\n)*+") for zoned, form in _FORMS.items()}
_TO_SECONDS: Final = 19
"""Characters up to the whole seconds."""
_LONGEST: Final = len(".123456789+12:34")
_OFFSET: Final = re.compile(r"([+-])([0-9]{2}):?([0-9]{2})?$")
_EXAMPLE: Final = "2024-05-01T12:00:00.010Z"


def is_date(cell: str) -> bool:
    """Whether a text is a date and time of ISO 8601, or a time that is written otherwise."""
    return _is_iso(cell) or is_written_time(cell)


def _is_iso(cell: str) -> bool:
    return any(form.fullmatch(cell) is not None for form in _ONE.values())


def dates(cells: Sequence[str]) -> npt.NDArray[Any] | None:
    """Return texts as times, those of a zone in UTC, to the nanosecond; None if one is none.

    All must be written alike, and tell their zone or none of them. In ISO 8601 a blank may stand
    in place of the T. Times without a date are durations since midnight.
    """
    found = _iso_dates(cells)
    return written_times(cells) if found is None and cells and not _is_iso(cells[0]) else found


def _iso_dates(cells: Sequence[str]) -> Dates | None:
    zoned = bool(cells) and _ONE[True].fullmatch(cells[0]) is not None
    if _ALL[zoned].fullmatch("\n".join([*cells, ""])) is None:
        return None
    try:
        seconds = np.array([cell[:_TO_SECONDS] for cell in cells], "datetime64[s]")
    except ValueError:  # the calendar has no such day
        return None
    rest = [cell[_TO_SECONDS:] for cell in cells]
    times: Dates = seconds.astype("datetime64[ns]")
    times += _fractions(rest)
    if zoned:
        times -= _offsets(rest)
    return times


def _fractions(rest: Sequence[str]) -> npt.NDArray[np.timedelta64]:
    """Return the fractions of seconds at the beginning of texts, in nanoseconds."""
    width = f"S{_LONGEST}"
    marks = np.array(rest, width).view(np.uint8).reshape(len(rest), _LONGEST)
    inside = (marks[:, 0] == ord(".")) | (marks[:, 0] == ord(","))
    nanoseconds = np.zeros(len(rest), np.int64)
    for place in range(1, 10):
        digit = marks[:, place].astype(np.int64) - ord("0")
        inside = inside & (digit >= 0) & (digit <= 9)
        nanoseconds += np.where(inside, digit, 0) * 10 ** (9 - place)
    return nanoseconds.astype("timedelta64[ns]")


def _offsets(rest: Sequence[str]) -> npt.NDArray[np.timedelta64]:
    """Return how far the zones at the end of texts are ahead of UTC."""
    minutes = [0 if text.endswith("Z") else _minutes(text) for text in rest]
    return np.array(minutes, "timedelta64[m]")


def _minutes(text: str) -> int:
    found = _OFFSET.search(text)
    assert found is not None
    ahead = 60 * int(found[2]) + int(found[3] or 0)
    return -ahead if found[1] == "-" else ahead


class Fault(NamedTuple):
    """Where the first text stands that is not as the others, and the end of a sentence on it."""

    at: int
    reason: str


def fault_among(cells: Sequence[str]) -> Fault:
    """Return what keeps `dates` from reading some texts."""
    zoned = _ONE[True].fullmatch(cells[0]) is not None
    if is_written_time(cells[0]) and not _is_iso(cells[0]):
        return _unlike_first(cells)
    for index, cell in enumerate(cells):
        if cell.strip() in MISSING:
            return Fault(index, "is missing, expected a timestamp in every row")
        if _ONE[not zoned].fullmatch(cell):
            tells = "no time zone" if zoned else "a time zone"
            return Fault(index, f"tells {tells}, unlike the first row")
        if not _ONE[zoned].fullmatch(cell):
            return Fault(index, f"is no date and time of ISO 8601 such as {_EXAMPLE}")
        if dates([cell]) is None:
            return Fault(index, "is no date of the calendar")
    raise AssertionError("all texts are dates")


def _unlike_first(cells: Sequence[str]) -> Fault:
    for index, cell in enumerate(cells):
        if cell.strip() in MISSING:
            return Fault(index, "is missing, expected a timestamp in every row")
        if written_times([cells[0], cell]) is None:
            return Fault(index, f"is no time as in the first row, '{cells[0]}'")
    return Fault(0, "is written otherwise than others")


def dates_in(column: npt.NDArray[Any], name: str) -> npt.NDArray[Any]:
    """Return a column of texts as times; LogError that names column and row of a fault."""
    cells = [_text(value) for value in column.tolist()]
    found = dates(cells)
    if found is None:
        at, reason = fault_among(cells)
        shown = cells[at] if len(cells[at]) <= 40 else cells[at][:37] + "..."
        raise LogError(f"time column '{name}', row {at} (counting from 0): '{shown}' {reason}")
    return found


def _text(value: object) -> str:
    if isinstance(value, bytes):
        return value.decode("utf-8", "replace")
    return "" if value is None or value != value else str(value)
