"""Names of times: which columns hold timestamps, and the unit that their names tell."""

from __future__ import annotations

import re
from typing import Final

from zerorate.record.names import plain

UNITS: Final = {
    "s": ("s", "sec", "secs", "second", "seconds"),
    "ms": ("ms", "msec", "msecs", "millis", "milliseconds"),
    "us": ("us", "µs", "usec", "usecs", "micros", "microseconds"),
    "ns": ("ns", "nsec", "nsecs", "nanos", "nanoseconds"),
    "min": ("min", "mins", "minutes"),
    "h": ("h", "hr", "hrs", "hours"),
    "days": ("days",),
}
"""Units of time, each with the words that tell it."""

_UNIT: Final = {spelling: unit for unit, all_ in UNITS.items() for spelling in all_}
_ALONE: Final = (
    "seconds", "millis", "milliseconds", "micros", "microseconds", "nanos", "nanoseconds"
)  # fmt: skip
"""Names that are a unit and nothing else."""
_COUNTED_FROM: Final = (
    r"(?:_(?:since|from|start|startup|begin|boot|reboot|epoch|unix|1970|since1970|utc|gps|local|tow"
    r"|abs|absolute|elapsed|fine|cal|sample|device|system|sys|host|header|txt|iso|of|day|week"
    r"|\d\d_\d\d))*"
)
"""What may follow: whose time it is, and since when it counts; ``time (+02:00)``."""
_SUFFIX: Final = rf"{_COUNTED_FROM}(?:_(?:{'|'.join(_UNIT)}))?"
_TIME: Final = re.compile(
    rf"^(?:t|(?:.*_)?(?:times?|time_?stamps?|stamps?|realtime|uptime|systime)){_SUFFIX}$"
)
_MAYBE_TIME: Final = re.compile(
    rf"^(?:(?:ts|elapsed|epoch|unix|clock){_SUFFIX}|date|date_?times?|(?:{'|'.join(_ALONE)}"
    rf"){_COUNTED_FROM})$"
)
_IN_BRACKETS: Final = re.compile(rf"[\[(]\s*(?:{'|'.join(_UNIT)})\s*[\])]\s*(?:\.\d+)?$")
_REPEATED: Final = re.compile(r"\.\d+$")
"""What pandas adds to a name that stands twice."""
_TAIL: Final = re.compile(_COUNTED_FROM + "$")


def looks_like_time(name: str) -> bool:
    """Whether a column of this name holds timestamps."""
    return bool(_TIME.match(plain(name)))


def may_be_time(name: str) -> bool:
    """Whether a column of this name holds timestamps if no other does and its values rise.

    What stands in a unit of time in brackets may, whatever its name: ``X[s]``.
    """
    return bool(_MAYBE_TIME.match(plain(name)) or _IN_BRACKETS.search(name.lower()))


def named_like_time(name: str) -> bool:
    """Whether a column of this name holds timestamps, for certain or perhaps."""
    return looks_like_time(name) or may_be_time(name)


def time_unit(name: str) -> str | None:
    """Return the unit of timestamps that a column's name tells, None if it tells none."""
    whole = plain(_REPEATED.sub("", name))
    for told in (whole, _TAIL.sub("", whole)):
        words = told.split("_")
        if words[-1] in _UNIT and (len(words) > 1 or words[0] in _ALONE):
            return _UNIT[words[-1]]
    return None
