"""Times in written notations: ``01-May-2024 12:00:00.000``, ``5/1/2024 1:02 PM``.

If day and month of a date cannot be distinguished, only the time of day is read.
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
_COMPACT: Final = re.compile(
    r"([12][0-9]{3})([01][0-9])([0-3][0-9])[T_ -]([0-2][0-9])([0-5][0-9])([0-6][0-9])"
    r"(?:[.,]([0-9]{1,9}))?(Z|[+-][0-9]{2}:?[0-9]{2})?"
)
"""Compact form of ISO 8601: ``20240501T120000.010``."""
_EPOCH_DAY: Final = date(1970, 1, 1).toordinal()
_DAY_NS: Final = 86_400 * 10**9


_HALF_DAY_S: Final = 43_200.0
_MAX_PROBED: Final = 10_000
"""Number of values tested first; this rejects nearly all plain counts quickly."""
_FIRST_PACKED_DATE: Final = 2e13
"""Smallest number that is a date of this century as YYYYMMDDHHMMSS."""
_MAX_DAYS: Final = 1000
"""Largest length of a log, days."""
_PACKED_PER_SECOND: Final = (1, 1_000, 1_000_000)
"""Counts per second of times written as one number: HHMMSS, HHMMSSmmm, HHMMSSmmmuuu."""


class _TimeParts(NamedTuple):
    """Parts of a time as text: date, hours, minutes, seconds, fraction, AM or PM, zone."""

    day: str
    hours: str
    minutes: str
    seconds: str
    fraction: str
    half: str
    zone: str


def is_written_time(cell: str) -> bool:
    """Return True if a text is a time of day, with or without a date."""
    parts = _split_time(cell)
    return parts is not None and _time_of_day_ns(parts) is not None


def _split_time(cell: str) -> _TimeParts | None:
    text = cell.strip()
    compact = _COMPACT.fullmatch(text)
    if compact is not None:
        year, month, day, hours, minutes, seconds = compact.groups()[:6]
        fraction, zone = (part or "" for part in compact.groups()[6:])
        return _TimeParts(f"{year}-{month}-{day}", hours, minutes, seconds, fraction, "", zone)
    match = _TIME.fullmatch(text)
    return None if match is None else _TimeParts(*(text or "" for text in match.groups()))


def parse_written_times(cells: Sequence[str]) -> npt.NDArray[Any] | None:
    """Return texts as dates, or as durations since midnight if the date is ambiguous.

    Return None if a text is no time, or has another notation than the first.
    """
    parts = [_split_time(cell) for cell in cells]
    if not parts or any(time_parts is None for time_parts in parts):
        return None
    known = [time_parts for time_parts in parts if time_parts is not None]
    shapes = {
        (
            bool(time_parts.day),
            bool(time_parts.half),
            bool(time_parts.zone),
            bool(time_parts.seconds),
        )
        for time_parts in known
    }
    clock = [_time_of_day_ns(time_parts) for time_parts in known]
    if len(shapes) != 1 or None in clock:
        return None
    time = np.array(clock, dtype=np.int64)
    if not known[0].day:
        return time.astype("timedelta64[ns]")
    days = _parse_days([time_parts.day for time_parts in known])
    if isinstance(days, str):
        return None if days == "none" else time.astype("timedelta64[ns]")
    return (time + days * _DAY_NS).astype("datetime64[ns]")


def _time_of_day_ns(parts: _TimeParts) -> int | None:
    """Return the time of day minus its zone, ns; None if it is impossible."""
    fraction = int(parts.fraction.ljust(9, "0")) if parts.fraction else 0
    hours, minutes = int(parts.hours), int(parts.minutes)
    if not parts.seconds:
        if not parts.fraction:
            return None if hours > 23 or minutes > 59 else 60 * (60 * hours + minutes) * 10**9
        # Minutes, seconds and decimals, as in spreadsheets.
        return None if minutes > 59 else (60 * hours + minutes) * 10**9 + fraction
    seconds = int(parts.seconds)
    if parts.half:
        if not 1 <= hours <= 12:
            return None
        hours = hours % 12 + (12 if parts.half in "pP" else 0)
    if hours > 23 or minutes > 59 or seconds > 60:
        return None
    return (3600 * hours + 60 * minutes + seconds) * 10**9 + fraction - _zone_offset_ns(parts.zone)


def _zone_offset_ns(zone: str) -> int:
    if zone in ("", "Z"):
        return 0
    minutes = 60 * int(zone[1:3]) + int(zone[-2:])
    return (-minutes if zone[0] == "-" else minutes) * 60 * 10**9


def _parse_days(texts: Sequence[str]) -> npt.NDArray[np.int64] | str:
    """Return days since 1970; "none" if one is no date, "unsure" if day and month are ambiguous."""
    different = dict.fromkeys(texts)
    split = {text: re.split(r"[-/. ]", text) for text in different}
    numbers = [parts for parts in split.values() if parts[1].isdigit() and len(parts[0]) < 4]
    # Dates with points begin with the day.
    points = all("." in text for text in different)
    day_first = points or any(int(parts[0]) > 12 for parts in numbers)
    month_first = not points and any(int(parts[1]) > 12 for parts in numbers)
    if numbers and not day_first and not month_first:
        same = all(parts[0] == parts[1] for parts in numbers)
        if not same:
            return "unsure"
    day_numbers: dict[str, int] = {}
    for text, parts in split.items():
        day = _parse_day(parts, month_first and not day_first)
        if day is None:
            return "none"
        day_numbers[text] = day - _EPOCH_DAY
    return np.array([day_numbers[text] for text in texts], dtype=np.int64)


def _parse_day(parts: Sequence[str], month_first: bool) -> int | None:
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


def unpack_dates(numbers: npt.NDArray[Any]) -> npt.NDArray[np.float64] | None:
    """Return the Unix time of numbers such as 20240501120000010, s; None for other numbers.

    ``YYYYMMDDHHMMSS``, with or without milliseconds, differs from a count by its digits: in all
    rows they form dates of this century.
    """
    if float(numbers.min()) < _FIRST_PACKED_DATE:
        return None
    for per_second in _PACKED_PER_SECOND[:2]:
        day, clock = np.divmod(numbers, 10**6 * per_second)
        packed_days = np.unique(np.asarray(day, dtype=np.int64))
        split = _split_packed(clock, float(per_second)) if len(packed_days) < _MAX_DAYS else None
        days = {number: _packed_day(int(number)) for number in packed_days} if split else {}
        if (
            split is not None
            and None not in days.values()
            and float(clock.max()) < 240_000 * per_second
        ):
            starts = np.array([days[number] or 0 for number in packed_days]) * 86_400.0
            seconds: npt.NDArray[np.float64] = starts[np.searchsorted(packed_days, day)] + split[1]
            return seconds
    return None


def _packed_day(number: int) -> int | None:
    """Return the day since 1970 of a number such as 20240501; None if not in this century."""
    year, month, day = number // 10_000, number // 100 % 100, number % 100
    found = _parse_day((str(year), str(month), str(day)), False) if 2000 <= year < 2100 else None
    return None if found is None else found - _EPOCH_DAY


def unpack_times(numbers: npt.NDArray[Any]) -> npt.NDArray[np.float64] | None:
    """Return the time of day of numbers such as 120059990, s; None for other numbers.

    ``HHMMSS`` with decimals, milliseconds or microseconds differs from a count at full minutes: it
    jumps by forty seconds there. And the seconds are never 60.
    """
    probed = numbers[:: max(1, len(numbers) // _MAX_PROBED)]
    for per_second in map(float, _PACKED_PER_SECOND):
        if _spans_minutes(numbers, per_second) and _split_packed(probed, per_second) is not None:
            seconds = _unpack(numbers, per_second)
            if seconds is not None:
                return seconds
    return None


def _spans_minutes(numbers: npt.NDArray[Any], per_second: float) -> bool:
    """Return True if numbers are times within a day, over more than one minute."""
    smallest, largest = float(numbers.min()), float(numbers.max())
    minute = 100.0 * per_second
    return 0.0 <= smallest <= largest < 2_400.0 * minute and smallest // minute < largest // minute


def _split_packed(
    numbers: npt.NDArray[Any], per_second: float
) -> tuple[npt.NDArray[Any], ...] | None:
    """Return hours and minutes as one number, and seconds; None if a number is no such time."""
    written = numbers / per_second
    whole = np.floor(written)
    minutes, second = np.divmod(whole, 100.0)
    hour, minute = np.divmod(minutes, 100.0)
    if max(float(second.max()), float(minute.max())) >= 60.0:
        return None
    return minutes, 3600.0 * hour + 60.0 * minute + second + (written - whole)


def _unpack(numbers: npt.NDArray[Any], per_second: float) -> npt.NDArray[np.float64] | None:
    split = _split_packed(numbers, per_second)
    if split is None:
        return None
    minutes, seconds = split
    minute_changes = np.diff(minutes) != 0.0
    if not minute_changes.any() or minute_changes.mean() > 0.5:
        return None
    step = float(np.median(np.diff(seconds)))
    # Rows continue evenly over full minutes and midnight.
    minute_steps = (np.diff(seconds)[minute_changes] + _HALF_DAY_S) % (
        2.0 * _HALF_DAY_S
    ) - _HALF_DAY_S
    return (
        seconds if float(np.median(np.abs(minute_steps - step))) <= max(1.0, 2.0 * step) else None
    )
