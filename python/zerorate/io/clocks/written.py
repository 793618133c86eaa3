"""Times as people and programs write them: ``01-May-2024 12:00:00.000``, ``5/1/2024 1:02 PM``.

A date whose day and month cannot be told apart counts for nothing: the time of day alone is read.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from datetime import date
from typing import Any, Final, NamedTuple

import numpy as np
import numpy.typing as npt

_MONTHS: Final = (
    "jan",
    "feb",
    "mar",
    "apr",
    "may",
    "jun",
    "jul",
    "aug",
    "sep",
    "oct",
    "nov",
    "dec",
)
_DATE: Final = (
    r"[0-9]{1,2}[-/. ](?:[0-9]{1,2}|[A-Za-z]{3,9})[-/. ][0-9]{4}"
    r"|[0-9]{4}[-/.][0-9]{1,2}[-/.][0-9]{1,2}"
)
_TIME: Final = re.compile(
    rf"(?:({_DATE})(?:,? |T|_))?"
    r"([0-9]{1,2}):([0-9]{2})(?::([0-9]{2}))?(?:[.,:]([0-9]{1,9}))?"
    r"(?: ?([AaPp])\.?[Mm]\.?)?(?: ?(Z|[+-][0-9]{2}:?[0-9]{2}))?"
)
_EPOCH: Final = date(1970, 1, 1).toordinal()
_DAY: Final = 86_400 * 10**9


_HALF_DAY: Final = 43_200.0
_LOOKED_AT: Final = 10_000
"""Numbers that tell nearly any count from times of day, for little of what all would cost."""
_PACKED: Final = (1, 1_000, 1_000_000)
"""Counts a second of hours, minutes and seconds written as one number: HHMMSS, HHMMSSmmm."""


class _Parts(NamedTuple):
    """Texts of a time: its date, hours, minutes, seconds, their fraction, half of day and zone."""

    day: str
    hours: str
    minutes: str
    seconds: str
    fraction: str
    half: str
    zone: str


def is_written_time(cell: str) -> bool:
    """Whether a text is a time of day, maybe after a date."""
    parts = _parts(cell)
    return parts is not None and _nanoseconds(parts) is not None


def _parts(cell: str) -> _Parts | None:
    found = _TIME.fullmatch(cell.strip())
    return None if found is None else _Parts(*(text or "" for text in found.groups()))


def written_times(cells: Sequence[str]) -> npt.NDArray[Any] | None:
    """Return texts as dates, or as durations since midnight where they tell no date for certain.

    None if one is no time, or not written like the first one.
    """
    parts = [_parts(cell) for cell in cells]
    if not parts or any(one is None for one in parts):
        return None
    known = [one for one in parts if one is not None]
    shapes = {(bool(one.day), bool(one.half), bool(one.zone), bool(one.seconds)) for one in known}
    clock = [_nanoseconds(one) for one in known]
    if len(shapes) != 1 or None in clock:
        return None
    time = np.array(clock, dtype=np.int64)
    if not known[0].day:
        return time.astype("timedelta64[ns]")
    days = _days([one.day for one in known])
    if isinstance(days, str):
        return None if days == "none" else time.astype("timedelta64[ns]")
    return (time + days * _DAY).astype("datetime64[ns]")


def _nanoseconds(parts: _Parts) -> int | None:
    """Return the time of day less its zone, None if no clock shows it."""
    fraction = int(parts.fraction.ljust(9, "0")) if parts.fraction else 0
    hours, minutes = int(parts.hours), int(parts.minutes)
    if not parts.seconds:
        if not parts.fraction:
            return None if hours > 23 or minutes > 59 else 60 * (60 * hours + minutes) * 10**9
        # Minutes, seconds and their decimals, as spreadsheets show them.
        return None if minutes > 59 else (60 * hours + minutes) * 10**9 + fraction
    seconds = int(parts.seconds)
    if parts.half:
        if not 1 <= hours <= 12:
            return None
        hours = hours % 12 + (12 if parts.half in "pP" else 0)
    if hours > 23 or minutes > 59 or seconds > 60:
        return None
    return (3600 * hours + 60 * minutes + seconds) * 10**9 + fraction - _ahead(parts.zone)


def _ahead(zone: str) -> int:
    if zone in ("", "Z"):
        return 0
    minutes = 60 * int(zone[1:3]) + int(zone[-2:])
    return (-minutes if zone[0] == "-" else minutes) * 60 * 10**9


def _days(texts: Sequence[str]) -> npt.NDArray[np.int64] | str:
    """Return days since 1970; "none" if one is no date, "unsure" if day and month may be either."""
    different = dict.fromkeys(texts)
    split = {text: re.split(r"[-/. ]", text) for text in different}
    numbers = [parts for parts in split.values() if parts[1].isdigit() and len(parts[0]) < 4]
    # Points stand in dates that begin with the day.
    points = all("." in text for text in different)
    day_first = points or any(int(parts[0]) > 12 for parts in numbers)
    month_first = not points and any(int(parts[1]) > 12 for parts in numbers)
    if numbers and not day_first and not month_first:
        same = all(parts[0] == parts[1] for parts in numbers)
        if not same:
            return "unsure"
    found: dict[str, int] = {}
    for text, parts in split.items():
        day = _ordinal(parts, month_first and not day_first)
        if day is None:
            return "none"
        found[text] = day - _EPOCH
    return np.array([found[text] for text in texts], dtype=np.int64)


def _ordinal(parts: Sequence[str], month_first: bool) -> int | None:
    if len(parts[0]) == 4:
        year, month, day = (int(part) for part in parts)
    elif parts[1].isdigit():
        day, month, year = (int(part) for part in parts)
        day, month = (month, day) if month_first else (day, month)
    else:
        if parts[1][:3].lower() not in _MONTHS:
            return None
        day, month, year = int(parts[0]), _MONTHS.index(parts[1][:3].lower()) + 1, int(parts[2])
    try:
        return date(year, month, day).toordinal()
    except ValueError:
        return None


def unpacked_times(numbers: npt.NDArray[Any]) -> npt.NDArray[np.float64] | None:
    """Return the seconds of day of numbers such as 120059990, None where they are no such times.

    ``HHMMSS`` with decimals, ``HHMMSSmmm`` and microseconds are told from a count by what they do
    at a full minute: they leap by forty seconds there, and no number has a 60 where seconds stand.
    """
    some = numbers[:: max(1, len(numbers) // _LOOKED_AT)]
    for per_second in map(float, _PACKED):
        if _passes_minutes(numbers, per_second) and _split(some, per_second) is not None:
            seconds = _unpacked(numbers, per_second)
            if seconds is not None:
                return seconds
    return None


def _passes_minutes(numbers: npt.NDArray[Any], per_second: float) -> bool:
    """Whether numbers are within a day, and not all of one minute."""
    least, most = float(numbers.min()), float(numbers.max())
    minute = 100.0 * per_second
    return 0.0 <= least <= most < 2_400.0 * minute and least // minute < most // minute


def _split(numbers: npt.NDArray[Any], per_second: float) -> tuple[npt.NDArray[Any], ...] | None:
    """Return hours and minutes as one number, and seconds of day; None if one of these is none."""
    written = numbers / per_second
    whole = np.floor(written)
    minutes, second = np.divmod(whole, 100.0)
    hour, minute = np.divmod(minutes, 100.0)
    if max(float(second.max()), float(minute.max())) >= 60.0:
        return None
    return minutes, 3600.0 * hour + 60.0 * minute + second + (written - whole)


def _unpacked(numbers: npt.NDArray[Any], per_second: float) -> npt.NDArray[np.float64] | None:
    split = _split(numbers, per_second)
    if split is None:
        return None
    minutes, seconds = split
    turns = np.diff(minutes) != 0.0
    if not turns.any() or turns.mean() > 0.5:
        return None
    step = float(np.median(np.diff(seconds)))
    # At a full minute, and at midnight, the rows go on as within it.
    over = (np.diff(seconds)[turns] + _HALF_DAY) % (2.0 * _HALF_DAY) - _HALF_DAY
    return seconds if float(np.median(np.abs(over - step))) <= max(1.0, 2.0 * step) else None
