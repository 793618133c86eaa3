"""Names of times: columns that hold timestamps, and the unit in their names."""

from __future__ import annotations

import re
from typing import Final

from zerorate.record.names import to_snake_case

UNITS: Final = {
    "s": ("s", "sec", "secs", "second", "seconds"),
    "ms": ("ms", "msec", "msecs", "millis", "milliseconds"),
    "us": ("us", "µs", "usec", "usecs", "micros", "microseconds"),
    "ns": ("ns", "nsec", "nsecs", "nanos", "nanoseconds"),
    "min": ("min", "mins", "minutes"),
    "h": ("h", "hr", "hrs", "hours"),
    "days": ("days",),
    "100us": ("100us",),
}
"""Units of time with their spellings."""

UNIT_SPELLINGS: Final = {spelling for spellings in UNITS.values() for spelling in spellings}
"""Spellings of units of time."""

_UNIT_OF_WORD: Final = {spelling: unit for unit, all_ in UNITS.items() for spelling in all_}
_UNIT_NAMES: Final = (
    "seconds", "millis", "milliseconds", "micros", "microseconds", "nanos", "nanoseconds"
)  # fmt: skip
"""Names that consist of a unit only."""
_SHORT: Final = ("sec", "secs", "ms", "msec", "us", "µs", "usec", "ns", "nsec")
"""Names of a clock if the values increase."""
_ORIGIN: Final = (
    r"(?:_(?:in|since|from|start|startup|begin|boot|reboot|epoch|unix|1970|since1970|utc|gps|local|tow"
    r"|abs|absolute|elapsed|fine|cal|sample|device|system|sys|host|header|txt|iso|of|day|week"
    r"|\d\d_\d\d))*"
)
"""Suffixes for the source and origin of a time; ``time (+02:00)``."""
_SUFFIX: Final = rf"{_ORIGIN}(?:_(?:{'|'.join(_UNIT_OF_WORD)}))?"
_TIME_NAME: Final = re.compile(
    rf"^(?:t|(?:.*_)?(?:times?|time_?stamps?|stamps?|realtime|uptime|systime)){_SUFFIX}$"
)
_MAYBE_TIME_NAME: Final = re.compile(
    rf"^(?:(?:ts|elapsed|epoch|unix|clock){_SUFFIX}|temps|date|date_?times?|i?_?tow(?:_ms)?|(?:{'|'.join(_UNIT_NAMES)}"
    rf"){_ORIGIN})$"
)
_BRACKETED_UNIT: Final = re.compile(rf"[\[(]\s*(?:{'|'.join(_UNIT_OF_WORD)})\s*[\])]\s*(?:\.\d+)?$")
_REPEAT_SUFFIX: Final = re.compile(r"\.\d+$")
"""Suffix that pandas adds to repeated names."""
_ORIGIN_END: Final = re.compile(_ORIGIN + "$")


def looks_like_time(name: str) -> bool:
    """Return True if a column of this name holds timestamps."""
    return bool(_TIME_NAME.match(to_snake_case(name)))


def may_be_time(name: str) -> bool:
    """Return True if a column of this name may be a clock, provided that its values increase.

    Any name with a unit of time in brackets may: ``X[s]``.
    """
    return bool(_MAYBE_TIME_NAME.match(to_snake_case(name)) or _BRACKETED_UNIT.search(name.lower()))


def has_time_name(name: str) -> bool:
    """Return True if a column of this name certainly or possibly contains timestamps."""
    return looks_like_time(name) or may_be_time(name)


def find_time_unit(name: str) -> str | None:
    """Return the unit of timestamps in a column's name; None without one."""
    whole = to_snake_case(_REPEAT_SUFFIX.sub("", name))
    for candidate in (whole, _ORIGIN_END.sub("", whole)):
        words = candidate.split("_")
        if words[-1] in _UNIT_OF_WORD and (
            len(words) > 1 or words[0] in _UNIT_NAMES or words[0] in _SHORT
        ):
            return _UNIT_OF_WORD[words[-1]]
    return None
